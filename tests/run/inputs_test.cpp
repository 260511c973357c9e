// Known functions of time in drift and sensor: filters against Kalman's, written out here.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include "wienertree/filter/simulate.hpp"
#include "wienertree/model/text_model.hpp"
#include "wienertree/run/controlled_filter.hpp"
#include "wienertree/run/window_source.hpp"

using namespace wienertree;

namespace {

const std::filesystem::path formulas =
    std::filesystem::path(WIENERTREE_SOURCE_DIR) / "data/cubature_formulas";
constexpr double noise_sd = 0.4, s = 0.7, start = 0.2;

TextModel driven(const std::string& between, const std::string& observation, const std::string& more = "") {
  return TextModel::parse("name = \"driven\"\nconvention = \"ito\"\n[inputs]\nu = { between = \"" + between +
                              "\" }\n[state]\nx = { initial = 0.2 }\n[drift]\nx = \"u - x\"\n[diffusion]\n"
                              "x = [\"0.7\"]\n[observation]\n" +
                              observation + "\n" + more,
                          "driven.toml");
}

const std::string discrete =
    "kind = \"discrete\"\nh = [\"x + u/2\"]\nnoise = { law = \"gaussian\", sd = 0.4 }";
const std::string continuous = "kind = \"continuous\"\nh = [\"x + u/2\"]";

// Some jumps are at rows of the observations (1.5, 4), some between them.
const InputFunction given{"u", Between::linear, {0, 0.3, 1.5, 2.2, 2.4, 4, 6}, {1, -1, 2.5, 0.5, -2, 3, 1}};

ObservationPath rows(std::size_t count, double gap) {
  ObservationPath path;
  path.dimension = 1;
  for (std::size_t r = 0; r < count; ++r) {
    const double t = gap * static_cast<double>(r);
    path.append(t, std::vector{0.8 * std::sin(1.7 * t) + 0.3 * std::cos(5 * t)});
  }
  return path;
}

// u on a piece: u(a) and its slope.
struct Piece {
  double end, value, slope;
};

// The pieces of [from, to].
std::vector<Piece> pieces(Between between, double from, double to) {
  std::vector<Piece> all;
  for (std::size_t i = 0; i + 1 < given.times.size(); ++i) {
    const double a = std::max(from, given.times[i]), b = std::min(to, given.times[i + 1]);
    if (!(b > a + 1e-12)) continue;
    const double slope = between == Between::previous ? 0
                                                      : (given.values[i + 1] - given.values[i]) /
                                                            (given.times[i + 1] - given.times[i]);
    all.push_back({b, given.values[i] + slope * (a - given.times[i]), slope});
  }
  return all;
}

// u at t, after a jump there.
double value_at(Between between, double t) {
  const std::vector<Piece> here = pieces(between, t, t + 1e-9);
  return here.empty() ? given.values.back() : here.front().value;
}

double log_normal(double x, double mean, double variance) {
  return -0.5 * std::log(2 * std::numbers::pi * variance) - (x - mean) * (x - mean) / (2 * variance);
}

// x_b = e x_a + (1 - e) u(a) + u' (D - (1 - e)) + noise of variance s^2 (1 - e^2)/2, e = exp(-D), D = b - a.
double kalman_log_evidence(
    Between between, const ObservationPath& y,
    const std::function<double(double)>& variance = [](double) { return noise_sd * noise_sd; }) {
  double m = start, P = 0, sum = 0, t = 0;
  for (std::size_t r = 0; r < y.rows(); ++r) {
    for (const Piece& piece : pieces(between, t, y.times[r])) {
      const double D = piece.end - t, e = std::exp(-D);
      m = e * m + (1 - e) * piece.value + piece.slope * (D - (1 - e));
      P = e * e * P + s * s * (1 - e * e) / 2;
      t = piece.end;
    }
    const double S = P + variance(value_at(between, t)), predicted = m + value_at(between, t) / 2;
    sum += log_normal(y.row(r)[0], predicted, S);
    m += P / S * (y.row(r)[0] - predicted);
    P -= P * P / S;
  }
  return sum;
}

// Of increments over gaps: with I = int x, h = int u/2,  dY = I + h + N(0, D); against N(0, D) alone.
double kalman_bucy_log_evidence(Between between, const ObservationPath& y) {
  double m = start, P = 0, sum = 0, t = 0;
  for (std::size_t r = 1; r < y.rows(); ++r) {
    const std::vector<Piece> all = pieces(between, t, y.times[r]);
    if (all.size() != 1) FAIL("every knot is a row");
    const Piece piece = all.front();
    const double D = piece.end - t, e = std::exp(-D), g = 1 - e;
    const double U = piece.value * D + piece.slope * D * D / 2;
    const double to_x = g * piece.value + piece.slope * (D - g), to_I = U - to_x;
    const double Qxx = s * s * (1 - e * e) / 2, QII = s * s * (D - 2 * g + (1 - e * e) / 2),
                 QxI = s * s * (g - (1 - e * e) / 2);
    const double increment = y.row(r)[0] - y.row(r - 1)[0];
    const double S = g * g * P + QII + D, C = e * g * P + QxI, predicted = g * m + to_I + U / 2;
    sum += log_normal(increment, predicted, S) - log_normal(increment, 0, D);
    m = e * m + to_x + C / S * (increment - predicted);
    P = e * e * P + Qxx - C * C / S;
    t = piece.end;
  }
  return sum;
}

double evidence(const Model& model, const GivenOptions& options, const ObservationPath& y, double tolerance) {
  ControlOptions control;
  control.formulas = formulas;
  control.tolerance = tolerance;
  ControlledFilter filter(model, recommended_options(model, options, formulas), control, y);
  while (filter.advance()) {
  }
  return filter.answer().rows.back().mean.log_evidence;
}

GivenOptions by(FilterMethod method) {
  GivenOptions options;
  options.method = method;
  return options;
}

const char* name(Between between) { return between == Between::linear ? "linear" : "previous"; }

}  // namespace

TEST_CASE("discrete observations of a driven Ornstein-Uhlenbeck process: Kalman's evidence") {
  const ObservationPath y = rows(13, 0.5);
  for (const Between between : {Between::linear, Between::previous}) {
    INFO(name(between));
    const Model model = driven(name(between), discrete).with_inputs({given}, "u.csv").model();
    const double exact = kalman_log_evidence(between, y);
    CHECK(evidence(model, {}, y, 1e-3) == Approx(exact).margin(1e-3));
    GivenOptions children = by(FilterMethod::klv);
    children.conditioning = Conditioning::children;
    CHECK(evidence(model, children, y, 5e-3) == Approx(exact).margin(5e-3));
  }
}

TEST_CASE("the standard deviation of the noise may be a function of an input, or of the state") {
  const ObservationPath y = rows(13, 0.5);
  for (const Between between : {Between::linear, Between::previous}) {
    INFO(name(between));
    const std::string law = "noise = { law = \"gaussian\", sd = \"0.3 + 0.1*u^2\" }";
    const Model model = driven(name(between), "kind = \"discrete\"\nh = [\"x + u/2\"]\n" + law)
                            .with_inputs({given}, "u.csv")
                            .model();
    const double exact =
        kalman_log_evidence(between, y, [](double u) { return std::pow(0.3 + 0.1 * u * u, 2); });
    CHECK(evidence(model, {}, y, 1e-3) == Approx(exact).margin(1e-3));
    // Of the state: the same as the density written out.
    const Model by_law =
        driven(name(between),
               "kind = \"discrete\"\nh = [\"x\"]\nnoise = { law = \"laplace\", scale = \"exp(x/4)\" }")
            .with_inputs({given}, "u.csv")
            .model();
    const Model by_density =
        driven(name(between),
               "kind = \"discrete\"\nlog_likelihood = \"-abs(y1 - x)/exp(x/4) - log(2) - x/4\"")
            .with_inputs({given}, "u.csv")
            .model();
    for (const FilterMethod method :
         {FilterMethod::klv, FilterMethod::euler, FilterMethod::gaussian_mixture}) {
      GivenOptions options = by(method);
      options.nodes = 60;
      CHECK(evidence(by_law, options, y, 0.02) ==
            Approx(evidence(by_density, options, y, 0.02)).epsilon(1e-9));
    }
    CHECK(by_law.density->gaussian_variances().empty());
    CHECK_THROWS_AS(by_law.density->log_noise_density(std::vector{1.0}), InputError);
    CHECK(std::isfinite(simulate(by_law, 6, 60, 12, 1).observations.values.back()));
  }
}

TEST_CASE("the same beside a second state, by Gaussian components") {
  const ObservationPath y = rows(13, 0.5);
  for (const Between between : {Between::linear, Between::previous}) {
    INFO(name(between));
    const TextModel two = TextModel::parse(
        "name = \"two\"\nconvention = \"ito\"\n[inputs]\nu = { between = \"" + std::string(name(between)) +
            "\" }\n[state]\nx = { initial = 0.2 }\nz = { initial = 0 }\n[drift]\nx = \"u - x\"\nz = \"-z\"\n"
            "[diffusion]\nx = [\"0.7\", \"0\"]\nz = [\"0\", \"0.3\"]\n[observation]\n" +
            discrete + "\n",
        "two.toml");
    const Model model = two.with_inputs({given}, "u.csv").model();
    CHECK(evidence(model, {}, y, 1e-3) == Approx(kalman_log_evidence(between, y)).margin(1e-3));
  }
}

TEST_CASE("a continuous record of a driven Ornstein-Uhlenbeck process: Kalman and Bucy's evidence") {
  const ObservationPath y = rows(301, 0.02);
  for (const Between between : {Between::linear, Between::previous}) {
    INFO(name(between));
    const Model model = driven(name(between), continuous).with_inputs({given}, "u.csv").model();
    const double exact = kalman_bucy_log_evidence(between, y);
    CHECK(evidence(model, {}, y, 0.01) == Approx(exact).margin(1e-3));
  }
}

TEST_CASE("every filter sees an input on the right side of its jumps") {
  // h = u knows nothing of x: the evidence is a sum of known terms for any filter.
  const ObservationPath y = rows(13, 0.5), path = rows(301, 0.02);
  for (const Between between : {Between::linear, Between::previous}) {
    double at_rows = 0, by_density = 0, along = 0;
    for (std::size_t r = 0; r < y.rows(); ++r) {
      at_rows += log_normal(y.row(r)[0], value_at(between, y.times[r]), noise_sd * noise_sd);
      by_density += log_normal(y.row(r)[0], 0, 1 + std::pow(value_at(between, y.times[r]), 2));
    }
    for (std::size_t r = 1; r < path.rows(); ++r) {
      const Piece piece = pieces(between, path.times[r - 1], path.times[r]).front();
      const double D = path.times[r] - path.times[r - 1], increment = path.row(r)[0] - path.row(r - 1)[0];
      const double mean = piece.value * D + piece.slope * D * D / 2;
      along += log_normal(increment, mean, D) - log_normal(increment, 0, D);
    }
    std::string observation = discrete;
    observation.replace(observation.find("x + u/2"), 7, "u");
    const Model seen = driven(name(between), observation).with_inputs({given}, "u.csv").model();
    const Model density =
        driven(
            name(between),
            "kind = \"discrete\"\nlog_likelihood = \"-0.5*log(2*pi*(1 + u^2)) - y1^2/(2*(1 + u^2)) + 0*x\"")
            .with_inputs({given}, "u.csv")
            .model();
    const Model continuously =
        driven(name(between), "kind = \"continuous\"\nh = [\"u\"]").with_inputs({given}, "u.csv").model();
    for (const FilterMethod method :
         {FilterMethod::klv, FilterMethod::euler, FilterMethod::gaussian_mixture, FilterMethod::weighted}) {
      INFO(name(between) << ", method " << static_cast<int>(method));
      GivenOptions options = by(method);
      options.nodes = 60;
      CHECK(evidence(seen, options, y, 0.02) == Approx(at_rows).margin(1e-9));
      if (method != FilterMethod::weighted)  // which needs the law of the noise alone
        CHECK(evidence(density, options, y, 0.02) == Approx(by_density).margin(1e-9));
      // Along a path the functional has the integral of h^2 where the increments have the square of its mean over each
      // gap D: half the sum of u'^2 D^3/12, which is 3.25 D^2 for these slopes.
      if (method == FilterMethod::klv)
        CHECK(evidence(continuously, options, path, 0.02) ==
              Approx(along).margin(between == Between::linear ? 1.4e-3 : 1e-9));
    }
    GivenOptions families = by(FilterMethod::klv);
    families.conditioning = Conditioning::families;
    CHECK(evidence(seen, families, y, 0.02) == Approx(at_rows).margin(1e-9));
  }
}

TEST_CASE("simulated signals follow the input") {
  // Without noise x is the solution of x' = u - x, by Euler's method to O(dt).
  for (const Between between : {Between::linear, Between::previous}) {
    const TextModel text = TextModel::parse(
        "name = \"still\"\nconvention = \"ito\"\n[inputs]\nu = { between = \"" + std::string(name(between)) +
            "\" }\n[state]\nx = { initial = 0.2 }\n[drift]\nx = \"u - x\"\n[diffusion]\nx = [\"0\"]\n",
        "still.toml");
    const Simulation drawn = simulate(text.with_inputs({given}, "u.csv").model(), 6, 60000, 12, 1);
    double x = start, t = 0;
    for (std::size_t r = 1; r < drawn.signal.rows(); ++r) {
      for (const Piece& piece : pieces(between, t, drawn.signal.times[r])) {
        const double D = piece.end - t, e = std::exp(-D);
        x = e * x + (1 - e) * piece.value + piece.slope * (D - (1 - e));
        t = piece.end;
      }
      CHECK(drawn.signal.row(r)[0] == Approx(x).margin(1e-3));
    }
  }
}

TEST_CASE("inputs that do not reach, or are not known, are refused with the time that lacks") {
  const TextModel model = driven("previous", discrete);
  const auto refused = [](auto&& run, const std::string& message) {
    try {
      run();
    } catch (const InputError& error) {
      INFO(error.what());
      CHECK(std::string(error.what()).find(message) != std::string::npos);
      return;
    }
    FAIL("no InputError");
  };
  const ObservationPath y = rows(14, 0.5);  // to 6.5
  refused([&] { evidence(model.model(), {}, y, 0.02); }, "the input u of this model has no values");
  const Model known = model.with_inputs({given}, "u.csv").model();
  refused([&] { cut_windows(y, known, {}); },
          "the input u is given from t = 0 to t = 6, and the observations end at t = 6.5");
  refused([&] { simulate(known, 7, 70, 70, 1); }, "and the steps end at t = 7");
  InputFunction late = given;
  for (double& t : late.times) t += 1;
  refused([&] { cut_windows(rows(5, 0.5), model.with_inputs({late}, "u.csv").model(), {}); },
          "the observations begin at t = 0");
  InputFunction bad = given;
  bad.values[2] = std::nan("");
  refused([&] { model.with_inputs({bad}, "u.csv"); }, "u.csv: row 3, column u");
  bad = given;
  bad.times[3] = 1;
  refused([&] { model.with_inputs({bad}, "u.csv"); }, "u.csv: row 4, column t");
  bad = given;
  bad.name = "v";
  refused([&] { model.with_inputs({bad}, "u.csv"); }, "lacks an input of the model");
  refused([&] { model.with_inputs({given, bad}, "u.csv"); }, "the model has no such input");
}
