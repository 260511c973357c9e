#pragma once
/// CVODE over a block of nodes as one system: BDF, Newton with the exact block-diagonal Jacobian, and the
/// norm of the worst node.
///
/// SUNDIALS appears in this header and its source only, and in batch_nvector. Its messages are never printed.
#include <cvode/cvode.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>

#include <cstdint>
#include <exception>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "wienertree/cubature/batch_nvector.hpp"
#include "wienertree/cubature/block_diagonal.hpp"
#include "wienertree/cubature/flow.hpp"
#include "wienertree/cubature/segment_field.hpp"

namespace wienertree {

/// A SUNDIALS context and the memory of one integrator, made once and initialised anew for every solve.
class CvodeIntegrator {
 public:
  /// @throws RunError if SUNDIALS cannot be set up
  CvodeIntegrator(SegmentField& field, FlowTolerance tolerance);
  CvodeIntegrator(const CvodeIntegrator&) = delete;
  CvodeIntegrator& operator=(const CvodeIntegrator&) = delete;

  /// Sets the number of nodes, 1 to flow_block. Returns the states to be filled: d x nodes.
  BatchView prepare(std::size_t nodes);
  /// To be filled too: node n moves along the share lengths()[n] of the segment.
  std::span<double> lengths() { return {lengths_.data(), shape_.nodes}; }
  /// Moves the states to the end of the segment. Returns false if CVODE gave up.
  bool solve(std::span<const double> D);
  /// After `solve`: where it got to.
  ConstBatchView states() const { return batch_of(state_.get()); }
  /// After a `solve` of one node that returned false: why. `node` is 0.
  NodeFailure failure();

  std::uint64_t evaluations() const { return evaluations_; }

 private:
  struct Release {
    void operator()(N_Vector x) const { N_VDestroy(x); }
    void operator()(SUNMatrix A) const { SUNMatDestroy(A); }
    void operator()(SUNLinearSolver S) const { SUNLinSolFree(S); }
    void operator()(SUNContext context) const { SUNContext_Free(&context); }
    void operator()(void* memory) const { CVodeFree(&memory); }
  };
  template <class Pointer>
  using Owned = std::unique_ptr<std::remove_pointer_t<Pointer>, Release>;

  int right_hand_side(ConstBatchView y, BatchView derivative);
  int newton_matrix(ConstBatchView y, bool jacobian_is_current, bool& evaluated, double gamma);
  void note_fault(ConstBatchView y, ConstBatchView derivative);
  void make_linear_solver();

  SegmentField& field_;
  BatchShape shape_;
  std::span<const double> D_;
  std::vector<double> lengths_;
  Batch jacobian_;
  BlockDiagonalLU newton_;
  double gamma_ = 0;
  std::uint64_t evaluations_ = 0;
  int flag_ = 0;                  // of the last solve
  NodeFailure fault_;             // the last value of the field that was not finite
  std::string message_;           // of the last solve
  std::exception_ptr exception_;  // thrown by a vector field, carried over the C code between

  Owned<SUNContext> context_;
  Owned<N_Vector> state_, work_, weights_;
  Owned<SUNMatrix> matrix_;
  Owned<SUNLinearSolver> solver_;
  Owned<void*> memory_;
};

}  // namespace wienertree
