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

 protected:
  /// Room for `count` children of each parent, after a step of length s; `where` names the rule in the message.
  /// @throws InputError if 32-bit indices do not suffice
  static void reserve_children(const Generation& parents, std::size_t count, double s, const char* where,
                               Generation& children);
  /// What every child has besides its state. @return its number
  static std::size_t place_child(const Generation& parents, std::size_t parent, std::size_t branch,
                                 double log_weight, Generation& children);
};

}  // namespace wienertree
