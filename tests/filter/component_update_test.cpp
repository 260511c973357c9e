/// Components that an observation divides, against quadrature in the plane.
#include "wienertree/filter/component_update.hpp"

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "wienertree/filter/component_merge.hpp"
#include "wienertree/filter/component_split.hpp"
#include "wienertree/model/text_model.hpp"

using namespace wienertree;

namespace {

Model plane(const std::string& observation) {
  return parse_model(
      "name = \"plane\"\nconvention = \"ito\"\n[state]\nx = { initial = 0 }\nz = { initial = 0 }\n[drift]\n"
      "x = \"-x\"\nz = \"-z\"\n[diffusion]\nx = [1, 0]\nz = [0, 1]\n[observation]\nkind = \"discrete\"\n" +
          observation + "\n",
      "plane.toml");
}

GaussianComponents one(Eigen::Vector2d mean, Eigen::Matrix2d covariance) {
  GaussianComponents c;
  c.reshape(2, 1);
  c.log_weight[0] = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    c.mean(i, 0) = mean(static_cast<Eigen::Index>(i));
    for (std::size_t j = 0; j < 2; ++j)
      c.covariance(2 * i + j, 0) = covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  }
  return c;
}

// The trapezoidal rule on a grid of 0.01 over +-7: exact to rounding for what is analytic and wide against 0.01.
MixtureMoments by_quadrature(const Model& model, double y, Eigen::Vector2d m, Eigen::Matrix2d P) {
  constexpr double width = 0.01, reach = 7;
  const auto points = static_cast<std::size_t>(2 * reach / width) + 1;
  const Eigen::Matrix2d inverse = P.inverse();
  Batch x(2, points);
  std::vector<double> l(points), observed = {y};
  double mass = 0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (std::size_t a = 0; a < points; ++a) {
    for (std::size_t b = 0; b < points; ++b) {
      x(0, b) = -reach + width * (static_cast<double>(a) + 0.3);
      x(1, b) = -reach + width * (static_cast<double>(b) + 0.3);
    }
    model.density->log_density(observed, x, l);
    for (std::size_t b = 0; b < points; ++b) {
      const Eigen::Vector2d at(x(0, b), x(1, b)), u = at - m;
      const double w = std::exp(l[b] - 0.5 * u.dot(inverse * u));
      mass += w;
      mean += w * at;
      second += w * at * at.transpose();
    }
  }
  MixtureMoments out;
  out.mean = mean / mass;
  out.covariance = second / mass - out.mean * out.mean.transpose();
  out.log_mass = std::log(mass * width * width / (2 * std::numbers::pi)) - 0.5 * std::log(P.determinant());
  return out;
}

}  // namespace

// The log ratio of exact to linearised likelihood spreads by .05 in a component at most, which a rule of 5 points along
// an axis integrates to about its cube; what is left undivided is worth 1e-4, and densities ripple by 3e-4.
TEST_CASE("one Gaussian divided for a likelihood with a curved ridge, a ring, two modes, heavy tails") {
  struct Case {
    std::string observation;
    double y;
    Eigen::Vector2d mean;
    double tolerance;
  };
  const Case cases[] = {
      {"h = [\"sqrt(x^2 + z^2)\"]\nnoise = { law = \"gaussian\", sd = 0.1 }", 2.8, {0, 0}, 2e-3},
      {"h = [\"sqrt(x^2 + z^2)\"]\nnoise = { law = \"gaussian\", sd = 0.1 }", 1.0, {0.3, -0.2}, 2e-3},
      {"h = [\"atan((x + 3)/(z + 4))\"]\nnoise = { law = \"gaussian\", sd = 0.02 }", 0.7, {0, 0}, 2e-3},
      {"h = [\"x^2 - z\"]\nnoise = { law = \"gaussian\", sd = 0.1 }", 1.5, {0, 0}, 2e-3},
      {"h = [\"sin(3*x)\"]\nnoise = { law = \"gaussian\", sd = 0.1 }", 0.5, {0, 0}, 2e-3},
      {"h = [\"x + 0.5*z\"]\nnoise = { law = \"student-t\", dof = 3, scale = 0.1 }", 2.5, {0, 0}, 2e-3},
      {"h = [\"x + 0.5*z\"]\nnoise = { law = \"laplace\", scale = 0.2 }", 0.8, {0, 0}, 5e-3},
      {"log_likelihood = \"y1*(x + z) - exp(x + z)\"", 4, {0, 0}, 2e-3}};
  Eigen::Matrix2d P;
  P << 1, 0.2, 0.2, 0.5;
  for (const Case& c : cases) {
    INFO(c.observation << ", y = " << c.y);
    const Model model = plane(c.observation);
    GaussianComponents components = one(c.mean, P);
    ComponentUpdate update(model);
    const std::vector<double> y = {c.y};
    const double left = update.condition(y, 0, {0.05, 9600}, components, nullptr);
    CHECK(left == 0);
    const MixtureMoments got = moments(components), exact = by_quadrature(model, c.y, c.mean, P);
    INFO(components.size() << " components");
    CHECK(std::abs(got.log_mass - exact.log_mass) < c.tolerance);
    for (Eigen::Index i = 0; i < 2; ++i) {
      const double sd = std::sqrt(exact.covariance(i, i));
      CHECK(std::abs(got.mean(i) - exact.mean(i)) < c.tolerance * sd);
      CHECK(std::abs(std::sqrt(got.covariance(i, i)) - sd) < c.tolerance * sd);
    }
  }
}

TEST_CASE("a likelihood that needs more components than it may have is said to") {
  const Model model = plane("h = [\"sqrt(x^2 + z^2)\"]\nnoise = { law = \"gaussian\", sd = 0.001 }");
  GaussianComponents components = one({0, 0}, Eigen::Matrix2d::Identity());
  ComponentUpdate update(model);
  const std::vector<double> y = {1.5};
  CHECK(update.condition(y, 0, {0.05, 100}, components, nullptr) > 0.3);
}

TEST_CASE("parts of a wide component have its mass, mean and covariance, and leave no gaps") {
  Eigen::Matrix2d P;
  P << 2, 0.3, 0.3, 0.1;
  const GaussianComponents whole = one({1, -1}, P);
  const Eigen::Matrix2d S = Eigen::Matrix2d::Identity();
  for (const double kappa : {0.15, 0.4, 1.2}) {
    ComponentSplit split;
    GaussianComponents parts;
    split.split(whole, S, kappa, 1600, 6400, parts, nullptr);
    const MixtureMoments got = moments(parts);
    CHECK(got.log_mass == Approx(0).margin(1e-12));
    CHECK(got.mean(0) == Approx(1).epsilon(1e-10));
    CHECK((got.covariance - P).cwiseAbs().maxCoeff() < 1e-10);
    // The density of the parts along the widest axis: ripples of a lattice, 4e-4, or what three points make of a part
    // that is nearly narrow enough.
    for (double s = -2; s <= 2; s += 0.05) {
      const Eigen::Vector2d at =
          Eigen::Vector2d(1, -1) + s * Eigen::Vector2d(std::sqrt(2), 0.3 / std::sqrt(2));
      double sum = 0;
      for (std::size_t n = 0; n < parts.size(); ++n) {
        Eigen::Matrix2d C;
        C << parts.covariance(0, n), parts.covariance(1, n), parts.covariance(2, n), parts.covariance(3, n);
        const Eigen::Vector2d u = at - Eigen::Vector2d(parts.mean(0, n), parts.mean(1, n));
        sum += std::exp(parts.log_weight[n] - 0.5 * u.dot(C.inverse() * u)) / std::sqrt(C.determinant());
      }
      const Eigen::Vector2d u = at - Eigen::Vector2d(1, -1);
      const double exact = std::exp(-0.5 * u.dot(P.inverse() * u)) / std::sqrt(P.determinant());
      INFO("kappa " << kappa << ", s " << s);
      CHECK(sum == Approx(exact).epsilon(5e-3));
    }
  }
}

TEST_CASE("components that noise to come hides become one, others stay, with the moments of the whole") {
  // Three groups, one of them of unlike covariances; noise of standard deviations 1 and 0.1.
  GaussianComponents c;
  const std::size_t N = 90;
  c.reshape(2, N);
  for (std::size_t n = 0; n < N; ++n) {
    const std::size_t group = n % 3;
    const double k = static_cast<double>(n / 3) / 29 - 0.5;
    c.log_weight[n] = 3 - static_cast<double>(group) / 2 + k;
    c.mean(0, n) = 5 * static_cast<double>(group) + 0.2 * k;
    c.mean(1, n) = 0.02 * k * k;
    c.covariance(0, n) = 0.01 + (group == 2 && k > 0 ? 3.0 : 0.0);
    c.covariance(1, n) = c.covariance(2, n) = 1e-4;
    c.covariance(3, n) = 1e-4;
  }
  const MixtureMoments before = moments(c);
  const Eigen::MatrixXd W = Eigen::Vector2d(1, 10).asDiagonal();
  ComponentMerge merge;
  GaussianComponents fine = c;
  merge.merge_close(c, W, 0.2);
  CHECK(c.size() >= 4);  // cuts halve shares, so that groups may be divided
  CHECK(c.size() <= 16);
  const MixtureMoments after = moments(c);
  CHECK(after.log_mass == Approx(before.log_mass).epsilon(1e-13));
  CHECK(after.mean.isApprox(before.mean, 1e-12));
  CHECK(after.covariance.isApprox(before.covariance, 1e-12));
  // Not so where the noise is narrow beside the groups.
  merge.merge_close(fine, 1000 * W, 0.2);
  CHECK(fine.size() > 60);
}
