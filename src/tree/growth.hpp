#pragma once
/// From one generation to the next: every node moved along every path of a cubature formula, and the nodes
/// that a thinning keeps.
#include <memory>
#include <span>
#include <vector>

#include "wienertree/cubature/flow.hpp"
#include "wienertree/cubature/formula.hpp"
#include "wienertree/numeric/parallel.hpp"
#include "wienertree/thinning/thinning.hpp"
#include "wienertree/tree/generation.hpp"

namespace wienertree {

/// What else is to be done with nodes while they are in cache: called from the threads that grow them.
class FamilyVisitor {
 public:
  virtual ~FamilyVisitor() = default;
  /// Parents first..first+count-1, before their children are grown.
  virtual void parents(std::size_t first, std::size_t count, std::size_t thread) = 0;
  /// Their children along one path, nodes child..child+count-1, once they have been moved; in the thread that
  /// visited the parents last.
  virtual void children(std::size_t first_parent, std::size_t child, std::size_t count,
                        std::size_t thread) = 0;
};

/// KLV_m(mu, s) = sum_i sum_j mu_i lambda_j delta_{flow_j(x_i)}, branch-major: the child of parent i along
/// path j is node j * parents + i, at time parents.time + s, with log-weight log mu_i + log lambda_j, its
/// parent's log-likelihood if there are any, and no count. The same bytes for any number of threads: nodes
/// are handed out in blocks that do not depend on it. Buffers of `children` are reused.
/// @param flows one a thread of the pool at least
/// @param failures becomes the nodes that could not be moved, by ascending child index, each once. They have
/// their weight, and stand where their parent does: what they mean is the caller's to decide.
/// @param visitor if any, sees every parent and child
/// @throws InputError if the formula has no path or more than 2^16, there are fewer flows than threads, or
/// more than 2^32 - 1 children; what a flow throws
void grow(const Generation& parents, const CubatureFormula& formula, double s,
          std::span<const std::unique_ptr<Flow>> flows, ThreadPool& threads, Generation& children,
          std::vector<NodeFailure>& failures, FamilyVisitor* visitor = nullptr);

/// Only the children named by `chosen` (indices as above, in any order, each once), with the log-weights and
/// counts of the selection: a thinning that does not look at states spares the others their ODEs. Children
/// come branch by branch, in the order of the selection within a branch. Otherwise as `grow`.
void grow_chosen(const Generation& parents, const CubatureFormula& formula, double s, const Selection& chosen,
                 std::span<const std::unique_ptr<Flow>> flows, ThreadPool& threads, Generation& children,
                 std::vector<NodeFailure>& failures);

/// A formula with the flows and threads to apply it.
class TreeGrower {
 public:
  /// The model is kept by reference and must outlive the grower. @throws InputError as make_flow and
  /// ThreadPool
  TreeGrower(const Model& model, FlowMethod method, FlowTolerance tolerance, CubatureFormula formula,
             std::size_t threads);
  /// With flows of the caller's: clones of `flow`, one a thread.
  TreeGrower(std::unique_ptr<Flow> flow, CubatureFormula formula, std::size_t threads);

  void grow(const Generation& parents, double s, Generation& children, std::vector<NodeFailure>& failures,
            FamilyVisitor* visitor = nullptr) {
    wienertree::grow(parents, formula_, s, flows_, threads_, children, failures, visitor);
  }
  void grow_chosen(const Generation& parents, double s, const Selection& chosen, Generation& children,
                   std::vector<NodeFailure>& failures) {
    wienertree::grow_chosen(parents, formula_, s, chosen, flows_, threads_, children, failures);
  }
  const CubatureFormula& formula() const { return formula_; }
  ThreadPool& threads() { return threads_; }
  /// Work of all threads since construction.
  FlowStatistics statistics() const;

 private:
  CubatureFormula formula_;
  ThreadPool threads_;
  std::vector<std::unique_ptr<Flow>> flows_;
};

/// The nodes of `children` that were selected, in the order of the selection: states (the selection's own
/// where it moved them), log-weights and counts from the selection, all else from the child. Buffers are
/// reused.
/// @param threads to work on, if any
/// @throws InputError if the selection names a site that does not exist
void select(const Generation& children, const Selection& selection, Generation& survivors,
            ThreadPool* threads = nullptr);

/// All nodes. Buffers of `to` are reused.
void copy_generation(const Generation& from, Generation& to);

}  // namespace wienertree
