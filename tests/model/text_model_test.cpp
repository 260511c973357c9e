#include "wienertree/model/text_model.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>

#include "model/text_model_support.hpp"

using namespace wienertree;
using namespace wienertree::testing;

namespace {

// A model of one state with this text after the header.
std::string one_state(const std::string& drift, const std::string& diffusion, const std::string& more = "",
                      const std::string& convention = "ito") {
  return "convention = \"" + convention +
         "\"\n[parameters]\na = 0.5\nb = 1.5\n[state]\nx = { initial = 0.3 }\n" + "[drift]\nx = \"" + drift +
         "\"\n[diffusion]\nx = [\"" + diffusion + "\"]\n" + more;
}

const char* const continuous_x = "[observation]\nkind = \"continuous\"\nh = [\"2*x + 1\"]\n";

}  // namespace

TEST_CASE("an Ito model and its Stratonovich twin have equal fields") {
  // V_1 = a (1 + x^2): the correction is -1/2 V_1' V_1 = -a^2 x (1 + x^2).
  const Model ito = parse_model(one_state("sin(x)", "a*(1 + x^2)"), "ito.toml");
  const Model stratonovich = parse_model(
      one_state("sin(x) - a^2*x*(1 + x^2)", "a*(1 + x^2)", "", "stratonovich"), "stratonovich.toml");
  for (const double x : {-2.0, -0.3, 0.0, 0.7, 3.0}) {
    const Point at{x};
    CHECK(field(*ito.fields, 0, at)[0] == Approx(std::sin(x) - 0.25 * x * (1 + x * x)).epsilon(1e-14));
    CHECK(field(*stratonovich.fields, 0, at)[0] == Approx(field(*ito.fields, 0, at)[0]).epsilon(1e-14));
    CHECK(ito_drift(*ito.fields, at)[0] == Approx(std::sin(x)).epsilon(1e-14));
    CHECK(ito_drift(*stratonovich.fields, at)[0] == Approx(std::sin(x)).epsilon(1e-12));
  }
}

TEST_CASE("the order of the states is that of the file") {
  const Model model = parse_model(
      "convention = \"ito\"\nstate = { z = { initial = 1 }, a = { initial = 2 }, m = { initial = 3 } }\n"
      "[drift]\na = 20\nz = 10\nm = 30\n[diffusion]\nm = [3]\nz = [1]\na = [2]\n",
      "order.toml");
  CHECK(model.state_names == std::vector<std::string>{"z", "a", "m"});
  CHECK(model.initial == std::vector<double>{1, 2, 3});
  CHECK(field(*model.fields, 0, {0, 0, 0}) == Point{10, 20, 30});
  CHECK(field(*model.fields, 1, {0, 0, 0}) == Point{1, 2, 3});
}

TEST_CASE("parameters may be expressions of earlier ones, and overrides carry through") {
  const std::string text =
      "convention = \"ito\"\n[parameters]\na = 2\nb = \"a^2\"\nc = \"a + b\"\n"
      "[state]\nx = { initial = \"c\", lower = \"-b\", upper = \"10*c\" }\n"
      "[drift]\nx = \"c*x\"\n[diffusion]\nx = [1]\n";
  const Model plain = parse_model(text, "p.toml");
  CHECK(plain.parameters == std::vector<std::pair<std::string, double>>{{"a", 2}, {"b", 4}, {"c", 6}});
  CHECK(plain.initial[0] == 6);
  CHECK(plain.bounds[0].lower == -4);
  CHECK(plain.bounds[0].upper == 60);
  CHECK(parse_model(text, "p.toml", {{"a", 3}}).parameters.back().second == 12);
  CHECK(parse_model(text, "p.toml", {{"b", 1}}).parameters.back().second == 3);
  CHECK(field(*parse_model(text, "p.toml", {{"c", 7}}).fields, 0, {2.0})[0] == 14);
}

TEST_CASE("time becomes a hidden last state") {
  const TextModel model = TextModel::parse(one_state("a*sin(t) - x", "1 + t", continuous_x), "clock.toml");
  const Model& m = model.model();
  CHECK(m.has_clock);
  CHECK(m.state_names == std::vector<std::string>{"x", "t"});
  CHECK(m.reported_dimension() == 1);
  CHECK(m.initial == std::vector<double>{0.3, 0});
  CHECK(field(*m.fields, 0, {1, 2})[0] == Approx(0.5 * std::sin(2) - 1));
  CHECK(field(*m.fields, 0, {1, 2})[1] == 1);
  CHECK(field(*m.fields, 1, {1, 2}) == Point{3, 0});
  CHECK(value_of(model, "x + 10*t", {1, 2}) == 21);
  CHECK_FALSE(parse_model(one_state("-x", "1"), "still.toml").has_clock);
}

TEST_CASE("affine fields are recognised by their structure") {
  const auto affine = [](const std::string& drift, const std::string& diffusion) {
    return parse_model(one_state(drift, diffusion), "affine.toml").fields->affine_fields() != nullptr;
  };
  CHECK(affine("a*(b - x)", "b*x"));
  CHECK(affine("(x + 1)*3 - x/2 + sqrt(b)*x", "a"));
  CHECK(affine("x^b", "a") == false);
  CHECK(affine("x^(a + 0.5)", "a"));  // x^1
  CHECK_FALSE(affine("abs(x)", "a"));
  CHECK_FALSE(affine("-x", "sqrt(1 + x^2)"));
  CHECK_FALSE(affine("x^2", "1"));
  const Model model = parse_model(one_state("a*(b - x)", "b*x", continuous_x), "affine.toml");
  const AffineFields& fields = *model.fields->affine_fields();
  CHECK(fields.linear[0](0, 0) == Approx(-0.5 - 0.5 * 1.5 * 1.5));
  CHECK(fields.constant[0](0) == 0.75);
  CHECK(fields.linear[1](0, 0) == 1.5);
  REQUIRE(model.fields->affine_sensor() != nullptr);
  CHECK(model.fields->affine_sensor()->linear(0, 0) == 2);
  CHECK(model.fields->affine_sensor()->constant(0) == 1);
}

TEST_CASE("exact filters are found without being claimed") {
  const auto exact = [](const std::string& drift, const std::string& diffusion, const std::string& more) {
    return parse_model(one_state(drift, diffusion, more), "exact.toml").exact_filter;
  };
  const std::string discrete =
      "[observation]\nkind = \"discrete\"\nh = [\"x\"]\nnoise = { law = \"gaussian\", sd = 1 }\n";
  const std::string laplace =
      "[observation]\nkind = \"discrete\"\nh = [\"x\"]\nnoise = { law = \"laplace\", scale = 1 }\n";
  CHECK(exact("-x", "a", continuous_x) == ExactFilter::kalman_bucy);
  CHECK(exact("-x", "a", discrete) == ExactFilter::kalman);
  CHECK(exact("-x", "a", laplace) == ExactFilter::none);
  CHECK(exact("-x", "a", "") == ExactFilter::none);
  CHECK(exact("-x", "a*x", continuous_x) == ExactFilter::none);
  CHECK(exact("-x^3", "a", continuous_x) == ExactFilter::none);
  CHECK(exact("a*b*tanh(b*x/a)", "-a", continuous_x) == ExactFilter::benes);
  // The same function written with exponentials, with sigma = 1 and mu = 1.5.
  CHECK(exact("b*(exp(b*x) - exp(-b*x))/(exp(b*x) + exp(-b*x))", "1", continuous_x) == ExactFilter::benes);
  // The misprint mu sigma tanh(mu sigma x) is not Benes unless sigma = 1.
  CHECK(exact("a*b*tanh(a*b*x)", "a", continuous_x) == ExactFilter::none);
  CHECK(exact("a*b*tanh(b*x/a + 0.0001)", "a", continuous_x) == ExactFilter::none);
  CHECK(exact("max(a*b*tanh(b*x/a), -100)", "a", continuous_x) == ExactFilter::none);
  std::string bounded = one_state("-x", "a", continuous_x);
  bounded.replace(bounded.find("{ initial = 0.3 }"), 17, "{ initial = 0.3, lower = -9 }");
  CHECK(parse_model(bounded, "bounded.toml").exact_filter == ExactFilter::none);
}

TEST_CASE("Benes parameters of a model with negative sigma are those of its law") {
  const Model model = parse_model(one_state("a*b*tanh(b*x/a)", "-a", continuous_x), "benes.toml");
  REQUIRE(model.benes.has_value());
  CHECK(model.benes->mu == Approx(1.5));
  CHECK(model.benes->sigma == 0.5);
  CHECK(model.benes->h1 == 2);
  CHECK(model.benes->h2 == 1);
  CHECK(model.benes->x0 == 0.3);
}

TEST_CASE("clamped states: coefficients at the bound, derivative zero outside") {
  std::string text = one_state("1 - x", "sqrt(x)");
  text.replace(text.find("{ initial = 0.3 }"), 17, "{ initial = 0.3, lower = 0, boundary = \"clamp\" }");
  const Model model = parse_model(text, "clamp.toml");
  CHECK(model.bounds[0].boundary == Boundary::clamp);
  CHECK(field(*model.fields, 1, {-0.5})[0] == 0);
  CHECK(field(*model.fields, 0, {-0.5})[0] == 0.75);  // 1 - 0 - 1/4
  CHECK(jacobian(*model.fields, {-0.5}, {1, 0})[0] == 0);
  CHECK(jacobian(*model.fields, {0.0}, {1, 0})[0] == -1);
  CHECK(jacobian(*model.fields, {0.5}, {1, 0})[0] == -1);
  Batch dB(1, 1), out(1, 1);
  dB(0, 0) = -10;
  model.fields->euler_step(one_node({0.25}), 0.1, dB, out);
  CHECK(out(0, 0) == 0);
  CHECK(std::isnan(field(*model.fields, 0, {std::nan("")})[0]));
  CHECK_FALSE(model.fields->has_exact_flow());
}

TEST_CASE("absorbed components stay, whatever the coefficient there") {
  std::string text = one_state("a/x", "1");
  text.replace(text.find("{ initial = 0.3 }"), 17,
               "{ initial = 0.3, lower = 0, upper = 2, boundary = \"absorb\" }");
  const Model model = parse_model(text, "absorb.toml");
  CHECK(field(*model.fields, 0, {0.0})[0] == 0);  // a/0 otherwise
  CHECK(field(*model.fields, 1, {0.0})[0] == 0);
  CHECK(field(*model.fields, 1, {2.5})[0] == 0);
  CHECK(field(*model.fields, 0, {0.25})[0] == 2);
  CHECK(jacobian(*model.fields, {0.0}, {1, 0})[0] == 0);
  CHECK(std::isnan(field(*model.fields, 0, {std::nan("")})[0]));
  Batch dB(1, 1), out(1, 1);
  dB(0, 0) = 1;
  model.fields->euler_step(one_node({0.0}), 0.1, dB, out);
  CHECK(out(0, 0) == 0);
  model.fields->euler_step(one_node({1.9}), 0.1, dB, out);
  CHECK(out(0, 0) == 2);
}

TEST_CASE("fields that are not followed are not evaluated") {
  // sqrt of a negative number only matters where its field is followed.
  const Model model = parse_model(one_state("1", "sqrt(x)"), "followed.toml");
  CHECK(direct(*model.fields, {-1.0}, {2, 0})[0] == 1.5);
  CHECK(std::isnan(direct(*model.fields, {-1.0}, {0, 1})[0]));
  CHECK(direct(*model.fields, {-1.0}, {0, 0})[0] == 0);
}

TEST_CASE("many Brownian motions: fields in any combination") {
  const Model model = parse_model(
      "convention = \"ito\"\n[state]\nx = { initial = 1 }\n[drift]\nx = 1\n"
      "[diffusion]\nx = [2, 3, 5, 7, 11]\n",
      "many.toml");
  CHECK(direct(*model.fields, {0}, {1, 0, 0, 0, 0, 0})[0] == 1);
  CHECK(direct(*model.fields, {0}, {0, 0, 0, 0, 0, 2})[0] == 22);
  CHECK(direct(*model.fields, {0}, {1, 0, 1, 0, 0, 1})[0] == 15);
  CHECK(direct(*model.fields, {0}, {0, 0, 0, 0, 0, 0})[0] == 0);
}

TEST_CASE("a node's values do not depend on where it sits") {
  const Model model = load_model(bundled("heston"));
  const std::size_t N = 131;
  Batch x(2, N), all(2, N), one(2, 1);
  for (std::size_t n = 0; n < N; ++n) {
    x(0, n) = 0.5 + 0.01 * static_cast<double>(n);
    x(1, n) = 0.01 + 0.003 * static_cast<double>(n);
  }
  const Point D{0.3, -0.7, 0.2};
  model.fields->direct(x, D, all);
  for (std::size_t n = 0; n < N; ++n) {
    model.fields->direct(one_node({x(0, n), x(1, n)}), D, one);
    CHECK(std::memcmp(&one(0, 0), &all(0, n), sizeof(double)) == 0);
    CHECK(std::memcmp(&one(1, 0), &all(1, n), sizeof(double)) == 0);
  }
}

TEST_CASE("timing and several noise laws are read") {
  const std::string text =
      "convention = \"ito\"\n[parameters]\nsd = 2\n[state]\nx = { initial = 0 }\ny = { initial = 1 }\n"
      "[drift]\nx = 0\ny = 0\n[diffusion]\nx = [1]\ny = [1]\n[observation]\nkind = \"discrete\"\n"
      "h = [\"x\", \"x + y\"]\ntiming = \"previous\"\n"
      "noise = [{ law = \"gaussian\", sd = \"sd/4\" }, { law = \"student-t\", dof = 5, scale = \"sd\" }]\n";
  const Model model = parse_model(text, "laws.toml");
  CHECK(model.timing == ObservationTiming::previous);
  CHECK(model.observation_dimension() == 2);
  CHECK(model.density->gaussian_variances().empty());
  CHECK(model.exact_filter == ExactFilter::none);
  const double nan = std::nan("");
  const double gaussian = log_density(*model.density, {1, nan}, {0.5, 2});
  CHECK(gaussian == Approx(-0.5 - std::log(0.5 * std::sqrt(2 * std::acos(-1.0)))));
  CHECK(log_density(*model.density, {1, 3}, {0.5, 2}) ==
        Approx(gaussian + log_density(*model.density, {nan, 3}, {0.5, 2})));
  CHECK(log_density(*model.density, {nan, nan}, {0.5, 2}) == 0);
}

TEST_CASE("analysis prints what was derived, in the syntax of the file") {
  const ModelAnalysis heston = TextModel::load(bundled("heston")).analysis();
  CHECK(heston.convention == "ito");
  CHECK(heston.ito_drift == std::vector<std::string>{"r*s", "kappa*(theta - v)"});
  CHECK(heston.fields[0] ==
        std::vector<std::string>{"r*s - 0.5*s*v - 0.25*xi*rho*s", "-0.25*xi^2 + kappa*(theta - v)"});
  CHECK(heston.fields[1] == std::vector<std::string>{"s*sqrt(v)", "xi*rho*sqrt(v)"});
  CHECK(heston.jacobians[0] == std::vector<std::string>{"r - 0.5*v - 0.25*xi*rho", "-0.5*s", "0", "-kappa"});
  CHECK(heston.exact_filter_name == "none");
  CHECK(heston.parameters.size() == 5);
  const ModelAnalysis benes = TextModel::load(bundled("benes")).analysis();
  CHECK(benes.exact_filter == ExactFilter::benes);
  CHECK(benes.brackets.size() == 1);
  CHECK(benes.brackets[0].components[0] == "-sigma*mu^2*(1 - tanh(mu*x/sigma)^2)");
  CHECK(benes.sensor_derivative[0] == "sigma*h1");
  // Fields of one state that commute: the bracket of two multiples of x vanishes.
  CHECK(TextModel::load(bundled("gbm")).analysis().brackets[0].components[0] == "0");
  CHECK(TextModel::load(bundled("lorenz63")).analysis().brackets.size() == 6);
}

TEST_CASE("brackets: [V, W] = (DW) V - (DV) W") {
  const ModelAnalysis analysis =
      TextModel::parse(
          "convention = \"stratonovich\"\n[state]\nx = { initial = 1 }\ny = { initial = 1 }\n"
          "[drift]\nx = \"y\"\ny = \"x*y\"\n[diffusion]\nx = [\"x^2\"]\ny = [1]\n",
          "bracket.toml")
          .analysis();
  // DW V = (2 x y, 0), DV W = (1, y x^2 + x)
  CHECK(analysis.brackets[0].components[0] == "-1 + 2*x*y");
  CHECK(analysis.brackets[0].components[1] == "-x - y*x^2");
}

TEST_CASE("printed expressions parse back to the same function") {
  for (const char* name : {"benes", "heston", "cir", "lorenz63", "linear-3d"}) {
    const TextModel model = TextModel::load(bundled(name));
    const ModelAnalysis analysis = model.analysis();
    const Point& x = model.model().initial;
    for (std::size_t k = 0; k < analysis.fields.size(); ++k) {
      const Point V = field(*model.model().fields, k, x);
      for (std::size_t i = 0; i < V.size(); ++i) {
        INFO(name << ": " << analysis.fields[k][i]);
        CHECK(value_of(model, analysis.fields[k][i], x) == Approx(V[i]).epsilon(1e-13));
      }
    }
  }
}
