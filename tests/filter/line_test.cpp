/// The parts of the grid filter, and what it refuses.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <random>

#include "filter/linear_problems.hpp"
#include "filter/text_problems.hpp"
#include "wienertree/filter/grid_filter.hpp"

using namespace wienertree;

namespace {

double rational(double z) {
  const RationalExponential& r = RationalExponential::get();
  std::complex<double> sum = 0;
  for (std::size_t i = 0; i < RationalExponential::poles; ++i) sum += r.residue[i] / (z - r.pole[i]);
  return sum.real();
}

// f^T L at the nodes.
std::vector<double> transposed(BandedMatrix& L, const std::vector<double>& f) {
  std::vector<double> out(L.size, 0.0);
  for (std::size_t i = 0; i < L.size; ++i)
    for (std::size_t j = i > L.half_width ? i - L.half_width : 0; j <= i + L.half_width && j < L.size; ++j)
      out[j] += f[i] * L(i, j);
  return out;
}

Model scalar(const std::string& drift, const std::string& diffusion, const std::string& observation,
             const std::string& state = "{ initial = 0.0 }") {
  return parse_model("name = \"m\"\nconvention = \"ito\"\n[state]\nx = " + state + "\n[drift]\nx = \"" +
                         drift + "\"\n[diffusion]\nx = [\"" + diffusion + "\"]\n" + observation,
                     "m.toml", {});
}
const std::string discrete =
    "[observation]\nkind = \"discrete\"\nh = [\"x\"]\nnoise = { law = \"gaussian\", sd = 0.1 }\n";

void run_grid(const Model& model, const ObservationPath& path, std::size_t points = 400) {
  FilterOptions o;
  o.method = FilterMethod::grid;
  o.grid_points = points;
  const auto filter = make_filter(model, o);
  run(*filter, ObservationWindows(path, model.observation, model.timing, 0), {});
}

}  // namespace

TEST_CASE("rational exponential: order 13, bounded and small for stiff modes") {
  // The leading error is 6! 7!/(13! 14!) |z|^14 = 6.7e-15 |z|^14, reduced by what follows; residues of size
  // 1e4 lose four digits.
  for (const double z : {0.0, -0.1, -0.5, -1.0, -2.0, -3.0, -4.0}) {
    const double leading = 6.7e-15 * std::pow(z, 14);
    CHECK(std::abs(rational(z) - std::exp(z)) < leading + 1e-11);
    if (z <= -3) CHECK(std::abs(rational(z) - std::exp(z)) > 0.01 * leading);
  }
  for (const double z : {-10.0, -1e2, -1e4, -1e8}) {
    CHECK(std::abs(rational(z)) < 1e-3 + 7.0 / std::abs(z));
    CHECK(std::abs(rational(z)) < 0.1);
  }
}

TEST_CASE("banded exponential: equals the function of the matrix, mode by mode") {
  // A tridiagonal Laplacian has the eigenvectors sin(pi k i/(n+1)) and eigenvalues 2 cos(pi k/(n+1)) - 2.
  constexpr std::size_t n = 60;
  BandedMatrix L;
  L.size = n;
  L.half_width = 4;
  L.band.assign(n * 9, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    L(i, i) = -2;
    if (i > 0) L(i, i - 1) = 1;
    if (i + 1 < n) L(i, i + 1) = 1;
  }
  for (const double tau : {0.1, 1.0, 50.0})
    for (const double k : {1.0, 7.0, 40.0}) {
      BandedExponential e;
      e.assign(L, tau);
      std::vector<double> u(n), v(n);
      for (std::size_t i = 0; i < n; ++i)
        u[i] = v[i] = std::sin(std::numbers::pi * k * (double(i) + 1) / (n + 1));
      e.apply(u);
      const double z = tau * (2 * std::cos(std::numbers::pi * k / (n + 1)) - 2);
      for (std::size_t i = 0; i < n; ++i) CHECK(u[i] == Approx(rational(z) * v[i]).epsilon(0).margin(1e-11));
    }
}

TEST_CASE("Fokker-Planck matrix: conserves mass, and its transpose is the generator to order 8") {
  const auto errors = [](std::size_t n) {
    const LineGrid grid{-1, 2.0 / static_cast<double>(n), n};
    std::vector<double> b(n), v(n), f(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double x = grid.node(i);
      b[i] = std::sin(2 * x);
      v[i] = 1 + x * x;
      f[i] = std::sin(6 * x);
    }
    BandedMatrix L;
    fokker_planck(grid, b, v, L);
    const auto zero = transposed(L, std::vector<double>(n, 1.0)), Lf = transposed(L, f);
    double mass = 0, generator = 0, scale = 0;
    for (std::size_t i = 0; i < n; ++i) {
      mass = std::max(mass, std::abs(zero[i]));
      scale = std::max(scale, std::abs(L(i, i)));
      if (i < 8 || i + 8 >= n) continue;
      generator =
          std::max(generator, std::abs(Lf[i] - (6 * b[i] * std::cos(6 * grid.node(i)) - 18 * v[i] * f[i])));
    }
    CHECK(mass < 1e-14 * scale);
    return generator;
  };
  const double coarse = errors(40), fine = errors(80);
  CHECK(std::log2(coarse / fine) == Approx(8).margin(0.7));
}

TEST_CASE("interpolation and its adjoint are exact for polynomials of degree 7") {
  const LineGrid grid{-1, 0.1, 20}, other{-0.93, 0.037, 50};
  std::vector<double> p(20), out(50);
  const auto polynomial = [](double x) { return 1 + x * (2 + x * x * (1 - x * x * x * x)); };
  for (std::size_t i = 0; i < 20; ++i) p[i] = polynomial(grid.node(i));
  interpolate(grid, p, other, out);
  for (std::size_t i = 0; i < 50; ++i)
    CHECK(out[i] == Approx(polynomial(other.node(i))).epsilon(0).margin(1e-11));
  std::vector<double> point(20, 0.0);
  deposit(grid, 0.123, point);
  double integral = 0;
  for (std::size_t i = 0; i < 20; ++i) integral += point[i] * grid.width * p[i];
  CHECK(integral == Approx(polynomial(0.123)).epsilon(1e-12));
}

TEST_CASE("a density on the line: the Gaussian sum keeps moments, and weights are a probability") {
  LineDensity d(300, -INFINITY, INFINITY);
  d.set_gaussian(2, 0.25);
  CHECK(d.mass() == Approx(1).epsilon(1e-12));
  std::vector<double> x(300), w(300), scratch;
  d.gaussian_sum(x, w, scratch);
  Batch points(1, 300), covariance(1, 1);
  std::copy(x.begin(), x.end(), points.component(0).begin());
  covariance(0, 0) = d.grid().width * d.grid().width;
  Posterior p;
  p.points = points;
  p.weight = w;
  p.covariance = covariance;
  CHECK(*std::min_element(w.begin(), w.end()) >= 0);
  CHECK(raw_moment(p, 0, 0) == Approx(1).epsilon(1e-12));
  CHECK(raw_moment(p, 0, 2) == Approx(4.25).epsilon(1e-12));
  CHECK(raw_moment(p, 0, 4) == Approx(16 + 6 * 4 * 0.25 + 3 * 0.0625).epsilon(1e-9));
}

TEST_CASE("a density on the line follows its mass and stops at a bound") {
  LineDensity d(400, 0, INFINITY);
  d.set_gaussian(2, 0.01);
  CHECK(d.grid().lower > 0);
  CHECK_FALSE(d.follow_mass());
  // Four fifths of the support gone: what is left is laid on the whole grid, and its mass kept.
  for (std::size_t i = 200; i < 400; ++i) d.values()[i] = 0;
  for (std::size_t i = 0; i < 160; ++i) d.values()[i] = 0;
  const double mass = d.mass(), low = d.low(), high = d.high();
  CHECK(d.is_narrow());
  CHECK(d.follow_mass());
  CHECK(d.mass() == Approx(mass).epsilon(1e-12));
  CHECK(d.grid().lower < low);
  CHECK(d.grid().upper() > high);
  d.set_gaussian(0.5, 1);
  CHECK(d.grid().lower == 0);
  CHECK(d.touches_a_bound());
}

TEST_CASE("grid filter: what it cannot do is refused, saying why") {
  const auto refuses = [](const Model& m, const FilterOptions& o, const char* why) {
    CHECK_THROWS_WITH(GridFilter(m, o), Catch::Contains(why));
    CHECK_THROWS_AS(GridFilter(m, o), InputError);
  };
  FilterOptions o;
  refuses(LinearProblem(2, 1, 1, 3).model("", false), o, "one state");
  refuses(scalar("-x*t", "1", ""), o, "one state");
  refuses(scalar("-x", "1", "", "{ initial = 1.0, lower = 0.0, boundary = \"absorb\" }"), o, "absorb");
  Model at_bound = scalar("-x", "1", "", "{ initial = 1.0, lower = 0.0 }");
  at_bound.initial_law = InitialLaw{Eigen::VectorXd::Constant(1, 1.0), Eigen::MatrixXd::Constant(1, 1, 1.0)};
  refuses(at_bound, o, "bound");
  o.grid_points = 10;
  refuses(scalar("-x", "1", ""), o, "nodes");
  o = {};
  o.grid_step = 0;
  refuses(scalar("-x", "1", ""), o, "grid step");
}

TEST_CASE("grid filter: what goes wrong names the step and the observation") {
  const auto fails = [](const Model& m, const ObservationPath& path, const char* why) {
    CHECK_THROWS_WITH(run_grid(m, path), Catch::Contains(why) && Catch::Contains("t = "));
    CHECK_THROWS_AS(run_grid(m, path), RunError);
  };
  fails(scalar("-x", "1", discrete), {1, {0.0, 1.0}, {0.0, 60.0}}, "rounding errors");
  fails(scalar("-x", "1", discrete), {1, {0.0, 1.0}, {INFINITY, 1.0}}, "no likelihood");
  fails(scalar("-x", "x", discrete), {1, {0.0, 1.0}, {0.0, 1.0}}, "diffuses");
  fails(scalar("0.1*(0.3 - x)", "sqrt(x)", discrete, "{ initial = 0.3 }"), {1, {0.0, 1.0}, {0.3, 0.3}},
        "not finite");
  fails(scalar("-x", "0.00001", discrete, "{ initial = 3.0 }"), {1, {0.0, 1.0}, {3.0, 1.0}}, "too coarse");
}
