#include "wienertree/model/observation_density.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cassert>
#include <cmath>
#include <numbers>

#include "wienertree/model/scalar_functions.hpp"

namespace wienertree {

namespace {

using Value = TapeBuilder::Value;

// From this many degrees of freedom on, forms that do not cancel.
constexpr double many_degrees = 100;

// log of Gamma((n+1)/2) / (Gamma(n/2) sqrt(n pi)). For large a = n/2 by the asymptotic series
//     log Gamma(a + 1/2) - log Gamma(a) = log(a)/2 - 1/(8 a) + 1/(192 a^3) - 1/(640 a^5) + 17/(14336 a^7) - ..
// (Abramowitz, Stegun 1964, 6.1.40; the next term is below 1e-19 at a = 50). The difference itself would lose all digits
// by n = 1e16.
double log_student_normaliser(double n) {
  if (n < many_degrees)
    return scalar::lgamma(0.5 * (n + 1.0)) - scalar::lgamma(0.5 * n) - 0.5 * std::log(n * std::numbers::pi);
  const double b = 2 / n, b2 = b * b;
  const double series = b * (-1. / 8 + b2 * (1. / 192 + b2 * (-1. / 640 + b2 * (17. / 14336))));
  return series - 0.5 * std::log(2 * std::numbers::pi);
}

// log g(v), as in the header.
Value log_density_of(const NoiseLaw& law, Value v, TapeBuilder& tape) {
  const auto constant = [&](double c) { return tape.constant(c); };
  const auto times = [&](double c, Value a) { return tape.binary(Op::multiply, constant(c), a); };
  const auto plus = [&](double c, Value a) { return tape.binary(Op::add, a, constant(c)); };
  const double log_root_two_pi = 0.5 * std::log(2.0 * std::numbers::pi);
  const Value z = times(1.0 / law.scale, v);
  switch (law.kind) {
    case NoiseLaw::Kind::gaussian:
      return plus(-log_root_two_pi - std::log(law.scale), times(-0.5, tape.binary(Op::multiply, z, z)));
    case NoiseLaw::Kind::laplace:
      return plus(-std::log(2.0 * law.scale), times(-1.0, tape.unary(Op::absolute, z)));
    case NoiseLaw::Kind::student_t: {
      const double n = law.dof;
      const Value u = times(1.0 / n, tape.binary(Op::multiply, z, z));
      const Value spread = n < many_degrees ? tape.unary(Op::logarithm, plus(1.0, u))
                                            : tape.unary(Op::logarithm_of_one_plus, u);
      const double log_normaliser = log_student_normaliser(n) - std::log(law.scale);
      return plus(log_normaliser, times(-0.5 * (n + 1.0), spread));
    }
    case NoiseLaw::Kind::log_chi_square:
      break;
  }
  const Value excess = tape.binary(Op::subtract, v, tape.unary(Op::exponential, v));
  return plus(-log_root_two_pi, times(0.5, excess));
}

// Inputs h_i, uniforms y_i, outputs log g_i(y_i - h_i).
Tape log_densities(const std::vector<NoiseLaw>& laws) {
  TapeBuilder builder(laws.size(), laws.size());
  std::vector<Value> outputs;
  for (std::size_t i = 0; i < laws.size(); ++i)
    outputs.push_back(
        log_density_of(laws[i], builder.binary(Op::subtract, builder.uniform(i), builder.input(i)), builder));
  return builder.finish(outputs);
}

double draw(const NoiseLaw& law, double uniform, double normal) {
  switch (law.kind) {
    case NoiseLaw::Kind::gaussian:
      return law.scale * normal;
    case NoiseLaw::Kind::laplace:  // by inversion, from the nearer tail
      return uniform < 0.5 ? law.scale * std::log(2.0 * uniform) : -law.scale * std::log(2.0 - 2.0 * uniform);
    case NoiseLaw::Kind::student_t:
      return law.scale * boost::math::quantile(boost::math::students_t(law.dof), uniform);
    case NoiseLaw::Kind::log_chi_square:
      break;
  }
  return 2.0 * std::log(std::abs(normal));
}

void check_law(const NoiseLaw& law) {
  const auto positive = [](double value, const char* what) {
    if (!(value > 0) || !std::isfinite(value))
      throw InputError("must be positive", fmt::format("observation noise: {}", what),
                       fmt::format("{}", value));
  };
  positive(law.scale, "scale");
  if (law.kind == NoiseLaw::Kind::student_t) positive(law.dof, "dof");
}

class AdditiveNoise final : public ObservationDensity {
 public:
  AdditiveNoise(std::shared_ptr<const VectorFields> fields, std::vector<NoiseLaw> laws)
      : fields_(std::move(fields)), laws_(std::move(laws)), log_densities_(log_densities(laws_)) {}

  std::size_t observation_dimension() const override { return laws_.size(); }

  void log_density(std::span<const double> y, ConstBatchView x, std::span<double> out) const override {
    assert(y.size() == laws_.size() && out.size() == x.nodes());
    const std::size_t k = laws_.size();
    thread_local Batch h, densities;
    thread_local std::vector<const double*> inputs;
    thread_local std::vector<double*> outputs;
    h.reshape(k, x.nodes());
    densities.reshape(k, x.nodes());
    fields_->sensor(x, h);
    inputs.clear();
    outputs.clear();
    for (std::size_t i = 0; i < k; ++i) {
      inputs.push_back(h.component(i).data());
      outputs.push_back(densities.component(i).data());
    }
    log_densities_.evaluate(inputs, y, outputs, x.nodes());
    std::fill(out.begin(), out.end(), 0.0);
    for (std::size_t i = 0; i < k; ++i) {
      if (std::isnan(y[i])) continue;
      const double* const term = densities.component(i).data();
      for (std::size_t n = 0; n < out.size(); ++n) out[n] += term[n];
    }
  }

  double log_noise_density(std::span<const double> y) const override {
    double sum = 0;
    for (std::size_t i = 0; i < laws_.size(); ++i)
      if (!std::isnan(y[i])) sum += log_noise(laws_[i], y[i]);
    return sum;
  }

  void sample(std::span<const double> x, std::span<const double> uniforms, std::span<const double> normals,
              std::span<double> y) const override {
    assert(uniforms.size() == laws_.size() && normals.size() == laws_.size() && y.size() == laws_.size());
    fields_->sensor({x.data(), x.size(), 1, 1}, {y.data(), y.size(), 1, 1});
    for (std::size_t i = 0; i < y.size(); ++i) y[i] += draw(laws_[i], uniforms[i], normals[i]);
  }

  std::vector<double> gaussian_variances() const override {
    std::vector<double> variances;
    for (const NoiseLaw& law : laws_) {
      if (law.kind != NoiseLaw::Kind::gaussian) return {};
      variances.push_back(law.scale * law.scale);
    }
    return variances;
  }

 private:
  std::shared_ptr<const VectorFields> fields_;
  std::vector<NoiseLaw> laws_;
  Tape log_densities_;
};

class ScaledNoise final : public ObservationDensity {
 public:
  ScaledNoise(std::shared_ptr<const VectorFields> fields, std::vector<NoiseLaw> laws, Tape scales,
              std::string name, std::shared_ptr<const InputFunctions> inputs)
      : fields_(std::move(fields)),
        laws_(std::move(laws)),
        scales_(std::move(scales)),
        name_(std::move(name)),
        inputs_(std::move(inputs)) {
    for (NoiseLaw& law : laws_) law.scale = 1;
    log_densities_ = log_densities(laws_);
  }

  std::size_t observation_dimension() const override { return laws_.size(); }

  // log g((y - h)/s) - log s: the tape is given (h - y)/s for h, and 0 for y.
  void log_density(std::span<const double> y, ConstBatchView x, std::span<double> out) const override {
    const std::size_t k = laws_.size(), N = x.nodes();
    thread_local Batch z, scale, densities;
    z.reshape(k, N);
    scale.reshape(k, N);
    densities.reshape(k, N);
    fields_->sensor(x, z);
    evaluate_scales(x, scale);
    thread_local std::vector<const double*> inputs;
    thread_local std::vector<double*> outputs;
    thread_local std::vector<double> zero;
    inputs.clear();
    outputs.clear();
    zero.assign(k, 0.0);
    for (std::size_t i = 0; i < k; ++i) {
      const std::span<const double> s = scale.component(i);
      const std::span<double> u = z.component(i);
      for (std::size_t n = 0; n < N; ++n) u[n] = s[n] > 0 ? (u[n] - y[i]) / s[n] : NAN;
      inputs.push_back(u.data());
      outputs.push_back(densities.component(i).data());
    }
    log_densities_.evaluate(inputs, zero, outputs, N);
    std::fill(out.begin(), out.end(), 0.0);
    for (std::size_t i = 0; i < k; ++i) {
      if (std::isnan(y[i])) continue;
      const std::span<const double> term = densities.component(i), s = scale.component(i);
      for (std::size_t n = 0; n < N; ++n) out[n] += term[n] - std::log(s[n]);
    }
  }

  double log_noise_density(std::span<const double>) const override {
    throw InputError(
        "the scale of the noise depends on the state, so that there is no law of the noise alone", name_);
  }

  void sample(std::span<const double> x, std::span<const double> uniforms, std::span<const double> normals,
              std::span<double> y) const override {
    const ConstBatchView at{x.data(), x.size(), 1, 1};
    fields_->sensor(at, {y.data(), y.size(), 1, 1});
    Batch scale(y.size(), 1);
    evaluate_scales(at, scale);
    for (std::size_t i = 0; i < y.size(); ++i) y[i] += scale(i, 0) * draw(laws_[i], uniforms[i], normals[i]);
  }

 private:
  void evaluate_scales(ConstBatchView x, BatchView out) const {
    thread_local std::vector<const double*> inputs;
    thread_local std::vector<double*> outputs;
    inputs.clear();
    outputs.clear();
    for (std::size_t i = 0; i < x.components(); ++i) inputs.push_back(x.component(i).data());
    if (inputs_) inputs_->append(x.component(x.components() - 1), inputs);
    for (std::size_t i = 0; i < out.components(); ++i) outputs.push_back(out.component(i).data());
    scales_.evaluate(inputs, {}, outputs, x.nodes());
  }

  std::shared_ptr<const VectorFields> fields_;
  std::vector<NoiseLaw> laws_;
  Tape scales_, log_densities_;
  std::string name_;
  std::shared_ptr<const InputFunctions> inputs_;
};

class TapeDensity final : public ObservationDensity {
 public:
  TapeDensity(Tape log_likelihood, std::string name, std::shared_ptr<const InputFunctions> inputs)
      : log_likelihood_(std::move(log_likelihood)), name_(std::move(name)), inputs_(std::move(inputs)) {}

  std::size_t observation_dimension() const override { return log_likelihood_.uniforms(); }

  void log_density(std::span<const double> y, ConstBatchView x, std::span<double> out) const override {
    assert(y.size() == observation_dimension() && out.size() == x.nodes());
    const auto missing = std::count_if(y.begin(), y.end(), [](double v) { return std::isnan(v); });
    if (missing == static_cast<std::ptrdiff_t>(y.size())) {
      std::fill(out.begin(), out.end(), 0.0);
      return;
    }
    if (missing > 0)
      throw InputError("some components of an observation are missing, and this density cannot be split",
                       name_, fmt::format("{} of {} missing", missing, y.size()));
    thread_local std::vector<const double*> inputs;
    inputs.clear();
    for (std::size_t i = 0; i < x.components(); ++i) inputs.push_back(x.component(i).data());
    if (inputs_) inputs_->append(x.component(x.components() - 1), inputs);
    double* const output = out.data();
    log_likelihood_.evaluate(inputs, y, std::span(&output, 1), x.nodes());
  }

  double log_noise_density(std::span<const double>) const override {
    throw InputError("a density given as an expression has no law of the noise alone: give h and noise",
                     name_);
  }

  void sample(std::span<const double>, std::span<const double>, std::span<const double>,
              std::span<double>) const override {
    throw InputError("observations cannot be drawn from a density given as an expression", name_);
  }

 private:
  Tape log_likelihood_;
  std::string name_;
  std::shared_ptr<const InputFunctions> inputs_;
};

}  // namespace

double log_noise(const NoiseLaw& law, double v) {
  const double z = v / law.scale;
  switch (law.kind) {
    case NoiseLaw::Kind::gaussian:
      return -0.5 * z * z - std::log(law.scale) - 0.5 * std::log(2.0 * std::numbers::pi);
    case NoiseLaw::Kind::laplace:
      return -std::abs(z) - std::log(2.0 * law.scale);
    case NoiseLaw::Kind::student_t: {
      const double n = law.dof;
      return log_student_normaliser(n) - std::log(law.scale) - 0.5 * (n + 1.0) * std::log1p(z * z / n);
    }
    case NoiseLaw::Kind::log_chi_square:
      break;
  }
  return 0.5 * (v - std::exp(v)) - 0.5 * std::log(2.0 * std::numbers::pi);
}

namespace {

void check_laws(const VectorFields& fields, const std::vector<NoiseLaw>& laws) {
  if (laws.size() != fields.sensor_dimension())
    throw InputError(
        fmt::format("one law of the noise for each of {} components of h", fields.sensor_dimension()),
        "observation noise", std::to_string(laws.size()));
  for (const NoiseLaw& law : laws) check_law(law);
}

}  // namespace

std::unique_ptr<ObservationDensity> make_additive_noise(std::shared_ptr<const VectorFields> fields,
                                                        std::vector<NoiseLaw> laws) {
  check_laws(*fields, laws);
  return std::make_unique<AdditiveNoise>(std::move(fields), std::move(laws));
}

std::unique_ptr<ObservationDensity> make_scaled_noise(std::shared_ptr<const VectorFields> fields,
                                                      std::vector<NoiseLaw> laws, Tape scales,
                                                      std::string name,
                                                      std::shared_ptr<const InputFunctions> inputs) {
  check_laws(*fields, laws);
  return std::make_unique<ScaledNoise>(std::move(fields), std::move(laws), std::move(scales), std::move(name),
                                       std::move(inputs));
}

std::unique_ptr<ObservationDensity> make_tape_density(Tape log_likelihood, std::string name,
                                                      std::shared_ptr<const InputFunctions> inputs) {
  return std::make_unique<TapeDensity>(std::move(log_likelihood), std::move(name), std::move(inputs));
}

}  // namespace wienertree
