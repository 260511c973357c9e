// The flows allocate nothing once they are warm.
#include <catch2/catch.hpp>

#include "allocations.hpp"
#include "cubature/flow_cases.hpp"
#include "wienertree/cubature/flow.hpp"

using namespace wienertree;
using namespace wienertree::test;

TEST_CASE("moving nodes allocates nothing after the first time") {
  for (const FlowCase& problem : flow_cases())
    for (const FlowMethod method : methods_for(problem.model)) {
      const auto flow = make_flow(method, problem.model, {}, 5);
      CubaturePath path;
      path.increments =
          Eigen::MatrixXd::Constant(static_cast<Eigen::Index>(problem.segments[0].size()), 2, 0.3);
      std::vector<NodeFailure> failures;
      std::size_t during[2];
      for (std::size_t& count : during) {
        Batch x = copy(problem.nodes);
        const std::size_t before = allocations();
        for (const std::vector<double>& D : problem.segments) flow->move(D, x, failures);
        flow->move_along(path, 0.01, x, failures);
        count = allocations() - before;
      }
      CAPTURE(problem.model.name, flow->name());
      CHECK(during[1] == 0);
      CHECK(failures.empty());
    }
}
