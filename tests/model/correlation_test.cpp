// [noise] correlation: Brownian motions of the file as combinations of independent ones.
#include <catch2/catch.hpp>

#include <Eigen/Core>
#include <cmath>
#include <string>
#include <vector>

#include "model/model_mistakes.hpp"
#include "model/text_model_support.hpp"

using namespace wienertree;
using namespace wienertree::testing;

namespace {

std::string heston(const std::string& s, const std::string& v, const std::string& more = "") {
  return "convention = \"ito\"\n[parameters]\nrho = -0.5\nxi = 0.4\n[state]\n"
         "s = { initial = 100 }\nv = { initial = 0.04, lower = 0 }\n[drift]\n"
         "s = \"0.02*s\"\nv = \"1.5*(0.05 - v)\"\n[diffusion]\ns = " +
         s + "\nv = " + v + "\n" + more;
}

const std::string correlated = heston("[\"sqrt(v)*s\", 0]", "[0, \"xi*sqrt(v)\"]",
                                      "[noise]\ncorrelation = [[1, \"rho\"], [\"rho\", 1]]\n");
const std::string by_hand = heston("[\"sqrt(v)*s\", 0]", "[\"rho*xi*sqrt(v)\", \"xi*sqrt((1 - rho^2)*v)\"]");

// Of p states x_i with dx_i = sigma_i dW_i.
std::string brownian(const std::vector<std::string>& sigma, const std::string& rows) {
  std::string states, drift, diffusion;
  for (std::size_t i = 0; i < sigma.size(); ++i) {
    const std::string name = "x" + std::to_string(i + 1);
    states += name + " = { initial = 1 }\n";
    drift += name + " = 0\n";
    diffusion += name + " = [";
    for (std::size_t j = 0; j < sigma.size(); ++j)
      diffusion += std::string(j > 0 ? ", " : "") + (i == j ? "\"" + sigma[i] + "\"" : "0");
    diffusion += "]\n";
  }
  return "convention = \"ito\"\n[parameters]\nr = 0.3\nq = -0.6\n[state]\n" + states + "[drift]\n" + drift +
         "[diffusion]\n" + diffusion + "[noise]\ncorrelation = " + rows + "\n";
}

// sum_k V_k V_k^T at a point, the matrix of the law.
Eigen::MatrixXd covariance_at(const VectorFields& fields, const Point& x) {
  const auto d = static_cast<Eigen::Index>(x.size());
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(d, d);
  for (std::size_t k = 1; k <= fields.noise_dimension(); ++k) {
    const Point V = field(fields, k, x);
    const Eigen::VectorXd column = Eigen::Map<const Eigen::VectorXd>(V.data(), d);
    sum += column * column.transpose();
  }
  return sum;
}

}  // namespace

TEST_CASE("Heston's model with a correlation is the one with the factor written by hand") {
  const TextModel a = TextModel::parse(correlated, "a.toml"), b = TextModel::parse(by_hand, "b.toml");
  for (const Point& x : {Point{100, 0.04}, Point{80, 0.3}, Point{1, 1e-5}}) {
    for (std::size_t k = 0; k <= 2; ++k)
      for (std::size_t i = 0; i < 2; ++i)
        CHECK(field(*a.model().fields, k, x)[i] == Approx(field(*b.model().fields, k, x)[i]).epsilon(1e-13));
    const Point D{0.1, 0.7, -0.4};
    for (std::size_t i = 0; i < 4; ++i)
      CHECK(jacobian(*a.model().fields, x, D)[i] ==
            Approx(jacobian(*b.model().fields, x, D)[i]).epsilon(1e-12));
  }
  REQUIRE(a.square_roots());
  REQUIRE(a.square_roots()->price);
  CHECK(a.square_roots()->price->correlated[0] == Approx(-0.5).epsilon(1e-14));
  CHECK(a.square_roots()->price->independent[0] == Approx(0.75).epsilon(1e-14));
  CHECK(a.square_roots()->components[0].process.c == Approx(0.16).epsilon(1e-14));
  const ModelAnalysis shown = a.analysis();
  CHECK(shown.correlation == std::vector<std::vector<std::string>>{{"1", "rho"}, {"rho", "1"}});
  CHECK(shown.fields[1] == std::vector<std::string>{"s*sqrt(v)", "rho*xi*sqrt(v)"});
  CHECK(shown.fields[2] == std::vector<std::string>{"0", "xi*sqrt(v)*sqrt(1 - rho^2)"});
  CHECK(b.analysis().correlation.empty());
  // The integral of a variance and a model without the price keep the correlation.
  CHECK(a.without_price().model().fields->noise_dimension() == 2);
  CHECK(a.with_integrals({{"I", "v", "test"}}).square_roots());
}

TEST_CASE("the law has the correlation of the file, also where it is singular and of many Brownian motions") {
  struct Case {
    std::vector<std::string> sigma;
    std::string rows;
    Eigen::MatrixXd R;
  };
  std::vector<Case> cases(5);
  cases[0] = {{"x1", "2"}, "[[1, 1], [1, 1]]", Eigen::MatrixXd::Ones(2, 2)};
  cases[1] = {{"x1", "2", "3*x3"},
              "[[1, \"r\", 0], [\"r\", 1, \"q\"], [0, \"q\", 1]]",
              (Eigen::MatrixXd(3, 3) << 1, 0.3, 0, 0.3, 1, -0.6, 0, -0.6, 1).finished()};
  // Equicorrelated at the least that there is: singular.
  cases[2] = {{"1", "1", "1"},
              "[[1, -0.5, -0.5], [-0.5, 1, -0.5], [-0.5, -0.5, 1]]",
              (Eigen::MatrixXd(3, 3) << 1, -0.5, -0.5, -0.5, 1, -0.5, -0.5, -0.5, 1).finished()};
  cases[3] = {{"1", "2", "3"},
              "[[1, -1, \"r\"], [-1, 1, \"-r\"], [\"r\", \"-r\", 1]]",
              (Eigen::MatrixXd(3, 3) << 1, -1, 0.3, -1, 1, -0.3, 0.3, -0.3, 1).finished()};
  Eigen::MatrixXd R = Eigen::MatrixXd::Constant(5, 5, 0.3);
  R.diagonal().setOnes();
  std::string rows;
  for (int j = 0; j < 5; ++j) {
    rows += j > 0 ? ", [" : "[";
    for (int k = 0; k < 5; ++k) rows += std::string(k > 0 ? ", " : "") + (j == k ? "1" : "\"r\"");
    rows += "]";
  }
  cases[4] = {{"1", "x2", "3", "x4^2", "5"}, "[" + rows + "]", R};
  for (const Case& c : cases) {
    INFO(c.rows);
    const TextModel model = TextModel::parse(brownian(c.sigma, c.rows), "m.toml");
    const std::size_t p = c.sigma.size();
    Point x(p), sigma(p);
    for (std::size_t i = 0; i < p; ++i) x[i] = 0.5 + static_cast<double>(i);
    for (std::size_t i = 0; i < p; ++i) sigma[i] = value_of(model, c.sigma[i], x);
    const Eigen::MatrixXd law = covariance_at(*model.model().fields, x);
    for (std::size_t i = 0; i < p; ++i)
      for (std::size_t j = 0; j < p; ++j) {
        const auto a = static_cast<Eigen::Index>(i), b = static_cast<Eigen::Index>(j);
        CHECK(law(a, b) == Approx(sigma[i] * sigma[j] * c.R(a, b)).epsilon(1e-13).margin(1e-13));
      }
  }
}

TEST_CASE("a parameter of the correlation is set like any other") {
  const Model set = parse_model(correlated, "m.toml", {{"rho", 0.25}});
  CHECK(field(*set.fields, 1, {1, 1})[1] == Approx(0.1).epsilon(1e-14));
  CHECK(field(*set.fields, 2, {1, 1})[1] == Approx(0.4 * std::sqrt(1 - 0.0625)).epsilon(1e-14));
  // Fully correlated: the second Brownian motion drives nothing.
  const Model full = parse_model(correlated, "m.toml", {{"rho", 1}});
  CHECK(field(*full.fields, 2, {1, 1}) == Point{0, 0});
  CHECK(jacobian(*full.fields, {1, 1}, {0, 0, 1}) == Point{0, 0, 0, 0});
}

TEST_CASE("exact filters are found, and simulated signals have the bytes of the factor written by hand") {
  const std::string head =
                        "convention = \"ito\"\n[parameters]\nrho = -0.6\n[state]\nx = { initial = 0 }\n"
                        "v = { initial = 1 }\n[drift]\nx = \"v\"\nv = \"-v\"\n[diffusion]\n",
                    observed =
                        "[observation]\nkind = \"discrete\"\nh = [\"x\"]\n"
                        "noise = { law = \"gaussian\", sd = 0.5 }\n";
  const Model a = parse_model(head +
                                  "x = [1, 0]\nv = [0, 2]\n[noise]\ncorrelation = [[1, \"rho\"], "
                                  "[\"rho\", 1]]\n" +
                                  observed,
                              "a.toml"),
              b = parse_model(head + "x = [1, 0]\nv = [\"2*rho\", \"2*sqrt(1 - rho^2)\"]\n" + observed,
                              "b.toml");
  CHECK(a.exact_filter == ExactFilter::kalman);
  CHECK(a.fields->has_exact_flow());
  REQUIRE(a.fields->affine_fields());
  for (std::size_t k = 1; k <= 2; ++k)
    CHECK((a.fields->affine_fields()->constant[k] - b.fields->affine_fields()->constant[k]).norm() < 1e-15);
  Batch dB(2, 1), to_a(2, 1), to_b(2, 1);
  dB(0, 0) = 0.3;
  dB(1, 0) = -0.2;
  a.fields->euler_step(one_node({0.5, 2}), 0.1, dB, to_a);
  b.fields->euler_step(one_node({0.5, 2}), 0.1, dB, to_b);
  CHECK(values(to_a) == values(to_b));
}

TEST_CASE("what is no correlation is refused with its place and value") {
  const auto refused = [](const std::string& rows, const std::string& where, const std::string& message,
                          const std::string& value) {
    const Error error = mistakes::error_of(brownian({"1", "1", "1"}, rows));
    INFO(error.what());
    CHECK(error.where() == where);
    CHECK(error.message().find(message) != std::string::npos);
    if (!value.empty()) CHECK(error.value() == value);
  };
  const std::string line = "m.toml:18:";
  refused("[[1, 0.5, 0], [0.5, 1.1, 0], [0, 0, 1]]", line + "35, noise.correlation[2][2]", "with itself is 1",
          "1.1");
  refused("[[1, 1.5, 0], [1.5, 1, 0], [0, 0, 1]]", line + "20, noise.correlation[1][2]", "between -1 and 1",
          "1.5");
  refused("[[1, 0.5, 0], [0.4, 1, 0], [0, 0, 1]]", line + "30, noise.correlation[2][1]", "not symmetric",
          "0.4 and 0.5");
  // 1 + 2 cos(theta) of the equicorrelated matrix: 1 - 2 0.6 = -0.2.
  refused("[[1, -0.6, -0.6], [-0.6, 1, \"q\"], [\"q\", -0.6, 1]]", line + "17, noise.correlation[1][1]",
          "negative eigenvalue", "");
  refused("[[1, 0], [0, 1]]", line + "15, noise.correlation", "needs 3 rows", "2");
  refused("[[1, 0], [0, 1], [0, 0]]", line + "15, noise.correlation", "needs 3 entries", "2");
  refused("[[1, \"x1\", 0], [0, 1, 0], [0, 0, 1]]", line + "21, noise.correlation[1][2]",
          "a state cannot be used here", "x1");
}
