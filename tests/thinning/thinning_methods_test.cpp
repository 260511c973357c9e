// One suite over every random method in every order: what the seam promises, whoever keeps it.
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <numeric>

#include "numeric/statistics.hpp"
#include "wienertree/numeric/error.hpp"
#include "wienertree/thinning/thinning.hpp"

using namespace wienertree;
using namespace wienertree_test;

namespace {

constexpr ThinningMethod methods[] = {ThinningMethod::tbba, ThinningMethod::multinomial,
                                      ThinningMethod::residual, ThinningMethod::stratified,
                                      ThinningMethod::systematic};
constexpr SiteOrder orders[] = {SiteOrder::tree, SiteOrder::spatial};
constexpr double combinations = 10;

template <class Body>
void for_every_method(Body body) {
  for (const ThinningMethod method : methods)
    for (const SiteOrder order : orders) {
      const auto thinning = make_thinning({method, order});
      CAPTURE(std::string(thinning->name()), order == SiteOrder::spatial);
      body(*thinning, method, order);
    }
}

/// Sites with random states and the given log-weights.
struct Measure {
  Batch x;
  std::vector<double> log_weight;
  std::size_t parents = 0;
  explicit Measure(std::vector<double> l, std::size_t d = 1, std::size_t parents_of = 0)
      : x(d, l.size()), log_weight(std::move(l)), parents(parents_of) {
    for (std::size_t i = 0; i < d; ++i)
      RandomStream{3, 0, static_cast<std::uint32_t>(i)}.normals(0, x.component(i));
  }
  operator Sites() const { return {x, log_weight, parents}; }
  std::size_t size() const { return log_weight.size(); }
  double log_total() const {
    const double largest = *std::max_element(log_weight.begin(), log_weight.end());
    double sum = 0;
    for (const double l : log_weight) sum += std::exp(l - largest);
    return largest + std::log(sum);
  }
  std::vector<double> normalised() const {
    std::vector<double> g;
    for (const double l : log_weight) g.push_back(std::exp(l - log_total()));
    return g;
  }
};

std::vector<double> normals(std::size_t n, std::uint64_t seed) {
  std::vector<double> z(n);
  RandomStream{seed, 0, 0, Purpose::signal_noise}.normals(0, z);
  return z;
}

std::vector<std::uint32_t> counts_by_site(const Selection& s, std::size_t sites) {
  std::vector<std::uint32_t> count(sites);
  for (std::size_t k = 0; k < s.site.size(); ++k) count[s.site[k]] = s.count[k];
  return count;
}

// What every selection must be.
void require_valid(const Measure& m, std::size_t N, const Selection& s) {
  REQUIRE(s.site.size() == s.count.size());
  REQUIRE(s.site.size() == s.log_weight.size());
  REQUIRE(s.moved_states.nodes() == 0);
  std::vector<bool> seen(m.size());
  std::uint64_t total = 0;
  const double log_total = m.log_total();
  bool good = true;
  for (std::size_t k = 0; k < s.site.size(); ++k) {
    good &= s.site[k] < m.size() && !seen[s.site[k]] && s.count[k] > 0;
    good &= m.log_weight[s.site[k]] > -INFINITY;
    // log of a number in [1/N, 1] plus the total: two roundings of numbers of this size.
    const double expected = log_total + std::log(static_cast<double>(s.count[k]) / static_cast<double>(N));
    good &= std::abs(s.log_weight[k] - expected) <= 1e-14 * (40 + std::abs(log_total));
    seen[s.site[k]] = true;
    total += s.count[k];
  }
  REQUIRE(good);
  REQUIRE(total == N);
}

// Variance of the counts, for the Bernstein bounds: exact where the literature has a formula, above
// otherwise.
double count_variance(ThinningMethod method, double owed, double g, double residual_particles) {
  const double f = owed - std::floor(owed);
  switch (method) {
    case ThinningMethod::tbba:
    case ThinningMethod::systematic:
      return f * (1 - f);
    case ThinningMethod::residual:
      return f - (residual_particles > 0 ? f * f / residual_particles : 0);
    default:
      return owed * (1 - g);
  }
}

double residual_particles(const std::vector<double>& g, double N) {
  double left = 0;
  for (const double x : g) left += N * x - std::floor(N * x);
  return left;
}

}  // namespace

TEST_CASE("Counts are unbiased, valid, and spread as the method's formula says") {
  // H0: E o_i = N g_i for every site. 3000 draws; Bernstein over all sites, methods, orders and measures.
  // Where the variance has a closed form (all but stratified, for which multinomial's bounds it), the mean
  // squared deviation is tested too, by the central limit with the sample's own deviation.
  std::vector<double> gaps = normals(20, 5);
  gaps[3] = gaps[11] = -INFINITY;
  const std::vector<std::pair<Measure, std::size_t>> cases = {
      {Measure(normals(12, 1)), 7},
      {Measure(normals(30, 2), 2, 10), 100},
      {Measure({0, -3, -5, -2, -8}), 4},
      {Measure(std::vector<double>(9, -2.5), 3, 3), 6},
      {Measure(gaps), 1},
      {Measure(normals(15, 4), 1, 5), 15}};
  const std::size_t R = 3000;
  const double draws = R, comparisons = combinations * 2 * 91;
  for (const auto& [m, N] : cases) {
    const std::vector<double> g = m.normalised();
    const double n = static_cast<double>(N), left = residual_particles(g, n);
    for_every_method([&, &measure = m, &budget = N](Thinning& thinning, ThinningMethod method, SiteOrder) {
      Selection s;
      std::vector<double> sum(measure.size()), square(measure.size()), fourth(measure.size());
      for (std::uint32_t k = 0; k < R; ++k) {
        thinning.thin(measure, budget, {99, 0, k}, s);
        if (k < 20) require_valid(measure, budget, s);
        const auto count = counts_by_site(s, measure.size());
        for (std::size_t i = 0; i < measure.size(); ++i) {
          const double deviation = count[i] - n * g[i];
          sum[i] += count[i];
          square[i] += deviation * deviation;
          fourth[i] += std::pow(deviation, 4);
        }
      }
      for (std::size_t i = 0; i < measure.size(); ++i) {
        const double variance = count_variance(method, n * g[i], g[i], left);
        // 1e-12: N g in this test and in the library are rounded apart.
        CHECK(std::abs(sum[i] / draws - n * g[i]) <= bernstein_bound(variance, draws, comparisons) + 1e-12);
        if (draws * variance < 300) continue;
        const double deviation =
            std::sqrt(std::max(0.0, fourth[i] / draws - std::pow(square[i] / draws, 2)) / draws);
        const double excess = square[i] / draws - variance;
        if (method == ThinningMethod::stratified)
          CHECK(excess <= normal_bound(comparisons) * deviation);
        else
          CHECK(std::abs(excess) <= normal_bound(comparisons) * deviation);
      }
    });
  }
}

TEST_CASE("Counts are [N g] or the next integer where the method promises it") {
  const Measure m(normals(50, 6), 2, 25);
  const std::vector<double> g = m.normalised();
  for_every_method([&](Thinning& thinning, ThinningMethod method, SiteOrder) {
    Selection s;
    for (std::uint32_t k = 0; k < 200; ++k) {
      thinning.thin(m, 120, {7, 0, k}, s);
      const auto count = counts_by_site(s, m.size());
      for (std::size_t i = 0; i < m.size(); ++i) {
        const double owed = 120 * g[i];
        if (method == ThinningMethod::tbba || method == ThinningMethod::systematic)
          REQUIRE((count[i] >= std::floor(owed - 1e-12) && count[i] <= std::ceil(owed + 1e-12)));
        if (method == ThinningMethod::residual) REQUIRE(count[i] >= std::floor(owed - 1e-12));
        if (method == ThinningMethod::stratified) REQUIRE(std::abs(count[i] - owed) < 2);
      }
    }
  });
}

TEST_CASE("Multinomial counts have the multinomial law") {
  // H0: joint counts of 3 particles on 3 sites are multinomial (10 outcomes). 2^16 draws.
  const std::vector<double> g = {0.2, 0.5, 0.3};
  const Measure m({std::log(0.2), std::log(0.5), std::log(0.3)});
  const auto thinning = make_thinning({ThinningMethod::multinomial, SiteOrder::tree});
  std::map<std::vector<std::uint32_t>, double> observed;
  Selection s;
  for (std::uint32_t k = 0; k < 1 << 16; ++k) {
    thinning->thin(m, 3, {31, 0, k}, s);
    ++observed[counts_by_site(s, 3)];
  }
  std::vector<double> got, expected;
  for (const auto& [o, n] : observed) {
    double p = 6;
    for (std::size_t i = 0; i < 3; ++i) p *= std::pow(g[i], o[i]) / std::tgamma(o[i] + 1.0);
    got.push_back(n);
    expected.push_back(p * (1 << 16));
  }
  REQUIRE(got.size() == 10);
  CHECK(chi_square(got, expected) < chi_square_bound(9, 1));
}

TEST_CASE("Strata are drawn independently, the steps of systematic counts together") {
  // H0: 2 particles on 4 equal sites. Stratified: each half takes either of its sites, 4 equally likely
  // outcomes. Systematic: sites 0 and 2, or 1 and 3, each half of the time. 2^14 draws.
  const Measure m(std::vector<double>(4, 1.0));
  for (const ThinningMethod method : {ThinningMethod::stratified, ThinningMethod::systematic}) {
    const auto thinning = make_thinning({method, SiteOrder::tree});
    std::map<std::vector<std::uint32_t>, double> observed;
    Selection s;
    for (std::uint32_t k = 0; k < 1 << 14; ++k) {
      thinning->thin(m, 2, {32, 0, k}, s);
      ++observed[s.site];
    }
    std::vector<double> got;
    for (const auto& [sites, n] : observed) {
      CHECK((sites.size() == 2 && sites[0] < 2 && sites[1] >= 2));
      if (method == ThinningMethod::systematic) CHECK(sites[1] == sites[0] + 2);
      got.push_back(n);
    }
    REQUIRE(got.size() == (method == ThinningMethod::stratified ? 4 : 2));
    const std::vector<double> expected(got.size(), 16384.0 / static_cast<double>(got.size()));
    CHECK(chi_square(got, expected) < chi_square_bound(static_cast<double>(got.size()) - 1, 2));
  }
}

TEST_CASE("Nasty measures give valid selections") {
  std::vector<double> huge = normals(40, 8), wide = normals(500, 9), lone(30, -INFINITY),
                      tiny = normals(100, 10);
  for (double& l : huge) l += 1e6;
  for (double& l : wide) l *= 300;
  for (double& l : tiny) l -= 1e6;
  lone[17] = -12345.5;
  const std::vector<Measure> measures = {Measure(huge),
                                         Measure(wide, 2),
                                         Measure(lone),
                                         Measure(tiny, 5),
                                         Measure({0.0}),
                                         Measure({-INFINITY, 3.0}),
                                         Measure(normals(3000, 11), 4)};
  for_every_method([&](Thinning& thinning, ThinningMethod, SiteOrder) {
    Selection s;
    for (const Measure& m : measures)
      for (const std::size_t N : {1U, 2U, 3U, 64U, 1000U, 65536U}) {
        thinning.thin(m, N, {12, 0, static_cast<std::uint32_t>(N)}, s);
        require_valid(m, N, s);
      }
  });
}

TEST_CASE("A billion particles") {
  // Methods that draw once a particle take a few seconds for this: the others alone.
  const Measure m(normals(40, 13));
  for (const ThinningMethod method : {ThinningMethod::tbba, ThinningMethod::systematic,
                                      ThinningMethod::stratified, ThinningMethod::residual}) {
    Selection s;
    make_thinning({method, SiteOrder::spatial})->thin(m, 1000000000, {14}, s);
    require_valid(m, 1000000000, s);
  }
}

TEST_CASE("Selections are the same for the same stream, whatever was thinned before") {
  const Measure m(normals(300, 15), 3, 100), other(normals(1000, 16), 1);
  for_every_method([&](Thinning& thinning, ThinningMethod method, SiteOrder order) {
    Selection a, b, c;
    thinning.thin(m, 100, {1, 2, 3}, a);
    thinning.thin(other, 500, {4}, b);
    thinning.thin(m, 100, {1, 2, 3}, b);
    make_thinning({method, order})->thin(m, 100, {1, 2, 3}, c);
    CHECK(a.site == b.site);
    CHECK(a.count == b.count);
    CHECK(a.log_weight == b.log_weight);
    CHECK(a.site == c.site);
    thinning.thin(m, 100, {1, 2, 4}, b);
    CHECK(a.count != b.count);
  });
}

TEST_CASE("Sites come in the order visited") {
  const Measure line(normals(200, 17), 1, 50);
  for_every_method([&](Thinning& thinning, ThinningMethod, SiteOrder order) {
    Selection s;
    thinning.thin(line, 150, {5}, s);
    const auto place = [&](std::uint32_t i) {
      return order == SiteOrder::spatial ? line.x(0, i) : static_cast<double>(i % 50 * 4 + i / 50);
    };
    for (std::size_t k = 1; k < s.site.size(); ++k) REQUIRE(place(s.site[k - 1]) < place(s.site[k]));
  });
}

TEST_CASE("Without thinning every site of positive weight stays as it is") {
  std::vector<double> l = normals(100, 18);
  l[5] = l[50] = -INFINITY;
  const Measure m(l, 1, 25);
  Selection s;
  for (const SiteOrder order : orders) {
    make_thinning({ThinningMethod::none, order})->thin(m, 1, {}, s);
    REQUIRE(s.site.size() == 98);
    CHECK(s.count.empty());
    for (std::size_t k = 0; k < s.site.size(); ++k) REQUIRE(s.log_weight[k] == l[s.site[k]]);
    if (order == SiteOrder::spatial)
      for (std::size_t k = 1; k < s.site.size(); ++k) REQUIRE(m.x(0, s.site[k - 1]) < m.x(0, s.site[k]));
  }
}

TEST_CASE("Every method is made under its name, deterministic or not") {
  const std::pair<ThinningMethod, std::string_view> names[] = {
      {ThinningMethod::none, "none"},
      {ThinningMethod::tbba, "tbba"},
      {ThinningMethod::residual, "residual"},
      {ThinningMethod::multinomial, "multinomial"},
      {ThinningMethod::stratified, "stratified"},
      {ThinningMethod::systematic, "systematic"},
      {ThinningMethod::recombination, "recombination"}};
  for (const auto& [method, name] : names) {
    const auto thinning = make_thinning({.method = method});
    CHECK(thinning->name() == name);
    CHECK(thinning->deterministic() ==
          (method == ThinningMethod::none || method == ThinningMethod::recombination));
  }
}

TEST_CASE("Measures that cannot be thinned are refused") {
  for_every_method([&](Thinning& thinning, ThinningMethod, SiteOrder order) {
    Selection s;
    CHECK_THROWS_AS(thinning.thin(Measure({-INFINITY, -INFINITY}), 5, {}, s), RunError);
    CHECK_THROWS_AS(thinning.thin(Measure({0, NAN}), 5, {}, s), RunError);
    CHECK_THROWS_AS(thinning.thin(Measure({0, INFINITY}), 5, {}, s), RunError);
    CHECK_THROWS_AS(thinning.thin(Measure({}), 5, {}, s), RunError);
    CHECK_THROWS_AS(thinning.thin(Measure({0, 0}), 0, {}, s), InputError);
    CHECK_THROWS_AS(thinning.thin(Sites{Batch(1, 3), std::vector<double>(2), 0}, 5, {}, s), InputError);
    if (order == SiteOrder::tree)
      CHECK_THROWS_AS(thinning.thin(Measure(std::vector<double>(10), 1, 3), 5, {}, s), InputError);
  });
}
