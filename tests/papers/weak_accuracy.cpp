/// Weak approximation against closed forms and published values.
///
/// - Linear SDEs as text, through the ODE flow: E X_1 = exp(A_0 + 1/2 sum A_i^2) X_0. Fields and payoff being
///   linear, recombination keeps the mean exactly, so that any number of steps is cheap. Criterion: for every
///   formula the slope of the error over n = 2, 4, 8 is within 0.15 of (m-1)/2.
/// - Asian call in Heston's model (Ninomiya, Victoir 2008): 6.04735e-2 +- 1.5e-6. Criterion: within 1e-5 at
///   tolerance 1e-5.
/// - Black-Scholes 10.450583572186; Cox-Ingersoll-Ross zero bond 0.91397030320316; Heston's European call
///   (Heston 1993) with the parameters of the Asian call, with kappa 2, theta = v0 = 0.04, xi 0.3, rho -0.7,
///   and beyond Feller's condition (kappa 6.21, theta 0.019, xi 0.61, v0 0.010201, r 0.0319). Criterion:
///   1e-6, the last in the state sqrt(v).
/// - dX = (X/2 + sqrt(X^2+1)) dt + sqrt(X^2+1) dB: E q(asinh X_t) = t^3 - 3 t^2 + 2 t for
///   q = z^3 - 6 z^2 + 8 z. Criterion: 1e-8 at degree 7.
/// - Three states, two Brownian motions, fields that do not commute: against the extrapolated limit of
///   degree 9. Criterion: slopes of at least 1.85 (degree 5) and 2.8 (degree 7).
///
/// WIENERTREE_FULL = 0 leaves out what takes more than a second or two.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <ctime>
#include <random>
#include <tuple>
#include <unsupported/Eigen/MatrixFunctions>

#include "weak_problems.hpp"
#include "wienertree/cubature/construct.hpp"
#include "wienertree/cubature/lie_formula.hpp"

using namespace wienertree;
using namespace wienertree_test;

namespace {

constexpr bool full = WIENERTREE_FULL;

double seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double slope(const std::vector<double>& n, const std::vector<double>& error) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < n.size(); ++i) {
    const double x = std::log(n[i]), y = std::log(error[i]);
    sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  const auto k = static_cast<double>(n.size());
  return (k * sxy - sx * sy) / (k * sxx - sx * sx);
}

constexpr int size = 3;
using Matrix = Eigen::Matrix<double, size, size>;

std::string linear_model(const std::vector<Matrix>& A) {
  const auto row = [](const Matrix& a, int i) {
    return fmt::format("({:.17g})*x0 + ({:.17g})*x1 + ({:.17g})*x2", a(i, 0), a(i, 1), a(i, 2));
  };
  std::string text = "name = \"linear\"\nconvention = \"stratonovich\"\n[state]\n";
  for (int i = 0; i < size; ++i) text += fmt::format("x{} = {{ initial = {} }}\n", i, 1 - 0.5 * i);
  text += "[drift]\n";
  for (int i = 0; i < size; ++i) text += fmt::format("x{} = \"{}\"\n", i, row(A[0], i));
  text += "[diffusion]\n";
  for (int i = 0; i < size; ++i) {
    text += fmt::format("x{} = [", i);
    for (std::size_t j = 1; j < A.size(); ++j) text += fmt::format("\"{}\", ", row(A[j], i));
    text += "]\n";
  }
  return text;
}

std::vector<Matrix> random_fields(int p, std::mt19937_64& engine) {
  std::normal_distribution<double> normal;
  std::vector<Matrix> A(static_cast<std::size_t>(p) + 1);
  for (Matrix& a : A) {
    for (double& entry : a.reshaped()) entry = normal(engine);
    a /= a.norm();
  }
  return A;
}

// Root mean square over some draws of the relative error at n = 2, 4, 8.
template <class Driven>
std::vector<double> linear_errors(int p, const Driven& driven) {
  std::mt19937_64 engine(2);
  std::vector<double> squares(3, 0.0);
  constexpr int draws = full ? 6 : 2;
  for (int draw = 0; draw < draws; ++draw) {
    const std::vector<Matrix> A = random_fields(p, engine);
    Matrix generator = A[0];
    for (std::size_t j = 1; j < A.size(); ++j) generator += 0.5 * A[j] * A[j];
    const Eigen::Vector3d exact = generator.exp() * Eigen::Vector3d(1, 0.5, 0);
    const TextModel text = TextModel::parse(linear_model(A), "linear");
    std::vector<WeakPayoff> means;
    for (int i = 0; i < size; ++i) means.push_back(text.compile(fmt::format("x{}", i), "payoff"));
    WeakRun run;
    const Model model = driven(text, run.options.formula);
    run.options.flow = FlowMethod::explicit_;
    run.options.tolerance = {1e-13, 1e-14};
    run.options.nodes = 30;
    run.options.thinning.recombination_degree = 1;
    for (std::size_t k = 0; k < 3; ++k) {
      run.steps = std::size_t{2} << k;
      const WeakResult result = run_weak(model, means, run);
      const Eigen::Map<const Eigen::Vector3d> mean(result.value.data());
      squares[k] += (mean - exact).squaredNorm() / exact.squaredNorm() / draws;
    }
  }
  for (double& square : squares) square = std::sqrt(square);
  return squares;
}

template <class Driven>
void check_order(const std::string& name, int degree, int p, const Driven& driven) {
  const std::vector<double> e = linear_errors(p, driven);
  const double order = -slope({2, 4, 8}, e);
  fmt::print("{:<28} {:>2} {}  {:.2e} {:.2e} {:.2e}  {:.3f}\n", name, degree, p, e[0], e[1], e[2], order);
  INFO(name);
  CHECK(order == Approx((degree - 1) / 2.0).margin(0.15));
}

void check_order(const CubatureFormula& formula) {
  check_order(formula.name, formula.degree, formula.dimension,
              [&](const TextModel& text, CubatureFormula& f) {
                f = formula;
                return text.model();
              });
}

const KnownAverage& known(const std::string& name) {
  static const std::vector<KnownAverage> all = known_averages();
  return *std::find_if(all.begin(), all.end(), [&](const KnownAverage& one) { return one.name == name; });
}

double check_value(const std::string& name, double tolerance, double margin) {
  const double began = seconds();
  const ControlledResult result = to_tolerance(known(name), tolerance);
  print(name, tolerance, result, known(name).exact);
  INFO(name);
  CHECK(std::abs(result.value[0] - known(name).exact) <= margin);
  return seconds() - began;
}

BatchFunction with_smooth_kink(const TextModel& text, const KinkedFunction& f) {
  return smooth_payoff(f, kink_scales(text.model(), {f}, 1, {})[0], 0.4);
}

}  // namespace

TEST_CASE("linear SDEs through the ODE flow: order (m-1)/2 for every formula") {
  fmt::print("{:<28} {:>2} p  error at n = 2, 4, 8, order\n", "formula", "m");
  for (const CatalogueEntry& entry : bundled_formulas(formulas))
    if (full || total_segments(entry.formula) < 300) check_order(entry.formula);
  for (int p = 1; p <= 4; ++p) check_order(construct(3, p));
  for (int p = 1; p <= 4; ++p) {
    const LieFormula lie = construct_lie_5(p);
    check_order(lie.name, 5, p, [&](const TextModel& text, CubatureFormula& f) {
      BracketFormula driven = bracket_formula(lie);
      f = driven.formula;
      return text.with_brackets(driven.brackets);
    });
  }
}

TEST_CASE("Heston's Asian call to 1e-5") {
  const KnownAverage& asian = known("Heston, Asian call");
  fmt::print("  {:.2f} s of processor time\n", check_value(asian.name, 1e-5, 1e-5));
  const TextModel& text = asian.model;
  const KinkedFunction f = text.compile_kinked(asian.payoff, "payoff");
  const std::vector<WeakPayoff> smooth = {with_smooth_kink(text, f)};
  fmt::print("error of the Asian call against n, 800 nodes\n");
  for (const int degree : {5, 7, 9}) {
    fmt::print("  degree {}:", degree);
    std::vector<double> steps, errors;
    for (const std::size_t n : {2, 4, 8, 16}) {
      if (degree == 9 && n > 4) break;
      WeakRun run;
      run.options.formula = find_formula(degree, 2, formulas);
      run.options.nodes = 800;
      run.options.finest_along = f.kinks.front();
      run.steps = n;
      const double error = run_weak(text.model(), smooth, run).value[0] - asian.exact;
      steps.push_back(static_cast<double>(n));
      errors.push_back(std::abs(error));
      fmt::print("  n {}: {:+.2e}", n, error);
    }
    fmt::print("  slope {:.2f}\n", slope(steps, errors));
    CHECK(errors.back() < errors.front());
  }
}

TEST_CASE("Black-Scholes, Heston and Cox-Ingersoll-Ross in closed form to 1e-6") {
  check_value("Black-Scholes, call", 1e-6, 1e-6);
  check_value("Cox-Ingersoll-Ross, bond", 1e-8, 1e-8);
  const double tolerance = full ? 1e-6 : 1e-4;
  check_value("Heston, call", tolerance, tolerance);
  check_value("Heston, call, rho -0.7", tolerance, tolerance);
  check_value("Heston beyond Feller, in sqrt v", tolerance, tolerance);
}

TEST_CASE("Heston beyond Feller's condition: the order in v and in its root") {
  // kappa theta = 0.118 is below xi^2/2 = 0.186, so that v reaches 0 (Feller 1951), but above xi^2/4 = 0.093:
  // V_0 points inwards at v = 0. Along V_2 the root of v moves by a constant and passes through 0: E over
  // both signs is a smooth function of v, as for the splitting schemes of Alfonsi (2010, "High order
  // discretization schemes for the CIR process", Math. Comp. 79). The flow in v stays at 0 and loses this.
  const KnownAverage &in_v = known("Heston beyond Feller, in v"),
                     &in_root = known("Heston beyond Feller, in sqrt v");
  const auto errors = [&](const KnownAverage& problem, const std::string& formula) {
    const TextModel& text = problem.model;
    const KinkedFunction f = text.compile_kinked(problem.payoff, "payoff");
    const BatchFunction smooth = with_smooth_kink(text, f);
    std::vector<double> found;
    fmt::print("{}, {}:", problem.name, formula);
    WeakRun run;
    for (const CatalogueEntry& entry : bundled_formulas(formulas))
      if (entry.formula.name == formula) run.options.formula = entry.formula;
    run.options.nodes = full ? 1600 : 800;
    run.options.finest_along = f.kinks.front();
    for (const std::size_t n : {8, 16, 32}) {
      run.steps = n;
      found.push_back(std::abs(run_weak(text.model(), {smooth}, run).value[0] - problem.exact));
      fmt::print("  n {}: {:.1e}", n, found.back());
    }
    fmt::print("\n");
    return found;
  };
  const std::string splitting = "ninomiya-victoir-5-2";
  const std::vector<double> v = errors(in_v, splitting), root = errors(in_root, splitting),
                            mixed = errors(in_root, "moment-equations-5-2");
  CHECK(-slope({8, 16, 32}, root) > 1.85);
  CHECK(-slope({8, 16, 32}, v) < 1.3);
  CHECK(-slope({8, 16, 32}, mixed) < 1.3);
}

TEST_CASE("a call's kink: uniform and Kusuoka's grid, and smoothing") {
  const TextModel gbm = bundled("gbm");
  const KinkedFunction call = gbm.compile_kinked("exp(-r)*max(s - 100, 0)", "payoff");
  std::vector<double> uniform, kusuoka, smoothed;
  fmt::print(
      "Black-Scholes call, degree 5, 400 nodes: error with uniform grid, Kusuoka's (gamma 5), and "
      "smoothed kink\n");
  for (const std::size_t n : {8, 16, 32, 64}) {
    WeakRun run;
    run.options.formula = construct(5, 1);
    run.options.nodes = 400;
    run.steps = n;
    const auto error = [&](const BatchFunction& f) {
      return std::abs(run_weak(gbm.model(), {f}, run).value[0] - 10.450583572186);
    };
    uniform.push_back(error(call.exact));
    smoothed.push_back(error(with_smooth_kink(gbm, call)));
    run.grid = GridKind::kusuoka;
    run.gamma = 5;
    kusuoka.push_back(error(call.exact));
    fmt::print("  n {:>2}: {:.2e} {:.2e} {:.2e}\n", n, uniform.back(), kusuoka.back(), smoothed.back());
  }
  CHECK(kusuoka.back() < uniform.back());
  CHECK(smoothed.back() < uniform.back() / 50);
}

TEST_CASE("a polynomial of asinh is exact to 1e-8 at degree 7") {
  const TextModel text = TextModel::parse(
      "name = \"asinh\"\nconvention = \"ito\"\n[state]\nx = { initial = 0.0 }\n[drift]\nx = \"x/2 + sqrt(x^2 "
      "+ "
      "1)\"\n[diffusion]\nx = [\"sqrt(x^2 + 1)\"]\n",
      "asinh");
  const std::string z = "log(x + sqrt(x^2 + 1))";
  const BatchFunction q = text.compile(fmt::format("({0})^3 - 6*({0})^2 + 8*({0})", z), "payoff");
  WeakRun run;
  run.options.formula = find_formula(7, 1, formulas);
  run.options.thinning.method = ThinningMethod::none;
  run.options.tolerance = {1e-11, 1e-12};
  run.steps = 4;
  for (const double t : {0.5, 1.0, 2.0}) {
    run.horizon = t;
    const double value = run_weak(text.model(), {q}, run).value[0], exact = t * t * t - 3 * t * t + 2 * t;
    fmt::print("E q(asinh X_t), t = {}: {:+.12f}, error {:+.1e}\n", t, value, value - exact);
    CHECK(std::abs(value - exact) <= 1e-8);
  }
}

TEST_CASE("three states whose fields do not commute, against the limit of a high degree") {
  const TextModel text = TextModel::parse(
      "name = \"bent\"\nconvention = \"stratonovich\"\n[state]\nx = { initial = 0.3 }\ny = { initial = -0.2 "
      "}\nz = { initial = 0.1 }\n[drift]\nx = \"sin(y)\"\ny = \"-x\"\nz = \"0.5*cos(x)\"\n[diffusion]\nx = "
      "[\"0.6*cos(z)\", \"0.2\"]\ny = [\"0.3\", \"0.5*sin(x) + 0.4\"]\nz = [\"0.4*sin(x + y)\", "
      "\"0.5*cos(y)\"]\n",
      "bent");
  const BatchFunction f = text.compile("sin(x) + x*y + cos(z)*y", "payoff");
  // Whole trees, so that the order is that of the steps alone: 24^4 leaves at degree 7.
  const auto value = [&](int degree, std::size_t n, bool richardson) {
    WeakRun run;
    run.options.formula = find_formula(degree, 2, formulas);
    run.options.thinning.method = ThinningMethod::none;
    run.options.tolerance = {1e-11, 1e-12};
    run.horizon = 0.5;
    run.steps = n;
    run.richardson = richardson;
    const WeakResult result = run_weak(text.model(), {f}, run);
    return richardson ? result.extrapolated[0] : result.value[0];
  };
  // 92^3 leaves and 92^2: the full program computes it again.
  constexpr double limit = -0.0846725679;
  if (full) CHECK(value(9, 3, true) == Approx(limit).epsilon(0).margin(1e-9));
  for (const auto& [degree, least] : {std::pair{5, 1.85}, std::pair{7, 2.8}}) {
    std::vector<double> steps, errors;
    fmt::print("three states, degree {}:", degree);
    for (std::size_t n = 2; n <= 4; ++n) {
      steps.push_back(static_cast<double>(n));
      errors.push_back(std::abs(value(degree, n, false) - limit));
      fmt::print("  n {}: {:.2e}", n, errors.back());
    }
    const double order = -slope(steps, errors);
    fmt::print("  order {:.2f} (limit {:.10f})\n", order, limit);
    CHECK(order > least);
  }
}
