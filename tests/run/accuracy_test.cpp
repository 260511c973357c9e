/// What two answers differ by.
#include <catch2/catch.hpp>

#include "wienertree/run/accuracy.hpp"

using namespace wienertree;

namespace {

LaunchesSummary row(double time, double mean, double sd, double log_evidence) {
  LaunchesSummary s;
  s.mean.time = time;
  s.mean.mean = {mean};
  s.mean.sd = {sd};
  s.mean.q05 = {mean - 1.6 * sd};
  s.mean.q50 = {mean};
  s.mean.q95 = {mean + 1.6 * sd};
  s.mean.log_evidence = log_evidence;
  return s;
}

}  // namespace

TEST_CASE(
    "differences are in posterior standard deviations, and rows that the other lacks have those of the "
    "next") {
  const std::vector<LaunchesSummary> answer = {row(0, 1, 0, 0), row(1, 2, 2, -1), row(2, 3, 2, -3)};
  const std::vector<LaunchesSummary> other = {row(0, 5, 0, 0), row(2, 3.5, 2, -3.25)};
  const RowErrors errors = differences(answer, other);
  REQUIRE(errors.size() == 3);
  CHECK(errors[0].mean == 0);  // a point
  for (const std::size_t r : {std::size_t{1}, std::size_t{2}}) {
    CHECK(errors[r].mean == Approx(0.25));
    CHECK(errors[r].sd == 0);
    CHECK(errors[r].quantile == Approx(0.25));
    CHECK(errors[r].log_evidence == Approx(0.25));
  }
  CHECK(largest(errors).mean == Approx(0.25));
  CHECK_FALSE(largest(errors).within(0.2));
  CHECK(largest(errors).within(0.25));
}

TEST_CASE("what is not a number is no agreement") {
  const std::vector<LaunchesSummary> answer = {row(0, 1, 1, 0)}, other = {row(0, 1, 1, NAN)};
  CHECK_FALSE(largest(differences(answer, other)).within(1e9));
}
