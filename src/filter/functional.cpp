#include "wienertree/filter/functional.hpp"

#include <algorithm>
#include <numbers>

namespace wienertree {
namespace {

constexpr double pi = std::numbers::pi;

class Picard final : public Functional {
 public:
  std::string_view name() const override { return "picard"; }
  bool uses_end() const override { return false; }
  bool uses_derivative() const override { return false; }
  void at_start(const ObservationWindow& window, ConstBatchView h0, ConstBatchView,
                std::span<double> out) const override {
    std::fill(out.begin(), out.end(), 0.0);
    const double half = window.length() / 2;
    for (std::size_t i = 0; i < h0.components(); ++i) {
      const double D = window.increment[i];
      const double* h = h0.component(i).data();
      for (std::size_t n = 0; n < out.size(); ++n) out[n] += h[n] * (D - half * h[n]);
    }
  }
  void at_end(const ObservationWindow&, ConstBatchView, ConstBatchView, ConstBatchView,
              std::span<double>) const override {}
};

// h_0.(D - I/s) + h_1.I/s - (s/6)(|h_0|^2 + h_0.h_1 + |h_1|^2): with I = sD/2 this is the trapezoid.
class LinearInterpolation : public Functional {
 public:
  explicit LinearInterpolation(bool second_order) : second_order_(second_order) {}
  std::string_view name() const override { return second_order_ ? "second-order" : "trapezoid"; }
  bool uses_end() const override { return true; }
  bool uses_derivative() const override { return second_order_; }

  void at_start(const ObservationWindow& window, ConstBatchView h0, ConstBatchView G,
                std::span<double> out) const override {
    const double s = window.length();
    std::fill(out.begin(), out.end(), 0.0);
    for (std::size_t i = 0; i < h0.components(); ++i) {
      const double a = window.increment[i] - slope(window, i);
      const double* h = h0.component(i).data();
      for (std::size_t n = 0; n < out.size(); ++n) out[n] += h[n] * (a - s / 6 * h[n]);
    }
    if (!second_order_) return;
    for_pairs(window, h0.components(), G, out.size(),
              [&](const Pair& c, const double* gg, std::size_t first, std::size_t count) {
                const double *a = h0.component(c.i).data() + first, *b = h0.component(c.l).data() + first;
                double* w = out.data() + first;
                for (std::size_t n = 0; n < count; ++n)
                  w[n] +=
                      gg[n] * (c.covariation + c.same * a[n] * b[n] - c.start_i * b[n] - c.start_l * a[n]);
              });
  }

  void at_end(const ObservationWindow& window, ConstBatchView h0, ConstBatchView G, ConstBatchView h1,
              std::span<double> log_weight) const override {
    const double s = window.length();
    for (std::size_t i = 0; i < h0.components(); ++i) {
      const double b = slope(window, i);
      const double* p = h0.component(i).data();
      const double* q = h1.component(i).data();
      for (std::size_t n = 0; n < log_weight.size(); ++n) log_weight[n] += q[n] * (b - s / 6 * (p[n] + q[n]));
    }
    if (!second_order_) return;
    for_pairs(window, h0.components(), G, log_weight.size(),
              [&](const Pair& c, const double* gg, std::size_t first, std::size_t count) {
                const double *a = h0.component(c.i).data() + first, *b = h0.component(c.l).data() + first;
                const double *p = h1.component(c.i).data() + first, *q = h1.component(c.l).data() + first;
                double* w = log_weight.data() + first;
                for (std::size_t n = 0; n < count; ++n)
                  w[n] += gg[n] * (c.same * p[n] * q[n] + c.mixed * (a[n] * q[n] + b[n] * p[n]) -
                                   c.end_i * q[n] - c.end_l * p[n]);
              });
  }

 private:
  // I/s, or D/2 when only the increment is to be used.
  double slope(const ObservationWindow& window, std::size_t i) const {
    return second_order_ ? window.integral[i] / window.length() : window.increment[i] / 2;
  }

  // What multiplies theta (G G^T)_il, off the diagonal for (i,l) and (l,i) together.
  struct Pair {
    std::size_t i, l;
    double covariation, same, mixed, start_i, start_l, end_i, end_l;
  };

  // add(pair, theta (G G^T)_il, first, count) for l <= i and blocks of nodes.
  template <class Add>
  static void for_pairs(const ObservationWindow& window, std::size_t k, ConstBatchView G, std::size_t nodes,
                        Add add) {
    constexpr std::size_t block = 64;
    double theta[block], product[block];
    const double s = window.length(), s3 = s * s * s, first_eigenvalue = s * s / (pi * pi);
    const std::size_t p = G.components() / k;
    for (std::size_t first = 0; first < nodes; first += block) {
      const std::size_t count = std::min(block, nodes - first);
      std::fill_n(theta, count, 1.0);
      for (std::size_t c = 0; c < k * p; ++c) {
        const double* g = G.component(c).data() + first;
        for (std::size_t n = 0; n < count; ++n) theta[n] += first_eigenvalue * g[n] * g[n];
      }
      for (std::size_t n = 0; n < count; ++n) theta[n] = 1 / theta[n];
      for (std::size_t i = 0; i < k; ++i)
        for (std::size_t l = 0; l <= i; ++l) {
          const double half = i == l ? 0.5 : 1.0;
          const double covariation = window.covariation[i * k + l] - (i == l ? s * s / 6 : 0.0);
          const Pair pair{.i = i,
                          .l = l,
                          .covariation = half * covariation,
                          .same = half * s3 / 45,
                          .mixed = half * s3 * 7 / 360,
                          .start_i = half * window.bridge_start[i],
                          .start_l = half * window.bridge_start[l],
                          .end_i = half * window.bridge_end[i],
                          .end_l = half * window.bridge_end[l]};
          std::fill_n(product, count, 0.0);
          for (std::size_t r = 0; r < p; ++r) {
            const double* a = G.component(i * p + r).data() + first;
            const double* b = G.component(l * p + r).data() + first;
            for (std::size_t n = 0; n < count; ++n) product[n] += a[n] * b[n];
          }
          for (std::size_t n = 0; n < count; ++n) product[n] *= theta[n];
          add(pair, product, first, count);
        }
    }
  }

  bool second_order_;
};

}  // namespace

std::unique_ptr<Functional> make_functional(FunctionalMethod method) {
  if (method == FunctionalMethod::picard) return std::make_unique<Picard>();
  return std::make_unique<LinearInterpolation>(method == FunctionalMethod::second_order);
}

}  // namespace wienertree
