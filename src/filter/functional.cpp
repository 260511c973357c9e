#include "wienertree/filter/functional.hpp"

#include <algorithm>

namespace wienertree {
namespace {

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
  void at_end(const ObservationWindow&, ConstBatchView, ConstBatchView, std::span<double>) const override {}
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
    if (second_order_ && window.rows() > 2) add_bridge_remainder(window, h0.components(), G, out);
  }

  void at_end(const ObservationWindow& window, ConstBatchView h0, ConstBatchView h1,
              std::span<double> log_weight) const override {
    const double s = window.length();
    for (std::size_t i = 0; i < h0.components(); ++i) {
      const double b = slope(window, i);
      const double* p = h0.component(i).data();
      const double* q = h1.component(i).data();
      for (std::size_t n = 0; n < log_weight.size(); ++n) log_weight[n] += q[n] * (b - s / 6 * (p[n] + q[n]));
    }
  }

 private:
  // I/s, or D/2 when only the increment is to be used.
  double slope(const ObservationWindow& window, std::size_t i) const {
    return second_order_ ? window.integral[i] / window.length() : window.increment[i] / 2;
  }

  // 1/2 tr(G^T M G) with M = C - (s^2/6) Id symmetric: 1/2 sum_{i,l} M_il sum_r G_ir G_lr.
  static void add_bridge_remainder(const ObservationWindow& window, std::size_t k, ConstBatchView G,
                                   std::span<double> out) {
    const double s = window.length();
    const std::size_t p = G.components() / k;
    for (std::size_t i = 0; i < k; ++i)
      for (std::size_t l = 0; l <= i; ++l) {
        double m = window.covariation[i * k + l];
        m = i == l ? (m - s * s / 6) / 2 : m;  // off the diagonal (i,l) and (l,i) together
        for (std::size_t r = 0; r < p; ++r) {
          const double* a = G.component(i * p + r).data();
          const double* b = G.component(l * p + r).data();
          for (std::size_t n = 0; n < out.size(); ++n) out[n] += m * a[n] * b[n];
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
