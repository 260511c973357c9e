#pragma once
/// Recombination where one component varies: Gauss quadratures of patches of the line.
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "wienertree/thinning/recombination/gauss.hpp"

namespace wienertree::recombination {

/// How many nodes a patch gets.
struct LineRule {
  std::size_t nodes, patches;  ///< s, and the largest number of patches; nodes * patches <= budget
};

/// degree r > 0: s = [r/2] + 1, at most the budget. r = 0, a balance measured on filtering problems (the more
/// nodes in a patch the better where the posterior is smooth, the more patches the better where it is not):
/// one patch up to 10 nodes, two up to 32, and then patches of 16 nodes at most.
LineRule line_rule(int degree, std::size_t budget);

/// Patches of points x_0 <= x_1 <= ..: begins and, last, the number of points. They are such that
///
///     mass * width^(2s),
///
/// which bounds the error of a patch's Gauss quadrature for functions of bounded 2s-th derivative, is about
/// the same in all of them, and no more than `patches`. A patch has at least s points but for the last.
/// @param cumulative weights before each point, and the total last: one more than points
void cut_line(std::span<const double> x, std::span<const double> cumulative, LineRule rule,
              std::vector<std::size_t>& begin);

/// Patches of equal width on the scale  xi(x) = integral of dx / deviation(x), no more than `most`, over the
/// part of the line that all but 1e-20 of the mass lies in on either side; what is beyond belongs to the first
/// and the last. On a lattice of local standard deviations the smooth functions that a diffusion makes of any
/// payoff vary alike everywhere, and the tails of a lognormal law are cut as finely as its middle.
/// @param xi at the points, ascending
void cut_evenly(std::span<const double> xi, std::span<const double> cumulative, double width,
                std::size_t most, std::vector<std::size_t>& begin);

struct LineNodes {
  std::vector<double> x;            ///< ascending
  std::vector<double> log_weight;   ///< one per node
  std::vector<std::uint32_t> near;  ///< a point next to each node, ascending, each once
  double discarded = 0;             ///< as Selection::discarded
};

class LineRecombination {
 public:
  /// @param x ascending, log_weight > -infinity, of the same length > budget
  void reduce(std::span<const double> x, std::span<const double> log_weight, int degree, std::size_t budget,
              LineNodes& out);
  /// In patches cut evenly, of [r/2] + 1 nodes each (r = 0: 4).
  /// @param deviation of each point, >= 0 and not all 0
  void reduce_evenly(std::span<const double> x, std::span<const double> log_weight,
                     std::span<const double> deviation, double width, int degree, std::size_t budget,
                     LineNodes& out);

 private:
  void prepare(std::span<const double> x, std::span<const double> log_weight, LineNodes& out);
  void reduce_patches(std::span<const double> x, std::span<const double> log_weight, std::size_t nodes,
                      LineNodes& out);
  void reduce_patch(std::span<const double> x, std::span<const double> log_weight, std::size_t first,
                    std::size_t nodes, LineNodes& out);

  DiscreteGauss gauss_;
  double deviation_ = 0;
  std::vector<double> cumulative_, xi_, z_, weight_;
  std::vector<std::size_t> begin_;
};

}  // namespace wienertree::recombination
