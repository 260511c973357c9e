#include "wienertree/filter/riccati.hpp"

#include <cvode/cvode.h>
#include <fmt/format.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <cmath>
#include <type_traits>

#include "wienertree/numeric/error.hpp"

namespace wienertree {
namespace {

constexpr double tolerance = 1e-12;
constexpr double smallest_share = 1e-6;  // of the largest variance, as the scale of one that is smaller
constexpr long max_steps = 1'000'000;

void require(bool condition, const char* call) {
  if (!condition) throw RunError("SUNDIALS cannot be set up", "Riccati equation", call);
}

}  // namespace

// The unknowns are the lower triangle, column after column.
class RiccatiEquation::Integration {
 public:
  Integration(const Eigen::MatrixXd& A, const Eigen::MatrixXd& Q, const Eigen::MatrixXd& H,
              const Eigen::MatrixXd& P, double tau)
      : A_(A), half_Q_(Q / 2), half_S_(H.transpose() * H / 2), start_(P), P_(P), floor_(Q.diagonal() * tau) {
    SUNContext context = nullptr;
    require(SUNContext_Create(nullptr, &context) == 0, "SUNContext_Create");
    context_.reset(context);
    const auto size = static_cast<sunindextype>(A.rows() * (A.rows() + 1) / 2);
    state_.reset(N_VNew_Serial(size, context));
    require(state_ != nullptr, "N_VNew_Serial");
    pack(P, N_VGetArrayPointer(state_.get()));
    memory_.reset(CVodeCreate(CV_BDF, context));
    require(memory_ != nullptr, "CVodeCreate");
    void* memory = memory_.get();
    require(CVodeSetErrHandlerFn(
                memory,
                [](int, const char*, const char*, char* text, void* self) {
                  static_cast<Integration*>(self)->message_ = text;
                },
                this) == CV_SUCCESS,
            "CVodeSetErrHandlerFn");
    require(CVodeInit(memory, right_hand_side, 0.0, state_.get()) == CV_SUCCESS, "CVodeInit");
    require(CVodeSetUserData(memory, this) == CV_SUCCESS, "CVodeSetUserData");
    require(CVodeWFtolerances(memory, error_weights) == CV_SUCCESS, "CVodeWFtolerances");
    require(CVodeSetMaxNumSteps(memory, max_steps) == CV_SUCCESS, "CVodeSetMaxNumSteps");
    matrix_.reset(SUNDenseMatrix(size, size, context));
    solver_.reset(SUNLinSol_Dense(state_.get(), matrix_.get(), context));
    require(CVodeSetLinearSolver(memory, solver_.get(), matrix_.get()) == CV_SUCCESS, "CVodeSetLinearSolver");
  }
  Integration(const Integration&) = delete;
  Integration& operator=(const Integration&) = delete;

  Eigen::Index dimension() const { return A_.rows(); }

  void at(double t, Eigen::MatrixXd& out) {
    if (t <= 0 || (start_.isZero(0) && half_Q_.isZero(0))) {
      out = start_;
      return;
    }
    double reached = 0;
    if (CVode(memory_.get(), t, state_.get(), &reached, CV_NORMAL) < 0)
      throw RunError("the Riccati equation cannot be solved: " + message_, "Kalman-Bucy filter",
                     fmt::format("t = {} after the start", t));
    unpack(N_VGetArrayPointer(state_.get()), out);
  }

 private:
  struct Release {
    void operator()(N_Vector x) const { N_VDestroy(x); }
    void operator()(SUNMatrix M) const { SUNMatDestroy(M); }
    void operator()(SUNLinearSolver S) const { SUNLinSolFree(S); }
    void operator()(SUNContext context) const { SUNContext_Free(&context); }
    void operator()(void* memory) const { CVodeFree(&memory); }
  };
  template <class Pointer>
  using Owned = std::unique_ptr<std::remove_pointer_t<Pointer>, Release>;

  static void pack(const Eigen::MatrixXd& P, double* out) {
    for (Eigen::Index j = 0; j < P.cols(); ++j)
      for (Eigen::Index i = j; i < P.rows(); ++i) *out++ = P(i, j);
  }
  static void unpack(const double* in, Eigen::MatrixXd& P) {
    for (Eigen::Index j = 0; j < P.cols(); ++j)
      for (Eigen::Index i = j; i < P.rows(); ++i) P(i, j) = P(j, i) = *in++;
  }

  // P' = M + M^T,  M = (A - P H^T H/2) P + Q/2.
  static int right_hand_side(double, N_Vector y, N_Vector derivative, void* user) {
    auto& self = *static_cast<Integration*>(user);
    unpack(N_VGetArrayPointer(y), self.P_);
    self.gain_.noalias() = self.A_ - self.P_ * self.half_S_;
    self.half_.noalias() = self.gain_ * self.P_;
    self.half_ += self.half_Q_;
    self.gain_ = self.half_ + self.half_.transpose();
    pack(self.gain_, N_VGetArrayPointer(derivative));
    return 0;
  }

  static int error_weights(N_Vector y, N_Vector weights, void* user) {
    auto& self = *static_cast<Integration*>(user);
    unpack(N_VGetArrayPointer(y), self.P_);
    self.scale_ = self.P_.diagonal().cwiseMax(0) + self.floor_;
    self.scale_ = (self.scale_.array() + smallest_share * self.scale_.maxCoeff()).sqrt().matrix();
    self.half_ = (tolerance * self.scale_ * self.scale_.transpose()).cwiseInverse();
    pack(self.half_, N_VGetArrayPointer(weights));
    return 0;
  }

  Eigen::MatrixXd A_, half_Q_, half_S_, start_;
  Eigen::MatrixXd P_, gain_, half_;
  Eigen::VectorXd floor_, scale_;
  std::string message_;
  Owned<SUNContext> context_;
  Owned<N_Vector> state_;
  Owned<SUNMatrix> matrix_;
  Owned<SUNLinearSolver> solver_;
  Owned<void*> memory_;
};

RiccatiEquation::RiccatiEquation(const Eigen::MatrixXd& A, const Eigen::MatrixXd& Q, const Eigen::MatrixXd& H,
                                 const Eigen::MatrixXd& P, double tau)
    : integration_(std::make_unique<Integration>(A, Q, H, P, tau)) {}
RiccatiEquation::~RiccatiEquation() = default;
RiccatiEquation::RiccatiEquation(RiccatiEquation&&) noexcept = default;

void RiccatiEquation::at(double t, Eigen::MatrixXd& out) {
  out.resize(integration_->dimension(), integration_->dimension());
  integration_->at(t, out);
}

}  // namespace wienertree
