#pragma once
/// Square-root processes and integrals of them, moved by the Gauss rule of their exact transition
/// (square_root_rule.hpp).
#include "wienertree/model/square_root.hpp"
#include "wienertree/tree/transition.hpp"

namespace wienertree {

/// Degree 3, 5 and 7: rules of 2, 3 and 4 nodes for each component; two children for every node where an
/// integral depends on the component.
class SquareRootTransition final : public TransitionRule {
 public:
  /// @throws InputError if there is a price: it is integrated out (conditional_price.hpp)
  explicit SquareRootTransition(SquareRootStructure structure);

  int highest_degree() const override { return 7; }
  std::size_t branches(int degree) const override;
  void grow(const Generation& parents, int degree, double s, ThreadPool* threads,
            Generation& children) const override;

 private:
  SquareRootStructure structure_;
  std::vector<bool> integrated_;  ///< whether an integral depends on the component
};

}  // namespace wienertree
