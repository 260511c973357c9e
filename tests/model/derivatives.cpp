#include "model/derivatives.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>

namespace wienertree::test {
namespace {

using Function = std::function<void(ConstBatchView x, BatchView out)>;

class Faults {
 public:
  /// Keeps the worst violation of |a - b| <= tolerance of this kind.
  void compare(const std::string& kind, std::size_t component, std::size_t node, double a, double b,
               double tolerance) {
    if (std::abs(a - b) <= tolerance) return;
    auto known = std::find_if(faults_.begin(), faults_.end(), [&](const Fault& f) { return f.kind == kind; });
    if (known == faults_.end()) known = faults_.insert(faults_.end(), Fault{kind, 0, {}});
    const double excess = std::abs(a - b) / tolerance;
    if (excess <= known->excess) return;
    known->excess = excess;
    known->text = fmt::format("{}: component {} of node {} is {} instead of {} +- {:.2g}", kind, component,
                              node, a, b, tolerance);
  }
  std::vector<std::string> lines() const {
    std::vector<std::string> result;
    for (const Fault& fault : faults_)
      result.push_back(fault.text.empty() ? fault.kind + ": not a number" : fault.text);
    return result;
  }

 private:
  struct Fault {
    std::string kind;
    double excess;
    std::string text;
  };
  std::vector<Fault> faults_;
};

constexpr double u = 0x1p-53;

Batch value(const Function& f, std::size_t components, ConstBatchView x) {
  Batch out(components, x.nodes());
  f(x, out);
  return out;
}

struct Derivative {
  Batch value, tolerance;
};

/// Of f (m components) along v (d x N).
Derivative directional(const Function& f, std::size_t m, ConstBatchView x, ConstBatchView v, double step,
                       double ulp) {
  const std::size_t d = x.components(), N = x.nodes();
  std::vector<double> h(N);
  for (std::size_t n = 0; n < N; ++n) {  // no component moves by more than step (1 + |x|)
    double fastest = 0.0;
    for (std::size_t i = 0; i < d; ++i)
      fastest = std::max(fastest, std::abs(v(i, n)) / (1 + std::abs(x(i, n))));
    h[n] = fastest == 0.0 ? step : step / fastest;
  }
  const auto moved = [&](double factor) {
    Batch y(d, N);
    for (std::size_t i = 0; i < d; ++i)
      for (std::size_t n = 0; n < N; ++n) y(i, n) = x(i, n) + factor * h[n] * v(i, n);
    return value(f, m, y);
  };
  std::vector<Batch> ahead, behind;
  for (const double factor : {1.0, 0.5, 0.25}) {
    ahead.push_back(moved(factor));
    behind.push_back(moved(-factor));
  }
  const Batch here = value(f, m, x);
  Derivative result{Batch(m, N), Batch(m, N)};
  for (std::size_t c = 0; c < m; ++c)
    for (std::size_t n = 0; n < N; ++n) {
      double E[3];
      double factor = 1.0;
      for (std::size_t s = 0; s < 3; ++s, factor /= 2)
        E[s] = (ahead[s](c, n) - behind[s](c, n)) / (2 * factor * h[n]);
      const double wide = (4 * E[1] - E[0]) / 3, narrow = (4 * E[2] - E[1]) / 3;
      // |x||f'| over the step is |f'| / step, since the fastest component moves by step (1 + |x|) at least.
      const double rounding = ulp * u * (std::abs(here(c, n)) / h[n] + std::abs(narrow) / step) * 4 * 2;
      result.value(c, n) = narrow;
      result.tolerance(c, n) = 2 * std::abs(narrow - wide) + rounding + 1e-300;
    }
  return result;
}

Batch unit_direction(std::size_t d, std::size_t N, std::size_t l) {
  Batch v(d, N);
  std::fill_n(v.view().data(), d * N, 0.0);
  std::fill_n(v.component(l).data(), N, 1.0);
  return v;
}

}  // namespace

std::vector<std::string> derivative_faults(const VectorFields& fields, ConstBatchView x, double step,
                                           double ulp) {
  const std::size_t d = fields.state_dimension(), p = fields.noise_dimension(), k = fields.sensor_dimension();
  const std::size_t N = x.nodes();
  Faults faults;
  const auto along = [&](std::vector<double> D) -> Function {
    return [&fields, D](ConstBatchView y, BatchView out) { fields.direct(y, D, out); };
  };
  const auto unit = [&](std::size_t j) {
    std::vector<double> D(1 + p, 0.0);
    D[j] = 1.0;
    return D;
  };
  std::vector<double> all(1 + p);
  for (std::size_t j = 0; j <= p; ++j) all[j] = 0.3 + 0.2 * static_cast<double>(j) * (j % 2 ? -1 : 1);
  std::vector<Batch> V;
  for (std::size_t j = 0; j <= p; ++j) V.push_back(value(along(unit(j)), d, x));

  const Batch sum = value(along(all), d, x);
  const Batch columns = value([&](auto y, auto out) { fields.diffusion(y, out); }, d * p, x);
  for (std::size_t i = 0; i < d; ++i)
    for (std::size_t n = 0; n < N; ++n) {
      double expected = 0, size = 0;
      for (std::size_t j = 0; j <= p; ++j) {
        expected += V[j](i, n) * all[j];
        size += std::abs(V[j](i, n) * all[j]) + std::abs(V[j](i, n));
        if (j == 0) continue;
        const double entry = columns(i * p + j - 1, n);
        faults.compare("diffusion", i, n, entry, V[j](i, n), ulp * u * std::abs(entry));
      }
      faults.compare("direct", i, n, sum(i, n), expected, ulp * u * size);
    }

  std::vector<std::vector<double>> increments = {all};
  for (std::size_t j = 0; j <= p; ++j) increments.push_back(unit(j));
  for (const auto& D : increments) {
    const Batch J = value([&](auto y, auto out) { fields.jacobian(y, D, out); }, d * d, x);
    for (std::size_t l = 0; l < d; ++l) {
      const Derivative column = directional(along(D), d, x, unit_direction(d, N, l), step, ulp);
      for (std::size_t i = 0; i < d; ++i)
        for (std::size_t n = 0; n < N; ++n)
          faults.compare("jacobian", i * d + l, n, J(i * d + l, n), column.value(i, n),
                         column.tolerance(i, n));
    }
  }

  const Batch drift = value([&](auto y, auto out) { fields.ito_drift(y, out); }, d, x);
  Batch expected = V[0], tolerance(d, N);
  for (std::size_t i = 0; i < d; ++i)
    for (std::size_t n = 0; n < N; ++n)
      tolerance(i, n) = ulp * u * (std::abs(V[0](i, n)) + std::abs(drift(i, n)));
  for (std::size_t j = 1; j <= p; ++j) {
    const Derivative own = directional(along(unit(j)), d, x, V[j], step, ulp);
    for (std::size_t i = 0; i < d; ++i)
      for (std::size_t n = 0; n < N; ++n) {
        expected(i, n) += 0.5 * own.value(i, n);
        tolerance(i, n) += 0.5 * own.tolerance(i, n);
      }
  }
  for (std::size_t i = 0; i < d; ++i)
    for (std::size_t n = 0; n < N; ++n)
      faults.compare("ito_drift", i, n, drift(i, n), expected(i, n), tolerance(i, n));

  Batch dB(p, N), end(d, N);
  for (std::size_t j = 0; j < p; ++j)
    for (std::size_t n = 0; n < N; ++n) dB(j, n) = 0.1 + 0.05 * static_cast<double>((j + n) % 7);
  fields.euler_step(x, 0.01, dB, end);
  for (std::size_t i = 0; i < d; ++i)
    for (std::size_t n = 0; n < N; ++n) {
      double to = x(i, n) + drift(i, n) * 0.01, size = std::abs(x(i, n)) + std::abs(drift(i, n) * 0.01);
      for (std::size_t j = 0; j < p; ++j) {
        to += columns(i * p + j, n) * dB(j, n);
        size += std::abs(columns(i * p + j, n) * dB(j, n));
      }
      faults.compare("euler_step", i, n, end(i, n), to, ulp * u * size);
    }

  if (k == 0) return faults.lines();
  const Batch slopes = value([&](auto y, auto out) { fields.sensor_derivative(y, out); }, k * p, x);
  for (std::size_t r = 1; r <= p; ++r) {
    const Derivative h = directional([&](auto y, auto out) { fields.sensor(y, out); }, k, x, V[r], step, ulp);
    for (std::size_t i = 0; i < k; ++i)
      for (std::size_t n = 0; n < N; ++n)
        faults.compare("sensor_derivative", i * p + r - 1, n, slopes(i * p + r - 1, n), h.value(i, n),
                       h.tolerance(i, n));
  }
  return faults.lines();
}

std::vector<std::string> position_faults(const VectorFields& fields, ConstBatchView x) {
  const std::size_t d = fields.state_dimension(), p = fields.noise_dimension(), k = fields.sensor_dimension();
  std::vector<double> D(1 + p);
  for (std::size_t j = 0; j <= p; ++j) D[j] = 0.4 - 0.3 * static_cast<double>(j);
  // The increment dB of a node is made of its state, to be the same wherever the node sits.
  const auto euler = [&](ConstBatchView y, BatchView out) {
    Batch dB(p, y.nodes());
    for (std::size_t j = 0; j < p; ++j)
      for (std::size_t n = 0; n < y.nodes(); ++n) dB(j, n) = 0.1 * y(j % d, n);
    fields.euler_step(y, 0.05, dB, out);
  };
  const struct {
    const char* name;
    std::size_t components;
    Function run;
  } functions[] = {
      {"direct", d, [&](auto y, auto out) { fields.direct(y, D, out); }},
      {"jacobian", d * d, [&](auto y, auto out) { fields.jacobian(y, D, out); }},
      {"euler_step", d, euler},
      {"ito_drift", d, [&](auto y, auto out) { fields.ito_drift(y, out); }},
      {"diffusion", d * p, [&](auto y, auto out) { fields.diffusion(y, out); }},
      {"sensor", k, [&](auto y, auto out) { fields.sensor(y, out); }},
      {"sensor_derivative", k * p, [&](auto y, auto out) { fields.sensor_derivative(y, out); }},
  };
  const std::size_t N = x.nodes();
  std::vector<std::string> faults;
  for (const auto& f : functions) {
    std::vector<Batch> alone;
    for (std::size_t n = 0; n < N; ++n) alone.push_back(value(f.run, f.components, x.nodes(n, 1)));
    std::size_t different = 0;
    for (std::size_t length = 1; length <= 130; ++length) {
      const auto place = [&](std::size_t n) { return (n * (length % 5 + 1) + 17 * length) % N; };
      Batch y(d, length + 1), out(f.components, length + 1);  // one node in, so that no vector is aligned
      for (std::size_t i = 0; i < d; ++i)
        for (std::size_t n = 0; n < length; ++n) y(i, n + 1) = x(i, place(n));
      f.run(y.view().nodes(1, length), out.view().nodes(1, length));
      for (std::size_t c = 0; c < f.components; ++c)
        for (std::size_t n = 0; n < length; ++n)
          different += std::memcmp(&out(c, n + 1), &alone[place(n)](c, 0), sizeof(double)) != 0;
    }
    if (different != 0)
      faults.push_back(fmt::format("{}: {} values depend on the node's place", f.name, different));
  }
  return faults;
}

}  // namespace wienertree::test
