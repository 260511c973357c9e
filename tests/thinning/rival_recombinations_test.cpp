// Level-wise recombination and heavy-first: mass, moments, budget, and what each promises besides.
#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>
#include <set>

#include "wienertree/numeric/error.hpp"
#include "wienertree/thinning/recombination/recombination.hpp"
#include "wienertree/thinning/thinning.hpp"

using namespace wienertree;

namespace {

constexpr ThinningMethod methods[] = {ThinningMethod::levelwise, ThinningMethod::heavy_first};

struct Cloud {
  Batch x;
  std::vector<double> log_weight;
  // Standard normal states; log-weights normal times `spread`.
  Cloud(std::size_t d, std::size_t n, double spread) : x(d, n), log_weight(n) {
    for (std::size_t i = 0; i < d; ++i)
      RandomStream{17, 0, static_cast<std::uint32_t>(i)}.normals(0, x.component(i));
    RandomStream{17, 1, 0}.normals(0, log_weight);
    for (double& l : log_weight) l *= spread;
  }
};

Selection thin(ThinningMethod method, const Cloud& c, std::size_t budget, int degree = 0) {
  Selection s;
  make_thinning({method, SiteOrder::spatial, degree})->thin({c.x, c.log_weight}, budget, {}, s);
  return s;
}

double state(const Cloud& c, const Selection& s, std::size_t i, std::size_t k) {
  return s.moved_states.nodes() != 0 ? s.moved_states(i, k) : c.x(i, s.site[k]);
}

// Integrals of prod x_i^{power_i} before and after, relative to the mass.
std::pair<double, double> moment(const Cloud& c, const Selection& s, const std::vector<int>& power) {
  double before = 0, after = 0, mass = 0;
  for (std::size_t n = 0; n < c.log_weight.size(); ++n) {
    double term = std::exp(c.log_weight[n]);
    mass += term;
    for (std::size_t i = 0; i < power.size(); ++i) term *= std::pow(c.x(i, n), power[i]);
    before += term;
  }
  for (std::size_t k = 0; k < s.site.size(); ++k) {
    double term = std::exp(s.log_weight[k]);
    for (std::size_t i = 0; i < power.size(); ++i) term *= std::pow(state(c, s, i, k), power[i]);
    after += term;
  }
  return {before / mass, after / mass};
}

}  // namespace

TEST_CASE("levelwise and heavy-first keep mass and mean on at most N distinct sites") {
  for (const ThinningMethod method : methods)
    for (const std::size_t d : {1, 2, 3})
      for (const double spread : {0.0, 1.0, 10.0})
        for (const std::size_t N : {1, 2, 5, 24, 60}) {
          const Cloud c(d, 900, spread);
          const Selection s = thin(method, c, N);
          CAPTURE(static_cast<int>(method), d, spread, N);
          REQUIRE(s.site.size() <= N);
          REQUIRE(s.log_weight.size() == s.site.size());
          REQUIRE(std::set<std::uint32_t>(s.site.begin(), s.site.end()).size() == s.site.size());
          // Rounding of some 900 terms of size up to 4, and of logarithms of size up to 40: 1e-11 at most.
          const std::vector<int> zero(d, 0);
          const auto [mass, kept] = moment(c, s, zero);
          REQUIRE(kept == Approx(mass).epsilon(1e-11));
          if (N < 24) continue;  // fewer may not hold 1 + d moments beside the heavy sites
          for (std::size_t i = 0; i < d; ++i) {
            std::vector<int> power(d, 0);
            power[i] = 1;
            const auto [before, after] = moment(c, s, power);
            REQUIRE(after == Approx(before).epsilon(0).margin(1e-10));
          }
        }
}

TEST_CASE("levelwise keeps all moments up to the degree the budget allows, and not the next") {
  const Cloud c(2, 900, 1.0);
  const Selection s = thin(ThinningMethod::levelwise, c, 21);  // (2 + 5 choose 5) = 21
  for (int degree = 0; degree <= 5; ++degree)
    for (int a = 0; a <= degree; ++a) {
      const auto [before, after] = moment(c, s, {a, degree - a});
      CHECK(after == Approx(before).epsilon(0).margin(1e-9));  // entries up to 4^5 = 1000
    }
  const auto [before, after] = moment(c, s, {6, 0});
  CHECK(std::abs(after - before) > 1e-3);
  CHECK(thin(ThinningMethod::levelwise, c, 20).site.size() <= 15);
  CHECK(thin(ThinningMethod::levelwise, c, 21, 2).site.size() <= 6);
  const Cloud line(1, 300, 1.0);
  const Selection gauss = thin(ThinningMethod::levelwise, line, 6);
  CHECK(gauss.site.size() == 6);
  const auto [eleven, kept] = moment(line, gauss, {11});
  CHECK(kept == Approx(eleven).epsilon(1e-8));
}

TEST_CASE("heavy-first leaves sites of more than 1/N of the mass as they are") {
  for (const std::size_t d : {1, 2}) {
    Cloud c(d, 500, 1.0);
    c.log_weight[7] = c.log_weight[123] = 6;
    const Selection s = thin(ThinningMethod::heavy_first, c, 20);
    for (const std::uint32_t heavy : {7U, 123U}) {
      const auto at = std::find(s.site.begin(), s.site.end(), heavy);
      REQUIRE(at != s.site.end());
      const auto k = static_cast<std::size_t>(at - s.site.begin());
      CHECK(s.log_weight[k] == 6.0);
      CHECK(state(c, s, 0, k) == c.x(0, heavy));
    }
  }
}

TEST_CASE("levelwise and heavy-first keep all sites of a budget that holds them, and refuse bad weights") {
  for (const ThinningMethod method : methods) {
    Cloud c(2, 30, 1.0);
    CHECK(thin(method, c, 30).site.size() == 30);
    CHECK_THROWS_AS(make_thinning({method, SiteOrder::spatial, -1}), InputError);
    CHECK_THROWS_AS(thin(method, c, 0), InputError);
    c.log_weight.assign(30, -INFINITY);
    c.log_weight[4] = 0;
    CHECK(thin(method, c, 2).site == std::vector<std::uint32_t>{4});
    c.log_weight[3] = NAN;
    CHECK_THROWS_AS(thin(method, c, 10), RunError);
    c.log_weight.assign(30, -INFINITY);
    CHECK_THROWS_AS(thin(method, c, 10), RunError);
  }
}
