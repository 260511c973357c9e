/// Weak approximation, E[f(X_T)]: moments of geometric Brownian motion by 2 .. 16 steps of degree 5, and
/// extrapolated.
///
///     weak_approximation
#include <cmath>
#include <cstdio>

#include "wienertree/cubature/construct.hpp"
#include "wienertree/model/cpp_model.hpp"
#include "wienertree/weak/run.hpp"

using namespace wienertree;

struct GeometricBrownianMotion : CppModel<1, 1> {
  static constexpr auto convention = Convention::ito;
  double mu = 0.1, sigma = 0.5;
  template <class T>
  State<T> drift(const State<T>& x) const {
    return {mu * x[0]};
  }
  template <class T>
  Diffusion<T> diffusion(const State<T>& x) const {
    return {{{sigma * x[0]}}};
  }
};

int main() {
  const GeometricBrownianMotion gbm;
  const Model model = make_model(gbm, {.name = "gbm", .initial = {1.0}});
  const BatchFunction square = [](ConstBatchView x, std::span<double> out) {
    for (std::size_t n = 0; n < out.size(); ++n) out[n] = x(0, n) * x(0, n);
  };
  const BatchFunction root = [](ConstBatchView x, std::span<double> out) {
    for (std::size_t n = 0; n < out.size(); ++n) out[n] = std::sqrt(x(0, n));
  };
  // E[X^a] = exp(a mu T + a (a - 1) sigma^2 T / 2)
  const auto exact = [&](double a) { return std::exp(a * gbm.mu + a * (a - 1) * gbm.sigma * gbm.sigma / 2); };

  WeakRun run;
  run.options.formula = construct(5, 1);
  run.options.nodes = 300;
  run.horizon = 1.0;
  run.richardson = true;
  std::printf("%6s %14s %14s %14s %14s\n", "steps", "error of x^2", "extrapolated", "of sqrt(x)",
              "extrapolated");
  for (run.steps = 2; run.steps <= 16; run.steps *= 2) {
    const WeakResult r = run_weak(model, {square, root}, run);
    std::printf("%6zu %14.2e %14.2e %14.2e %14.2e\n", run.steps, r.value[0] - exact(2),
                r.extrapolated[0] - exact(2), r.value[1] - exact(0.5), r.extrapolated[1] - exact(0.5));
  }
}
