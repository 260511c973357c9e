// CVODE over a block: the norm, Newton's matrix, and silence.
#include <sundials/sundials_context.h>
#include <unistd.h>

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cstdio>
#include <random>

#include "cubature/flow_cases.hpp"
#include "wienertree/cubature/batch_nvector.hpp"
#include "wienertree/cubature/block_diagonal.hpp"
#include "wienertree/cubature/segment_field.hpp"

using namespace wienertree;
using namespace wienertree::test;

TEST_CASE("the norm of a batch is that of its worst node") {
  SUNContext context = nullptr;
  REQUIRE(SUNContext_Create(nullptr, &context) == 0);
  BatchShape shape{2, 64, 61};
  N_Vector x = make_batch_nvector(shape, context), w = N_VClone(x), mask = N_VClone(x);
  N_VConst(1e-3, x);
  N_VConst(2.0, w);
  N_VConst(1.0, mask);
  batch_of(x)(0, 60) = 3.0;  // the last node, in the last, incomplete octet
  batch_of(x)(1, 60) = -4.0;
  const double worst = std::sqrt((36.0 + 64.0) / 2);  // over the two components of that node
  CHECK(N_VWrmsNorm(x, w) == Approx(worst).epsilon(1e-15));
  CHECK(N_VWrmsNormMask(x, w, mask) == Approx(worst).epsilon(1e-15));
  batch_of(mask)(1, 60) = 0.0;
  CHECK(N_VWrmsNormMask(x, w, mask) == Approx(std::sqrt(36.0 / 2)).epsilon(1e-15));
  CHECK(N_VMaxNorm(x) == 4.0);
  CHECK(N_VMin(x) == -4.0);
  CHECK(N_VGetLength(x) == 122);
  shape.nodes = 60;  // seen by all clones
  CHECK(N_VWrmsNorm(x, w) == Approx(2e-3).epsilon(1e-15));
  batch_of(x)(1, 3) = std::nan("");
  CHECK(std::isnan(N_VWrmsNorm(x, w)));
  for (N_Vector vector : {x, w, mask}) N_VDestroy(vector);
  SUNContext_Free(&context);
}

TEST_CASE("vector operations are those of SUNDIALS, also in place") {
  SUNContext context = nullptr;
  REQUIRE(SUNContext_Create(nullptr, &context) == 0);
  BatchShape shape{2, 16, 13};
  N_Vector x = make_batch_nvector(shape, context), y = N_VClone(x);
  const auto reset = [&] {
    for (std::size_t i = 0; i < 2; ++i)
      for (std::size_t n = 0; n < 13; ++n) {
        batch_of(x)(i, n) = double(n) - 5.5;
        batch_of(y)(i, n) = double(i) + 2;
      }
  };
  const auto at = [](N_Vector v) { return batch_of(v)(1, 12); };  // x = 6.5, y = 3
  reset();
  N_VLinearSum(2.0, x, -1.0, y, y);
  CHECK(at(y) == 10.0);
  reset();
  N_VProd(x, y, x);
  CHECK(at(x) == 19.5);
  reset();
  N_VDiv(x, y, y);
  CHECK(at(y) == 6.5 / 3);
  reset();
  N_VScale(-2.0, x, x);
  CHECK(at(x) == -13.0);
  N_VAbs(x, y);
  CHECK(at(y) == 13.0);
  N_VInv(y, y);
  CHECK(at(y) == 1.0 / 13);
  N_VAddConst(x, 0.5, y);
  CHECK(at(y) == -12.5);
  for (N_Vector vector : {x, y}) N_VDestroy(vector);
  SUNContext_Free(&context);
}

TEST_CASE("the block-diagonal LU solves every node's system") {
  std::mt19937_64 random(11);
  std::normal_distribution<> normal;
  for (const std::size_t d : {std::size_t{1}, std::size_t{2}, std::size_t{3}, std::size_t{6}}) {
    constexpr std::size_t nodes = 37;
    constexpr double gamma = 0.7;
    Batch jacobian(d * d, nodes), x(d, nodes);
    for (std::size_t n = 0; n < nodes; ++n) {
      for (std::size_t i = 0; i < d * d; ++i) jacobian(i, n) = normal(random);
      // Every second node has zeros on the diagonal of I - gamma J, so that rows must be exchanged.
      if (d > 1 && n % 2 == 0)
        for (std::size_t i = 0; i < d; ++i) jacobian(i * d + i, n) = 1 / gamma;
      for (std::size_t i = 0; i < d; ++i) x(i, n) = normal(random);
    }
    const Batch b = copy(x);
    BlockDiagonalLU lu(d, 64);
    REQUIRE(lu.factor(gamma, jacobian));
    lu.solve(x);
    for (std::size_t n = 0; n < nodes; ++n) {
      Eigen::MatrixXd A = Eigen::MatrixXd::Identity(Eigen::Index(d), Eigen::Index(d));
      Eigen::VectorXd rhs{Eigen::Index(d)};
      for (std::size_t i = 0; i < d; ++i) {
        rhs(Eigen::Index(i)) = b(i, n);
        for (std::size_t l = 0; l < d; ++l)
          A(Eigen::Index(i), Eigen::Index(l)) -= gamma * jacobian(i * d + l, n);
      }
      const Eigen::PartialPivLU<Eigen::MatrixXd> exact(A);
      const Eigen::VectorXd y = exact.solve(rhs);
      for (std::size_t i = 0; i < d; ++i)
        CHECK(std::abs(x(i, n) - y(Eigen::Index(i))) <= 1e-14 * y.norm() / exact.rcond());
    }
  }
}

TEST_CASE("a singular or infinite block is noticed") {
  BlockDiagonalLU lu(2, 64);
  Batch jacobian(4, 3);
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t n = 0; n < 3; ++n) jacobian(i, n) = 0.0;
  CHECK(lu.factor(1.0, jacobian));
  for (std::size_t i = 0; i < 4; ++i) jacobian(i, 1) = i % 3 == 0 ? 1.0 : 0.0;  // I - J = 0
  CHECK_FALSE(lu.factor(1.0, jacobian));
  jacobian(0, 1) = std::numeric_limits<double>::infinity();
  CHECK_FALSE(lu.factor(1.0, jacobian));
}

// The test's own models are hand-written: their Jacobians are checked against central differences, whose
// error is O(h^2 + eps/h) relative to the size of the derivatives.
TEST_CASE("Jacobians of the test models agree with finite differences") {
  for (const FlowCase& problem : flow_cases()) {
    const std::size_t d = problem.nodes.components();
    SegmentField field(problem.model);
    Batch x = copy(problem.nodes.view().nodes(0, 5)), J(d * d, 5), up(d, 5), down(d, 5);
    field.jacobian(x, problem.segments[1], J);
    for (std::size_t l = 0; l < d; ++l) {
      constexpr double h = 1e-6;
      Batch shifted = copy(x);
      for (double& value : shifted.component(l)) value += h;
      field.evaluate(shifted, problem.segments[1], up);
      for (double& value : shifted.component(l)) value -= 2 * h;
      field.evaluate(shifted, problem.segments[1], down);
      for (std::size_t i = 0; i < d; ++i)
        for (std::size_t n = 0; n < 5; ++n) {
          const double scale = 1 + std::abs(J(i * d + l, n)) + std::abs(up(i, n));
          CHECK(std::abs(J(i * d + l, n) - (up(i, n) - down(i, n)) / (2 * h)) <= 1e-6 * scale);
        }
    }
  }
}

TEST_CASE("SUNDIALS prints nothing when nodes fail") {
  std::FILE* file = std::tmpfile();
  REQUIRE(file != nullptr);
  const int saved_error = dup(STDERR_FILENO), saved_output = dup(STDOUT_FILENO);
  std::fflush(stdout);
  dup2(fileno(file), STDERR_FILENO);
  dup2(fileno(file), STDOUT_FILENO);
  const Model model = model_of("blow-up", BlowUp{}, {0.1});
  std::vector<NodeFailure> failures;
  {
    const auto flow = make_flow(FlowMethod::cvode, model, {}, 5);
    Batch x(1, 2);
    x(0, 0) = 2.0;
    x(0, 1) = 0.1;
    flow->move(std::vector{1.0, 0.0}, x, failures);
  }
  std::fflush(stdout);
  dup2(saved_error, STDERR_FILENO);
  dup2(saved_output, STDOUT_FILENO);
  close(saved_error);
  close(saved_output);
  std::fseek(file, 0, SEEK_END);
  CHECK(std::ftell(file) == 0);
  std::fclose(file);
  REQUIRE(failures.size() == 1);
  CHECK(failures[0].message.find("error test failed") != std::string::npos);
}
