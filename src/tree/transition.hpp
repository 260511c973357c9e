#pragma once
/// How nodes move over a step where the model's own transition is known better than by a cubature formula.
#include <cstddef>

#include "wienertree/numeric/parallel.hpp"
#include "wienertree/tree/generation.hpp"

namespace wienertree {

/// Children with weights that depend on the node. `degree` m is that of the cubature formula whose place the
/// rule takes: moments of the transition are kept so that the weak order is (m-1)/2 at least.
class TransitionRule {
 public:
  virtual ~TransitionRule() = default;
  /// The largest m that makes a difference.
  virtual int highest_degree() const = 0;
  /// Children of a node.
  virtual std::size_t branches(int degree) const = 0;
  /// Branch-major, as `grow` of growth.hpp: the child of parent i along branch j is node
  /// j * parents + i, of log-weight that of its parent plus the log of its share. The same bytes for any number of
  /// threads; buffers of `children` are reused.   s: length of the step
  virtual void grow(const Generation& parents, int degree, double s, ThreadPool* threads,
                    Generation& children) const = 0;
};

}  // namespace wienertree
