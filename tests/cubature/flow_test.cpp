// One suite over every flow: exact, explicit and cvode.
#include <catch2/catch.hpp>

#include "cubature/flow_cases.hpp"
#include "wienertree/cubature/flow.hpp"

using namespace wienertree;
using namespace wienertree::test;

namespace {

Batch moved(Flow& flow, const std::vector<double>& D, ConstBatchView start) {
  Batch x = copy(start);
  std::vector<NodeFailure> failures;
  flow.move(D, x, failures);
  REQUIRE(failures.empty());
  return x;
}

bool is_stiff(const FlowCase& problem) {
  return problem.model.name == "stiff relaxation" || problem.model.name == "Van der Pol";
}

}  // namespace

// The promise is made for the local error, and the bound on it for an estimate of it. Observed: at most 0.9
// tolerances by the explicit flow, 3.3 by CVODE (whose steps are controlled one by one), 3e-5 by the closed
// form.
TEST_CASE("every flow keeps the error of a segment within ten tolerances") {
  for (const FlowCase& problem : flow_cases())
    for (const FlowMethod method : methods_for(problem.model))
      for (const double relative : {1e-6, 1e-8, 1e-10}) {
        const FlowTolerance tolerance{relative, 0.01 * relative};
        const auto flow = make_flow(method, problem.model, tolerance, 5);
        for (std::size_t k = 0; k < problem.segments.size(); ++k) {
          const Batch x = moved(*flow, problem.segments[k], problem.nodes);
          const double error = error_in_tolerances(x, problem.ends[k], tolerance);
          CAPTURE(problem.model.name, flow->name(), relative, k);
          CHECK(error <= 10);
        }
      }
}

TEST_CASE("a degree above five asks for the pair of order eight and keeps the tolerance") {
  const FlowCase& problem = flow_cases().front();
  const auto low = make_flow(FlowMethod::explicit_, problem.model, {}, 5),
             high = make_flow(FlowMethod::explicit_, problem.model, {}, 7);
  const Batch x = moved(*high, problem.segments[0], problem.nodes);
  moved(*low, problem.segments[0], problem.nodes);
  CHECK(error_in_tolerances(x, problem.ends[0], {}) <= 10);
  CHECK(high->statistics().field_evaluations == 13 * x.nodes());
  CHECK(low->statistics().field_evaluations == 6 * x.nodes());
}

// A rotation at speed w is as hard as w, and known. Alone or among easy nodes, the hard node must fare alike.
// With a norm that averages over the block of 64, CVODE's error grows 8-fold.
TEST_CASE("one hard node among ten thousand easy ones keeps its accuracy") {
  constexpr std::size_t nodes = 10000, hard = 5017;
  constexpr double speed = 40;
  const Model model = model_of("rotation", Rotation{}, {1.0, 0.0, 0.1});
  Batch start(3, nodes), alone(3, 1), end(3, 1);
  for (std::size_t n = 0; n < nodes; ++n) {
    start(0, n) = 1;
    start(1, n) = 0;
    start(2, n) = n == hard ? speed : 0.1;
  }
  for (std::size_t i = 0; i < 3; ++i) alone(i, 0) = start(i, hard);
  end(0, 0) = std::cos(speed);
  end(1, 0) = std::sin(speed);
  end(2, 0) = speed;
  const FlowTolerance tolerance;
  for (const FlowMethod method : {FlowMethod::explicit_, FlowMethod::cvode}) {
    const auto flow = make_flow(method, model, tolerance, 5);
    const Batch x = moved(*flow, {1.0, 0.0}, start), y = moved(*flow, {1.0, 0.0}, alone);
    const double among = error_in_tolerances(x.view().nodes(hard, 1), end, tolerance),
                 by_itself = error_in_tolerances(y, end, tolerance);
    CAPTURE(flow->name(), among, by_itself);
    CHECK(among <= 10);
    CHECK(among <= 1.5 * by_itself + 0.1);
  }
}

TEST_CASE("a segment and its reverse bring a node back") {
  for (const FlowCase& problem : flow_cases()) {
    if (is_stiff(problem)) continue;  // backwards, a stiff relaxation explodes
    for (const FlowMethod method : methods_for(problem.model)) {
      const FlowTolerance tolerance;
      const auto flow = make_flow(method, problem.model, tolerance, 5);
      std::vector<double> D = problem.segments[0], back = D;
      for (double& increment : back) increment = -increment;
      const Batch x = moved(*flow, back, moved(*flow, D, problem.nodes));
      CAPTURE(problem.model.name, flow->name());
      // Two segments, each within ten tolerances; the segment is short enough to magnify nothing.
      CHECK(error_in_tolerances(x, problem.nodes, tolerance) <= 20);
    }
  }
}

TEST_CASE("two halves of a segment make the whole") {
  for (const FlowCase& problem : flow_cases())
    for (const FlowMethod method : methods_for(problem.model)) {
      const FlowTolerance tolerance;
      const auto flow = make_flow(method, problem.model, tolerance, 5);
      std::vector<double> half = problem.segments[1];
      for (double& increment : half) increment /= 2;
      const Batch x = moved(*flow, half, moved(*flow, half, problem.nodes));
      CAPTURE(problem.model.name, flow->name());
      CHECK(error_in_tolerances(x, problem.ends[1], tolerance) <= 20);
    }
}

TEST_CASE("a path is the composition of its scaled segments") {
  for (const FlowCase& problem : flow_cases())
    for (const FlowMethod method : methods_for(problem.model)) {
      CubaturePath path;
      path.weight = 1;
      path.increments.resize(static_cast<Eigen::Index>(problem.segments[0].size()), 3);
      for (Eigen::Index i = 0; i < path.increments.rows(); ++i)
        path.increments.row(i) << 1.0 / 3, -0.2 / (1.0 + double(i)), 0.4 * double(i);
      const auto flow = make_flow(method, problem.model, {}, 5);
      Batch along = copy(problem.nodes), step_by_step = copy(problem.nodes);
      std::vector<NodeFailure> failures;
      const double s = 0.02;
      flow->move_along(path, s, along, failures);
      for (std::size_t segment = 0; segment < 3; ++segment) {
        std::vector<double> D(problem.segments[0].size());
        scaled_increments(path, segment, s, D);
        flow->move(D, step_by_step, failures);
      }
      REQUIRE(failures.empty());
      CHECK(same_bytes(along, step_by_step));
    }
}

TEST_CASE("results are the same bytes for any split at multiples of flow_block, and for clones") {
  for (const FlowCase& problem : flow_cases())
    for (const FlowMethod method : methods_for(problem.model)) {
      Batch start(problem.nodes.components(), 5 * flow_block + 7);
      for (std::size_t i = 0; i < start.components(); ++i)
        for (std::size_t n = 0; n < start.nodes(); ++n)
          start(i, n) = problem.nodes(i, n % problem.nodes.nodes());
      const auto flow = make_flow(method, problem.model, {}, 5), other = flow->clone();
      CHECK(flow->name() == other->name());
      const std::vector<double>& D = problem.segments[1];
      const Batch whole = moved(*flow, D, start);
      CHECK(same_bytes(whole, moved(*flow, D, start)));
      Batch parts = copy(start);
      std::vector<NodeFailure> failures;
      for (const auto& [first, count] : {std::pair{3 * flow_block, 2 * flow_block + 7},
                                         {std::size_t{0}, flow_block},
                                         {flow_block, 2 * flow_block}})
        other->move(D, parts.view().nodes(first, count), failures);
      CAPTURE(problem.model.name, flow->name());
      CHECK(same_bytes(whole, parts));
    }
}

// Stronger than promised: the lanes of the explicit flow never mix.
TEST_CASE("what the explicit flow makes of a node does not depend on the others at all") {
  for (const FlowCase& problem : flow_cases()) {
    const auto flow = make_flow(FlowMethod::explicit_, problem.model, {}, 5);
    const std::vector<double>& D = problem.segments[1];
    const Batch whole = moved(*flow, D, problem.nodes);
    if (flow->statistics().cvode_nodes > 0) continue;
    for (std::size_t n = 0; n < whole.nodes(); n += 3) {
      const Batch one = moved(*flow, D, problem.nodes.view().nodes(n, 1));
      REQUIRE(same_bytes(one, whole.view().nodes(n, 1)));
    }
  }
}

TEST_CASE("statistics count what was done") {
  const FlowCase &easy = flow_cases().front(), &stiff = flow_cases().back();
  const auto flow = make_flow(FlowMethod::explicit_, easy.model, {}, 5);
  moved(*flow, easy.segments[0], easy.nodes);
  moved(*flow, easy.segments[0], easy.nodes);
  CHECK(flow->statistics().node_segments == 2 * easy.nodes.nodes());
  CHECK(flow->statistics().cvode_nodes == 0);
  CHECK(flow->clone()->statistics().node_segments == 0);

  const auto helped = make_flow(FlowMethod::explicit_, stiff.model, {}, 5);
  moved(*helped, stiff.segments[0], stiff.nodes);
  CHECK(helped->statistics().node_segments == stiff.nodes.nodes());
  CHECK(helped->statistics().cvode_nodes == stiff.nodes.nodes());

  const auto cvode = make_flow(FlowMethod::cvode, easy.model, {}, 5);
  moved(*cvode, easy.segments[0], easy.nodes);
  CHECK(cvode->statistics().cvode_nodes == easy.nodes.nodes());
  FlowStatistics sum = flow->statistics();
  sum += cvode->statistics();
  CHECK(sum.node_segments == 3 * easy.nodes.nodes());
  CHECK(sum.field_evaluations ==
        flow->statistics().field_evaluations + cvode->statistics().field_evaluations);
}

TEST_CASE("make_flow chooses and refuses") {
  const Model closed = flow_cases()[1].model, open = flow_cases()[0].model;
  CHECK(make_flow(FlowMethod::automatic, closed, {}, 5)->name() == "exact");
  CHECK(make_flow(FlowMethod::automatic, open, {}, 5)->name() == "explicit");
  CHECK(make_flow(FlowMethod::cvode, closed, {}, 5)->name() == "cvode");
  CHECK_THROWS_WITH(make_flow(FlowMethod::exact, open, {}, 5),
                    Catch::Contains("tanh") && Catch::Contains("auto, explicit, cvode"));
  CHECK_THROWS_AS(make_flow(FlowMethod::exact, open, {}, 5), InputError);
  for (const double bad : {0.0, -1e-8, std::nan(""), HUGE_VAL}) {
    CHECK_THROWS_AS(make_flow(FlowMethod::explicit_, open, {bad, 1e-10}, 5), InputError);
    CHECK_THROWS_AS(make_flow(FlowMethod::cvode, open, {1e-8, bad}, 5), InputError);
  }
  CHECK_THROWS_AS(make_flow(FlowMethod::explicit_, open, {}, 0), InputError);
}
