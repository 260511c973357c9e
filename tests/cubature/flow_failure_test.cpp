// Nodes that cannot be moved, and the bounds of a model.
#include <catch2/catch.hpp>

#include <limits>

#include "cubature/flow_cases.hpp"
#include "wienertree/cubature/flow.hpp"

using namespace wienertree;
using namespace wienertree::test;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

Batch row(const std::vector<double>& values) {
  Batch x(1, values.size());
  std::copy(values.begin(), values.end(), x.component(0).begin());
  return x;
}

Model square_root(Boundary boundary) {
  Model model = model_of("square root", SquareRoot{}, {0.3});
  model.bounds[0] = {0.0, infinity, boundary};
  return model;
}

Model bounded_ornstein_uhlenbeck(StateBound bound) {
  Model model = model_with("Ornstein-Uhlenbeck", std::make_shared<OrnsteinUhlenbeckFields>(), {0.0});
  model.bounds[0] = bound;
  return model;
}

}  // namespace

TEST_CASE("a node that is not finite is reported and leaves its neighbours alone") {
  for (const FlowCase& problem : flow_cases())
    for (const FlowMethod method : methods_for(problem.model))
      for (const double value : {std::nan(""), infinity}) {
        constexpr std::size_t bad = 3;
        const std::size_t last = problem.nodes.components() - 1;
        const auto flow = make_flow(method, problem.model, {}, 5);
        Batch x = copy(problem.nodes);
        x(last, bad) = value;
        // For CVODE, as for the stiff nodes of the explicit flow, the nodes of a block depend on each other:
        // they must move as if the bad one were not in the block.
        const std::size_t in_block = std::min(flow_block, x.nodes());
        Batch without(x.components(), in_block - 1);
        for (std::size_t i = 0; i < x.components(); ++i)
          for (std::size_t n = 0; n < without.nodes(); ++n) without(i, n) = x(i, n < bad ? n : n + 1);
        std::vector<NodeFailure> failures, none;
        flow->move(problem.segments[0], x, failures);
        flow->move(problem.segments[0], without, none);
        CAPTURE(problem.model.name, flow->name(), value);
        REQUIRE(failures.size() == 1);
        CHECK(none.empty());
        CHECK(failures[0].node == bad);
        CHECK(failures[0].state == last);
        CHECK(failures[0].reason == FailureReason::not_finite);
        CHECK(!std::isfinite(failures[0].value));
        for (std::size_t i = 0; i < x.components(); ++i) CHECK(std::isnan(x(i, bad)));
        CHECK(same_bytes(x.view().nodes(0, bad), without.view().nodes(0, bad)));
        CHECK(same_bytes(x.view().nodes(bad + 1, in_block - 1 - bad),
                         without.view().nodes(bad, in_block - 1 - bad)));
      }
}

TEST_CASE("a node that blows up on the way is reported and leaves its neighbours alone") {
  const Model model = model_of("blow-up", BlowUp{}, {0.1});
  for (const FlowMethod method : {FlowMethod::explicit_, FlowMethod::cvode}) {
    const auto flow = make_flow(method, model, {}, 5);
    Batch x = row({0.1, 0.2, 2.0, -0.5, 3.0, 0.3}), without = row({0.1, 0.2, -0.5, 0.3});
    std::vector<NodeFailure> failures, none;
    flow->move(std::vector{1.0, 0.0}, x, failures);
    flow->move(std::vector{1.0, 0.0}, without, none);
    CAPTURE(flow->name());
    REQUIRE(failures.size() == 2);
    CHECK(none.empty());
    CHECK(failures[0].node == 2);
    CHECK(failures[1].node == 4);
    CHECK(!failures[0].message.empty());  // CVODE's words
    CHECK(std::isnan(x(0, 2)));
    for (const auto& [n, m] : {std::pair{0, 0}, {1, 1}, {3, 2}, {5, 3}}) {
      CHECK(x(0, std::size_t(n)) == without(0, std::size_t(m)));
      const double start = n == 0 ? 0.1 : n == 1 ? 0.2 : n == 3 ? -0.5 : 0.3;
      CHECK(x(0, std::size_t(n)) == Approx(start / (1 - start)).epsilon(1e-7));
    }
  }
}

TEST_CASE("a path reports a failed node once") {
  CubaturePath path;
  path.increments = Eigen::MatrixXd::Constant(2, 3, 0.3);
  const Model model = model_of("blow-up", BlowUp{}, {0.1});
  for (const FlowMethod method : {FlowMethod::explicit_, FlowMethod::cvode}) {
    Batch x = row({0.1, 4.0, 1.2, std::nan("")});
    std::vector<NodeFailure> failures(1);  // of an earlier call: stays
    failures[0].node = 1;
    make_flow(method, model, {}, 5)->move_along(path, 1.0, x, failures);
    REQUIRE(failures.size() == 4);
    CHECK(failures[1].node == 1);  // on the first segment
    CHECK(failures[2].node == 2);  // on a later one
    CHECK(failures[3].node == 3);
    CHECK(std::isfinite(x(0, 0)));
  }
}

// Along D = (0, D_1) the square root of x moves by xi D_1 / 2 until it is 0.
TEST_CASE("a clamped node stops at its bound and can leave it again") {
  const Model model = square_root(Boundary::clamp);
  const FlowTolerance tolerance;
  for (const FlowMethod method : {FlowMethod::explicit_, FlowMethod::cvode}) {
    const auto flow = make_flow(method, model, tolerance, 5);
    Batch x = row({1.0, 0.04, 0.0, 0.25, 1e-6});
    std::vector<NodeFailure> failures;
    flow->move(std::vector{0.0, -1.0}, x, failures);
    CAPTURE(flow->name());
    REQUIRE(failures.empty());
    CHECK(x(0, 0) == Approx(0.25).epsilon(1e-7));
    for (std::size_t n = 1; n < x.nodes(); ++n) {
      CHECK(x(0, n) >= 0.0);
      CHECK(x(0, n) <= 10 * tolerance.absolute);
    }
    // Beyond the bound the fields are those of the bound: dx/du = D_0 (kappa theta - xi^2 / 4 - kappa x) + 0,
    // upwards for theta = 1/2.
    Model upwards = model_of("square root", SquareRoot{1.0, 0.5, 1.0}, {0.3});
    upwards.bounds = model.bounds;
    x = row({0.0, 0.5});
    make_flow(method, upwards, tolerance, 5)->move(std::vector{0.1, 0.0}, x, failures);
    REQUIRE(failures.empty());
    CHECK(x(0, 0) == Approx(0.25 * (1 - std::exp(-0.1))).epsilon(1e-7));
  }
}

TEST_CASE("an absorbed node stays on its bound") {
  for (const FlowMethod method : {FlowMethod::explicit_, FlowMethod::cvode, FlowMethod::exact}) {
    const Model model = bounded_ornstein_uhlenbeck({-1.0, 2.0, Boundary::absorb});
    const auto flow = make_flow(method, model, {}, 5);
    Batch x = row({0.0, -0.9, 1.9});
    std::vector<NodeFailure> failures;
    flow->move(std::vector{0.1, -1.0}, x, failures);
    CAPTURE(flow->name());
    CHECK(x(0, 1) == -1.0);
    flow->move(std::vector{0.1, 3.0}, x, failures);
    CHECK(x(0, 0) > -0.5);
    CHECK(x(0, 1) == -1.0);
    flow->move(std::vector{0.1, 3.0}, x, failures);
    flow->move(std::vector{0.1, -3.0}, x, failures);
    CHECK(x(0, 2) == 2.0);
    CHECK(failures.empty());
  }
}

TEST_CASE("the other components of an absorbed node move on") {
  Model model = model_of("linear", Linear3{}, {0.5, 0.5, 0.5});
  model.bounds[1] = {0.0, infinity, Boundary::absorb};
  for (const FlowMethod method : {FlowMethod::explicit_, FlowMethod::cvode}) {
    Batch x(3, 1);
    x(0, 0) = 1.0;
    x(1, 0) = 0.0;
    x(2, 0) = 0.0;
    std::vector<NodeFailure> failures;
    make_flow(method, model, {}, 5)->move(std::vector{1.0, 0.0, 0.0}, x, failures);
    REQUIRE(failures.empty());
    CHECK(x(1, 0) == 0.0);
    CHECK(x(0, 0) == Approx(std::exp(-0.5)).epsilon(1e-7));
    CHECK(x(2, 0) == 0.0);
  }
}

TEST_CASE("a node that leaves an error bound is reported where it is") {
  for (const FlowMethod method : {FlowMethod::explicit_, FlowMethod::cvode, FlowMethod::exact}) {
    const Model model = bounded_ornstein_uhlenbeck({-1.0, 1.0, Boundary::error});
    const auto flow = make_flow(method, model, {}, 5);
    Batch x = row({0.0, 0.9, -0.9});
    std::vector<NodeFailure> failures;
    flow->move(std::vector{0.0, 1.0}, x, failures);
    CAPTURE(flow->name());
    REQUIRE(failures.size() == 1);
    CHECK(failures[0].node == 1);
    CHECK(failures[0].state == 0);
    CHECK(failures[0].reason == FailureReason::left_bounds);
    CHECK(failures[0].value == Approx(1.6));
    CHECK(x(0, 1) == failures[0].value);
  }
}

TEST_CASE("a node whose field ends at an error bound is reported as leaving it") {
  for (const FlowMethod method : {FlowMethod::explicit_, FlowMethod::cvode}) {
    const Model model = square_root(Boundary::error);
    const auto flow = make_flow(method, model, {}, 5);
    Batch x = row({1.0, 0.04, 0.5});
    std::vector<NodeFailure> failures;
    flow->move(std::vector{0.0, -1.0}, x, failures);
    CAPTURE(flow->name());
    REQUIRE(failures.size() == 1);
    CHECK(failures[0].node == 1);
    CHECK(failures[0].reason == FailureReason::left_bounds);
    CHECK(failures[0].value < 0.0);
    CHECK(x(0, 0) == Approx(0.25).epsilon(1e-7));
    CHECK(std::abs(x(0, 1)) < 1e-3);  // where the integration stopped
  }
}
