/// Kinks and jumps by the law of the last step: its moments, its crossings, and the order of convergence that
/// it restores, against the formulas of Black and Scholes (1973).
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "wienertree/cubature/catalogue.hpp"
#include "wienertree/model/cpp_model.hpp"
#include "wienertree/weak/families.hpp"
#include "wienertree/weak/run.hpp"

using namespace wienertree;

namespace {

constexpr double r = 0.05;

/// x = log s of a geometric Brownian motion: fields are constant, so that no ODE adds an error.
template <int hundredths>
struct LogPrice : CppModel<1, 1> {
  static constexpr auto convention = Convention::stratonovich;
  static constexpr double sigma = hundredths / 100.0;
  template <class T>
  State<T> drift(const State<T>& x) const {
    return {0.0 * x[0] + (r - sigma * sigma / 2)};
  }
  template <class T>
  Diffusion<T> diffusion(const State<T>& x) const {
    return {{{0.0 * x[0] + sigma}}};
  }
};

BatchFunction of_state(double (*f)(double)) {
  return [f](ConstBatchView x, std::span<double> out) {
    for (std::size_t n = 0; n < out.size(); ++n) out[n] = f(x(0, n));
  };
}

/// g(u, above) with u = s - 100; `above` is what [u > 0] stands for.
KinkedFunction of_excess(double (*g)(double u, double above)) {
  const auto u = [](double x) { return std::exp(x) - 100; };
  const auto with = [g, u](double above) -> BatchFunction {
    return [g, u, above](ConstBatchView x, std::span<double> out) {
      for (std::size_t n = 0; n < out.size(); ++n) out[n] = g(u(x(0, n)), above);
    };
  };
  KinkedFunction f;
  f.exact = [g, u](ConstBatchView x, std::span<double> out) {
    for (std::size_t n = 0; n < out.size(); ++n) out[n] = g(u(x(0, n)), u(x(0, n)) > 0 ? 1 : 0);
  };
  f.kinks = {of_state([](double x) { return std::exp(x) - 100; })};
  f.branch = [with](std::span<const double> above) { return with(above[0]); };
  f.argument_branch = [kinks = f.kinks](std::size_t, std::span<const double>) { return kinks[0]; };
  f.with_argument = [g](std::size_t) -> BatchFunction {
    return [g](ConstBatchView x, std::span<double> out) {
      for (std::size_t n = 0; n < out.size(); ++n) out[n] = g(x(1, n), x(1, n) > 0 ? 1 : 0);
    };
  };
  return f;
}

double call(double u, double above) { return u * above; }
double digital(double, double above) { return above; }
double root(double u, double above) { return above > 0 ? std::sqrt(u) : 0; }

double Phi(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }
double exact_call(double sigma) {
  const double d1 = (r + sigma * sigma / 2) / sigma;
  return 100 * std::exp(r) * Phi(d1) - 100 * Phi(d1 - sigma);
}
double exact_digital(double sigma) { return Phi((r - sigma * sigma / 2) / sigma); }

template <int hundredths>
double value(const KinkedFunction& payoff, int degree, std::size_t n, double width = 1) {
  const Model model = make_model(LogPrice<hundredths>{}, {.name = "log price", .initial = {std::log(100.0)}});
  WeakRun run;
  run.options.formula = find_formula(degree, 1, WIENERTREE_SOURCE_DIR "/data/cubature_formulas");
  run.options.nodes = 100000;
  run.options.patch_width = width;
  run.steps = n;
  return run_weak(model, {WeakPayoff(payoff)}, run).value[0];
}

double slope(double coarse, double fine) { return std::log2(std::abs(coarse / fine)); }

}  // namespace

TEST_CASE("the law of the last step has the moments it is made from") {
  const std::array<double, 5> u = {-1, 0.2, 0.7, 2, 4.5}, w = {0.3, 0.8, 0.4, 0.35, 0.15};
  double moment[5] = {};
  for (std::size_t j = 0; j < u.size(); ++j)
    for (int k = 0; k < 5; ++k) moment[k] += w[j] * std::pow(u[j], k);
  for (const bool four : {false, true}) {
    const StepLaw law = step_law(u, w, four);
    // The trapezoidal rule with the Gaussian weight is exact to rounding.
    double got[5] = {};
    constexpr double h = 1.0 / 16;
    for (int i = -200; i <= 200; ++i) {
      const double z = i * h, p = h * std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi);
      for (int k = 0; k < 5; ++k) got[k] += p * std::pow(law(z), k);
    }
    for (int k = 0; k <= (law.d != 0 ? 4 : 3); ++k)
      CHECK(got[k] == Approx(moment[k] / moment[0]).epsilon(1e-11));
  }
  // All roots of a law that bends back.
  StepLaw bent{0.1, 2, 0.4, -0.3, 0.19};
  const Crossings found = crossings(bent, 0.3, 8);
  CHECK(found.count >= 1);
  int changes = 0;
  for (int i = -8000; i < 8000; ++i)
    changes += (bent(i * 1e-3) < 0.3) != (bent((i + 1) * 1e-3) < 0.3) ? 1 : 0;
  CHECK(static_cast<int>(found.count) == changes);
  for (std::size_t i = 0; i < found.count; ++i) CHECK(bent(found.z[i]) == Approx(0.3).epsilon(1e-12));
}

TEST_CASE("a call and a digital converge with the order of the formula, and one more once extrapolated") {
  const KinkedFunction payoffs[2] = {of_excess(call), of_excess(digital)};
  const double exact[2] = {exact_call(0.2), exact_digital(0.2)};
  for (const int degree : {5, 7}) {
    const double q = (degree - 1) / 2.0;
    for (int i = 0; i < 2; ++i) {
      std::array<double, 4> error;
      for (std::size_t k = 0; k < error.size(); ++k)
        error[k] = value<20>(payoffs[i], degree, std::size_t{8} << k) - exact[i];
      std::array<double, 3> extrapolated;
      for (std::size_t k = 0; k < 3; ++k)
        extrapolated[k] = error[k + 1] + (error[k + 1] - error[k]) / (std::exp2(q) - 1);
      CAPTURE(degree, i, error, extrapolated);
      // From 8 to 64 steps: 0.4 and 0.6 are what the next order leaves of it there.
      CHECK(slope(error[0], error[3]) / 3 > q - 0.4);
      CHECK(slope(extrapolated[0], extrapolated[2]) / 2 > q + 1 - 0.6);
    }
  }
}

TEST_CASE("Black and Scholes' call to ten digits") {
  const KinkedFunction f = of_excess(call);
  const double fine = value<20>(f, 7, 64), coarse = value<20>(f, 7, 32);
  CHECK(std::abs(extrapolate(coarse, fine, 32, 64, 7) / exact_call(0.2) - 1) < 3e-10);
}

TEST_CASE("probabilities stay between 0 and 1, and roots at a kink are finite") {
  for (const std::size_t n : {1, 2, 3, 7}) {
    const double p = value<150>(of_excess(digital), 7, n);
    CHECK(p >= 0);
    CHECK(p <= 1);
    CHECK(std::isfinite(value<20>(of_excess(root), 7, n)));
  }
  // E sqrt(max(s - 100, 0)), by the trapezoidal rule in t where s - 100 = t^2 makes it smooth.
  double sum = 0;
  constexpr double h = 1e-3;
  for (int i = 1; i < 20000; ++i) {
    const double t = i * h, s = 100 + t * t, z = (std::log(s / 100) - (r - 0.02)) / 0.2;
    sum += h * t * 2 * t / (0.2 * s) * std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi);
  }
  CHECK(value<20>(of_excess(root), 7, 32) == Approx(sum).epsilon(1e-6));
}
