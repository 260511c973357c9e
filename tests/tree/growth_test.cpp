// Growing a generation, selecting from it, and doing so without allocating.
#include "wienertree/tree/growth.hpp"

#include <atomic>
#include <bit>
#include <catch2/catch.hpp>
#include <cmath>

#include "allocations.hpp"
#include "wienertree/numeric/error.hpp"

using namespace wienertree;

namespace {

/// x_i += D_0 + x_i D_1 on all components; fails where component 0 exceeds a limit. What happens to a node
/// depends on its place in its block of `flow_block` nodes, as in a batched solver.
class Affine final : public Flow {
 public:
  explicit Affine(double limit = 1e300) : limit_(limit) {}
  void move(std::span<const double> D, BatchView x, std::vector<NodeFailure>& failures) override {
    for (std::size_t i = 0; i < x.components(); ++i)
      for (std::size_t n = 0; n < x.nodes(); ++n)
        x(i, n) += D[0] + x(i, n) * D[1] + 1e-3 * static_cast<double>(n % flow_block);
    for (std::size_t n = 0; n < x.nodes(); ++n) {
      if (!(x(0, n) > limit_)) continue;
      if (x(0, n) > 2 * limit_) throw RunError("far out", "flow");
      failures.push_back({n, 0, x(0, n), FailureReason::tolerance_not_reached, {}});
      x(0, n) = NAN;
    }
    statistics_.node_segments += x.nodes();
  }
  std::unique_ptr<Flow> clone() const override { return std::make_unique<Affine>(limit_); }
  std::string_view name() const override { return "affine"; }

 private:
  double limit_;
};

CubatureFormula three_paths() {
  CubatureFormula f{.name = "three", .degree = 3, .dimension = 1, .source = "test", .paths = {}};
  const auto add = [&](double weight, const Eigen::MatrixXd& increments) {
    f.paths.push_back({weight, increments});
  };
  Eigen::MatrixXd two(2, 2), one(2, 1);
  two << 0.5, 0.5, -1, -0.7;
  add(1.0 / 6, two);
  one << 1, 0;
  add(2.0 / 3, one);
  add(1.0 / 6, -two);
  return f;
}

Generation parents_of(std::size_t n, std::size_t d, bool likelihood = false) {
  Generation g;
  g.time = 2;
  g.states.reshape(d, n);
  for (std::size_t i = 0; i < d; ++i)
    RandomStream{1, 0, static_cast<std::uint32_t>(i)}.normals(0, g.states.component(i));
  g.log_weight.resize(n);
  RandomStream{2}.normals(0, g.log_weight);
  if (likelihood) {
    g.log_likelihood.resize(n);
    RandomStream{3}.normals(0, g.log_likelihood);
  }
  return g;
}

bool same_bytes(const Generation& a, const Generation& b) {
  for (std::size_t i = 0; i < a.states.components(); ++i)
    if (!std::equal(a.states.component(i).begin(), a.states.component(i).end(), b.states.component(i).begin(),
                    b.states.component(i).end(), [](double x, double y) {
                      return std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y);
                    }))
      return false;
  return a.time == b.time && a.log_weight == b.log_weight && a.log_likelihood == b.log_likelihood &&
         a.parent == b.parent && a.branch == b.branch && a.count == b.count;
}

}  // namespace

TEST_CASE("Children are branch-major, moved along their path, and weighted") {
  const CubatureFormula formula = three_paths();
  const Generation parents = parents_of(70, 2, true);
  TreeGrower grower(std::make_unique<Affine>(), formula, 1);
  Generation children;
  children.count = {1, 2, 3};
  std::vector<NodeFailure> failures(4);
  grower.grow(parents, 0.25, children, failures);
  CHECK(failures.empty());
  CHECK(children.time == 2.25);
  REQUIRE(children.size() == 210);
  CHECK(children.count.empty());
  for (std::size_t branch = 0; branch < 3; ++branch)
    for (std::size_t n = 0; n < 70; ++n) {
      const std::size_t child = branch * 70 + n;
      REQUIRE(children.parent[child] == n);
      REQUIRE(children.branch[child] == branch);
      REQUIRE(children.log_weight[child] == parents.log_weight[n] + std::log(formula.paths[branch].weight));
      REQUIRE(children.log_likelihood[child] == parents.log_likelihood[n]);
      for (std::size_t i = 0; i < 2; ++i) {
        double x = parents.states(i, n);
        for (Eigen::Index s = 0; s < formula.paths[branch].increments.cols(); ++s)
          x += 0.25 * formula.paths[branch].increments(0, s) +
               x * 0.5 * formula.paths[branch].increments(1, s) + 1e-3 * static_cast<double>(n % flow_block);
        REQUIRE(children.states(i, child) == Approx(x).epsilon(1e-14));
      }
    }
  CHECK(grower.statistics().node_segments == 70 * (2 + 1 + 2));
  grower.grow(parents_of(10, 2), 0.25, children, failures);
  CHECK(children.log_likelihood.empty());
  CHECK(grower.statistics().node_segments == 80 * 5);
}

TEST_CASE("The same bytes for any number of threads, failures included", "[threads]") {
  const CubatureFormula formula = three_paths();
  const Generation parents = parents_of(20011, 3, true);
  Generation one, many;
  std::vector<NodeFailure> failures_one, failures_many;
  TreeGrower(std::make_unique<Affine>(3.4), formula, 1).grow(parents, 0.01, one, failures_one);
  REQUIRE(failures_one.size() > 3);
  for (std::size_t k = 1; k < failures_one.size(); ++k)
    REQUIRE(failures_one[k - 1].node < failures_one[k].node);
  for (const NodeFailure& f : failures_one)
    for (std::size_t i = 0; i < 3; ++i)
      REQUIRE(one.states(i, f.node) == parents.states(i, one.parent[f.node]));
  for (const std::size_t threads : {2U, 3U, 7U}) {
    TreeGrower grower(std::make_unique<Affine>(3.4), formula, threads);
    grower.grow(parents, 0.01, many, failures_many);
    CHECK(same_bytes(one, many));
    REQUIRE(failures_many.size() == failures_one.size());
    for (std::size_t k = 0; k < failures_one.size(); ++k) {
      CHECK(failures_many[k].node == failures_one[k].node);
      CHECK(failures_many[k].value == failures_one[k].value);
    }
    CHECK(grower.statistics().node_segments == parents.size() * 5);
  }
}

TEST_CASE("A visitor sees every parent before its children, and every child moved") {
  const CubatureFormula formula = three_paths();
  const Generation parents = parents_of(20011, 2);
  Generation alone;
  std::vector<NodeFailure> failures;
  TreeGrower(std::make_unique<Affine>(), formula, 1).grow(parents, 0.01, alone, failures);
  struct Visitor final : FamilyVisitor {
    const Generation &expected, &seen;
    std::vector<int> parents_seen, children_seen;
    std::vector<std::size_t> visited_in;  // the thread of each parent
    std::atomic<bool> in_order{true}, moved{true};
    Visitor(const Generation& e, const Generation& s, std::size_t n)
        : expected(e), seen(s), parents_seen(n), children_seen(3 * n), visited_in(n) {}
    void parents(std::size_t first, std::size_t count, std::size_t thread) override {
      for (std::size_t n = first; n < first + count; ++n) ++parents_seen[n], visited_in[n] = thread;
    }
    void children(std::size_t first, std::size_t child, std::size_t count, std::size_t thread) override {
      for (std::size_t n = 0; n < count; ++n) {
        ++children_seen[child + n];
        if (parents_seen[first + n] != 1 || visited_in[first + n] != thread) in_order = false;
        if (seen.parent[child + n] != first + n || seen.states(1, child + n) != expected.states(1, child + n))
          moved = false;
      }
    }
  };
  for (const std::size_t threads : {1U, 3U}) {
    Generation children;
    Visitor visitor(alone, children, parents.size());
    TreeGrower(std::make_unique<Affine>(), formula, threads)
        .grow(parents, 0.01, children, failures, &visitor);
    CHECK(same_bytes(alone, children));
    CHECK(visitor.parents_seen == std::vector<int>(parents.size(), 1));
    CHECK(visitor.children_seen == std::vector<int>(3 * parents.size(), 1));
    CHECK(visitor.in_order);
    CHECK(visitor.moved);
  }
}

TEST_CASE("What a flow throws comes out of the growth", "[threads]") {
  for (const std::size_t threads : {1U, 3U}) {
    TreeGrower grower(std::make_unique<Affine>(1.0), three_paths(), threads);
    Generation children;
    std::vector<NodeFailure> failures;
    CHECK_THROWS_AS(grower.grow(parents_of(5000, 1), 0.01, children, failures), RunError);
  }
}

TEST_CASE("Growth without paths or with too few flows is refused") {
  Generation children;
  std::vector<NodeFailure> failures;
  CubatureFormula none = three_paths();
  none.paths.clear();
  CHECK_THROWS_AS(
      TreeGrower(std::make_unique<Affine>(), none, 1).grow(parents_of(3, 1), 1, children, failures),
      InputError);
  ThreadPool pool(2);
  std::vector<std::unique_ptr<Flow>> flows;
  flows.push_back(std::make_unique<Affine>());
  CHECK_THROWS_AS(grow(parents_of(3, 1), three_paths(), 1, flows, pool, children, failures), InputError);
}

TEST_CASE("A selection gathers its nodes") {
  Generation children, kept;
  std::vector<NodeFailure> failures;
  TreeGrower grower(std::make_unique<Affine>(), three_paths(), 1);
  grower.grow(parents_of(5, 2, true), 0.5, children, failures);
  Selection s;
  s.site = {12, 0, 7};
  s.log_weight = {-1, -2, -3};
  s.count = {4, 5, 6};
  select(children, s, kept);
  REQUIRE(kept.size() == 3);
  CHECK(kept.time == 2.5);
  CHECK(std::equal(s.log_weight.begin(), s.log_weight.end(), kept.log_weight.begin(), kept.log_weight.end()));
  CHECK(std::equal(s.count.begin(), s.count.end(), kept.count.begin(), kept.count.end()));
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(kept.parent[k] == children.parent[s.site[k]]);
    CHECK(kept.branch[k] == children.branch[s.site[k]]);
    CHECK(kept.log_likelihood[k] == children.log_likelihood[s.site[k]]);
    for (std::size_t i = 0; i < 2; ++i) CHECK(kept.states(i, k) == children.states(i, s.site[k]));
  }
  s.moved_states.reshape(2, 3);
  for (std::size_t k = 0; k < 3; ++k) s.moved_states(0, k) = s.moved_states(1, k) = static_cast<double>(k);
  select(children, s, kept);
  CHECK(kept.states(1, 2) == 2.0);
  CHECK(kept.parent[2] == children.parent[7]);
  s.site[1] = 15;
  CHECK_THROWS_AS(select(children, s, kept), InputError);

  Generation copy;
  copy_generation(children, copy);
  CHECK(same_bytes(children, copy));
}

TEST_CASE("Growing, thinning and selecting allocate nothing once warm") {
  const RandomStream random{4};
  for (const ThinningMethod method :
       {ThinningMethod::none, ThinningMethod::tbba, ThinningMethod::multinomial, ThinningMethod::residual,
        ThinningMethod::stratified, ThinningMethod::systematic})
    for (const SiteOrder order : {SiteOrder::tree, SiteOrder::spatial})
      for (const std::size_t d : {1U, 3U}) {
        const Generation parents = parents_of(3000, d);
        TreeGrower grower(std::make_unique<Affine>(), three_paths(), 1);
        const auto thinning = make_thinning({method, order});
        Generation children, survivors;
        Selection s;
        std::vector<NodeFailure> failures;
        const auto step = [&] {
          grower.grow(parents, 0.1, children, failures);
          thinning->thin({children.states, children.log_weight, parents.size()}, 3000, random, s);
          select(children, s, survivors);
        };
        step();
        step();
        const std::size_t before = test::allocations();
        step();
        CHECK(test::allocations() == before);
      }
}

TEST_CASE("On a line the next generation stays nearly sorted") {
  // Survivors in spatial order: the children of each branch are then one ascending run, since a flow on the
  // line keeps order, and the next sort merges them.
  Generation g = parents_of(1000, 1), children;
  std::vector<NodeFailure> failures;
  CubatureFormula formula = three_paths();
  TreeGrower grower(std::make_unique<Affine>(), formula, 1);
  const auto thinning = make_thinning({});
  Selection s;
  for (std::uint32_t step = 0; step < 5; ++step) {
    grower.grow(g, 0.01, children, failures);
    thinning->thin({children.states, children.log_weight, g.size()}, 1000, {5, 0, step}, s);
    select(children, s, g);
    for (std::size_t k = 1; k < g.size(); ++k) REQUIRE(g.states(0, k - 1) <= g.states(0, k));
  }
}
