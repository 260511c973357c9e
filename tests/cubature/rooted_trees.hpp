#pragma once
/// The order conditions of Runge-Kutta methods over rooted trees (Hairer, Norsett, Wanner, Solving Ordinary
/// Differential Equations I, II.2): a method has order p if for every tree t of at most p nodes
///
///     sum_i b_i Phi_i(t) = 1 / gamma(t),
///     Phi_i([t_1, .., t_m]) = prod_k sum_j a_ij Phi_j(t_k),   gamma([t_1, .., t_m]) = |t| prod_k gamma(t_k).
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace wienertree::test {

struct RootedTree {
  std::size_t nodes;
  std::vector<std::size_t> children;  ///< indices of smaller trees, descending: the root's subtrees
};

/// All rooted trees of at most `nodes` nodes, the smaller ones first.
inline std::vector<RootedTree> rooted_trees(std::size_t nodes) {
  std::vector<RootedTree> trees = {{1, {}}};
  for (std::size_t order = 2; order <= nodes; ++order) {
    const std::size_t smaller = trees.size();
    std::vector<std::size_t> children;
    const auto extend = [&](auto&& self, std::size_t left, std::size_t largest) -> void {
      if (left == 0) {
        trees.push_back({order, children});
        return;
      }
      for (std::size_t t = 0; t <= largest; ++t) {
        if (trees[t].nodes > left) break;
        children.push_back(t);
        self(self, left - trees[t].nodes, t);
        children.pop_back();
      }
    };
    extend(extend, order - 1, smaller - 1);
  }
  return trees;
}

/// A[i][j], strictly lower triangular.
using Tableau = std::vector<std::vector<double>>;

/// Residuals of the order conditions of one row of weights, tree by tree, in units of their rounding error:
/// the sum of the absolute values of all terms times the machine epsilon.
inline std::vector<double> order_residuals(const std::vector<RootedTree>& trees, const Tableau& A,
                                           std::span<const double> b) {
  const std::size_t stages = b.size();
  std::vector<std::vector<double>> phi, size;  // Phi_i, and the same of absolute values
  std::vector<double> gamma, residuals;
  for (const RootedTree& tree : trees) {
    std::vector<double> value(stages, 1.0), magnitude(stages, 1.0);
    double density = static_cast<double>(tree.nodes);
    for (const std::size_t child : tree.children) {
      density *= gamma[child];
      for (std::size_t i = 0; i < stages; ++i) {
        double sum = 0, absolute = 0;
        for (std::size_t j = 0; j < i; ++j) {
          sum += A[i][j] * phi[child][j];
          absolute += std::abs(A[i][j]) * size[child][j];
        }
        value[i] *= sum;
        magnitude[i] *= absolute;
      }
    }
    double sum = 0, absolute = 0;
    for (std::size_t i = 0; i < stages; ++i) {
      sum += b[i] * value[i];
      absolute += std::abs(b[i]) * magnitude[i];
    }
    residuals.push_back(std::abs(sum - 1 / density) / (absolute * std::numeric_limits<double>::epsilon()));
    phi.push_back(value);
    size.push_back(magnitude);
    gamma.push_back(density);
  }
  return residuals;
}

/// The largest p such that the conditions of all trees of at most p nodes hold up to `rounding` units of
/// rounding error. `next` is the largest residual among the trees of p+1 nodes.
inline std::size_t order_of(const std::vector<RootedTree>& trees, const Tableau& A, std::span<const double> b,
                            double rounding, double* next = nullptr) {
  const std::vector<double> residuals = order_residuals(trees, A, b);
  for (std::size_t order = 1; order <= trees.back().nodes; ++order) {
    double worst = 0;
    for (std::size_t t = 0; t < trees.size(); ++t)
      if (trees[t].nodes == order && !(residuals[t] <= worst)) worst = residuals[t];
    if (!(worst <= rounding)) {
      if (next) *next = worst;
      return order - 1;
    }
  }
  return trees.back().nodes;
}

}  // namespace wienertree::test
