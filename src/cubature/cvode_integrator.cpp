#include "wienertree/cubature/cvode_integrator.hpp"

#include <cvode/cvode_ls.h>

#include <cassert>
#include <cmath>
#include <type_traits>

namespace wienertree {
namespace {

/// CVODE keeps the error of one of its steps below its tolerance. A segment takes some tens of steps, whose
/// errors add up: a hundredth of the tolerance keeps the error of the segment below the tolerance (the tests
/// measure it).
constexpr double share_of_tolerance = 0.01;
constexpr long max_steps = 20000;
/// A solution that leaves every bound at some u < 1 makes steps shrink for ever.
constexpr double min_step = 1e-15;

void require(bool condition, const char* call) {
  if (!condition) throw RunError("SUNDIALS cannot be set up", "flow cvode", call);
}

}  // namespace

CvodeIntegrator::CvodeIntegrator(SegmentField& field, FlowTolerance tolerance)
    : field_(field),
      shape_{field.dimension(), flow_block, flow_block},
      lengths_(flow_block, 1.0),
      jacobian_(field.dimension() * field.dimension(), flow_block),
      newton_(field.dimension(), flow_block) {
  SUNContext context = nullptr;
  require(SUNContext_Create(nullptr, &context) == 0, "SUNContext_Create");
  context_.reset(context);
  for (auto* vector : {&state_, &work_, &weights_}) {
    vector->reset(make_batch_nvector(shape_, context));
    N_VConst(0.0, vector->get());
  }
  memory_.reset(CVodeCreate(CV_BDF, context));
  require(memory_ != nullptr, "CVodeCreate");
  void* memory = memory_.get();
  const auto keep_message = [](int, const char*, const char*, char* text, void* self) {
    static_cast<CvodeIntegrator*>(self)->message_ = text;
  };
  const auto right_hand_side = [](double, N_Vector y, N_Vector derivative, void* self) {
    return static_cast<CvodeIntegrator*>(self)->right_hand_side(batch_of(y), batch_of(derivative));
  };
  require(CVodeSetErrHandlerFn(memory, keep_message, this) == CV_SUCCESS, "CVodeSetErrHandlerFn");
  require(CVodeInit(memory, right_hand_side, 0.0, state_.get()) == CV_SUCCESS, "CVodeInit");
  require(CVodeSStolerances(memory, share_of_tolerance * tolerance.relative,
                            share_of_tolerance * tolerance.absolute) == CV_SUCCESS,
          "CVodeSStolerances");
  require(CVodeSetUserData(memory, this) == CV_SUCCESS, "CVodeSetUserData");
  require(CVodeSetMaxNumSteps(memory, max_steps) == CV_SUCCESS, "CVodeSetMaxNumSteps");
  require(CVodeSetMinStep(memory, min_step) == CV_SUCCESS, "CVodeSetMinStep");
  require(CVodeSetMaxHnilWarns(memory, -1) == CV_SUCCESS, "CVodeSetMaxHnilWarns");
  make_linear_solver();
}

void CvodeIntegrator::make_linear_solver() {
  matrix_.reset(SUNMatNewEmpty(context_.get()));
  require(matrix_ != nullptr, "SUNMatNewEmpty");
  matrix_->ops->getid = [](SUNMatrix) { return SUNMATRIX_CUSTOM; };
  matrix_->ops->destroy = SUNMatFreeEmpty;

  solver_.reset(SUNLinSolNewEmpty(context_.get()));
  require(solver_ != nullptr, "SUNLinSolNewEmpty");
  solver_->content = this;
  solver_->ops->gettype = [](SUNLinearSolver) { return SUNLINEARSOLVER_DIRECT; };
  solver_->ops->getid = [](SUNLinearSolver) { return SUNLINEARSOLVER_CUSTOM; };
  solver_->ops->setup = [](SUNLinearSolver S, SUNMatrix) -> int {
    auto& self = *static_cast<CvodeIntegrator*>(S->content);
    const BatchView J = self.jacobian_.view().nodes(0, self.shape_.nodes);
    return self.newton_.factor(self.gamma_, J) ? SUNLS_SUCCESS : SUNLS_LUFACT_FAIL;
  };
  solver_->ops->solve = [](SUNLinearSolver S, SUNMatrix, N_Vector x, N_Vector b, double) -> int {
    N_VScale(1.0, b, x);
    static_cast<CvodeIntegrator*>(S->content)->newton_.solve(batch_of(x));
    return SUNLS_SUCCESS;
  };
  solver_->ops->free = [](SUNLinearSolver S) {
    S->content = nullptr;
    SUNLinSolFreeEmpty(S);
    return 0;
  };
  const auto newton_matrix = [](double, N_Vector y, N_Vector, SUNMatrix, int jacobian_is_current,
                                int* evaluated, double gamma, void* self, N_Vector, N_Vector, N_Vector) {
    bool anew = false;
    const int result = static_cast<CvodeIntegrator*>(self)->newton_matrix(
        batch_of(y), jacobian_is_current != SUNFALSE, anew, gamma);
    *evaluated = anew ? SUNTRUE : SUNFALSE;
    return result;
  };
  require(CVodeSetLinearSolver(memory_.get(), solver_.get(), matrix_.get()) == CV_SUCCESS,
          "CVodeSetLinearSolver");
  require(CVodeSetLinSysFn(memory_.get(), newton_matrix) == CV_SUCCESS, "CVodeSetLinSysFn");
}

BatchView CvodeIntegrator::prepare(std::size_t nodes) {
  assert(nodes > 0 && nodes <= shape_.capacity);
  shape_.nodes = nodes;
  return batch_of(state_.get());
}

bool CvodeIntegrator::solve(std::span<const double> D) {
  D_ = D;
  exception_ = nullptr;
  message_.clear();
  fault_ = {};
  void* memory = memory_.get();
  require(CVodeReInit(memory, 0.0, state_.get()) == CV_SUCCESS, "CVodeReInit");
  require(CVodeSetStopTime(memory, 1.0) == CV_SUCCESS, "CVodeSetStopTime");
  double u = 0;
  flag_ = CVode(memory, 1.0, state_.get(), &u, CV_NORMAL);
  if (exception_) std::rethrow_exception(exception_);
  return flag_ >= 0;
}

int CvodeIntegrator::right_hand_side(ConstBatchView y, BatchView derivative) {
  evaluations_ += y.nodes();
  try {
    field_.evaluate(y, D_, derivative);
  } catch (...) {
    exception_ = std::current_exception();
    return -1;
  }
  double poison = 0;
  for (std::size_t i = 0; i < y.components(); ++i) {
    const std::span<double> out = derivative.component(i);
    for (std::size_t n = 0; n < out.size(); ++n) {
      out[n] *= lengths_[n];
      poison += out[n] - out[n];
    }
  }
  if (poison == 0) return 0;
  note_fault(y, derivative);
  return 1;  // CVODE tries a smaller step
}

void CvodeIntegrator::note_fault(ConstBatchView y, ConstBatchView derivative) {
  for (std::size_t n = 0; n < y.nodes(); ++n)
    for (std::size_t i = 0; i < y.components(); ++i) {
      if (std::isfinite(derivative(i, n))) continue;
      const std::size_t outside = field_.outside(y, n);
      const bool left = outside < y.components();
      const std::size_t state = left ? outside : i;
      fault_ = {0, state, y(state, n), left ? FailureReason::left_bounds : FailureReason::not_finite, {}};
      return;
    }
}

int CvodeIntegrator::newton_matrix(ConstBatchView y, bool jacobian_is_current, bool& evaluated,
                                   double gamma) {
  gamma_ = gamma;
  evaluated = !jacobian_is_current;
  if (jacobian_is_current) return 0;
  const BatchView J = jacobian_.view().nodes(0, y.nodes());
  try {
    field_.jacobian(y, D_, J);
  } catch (...) {
    exception_ = std::current_exception();
    return -1;
  }
  for (std::size_t i = 0; i < J.components(); ++i)
    for (std::size_t n = 0; n < J.nodes(); ++n) J(i, n) *= lengths_[n];
  return 0;
}

NodeFailure CvodeIntegrator::failure() {
  NodeFailure result = fault_;
  result.message = message_;
  if (flag_ == CV_FIRST_RHSFUNC_ERR || flag_ == CV_REPTD_RHSFUNC_ERR || flag_ == CV_RHSFUNC_FAIL ||
      flag_ == CV_UNREC_RHSFUNC_ERR)
    return result;
  // The component whose last local error was the greatest in units of its tolerance.
  result = {0, 0, states()(0, 0), FailureReason::tolerance_not_reached, message_};
  if (CVodeGetEstLocalErrors(memory_.get(), work_.get()) != CV_SUCCESS ||
      CVodeGetErrWeights(memory_.get(), weights_.get()) != CV_SUCCESS)
    return result;
  double worst = -1;
  for (std::size_t i = 0; i < shape_.components; ++i) {
    const double error = std::abs(batch_of(work_.get())(i, 0) * batch_of(weights_.get())(i, 0));
    if (error > worst) {
      worst = error;
      result.state = i;
      result.value = states()(i, 0);
    }
  }
  return result;
}

}  // namespace wienertree
