/// Patched recombination through its public face, for both ways of reducing a patch.
#include <catch2/catch.hpp>
#include <cstring>

#include "thinning/recombination_clouds.hpp"
#include "wienertree/numeric/error.hpp"

using namespace wienertree;
using namespace wienertree::recombination_test;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// What the moments may lose: 1e-12 of the mass, and the rounding of log-weights of size l, 2 epsilon l each.
double tolerance(const Cloud& c) {
  double largest = 0;
  for (const double l : c.log_weight)
    if (std::isfinite(l)) largest = std::max(largest, std::abs(l));
  return 1e-12 + 5e-16 * largest;
}

void check(const Cloud& c, int degree, std::size_t budget) {
  const Selection s = recombine(c, degree, budget);
  CAPTURE(c.x.components(), c.size(), degree, budget, s.site.size());
  REQUIRE(defect(c, s, budget) == "");
  REQUIRE(moment_difference(c, selected(c, s), degree) <= tolerance(c));
}

std::vector<std::vector<double>> as_sorted_rows(const Cloud& c) {
  std::vector<std::vector<double>> rows;
  for (std::size_t j = 0; j < c.size(); ++j) {
    std::vector<double> row;
    for (std::size_t i = 0; i < c.x.components(); ++i) row.push_back(c.x(i, j));
    row.push_back(c.log_weight[j]);
    rows.push_back(row);
  }
  std::sort(rows.begin(), rows.end());
  return rows;
}

}  // namespace

TEST_CASE("Moments are kept, weights stay positive, the budget is respected: d = 1..6, r = 1..7") {
  // Every dimension and degree with at most 130 moments; one patch, a few, and many.
  for (std::size_t d = 1; d <= 6; ++d)
    for (int r = 1; r <= 7; ++r) {
      const std::size_t q = moment_number(d, r, 1000);
      if (q > 130) continue;
      for (const std::size_t patches : {1, 5, 20}) {
        if (q > 60 && patches > 5) continue;
        check(normal_cloud(d, patches * q * 5 + 3, 100 * d + static_cast<std::size_t>(r)), r, patches * q);
      }
    }
}

TEST_CASE("The chosen degree keeps mass and mean, and its own moments") {
  for (std::size_t d = 1; d <= 6; ++d)
    for (const std::size_t budget : {d + 1, std::size_t{8}, std::size_t{40}, std::size_t{300}}) {
      const Cloud c = normal_cloud(d, 9 * budget + 50, 11 * d + budget);
      const Selection s = recombine(c, 0, budget);
      CAPTURE(d, budget);
      REQUIRE(defect(c, s, budget) == "");
      const int degree = d == 1 ? 3 : recombination_degree(d, budget);
      REQUIRE(moment_difference(c, selected(c, s), degree) <= tolerance(c));
    }
}

TEST_CASE("A budget below 1 + d keeps the mass, near the means") {
  const Cloud c = normal_cloud(4, 500, 5);
  for (std::size_t budget = 1; budget <= 4; ++budget)
    for (const int degree : {0, 1, 3}) {
      const Selection s = recombine(c, degree, budget);
      REQUIRE(defect(c, s, budget) == "");
      REQUIRE(s.site.size() == budget);
      REQUIRE(s.discarded > 0);
      // The mean moves by less than the points are wide.
      REQUIRE(moment_difference(c, selected(c, s), 1) < 0.3);
    }
}

TEST_CASE("What fits into the budget is kept as it is") {
  Cloud c = normal_cloud(3, 50, 9);
  c.log_weight[7] = c.log_weight[31] = -infinity;
  for (const std::size_t budget : {48, 49, 1000}) {
    const Selection s = recombine(c, 0, budget);
    REQUIRE(s.site.size() == 48);
    REQUIRE(defect(c, s, budget) == "");
    REQUIRE(s.moved_states.nodes() == 0);
    REQUIRE(s.discarded == 0);
    for (std::size_t k = 0; k < 48; ++k) REQUIRE(s.log_weight[k] == c.log_weight[s.site[k]]);
  }
  REQUIRE(recombine(c, 0, 47).site.size() <= 47);
}

TEST_CASE("Two calls give the same bytes, whatever was thinned before") {
  for (const std::size_t d : {1, 2, 3}) {
    const Cloud c = normal_cloud(d, 3000, 77), other = normal_cloud(d == 3 ? 2 : 3, 700, 78);
    Selection first, second;
    make_recombination(0)->thin(c.sites(), 200, {}, first);
    const auto used = make_recombination(0);
    used->thin(other.sites(), 90, {}, second);
    used->thin(c.sites(), 200, {}, second);
    REQUIRE(first.site == second.site);
    REQUIRE(std::memcmp(first.log_weight.data(), second.log_weight.data(), 8 * first.site.size()) == 0);
    REQUIRE(first.moved_states.nodes() == second.moved_states.nodes());
    for (std::size_t k = 0; k < first.moved_states.nodes(); ++k)
      REQUIRE(first.moved_states(0, k) == second.moved_states(0, k));
    REQUIRE(first.discarded == second.discarded);
  }
}

TEST_CASE("The order of the sites does not matter") {
  for (const std::size_t d : {1, 2, 4}) {
    const Cloud c = normal_cloud(d, 1500, 31 + d);
    Cloud shuffled = c;
    std::vector<std::size_t> order(c.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const RandomStream random{d};
    for (std::size_t i = order.size() - 1; i > 0; --i)
      std::swap(order[i], order[static_cast<std::size_t>(random.uniform(i) * static_cast<double>(i + 1))]);
    for (std::size_t j = 0; j < c.size(); ++j) {
      for (std::size_t i = 0; i < d; ++i) shuffled.x(i, j) = c.x(i, order[j]);
      shuffled.log_weight[j] = c.log_weight[order[j]];
    }
    const Selection a = recombine(c, 0, 100), b = recombine(shuffled, 0, 100);
    REQUIRE(as_sorted_rows(selected(c, a)) == as_sorted_rows(selected(shuffled, b)));
  }
}

TEST_CASE("Log-weights of any size") {
  for (const std::size_t d : {1, 2, 3}) {
    const Cloud c = normal_cloud(d, 800, 3);
    const Selection plain = recombine(c, 3, 60);
    for (const double shift : {1e6, -1e6}) {
      Cloud shifted = c;
      for (double& l : shifted.log_weight) l += shift;
      check(shifted, 3, 60);
      const Selection s = recombine(shifted, 3, 60);
      if (d > 1) REQUIRE(s.site == plain.site);
    }
    // Spans of 1e-300 and beyond: what lies below the rounding of a patch's mass may go, nothing turns
    // negative.
    for (const double depth : {40.0, 700.0, 1e4, 1e6}) {
      check(normal_cloud(d, 800, 4, depth), 3, 60);
      check(normal_cloud(d, 800, 4, depth), 0, 100);
    }
  }
}

TEST_CASE("Degenerate clouds") {
  SECTION("all points equal") {
    Cloud c = normal_cloud(3, 100, 1);
    for (std::size_t i = 0; i < 3; ++i) std::fill_n(c.x.component(i).begin(), 100, 0.1);
    const Selection s = recombine(c, 0, 20);
    REQUIRE(s.site.size() == 1);
    REQUIRE(defect(c, s, 20) == "");
  }
  SECTION("one point") {
    const Cloud c = normal_cloud(2, 1, 1);
    REQUIRE(recombine(c, 0, 1).site.size() == 1);
  }
  SECTION("one point of positive weight") {
    Cloud c = normal_cloud(2, 9, 1);
    for (std::size_t j = 0; j < 9; ++j)
      if (j != 4) c.log_weight[j] = -infinity;
    const Selection s = recombine(c, 0, 1);
    REQUIRE(s.site == std::vector<std::uint32_t>{4});
    REQUIRE(s.log_weight[0] == c.log_weight[4]);
  }
  SECTION("duplicated points") {
    for (const std::size_t d : {1, 2, 3}) {
      Cloud c = normal_cloud(d, 1200, 2);
      for (std::size_t j = 0; j < c.size(); ++j)
        for (std::size_t i = 0; i < d; ++i) c.x(i, j) = c.x(i, j % 7);
      check(c, 3, 40);
    }
  }
  SECTION("points on a line of the plane and of space") {
    for (const std::size_t d : {2, 3}) {
      Cloud c = normal_cloud(d, 900, 3);
      for (std::size_t j = 0; j < c.size(); ++j)
        for (std::size_t i = 1; i < d; ++i) c.x(i, j) = (1 + static_cast<double>(i)) * c.x(0, j) - 0.5;
      for (int r = 1; r <= 5; ++r) {
        check(c, r, moment_number(d, r, 1000));
        check(c, r, 3 * moment_number(d, r, 1000));
      }
    }
  }
  SECTION("points on a circle: quadrics are dependent, but no component is") {
    Cloud c = normal_cloud(2, 900, 3);
    for (std::size_t j = 0; j < c.size(); ++j) {
      const double angle = c.x(0, j);
      c.x(0, j) = std::cos(angle);
      c.x(1, j) = std::sin(angle);
    }
    for (int r = 2; r <= 5; ++r) check(c, r, moment_number(2, r, 1000));
  }
  SECTION("a grid") {
    Cloud c = normal_cloud(2, 900, 3, 0);
    for (std::size_t j = 0; j < c.size(); ++j) {
      c.x(0, j) = static_cast<double>(j % 30);
      c.x(1, j) = static_cast<double>(j / 30);
    }
    for (int r = 1; r <= 5; ++r) check(c, r, 5 * moment_number(2, r, 1000));
  }
  SECTION("components of very different scale and offset") {
    Cloud c = normal_cloud(3, 900, 3);
    for (std::size_t j = 0; j < c.size(); ++j) {
      c.x(0, j) = 1e8 + c.x(0, j);
      c.x(1, j) *= 1e-9;
      c.x(2, j) *= 1e12;
    }
    check(c, 3, 100);
  }
  SECTION("an outlier far away") {
    for (const std::size_t d : {1, 2}) {
      Cloud c = normal_cloud(d, 900, 3);
      c.x(0, 17) = 1e9;
      check(c, 3, 60);
      c.log_weight[17] = -600;
      check(c, 3, 60);
    }
  }
  SECTION("weights that fall geometrically in space") {
    for (const std::size_t d : {1, 2}) {
      Cloud c = normal_cloud(d, 5000, 3);
      for (std::size_t j = 0; j < c.size(); ++j) {
        c.x(0, j) = static_cast<double>(j);
        c.log_weight[j] = -0.7 * static_cast<double>(j);
      }
      check(c, 3, 200);
    }
  }
}

TEST_CASE("A clock leaves the line to Gauss, and its value alone") {
  Cloud c = normal_cloud(2, 400, 8);
  std::fill_n(c.x.component(1).begin(), c.size(), 3.25);
  const Selection s = recombine(c, 0, 24);
  REQUIRE(defect(c, s, 24) == "");
  REQUIRE(s.moved_states.nodes() == s.site.size());
  Cloud line{Batch(1, c.size()), c.log_weight};
  std::copy_n(c.x.component(0).begin(), c.size(), line.x.component(0).begin());
  const Selection t = recombine(line, 0, 24);
  REQUIRE(s.site == t.site);
  for (std::size_t k = 0; k < s.site.size(); ++k) {
    REQUIRE(s.moved_states(0, k) == t.moved_states(0, k));
    REQUIRE(s.moved_states(1, k) == 3.25);
    if (k > 0) REQUIRE(s.moved_states(0, k) > s.moved_states(0, k - 1));
  }
}

TEST_CASE("Nodes placed anew come with a site nearby") {
  const Cloud c = normal_cloud(1, 600, 12);
  const Selection s = recombine(c, 0, 60);
  for (std::size_t k = 0; k < s.site.size(); ++k) {
    // No further than the gap between neighbouring nodes on either side.
    const double x = s.moved_states(0, k), left = k > 0 ? s.moved_states(0, k - 1) : -infinity,
                 right = k + 1 < s.site.size() ? s.moved_states(0, k + 1) : infinity;
    REQUIRE((c.x(0, s.site[k]) > left && c.x(0, s.site[k]) < right));
    REQUIRE(std::abs(c.x(0, s.site[k]) - x) < 0.5);
  }
}

TEST_CASE("The error of a smooth integral falls with the number of nodes, and `discarded` with it") {
  for (const std::size_t d : {1, 2, 3}) {
    const Cloud c = normal_cloud(d, 40'000, 19, 1);
    const auto integral = [](const Cloud& m) {
      long double sum = 0, mass = 0;
      for (std::size_t j = 0; j < m.size(); ++j) {
        double phase = 0.3;
        for (std::size_t i = 0; i < m.x.components(); ++i) phase += 2 * m.x(i, j);
        const long double w = std::exp(static_cast<long double>(m.log_weight[j]));
        sum += w * std::sin(phase);
        mass += w;
      }
      return static_cast<double>(sum / mass);
    };
    // Degree r: a patch's error is mass x width^(r+1), so that of K patches K^(-(r+1)/d). A factor 8 in N
    // gives 8^(4/d) / 3 at the least for r = 3, with a margin of 3 for what the moments of degree 4 happen to
    // be.
    const Selection few = recombine(c, 3, 120), many = recombine(c, 3, 960);
    const double coarse = std::abs(integral(selected(c, few)) - integral(c)),
                 fine = std::abs(integral(selected(c, many)) - integral(c));
    CAPTURE(d, coarse, fine, few.discarded, many.discarded);
    REQUIRE(coarse < 0.1);
    REQUIRE(fine < coarse / (std::pow(8.0, 4.0 / static_cast<double>(d)) / 3));
    REQUIRE((many.discarded > 0 && many.discarded < few.discarded / 4));
  }
}

TEST_CASE("The degree that goes with dimension and budget") {
  REQUIRE(recombination_degree(2, 640) == 5);
  REQUIRE(recombination_degree(2, 100) == 3);
  REQUIRE(recombination_degree(2, 30) == 2);
  REQUIRE(recombination_degree(2, 3) == 1);
  REQUIRE(recombination_degree(2, 2) == 0);
  REQUIRE(recombination_degree(3, 640) == 3);
  REQUIRE(recombination_degree(3, 60) == 2);
  REQUIRE(recombination_degree(4, 640) == 3);
  REQUIRE(recombination_degree(10, 640) == 2);
  REQUIRE(recombination_degree(10, 100) == 1);
  REQUIRE(recombination_degree(10, 10) == 0);
  REQUIRE(moment_number(2, 5, 1000) == 21);
  REQUIRE(moment_number(3, 3, 1000) == 20);
  REQUIRE(moment_number(10, 7, 1000) == 1000);
  REQUIRE(moment_number(6, 0, 1000) == 1);
}

TEST_CASE("What cannot be thinned is refused with its place") {
  Cloud c = normal_cloud(2, 30, 6);
  Selection s;
  const auto thinning = make_recombination(0);
  REQUIRE(thinning->deterministic());
  REQUIRE(thinning->name() == "recombination");
  REQUIRE_THROWS_AS(make_recombination(-1), InputError);
  REQUIRE_THROWS_AS(thinning->thin(c.sites(), 0, {}, s), InputError);
  REQUIRE_THROWS_AS(thinning->thin({c.x.view().nodes(0, 29), c.log_weight, 0}, 5, {}, s), InputError);
  for (const double bad : {std::nan(""), infinity}) {
    Cloud broken = c;
    broken.log_weight[11] = bad;
    REQUIRE_THROWS_WITH(thinning->thin(broken.sites(), 5, {}, s), Catch::Contains("site 11 of 30"));
    broken = c;
    broken.x(1, 12) = bad;
    REQUIRE_THROWS_WITH(thinning->thin(broken.sites(), 5, {}, s),
                        Catch::Contains("component 1 of the state of site 12"));
    broken.log_weight[12] = -infinity;  // a site without weight may be anywhere
    thinning->thin(broken.sites(), 5, {}, s);
    REQUIRE(defect(broken, s, 5) == "");
  }
  std::fill(c.log_weight.begin(), c.log_weight.end(), -infinity);
  REQUIRE_THROWS_AS(thinning->thin(c.sites(), 5, {}, s), RunError);
}
