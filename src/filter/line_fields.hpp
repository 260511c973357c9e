#pragma once
/// The coefficients of a one-dimensional model at the nodes of a grid.
#include <span>
#include <string>
#include <vector>

#include "wienertree/filter/line_density.hpp"
#include "wienertree/model/model.hpp"

namespace wienertree {

class LineFields {
 public:
  explicit LineFields(const Model& model);
  /// Evaluates at the nodes of the grid.
  /// @throws RunError naming `where` and the state where a coefficient is not finite
  void read(const LineGrid& grid, const std::string& where);

  /// Whether at all nodes sigma^2 is at most 4 times `variance`, and the drift differs from b by no more than
  /// moves a standard deviation sqrt(variance time) in `time`.
  bool nearly_constant(const LineGrid& grid, double b, double variance, double time);

  std::span<const double> drift() const { return drift_.component(0); }  ///< Ito drift b
  std::span<const double> variance() const { return variance_; }         ///< sigma^2
  ConstBatchView nodes() const { return nodes_; }                        ///< 1 x n

  /// U = h.y - |h|^2/2 + `bridge` sum_ri (V_r h_i)^2, and G = sum_r (sum_i (y_i - h_i) V_r h_i)^2, which is sum_r (V_r U)^2 for
  /// bridge = 0, at the nodes; y = slope.
  void potential(std::span<const double> slope, double bridge, std::span<double> U,
                 std::span<double> G) const;

  /// Rate 1/tau at which the density changes in a way that limits the steps:
  ///     E[sigma^2 s^2]/2 + E[b'^2]^{1/2} + E[b^2 s^2]^{1/2}/4 + sum_i var h_i,   s = (log density)'
  /// diffusion over its own width, contraction, motion by a part of its width, and the information of
  /// continuous observations.
  double rate(const LineDensity& density) const;

 private:
  void evaluate(const LineGrid& grid);

  const VectorFields* fields_;
  std::size_t sensors_;  // of continuous observations
  std::string state_name_;
  Batch nodes_, drift_, diffusion_, sensor_, derivative_;
  std::vector<double> variance_;
};

/// E[s^2]^{1/2} width: how much the logarithm of the density changes over a cell.
double roughness(const LineDensity& density);

}  // namespace wienertree
