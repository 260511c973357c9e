// Every bundled model against its formulas written by hand, and against the identities that any model
// satisfies.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <numbers>

#include "model/text_model_support.hpp"

using namespace wienertree;
using namespace wienertree::testing;

namespace {

struct ByHand {
  std::vector<std::function<Point(const Point&)>> fields;  // V_0 .. V_p, Stratonovich
  std::function<Point(const Point&)> sensor;
  std::size_t k = 0;
  ExactFilter exact = ExactFilter::none;
  bool affine = false;
};

Point none(const Point&) { return {}; }

ByHand benes(double mu, double sigma, double h1) {
  return {{[=](const Point& x) { return Point{mu * sigma * std::tanh(mu * x[0] / sigma)}; },
           [=](const Point&) { return Point{sigma}; }},
          [=](const Point& x) { return Point{h1 * x[0]}; },
          1,
          ExactFilter::benes,
          false};
}

// Stratonovich corrections by hand: -1/2 sum_j (DV_j) V_j.
std::map<std::string, ByHand> models_by_hand() {
  std::map<std::string, ByHand> models;
  models["benes"] = benes(0.05, 1.0, 0.8);
  models["benes-prior"] = benes(2.2, 2.2, 0.15);
  models["benes-convergence"] = benes(0.5, 0.8, 0.4);
  models["benes-mixture"] = benes(0.3, 1.0, 0.8);
  models["ornstein-uhlenbeck"] = {
      {[](const Point& x) { return Point{0.5 - x[0]}; }, [](const Point&) { return Point{0.7}; }},
      [](const Point& x) { return Point{x[0]}; },
      1,
      ExactFilter::kalman_bucy,
      true};
  models["linear-3d"] = {{[](const Point& x) {
                            return Point{-0.6 * x[0] + 1.2 * x[1], -1.2 * x[0] - 0.6 * x[1] + 0.4 * x[2],
                                         0.3 * x[0] - 0.4 * x[2] + 0.2};
                          },
                          [](const Point&) {
                            return Point{0.6, -0.2, 0.1};
                          },
                          [](const Point&) {
                            return Point{0.1, 0.5, 0.3};
                          }},
                         [](const Point& x) {
                           return Point{x[0] + 0.5 * x[2], x[1] - 0.3 * x[0] + 0.1};
                         },
                         2,
                         ExactFilter::kalman_bucy,
                         true};
  models["lorenz63"] = {
      {[](const Point& x) {
         return Point{10 * (x[1] - x[0]), x[0] * (28 - x[2]) - x[1], x[0] * x[1] - 8.0 / 3.0 * x[2]};
       },
       [](const Point&) {
         return Point{1, 0, 0};
       },
       [](const Point&) {
         return Point{0, 1, 0};
       },
       [](const Point&) {
         return Point{0, 0, 1};
       }},
      [](const Point& x) { return Point{x[0]}; },
      1,
      ExactFilter::none,
      false};
  const double kappa = -std::log(0.97), sigma = 0.2 * std::sqrt(2 * kappa / (1 - 0.97 * 0.97));
  models["stochastic-volatility"] = {
      {[=](const Point& x) { return Point{-kappa * x[0]}; }, [=](const Point&) { return Point{sigma}; }},
      none,
      0,
      ExactFilter::none,
      true};
  // r = .05, kappa = 2, theta = .09, xi = .1, rho = 0: the correction of s is -s v/2, that of v is -xi^2/4.
  models["heston"] = {{[](const Point& x) {
                         return Point{0.05 * x[0] - 0.5 * x[0] * x[1], 2 * (0.09 - x[1]) - 0.0025};
                       },
                       [](const Point& x) {
                         return Point{std::sqrt(x[1]) * x[0], 0};
                       },
                       [](const Point& x) {
                         return Point{0, 0.1 * std::sqrt(x[1])};
                       }},
                      none,
                      0,
                      ExactFilter::none,
                      false};
  models["cir"] = {{[](const Point& x) {
                      return Point{2 * (0.09 - x[0]) - 0.0025, x[0]};
                    },
                    [](const Point& x) {
                      return Point{0.1 * std::sqrt(x[0]), 0};
                    }},
                   none,
                   0,
                   ExactFilter::none,
                   false};
  const double elasticity = 0.75, cev = 0.2 * std::pow(100, 0.25);
  models["cev"] = {
      {[=](const Point& x) {
         return Point{0.05 * x[0] - 0.5 * elasticity * cev * cev * std::pow(x[0], 2 * elasticity - 1)};
       },
       [=](const Point& x) { return Point{cev * std::pow(x[0], elasticity)}; }},
      none,
      0,
      ExactFilter::none,
      false};
  // beta = .7, nu = .4, rho = -.3: the corrections are -a^2 beta f^(2 beta - 1)/2 - nu rho a f^beta/2 and -nu^2 a/2.
  models["sabr"] = {{[](const Point& x) {
                       return Point{
                           -0.35 * x[1] * x[1] * std::pow(x[0], 0.4) + 0.06 * x[1] * std::pow(x[0], 0.7),
                           -0.08 * x[1]};
                     },
                     [](const Point& x) {
                       return Point{x[1] * std::pow(x[0], 0.7), -0.12 * x[1]};
                     },
                     [](const Point& x) {
                       return Point{0, 0.4 * std::sqrt(0.91) * x[1]};
                     }},
                    none,
                    0,
                    ExactFilter::none,
                    false};
  models["gbm"] = {{[](const Point& x) { return Point{(0.05 - 0.02) * x[0]}; },
                    [](const Point& x) { return Point{0.2 * x[0]}; }},
                   none,
                   0,
                   ExactFilter::none,
                   true};
  models["nile"] = {
      {[](const Point&) { return Point{0}; }, [](const Point&) { return Point{std::sqrt(1469.1)}; }},
      [](const Point& x) { return Point{x[0]}; },
      1,
      ExactFilter::kalman,
      true};
  return models;
}

// Points around the start that stay on its side of 0.
std::vector<Point> points_near(const Model& model, std::size_t count) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Point> points;
  for (std::size_t n = 0; n < count; ++n) {
    Point x;
    for (const double start : model.initial)
      x.push_back(start == 0 ? 2 * uniform(random) : start * (1 + 0.5 * uniform(random)));
    points.push_back(x);
  }
  return points;
}

void require_close(const Point& a, const Point& b, double tolerance) {
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) CHECK(std::abs(a[i] - b[i]) <= tolerance * (1 + std::abs(b[i])));
}

}  // namespace

TEST_CASE("every bundled model has its formulas written by hand here") {
  const auto by_hand = models_by_hand();
  std::size_t files = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(WIENERTREE_SOURCE_DIR) + "/data/models")) {
    INFO(entry.path());
    CHECK(by_hand.count(entry.path().stem().string()) == 1);
    ++files;
  }
  CHECK(files == by_hand.size());
}

TEST_CASE("bundled models agree with their formulas") {
  for (const auto& [name, expected] : models_by_hand()) {
    INFO(name);
    const Model model = load_model(bundled(name));
    CHECK(model.name == name);
    const VectorFields& fields = *model.fields;
    REQUIRE(fields.noise_dimension() + 1 == expected.fields.size());
    REQUIRE(fields.sensor_dimension() == expected.k);
    CHECK(model.exact_filter == expected.exact);
    CHECK((fields.affine_fields() != nullptr) == expected.affine);
    CHECK(fields.has_exact_flow() == expected.affine);
    // The tape's functions are within 4 units in the last place, and the expressions have few operations.
    for (const Point& x : points_near(model, 20)) {
      for (std::size_t k = 0; k < expected.fields.size(); ++k)
        require_close(field(fields, k, x), expected.fields[k](x), 1e-13);
      require_close(sensor(fields, x), expected.sensor(x), 1e-13);
    }
  }
}

TEST_CASE("derivatives of bundled models agree with finite differences") {
  // Central differences with step e = 1e-5 (1 + |x|) are off by e^2 f'''/6 and eps |f|/e, each below 1e-8
  // here.
  constexpr double tolerance = 1e-6;
  for (const auto& [name, expected] : models_by_hand()) {
    INFO(name);
    const Model model = load_model(bundled(name));
    const VectorFields& fields = *model.fields;
    const std::size_t d = fields.state_dimension(), p = fields.noise_dimension(),
                      k = fields.sensor_dimension();
    for (const Point& x : points_near(model, 5)) {
      Point D;
      for (std::size_t j = 0; j <= p; ++j) D.push_back(0.3 + 0.7 * static_cast<double>(j));
      const Point J = jacobian(fields, x, D);
      Batch along(k * p, 1);
      fields.sensor_derivative(one_node(x), along);
      Point numerical_along(k * p, 0.0);
      for (std::size_t l = 0; l < d; ++l) {
        const double e = 1e-5 * (1 + std::abs(x[l]));
        Point above = x, below = x;
        above[l] += e;
        below[l] -= e;
        const Point f_above = direct(fields, above, D), f_below = direct(fields, below, D);
        for (std::size_t i = 0; i < d; ++i) {
          const double slope = (f_above[i] - f_below[i]) / (2 * e);
          CHECK(std::abs(J[i * d + l] - slope) <= tolerance * (1 + std::abs(slope)));
        }
        const Point h_above = sensor(fields, above), h_below = sensor(fields, below);
        for (std::size_t i = 0; i < k; ++i)
          for (std::size_t r = 1; r <= p; ++r)
            numerical_along[i * p + r - 1] += field(fields, r, x)[l] * (h_above[i] - h_below[i]) / (2 * e);
      }
      require_close(values(along), numerical_along, tolerance);
    }
  }
}

TEST_CASE("Ito drift, diffusion and Euler step of bundled models are consistent") {
  for (const auto& [name, expected] : models_by_hand()) {
    INFO(name);
    const Model model = load_model(bundled(name));
    const VectorFields& fields = *model.fields;
    const std::size_t d = fields.state_dimension(), p = fields.noise_dimension();
    for (const Point& x : points_near(model, 5)) {
      Point drift = field(fields, 0, x);
      Batch diffusion(d * p, 1), dB(p, 1), euler(d, 1);
      fields.diffusion(one_node(x), diffusion);
      Point step = x;
      const Point ito = ito_drift(fields, x);
      for (std::size_t i = 0; i < d; ++i) step[i] += 0.25 * ito[i];
      for (std::size_t j = 1; j <= p; ++j) {
        dB(j - 1, 0) = 0.1 + 0.2 * static_cast<double>(j);
        const Point V = field(fields, j, x);
        Point D(1 + p, 0.0);
        D[j] = 1;
        const Point J = jacobian(fields, x, D);
        for (std::size_t i = 0; i < d; ++i) {
          for (std::size_t l = 0; l < d; ++l) drift[i] += 0.5 * J[i * d + l] * V[l];
          CHECK(std::abs(diffusion(i * p + j - 1, 0) - V[i]) <= 1e-14 * (1 + std::abs(V[i])));
          step[i] += V[i] * dB(j - 1, 0);
        }
      }
      require_close(ito, drift, 1e-13);
      fields.euler_step(one_node(x), 0.25, dB, euler);
      require_close(values(euler), step, 1e-13);
    }
  }
}

TEST_CASE("Benes parameters are read off the coefficients") {
  const Model model = load_model(bundled("benes-convergence"));
  REQUIRE(model.benes.has_value());
  CHECK(model.benes->mu == Approx(0.5).epsilon(1e-14));
  CHECK(model.benes->sigma == 0.8);
  CHECK(model.benes->h1 == 0.4);
  CHECK(model.benes->h2 == 0);
  CHECK(model.benes->x0 == 1);
  CHECK(model.initial == std::vector<double>{1.0});
}

TEST_CASE("stochastic volatility: stationary start, AR(1) at whole days, log-likelihood") {
  const double phi = 0.97, s = 0.2, beta = 0.9;
  const Model model = load_model(bundled("stochastic-volatility"));
  REQUIRE(model.initial_law.has_value());
  CHECK(model.initial_law->mean(0) == 0);
  const double variance = s * s / (1 - phi * phi);
  CHECK(model.initial_law->covariance(0, 0) == Approx(variance).epsilon(1e-14));
  // Over a unit of time the Ornstein-Uhlenbeck process has factor exp(-kappa) and variance
  // sigma^2 (1 - exp(-2 kappa))/(2 kappa).
  const AffineFields& affine = *model.fields->affine_fields();
  const double kappa = -affine.linear[0](0, 0), sigma = affine.constant[1](0);
  CHECK(std::exp(-kappa) == Approx(phi).epsilon(1e-14));
  CHECK(sigma * sigma * -std::expm1(-2 * kappa) / (2 * kappa) == Approx(s * s).epsilon(1e-14));
  REQUIRE(model.observation == ObservationKind::discrete);
  CHECK(model.observation_dimension() == 1);
  for (const double x : {-1.0, 0.0, 0.7})
    for (const double y : {-2.0, 0.1, 1.5}) {
      const double sd = beta * std::exp(x / 2), z = y / sd;
      const double expected = -0.5 * z * z - std::log(sd) - 0.5 * std::log(2 * std::numbers::pi);
      CHECK(log_density(*model.density, {y}, {x}) == Approx(expected).epsilon(1e-13));
    }
}

TEST_CASE("Nile: Gaussian noise, vague start") {
  const Model model = load_model(bundled("nile"));
  CHECK(model.density->gaussian_variances().at(0) == Approx(15098.5).epsilon(1e-15));
  CHECK(model.initial_law->covariance(0, 0) == 1e7);
  CHECK(model.timing == ObservationTiming::current);
}

TEST_CASE("bundled observations have the numbers of rows they should") {
  const auto lines = [](const std::string& name) {
    std::ifstream file(std::string(WIENERTREE_SOURCE_DIR) + "/data/observations/" + name);
    std::string header, line;
    std::getline(file, header);
    CHECK(header == "t,y1");
    std::size_t count = 0;
    while (std::getline(file, line)) ++count;
    return count;
  };
  CHECK(lines("nile.csv") == 100);
  CHECK(lines("dax.csv") == 1859);
}
