/// Families conditioned on discrete observations, against Kalman's filter, quadrature and the grid filter.
#include "wienertree/filter/family_filter.hpp"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cstring>

#include "filter/line_oracle.hpp"
#include "filter/text_problems.hpp"
#include "wienertree/cubature/catalogue.hpp"

using namespace wienertree;

namespace {

constexpr double missing = std::numeric_limits<double>::quiet_NaN();

FilterOptions families(int degree = 7, std::size_t nodes = 60) {
  FilterOptions o;
  o.formula = find_formula(degree, 1, std::string(WIENERTREE_SOURCE_DIR) + "/data/cubature_formulas");
  o.thinning.method = ThinningMethod::recombination;
  o.conditioning = Conditioning::families;
  o.nodes = nodes;
  return o;
}

Model line_model(const std::string& drift, const std::string& diffusion, const std::string& observation,
                 const std::string& rest = "", const std::string& state = "{ initial = 0.3 }") {
  return parse_model("name = \"line\"\nconvention = \"ito\"\n[state]\nx = " + state + "\n[drift]\nx = \"" +
                         drift + "\"\n[diffusion]\nx = [\"" + diffusion +
                         "\"]\n[observation]\nkind = \"discrete\"\n" + observation + "\n" + rest,
                     "line.toml");
}

std::string gaussian_noise(double sd) { return fmt::format("noise = {{ law = \"gaussian\", sd = {} }}", sd); }

ObservationPath record(std::vector<double> times, std::vector<double> values) {
  ObservationPath path;
  path.dimension = 1;
  path.times = std::move(times);
  path.values = std::move(values);
  return path;
}

std::unique_ptr<Filter> filtered(const Model& model, const ObservationPath& path, const FilterOptions& o,
                                 const std::function<void(const Posterior&)>& observe = {}) {
  auto filter = make_filter(model, o);
  run(*filter, ObservationWindows(path, model.observation, model.timing, 0), observe);
  return filter;
}

double sd_of(const Posterior& p) { return std::sqrt(covariance(p, 0, 0)); }

// Every row: mean, standard deviation, evidence.
void check_against(const Model& model, const ObservationPath& path, FilterMethod method, double tolerance) {
  struct Row {
    double mean, sd, log_evidence;
  };
  std::vector<Row> exact;
  FilterOptions reference;
  reference.method = method;
  reference.grid_points = 4000;
  filtered(model, path, reference, [&](const Posterior& p) {
    exact.push_back({mean(p, 0), sd_of(p), p.log_evidence});
  });
  std::size_t r = 0;
  const auto filter = filtered(model, path, families(), [&](const Posterior& p) {
    const Row& row = exact[r++];
    INFO("row " << r << " at " << p.time << ", model " << model.name);
    if (row.sd > 0) CHECK(std::abs(mean(p, 0) - row.mean) < tolerance * row.sd);
    CHECK(std::abs(sd_of(p) - row.sd) <= tolerance * row.sd);
    CHECK(std::abs(p.log_evidence - row.log_evidence) < tolerance);
  });
  CHECK(filter->warnings().empty());
}

}  // namespace

TEST_CASE("a linear model is Kalman's, whatever the noise, the prior, the gaps, the outliers") {
  const double sd = GENERATE(1e-4, 1e-2, 1.0);
  const double prior = GENERATE(0.0, 0.25, 1e6);
  const std::string timing = GENERATE("current", "previous");
  const Model model = line_model(
      "0.2 - 0.5*x", "0.8", "h = [\"0.7*x - 0.1\"]\n" + gaussian_noise(sd) + "\ntiming = \"" + timing + "\"",
      prior > 0 ? fmt::format("[initial]\nmean = [0.3]\ncovariance = [[{}]]", prior) : "");
  // Missing rows, a gap of 500 relaxation times, a value 30 standard deviations off. 1e-7: the covariances
  // are squares of standard deviations that are known to 1e-16 of the largest of 1e3 before it is conditioned
  // to 1e-4.
  ObservationPath path =
      record({0, 0.2, 0.4, 1.0, 1000, 1000.1, 1000.5, 1002}, {0.1, 0.4, missing, -0.5, 1.1, 0.9, 30, 0.2});
  if (timing == "previous") path.values[0] = missing;
  check_against(model, path, FilterMethod::kalman, 1e-7);
}

TEST_CASE("a forcing that depends on time leaves a linear signal exact") {
  const Model clocked =
      line_model("-0.4*x + 0.8*sin(2*pi*t/7)", "0.5*(1 + 0.3*cos(t))", "h = [\"x\"]\n" + gaussian_noise(0.4));
  // The same as a closed form: m' = -0.4 m + 0.8 sin(w t), P' = -0.8 P + 0.25 (1 + 0.3 cos t)^2, between
  // observations.
  const ObservationPath path = record({0, 1.3, 2, 5}, {missing, 0.9, missing, -0.4});
  const auto antiderivative = [](double a, double w, double t) {  // of exp(a t) sin(w t)
    return std::exp(a * t) * (a * std::sin(w * t) - w * std::cos(w * t)) / (a * a + w * w);
  };
  const auto cosine = [](double a, double w, double t) {
    return std::exp(a * t) * (a * std::cos(w * t) + w * std::sin(w * t)) / (a * a + w * w);
  };
  double m = 0.3, P = 0, log_evidence = 0;
  for (std::size_t r = 1; r < path.rows(); ++r) {
    const double s = path.times[r - 1], t = path.times[r], w = 2 * std::numbers::pi / 7;
    m = std::exp(-0.4 * (t - s)) * m +
        std::exp(-0.4 * t) * 0.8 * (antiderivative(0.4, w, t) - antiderivative(0.4, w, s));
    // (1 + 0.3 cos u)^2 = 1.045 + 0.6 cos u + 0.045 cos 2u
    const auto whole = [&](double u) {
      return 1.045 * std::exp(0.8 * u) / 0.8 + 0.6 * cosine(0.8, 1, u) + 0.045 * cosine(0.8, 2, u);
    };
    P = std::exp(-0.8 * (t - s)) * P + 0.25 * std::exp(-0.8 * t) * (whole(t) - whole(s));
    if (std::isnan(path.values[r])) continue;
    const double S = P + 0.16, e = path.values[r] - m;
    log_evidence -= (std::log(2 * std::numbers::pi * S) + e * e / S) / 2;
    m += P / S * e;
    P *= 0.16 / S;
  }
  const auto filter = filtered(clocked, path, families());
  CHECK(mean(filter->posterior(), 0) == Approx(m).epsilon(1e-8));
  CHECK(sd_of(filter->posterior()) == Approx(std::sqrt(P)).epsilon(1e-8));
  CHECK(filter->posterior().log_evidence == Approx(log_evidence).epsilon(1e-8));
}

// X = exp(Y), dY = -k Y dt + s dB: drift (s^2/2 - k log x) x and diffusion s x (Ito).
TEST_CASE("a state-dependent diffusion under noise of any width") {
  constexpr double k = 0.5, s = 0.8, gap = 0.25, start = 0.3;
  const double sd = GENERATE(1e-4, 1e-3, 1e-2, 0.1, 1.0);
  const Model model = line_model("(0.32 - 0.5*log(x))*x", "0.8*x", "h = [\"x\"]\n" + gaussian_noise(sd));
  const double y[] = {0.5, 0.9, 1.7, 2.4, 1.1, 0.6, 0.3, 0.4, 1.0, 0.8};
  ObservationPath path = record({0}, {missing});
  LineOracle oracle(std::log(start), 0);
  for (std::size_t r = 0; r < std::size(y); ++r) {
    path.times.push_back(gap * static_cast<double>(r + 1));
    path.values.push_back(y[r]);
    const double F = std::exp(-k * gap);
    oracle.move({F, 0, s * s * (1 - F * F) / (2 * k)});
    const auto [low, high] = oracle.range();
    oracle.observe(
        [&](double z) {
          const double e = (y[r] - std::exp(z)) / sd;
          return -e * e / 2 - std::log(sd) - std::log(2 * std::numbers::pi) / 2;
        },
        {{std::max(low, y[r] > 9 * sd ? std::log(y[r] - 9 * sd) : low),
          std::min(high, std::log(y[r] + 9 * sd))}});
  }
  const auto filter = filtered(model, path, families());
  const Posterior& p = filter->posterior();
  const auto x = [](double z) { return std::exp(z); };
  const double m = oracle.expectation(x);
  const double deviation = std::sqrt(oracle.expectation([&](double z) { return (x(z) - m) * (x(z) - m); }));
  INFO("noise " << sd << ", children " << filter->statistics().children);
  CHECK(std::abs(p.log_evidence - oracle.log_evidence()) < 0.01);
  CHECK(std::abs(mean(p, 0) - m) < 0.01 * deviation);
  CHECK(std::abs(sd_of(p) - deviation) < 0.01 * deviation);
  // The cost does not depend on the noise: in each of 10 gaps 7 steps are tried and 17 taken, of 6 children
  // from some 120 nodes that overlap.
  CHECK(filter->statistics().children < 10 * 24 * 120 * 6);
}

TEST_CASE("two modes of a square under noise of any width") {
  const double sd = GENERATE(1e-4, 1e-2, 0.1, 1.0);
  const Model model = line_model("-0.5*x", "0.8", "h = [\"x^2\"]\n" + gaussian_noise(sd),
                                 "[initial]\nmean = [0.1]\ncovariance = [[0.3]]", "{}");
  const double y[] = {0.04, 0.5, 0.9, 1.4, 0.3, 0.02, 0.6};
  ObservationPath path = record({}, {});
  LineOracle oracle(0.1, 0.3);
  for (std::size_t r = 0; r < std::size(y); ++r) {
    path.times.push_back(0.3 * static_cast<double>(r));
    path.values.push_back(y[r]);
    const double F = std::exp(-0.15);
    if (r > 0) oracle.move({F, 0, 0.64 * (1 - F * F)});
    const double outer = std::sqrt(y[r] + 9 * sd), inner = std::sqrt(std::max(0.0, y[r] - 9 * sd));
    LineOracle::Intervals where = {{-outer, -inner}, {inner, outer}};
    if (inner == 0) where = {{-outer, outer}};
    oracle.observe(
        [&](double z) {
          const double e = (y[r] - z * z) / sd;
          return -e * e / 2 - std::log(sd) - std::log(2 * std::numbers::pi) / 2;
        },
        where);
  }
  const auto filter = filtered(model, path, families());
  const Posterior& p = filter->posterior();
  const auto identity = [](double z) { return z; };
  const double m = oracle.expectation(identity);
  const double deviation = std::sqrt(oracle.expectation([&](double z) { return (z - m) * (z - m); }));
  INFO("noise " << sd);
  CHECK(std::abs(p.log_evidence - oracle.log_evidence()) < 1e-3);
  CHECK(std::abs(mean(p, 0) - m) < 1e-3 * deviation);
  CHECK(std::abs(sd_of(p) - deviation) < 1e-3 * deviation);
}

TEST_CASE("laws with kinks, heavy tails and counts") {
  struct Law {
    std::string text;
    std::function<double(double, double)> log_density;  // of y and x
    double tolerance;
  };
  const double pi = std::numbers::pi;
  const Law laws[] = {
      // The oracle's trapezoidal rule sees the kink: an error of its spacing squared, 1e-4.
      {"h = [\"x\"]\nnoise = { law = \"laplace\", scale = 0.2 }",
       [](double y, double x) { return -std::abs(y - x) / 0.2 - std::log(0.4); }, 2e-3},
      {"h = [\"x\"]\nnoise = { law = \"student-t\", dof = 2, scale = 0.1 }",
       [](double y, double x) {
         return -1.5 * std::log1p((y - x) * (y - x) / 0.02) - std::log(0.1 * 2 * std::sqrt(2.0));
       },
       1e-3},
      {"h = [\"x\"]\nnoise = { law = \"log-chi-square\" }",
       [=](double y, double x) { return (y - x - std::exp(y - x)) / 2 - std::log(2 * pi) / 2; }, 1e-3},
      {"log_likelihood = \"y1*x - exp(x)\"", [](double y, double x) { return y * x - std::exp(x); }, 1e-3}};
  for (const Law& law : laws) {
    INFO(law.text);
    const Model model =
        line_model("-0.5*x", "0.8", law.text, "[initial]\nmean = [0.1]\ncovariance = [[0.5]]", "{}");
    const double y[] = {1, 2, 0, 4, -3, 0, 1};
    ObservationPath path = record({}, {});
    LineOracle oracle(0.1, 0.5);
    for (std::size_t r = 0; r < std::size(y); ++r) {
      path.times.push_back(0.4 * static_cast<double>(r));
      path.values.push_back(y[r]);
      const double F = std::exp(-0.2);
      if (r > 0) oracle.move({F, 0, 0.64 * (1 - F * F)});
      oracle.observe([&](double z) { return law.log_density(y[r], z); }, {oracle.range()});
    }
    const auto filter = filtered(model, path, families());
    const Posterior& p = filter->posterior();
    const double m = oracle.expectation([](double z) { return z; });
    const double deviation = std::sqrt(oracle.expectation([&](double z) { return (z - m) * (z - m); }));
    CHECK(std::abs(p.log_evidence - oracle.log_evidence()) < law.tolerance);
    CHECK(std::abs(mean(p, 0) - m) < law.tolerance * deviation);
    CHECK(std::abs(sd_of(p) - deviation) < law.tolerance * deviation);
  }
}

TEST_CASE("a double well is the grid filter's") {
  const double sd = GENERATE(0.02, 0.3);
  const std::string timing = GENERATE("current", "previous");
  const Model model =
      line_model("x - x^3", "0.6", "h = [\"x\"]\n" + gaussian_noise(sd) + "\ntiming = \"" + timing + "\"",
                 "[initial]\nmean = [0]\ncovariance = [[0.25]]", "{}");
  ObservationPath path = record({0, 0.25, 0.5, 1.5, 1.75, 2.5}, {0.3, 0.6, missing, 0.9, 0.5, -0.6});
  if (timing == "previous") path.values[0] = missing;
  check_against(model, path, FilterMethod::grid, 0.01);
}

TEST_CASE("the same bytes for any number of threads, and from a checkpoint", "[threads]") {
  const Model model = line_model("x - x^3", "0.6*sqrt(1 + x^2)", "h = [\"x\"]\n" + gaussian_noise(0.1));
  const ObservationPath path = record({0, 0.25, 0.5, 1.5, 1.75, 2.5}, {0.3, 0.6, missing, 0.9, 0.5, -0.6});
  for (const ThinningMethod thin : {ThinningMethod::recombination, ThinningMethod::tbba}) {
    FilterOptions o = families();
    o.thinning.method = thin;
    const ObservationWindows windows(path, model.observation, model.timing, 0);
    const auto whole = make_filter(model, o);
    o.threads = 3;
    std::unique_ptr<Filter> resumed = make_filter(model, o);
    ObservationWindow window;
    for (std::size_t j = 0; j < windows.size(); ++j) {
      windows.get(j, window);
      whole->advance(window);
      resumed->advance(window);
      PosteriorSummary a, b;
      summarise(whole->posterior(), 1, 3, a);
      summarise(resumed->posterior(), 1, 3, b);
      const double x[] = {a.log_evidence, a.mean[0], a.sd[0], a.q05[0], a.q50[0], a.q95[0], a.moments[0][1]};
      const double y[] = {b.log_evidence, b.mean[0], b.sd[0], b.q05[0], b.q50[0], b.q95[0], b.moments[0][1]};
      CHECK(std::memcmp(x, y, sizeof x) == 0);
      StateArchive state;
      resumed->exchange(state);
      const std::string bytes = state.bytes();
      resumed = make_filter(model, o);
      StateArchive back(bytes);
      resumed->exchange(back);
      back.finish();
    }
    CHECK(resumed->statistics().children == whole->statistics().children);
  }
}

TEST_CASE("what does not fit is refused, and what is doubtful is said") {
  FilterOptions o = families();
  CHECK_THROWS_AS(make_filter(benes_model(0.5, 0.8, 0.4, 0, 1), o), InputError);
  const Model model = line_model("-x", "1", "h = [\"x\"]\n" + gaussian_noise(0.1));
  o.thinning.method = ThinningMethod::none;
  CHECK_THROWS_AS(make_filter(model, o), InputError);
  o = families();
  o.prune_weights = PruneWeights::cubature;
  CHECK_THROWS_AS(make_filter(model, o), InputError);
  o = families();
  o.substep_tolerance = 0;
  CHECK_THROWS_AS(make_filter(model, o), InputError);
  // kappa theta = 0.01 < xi^2/4 = 0.0225
  const Model root = line_model("0.5*(0.02 - x)", "0.3*sqrt(x)", "log_likelihood = \"-0.5*(y1 - x)^2\"", "",
                                "{ initial = 0.3, lower = 0, boundary = \"clamp\" }");
  const auto filter = make_filter(root, families());
  REQUIRE(filter->warnings().size() == 1);
  CHECK(filter->warnings()[0].kind == WarningKind::drift_leaves_bound);
}
