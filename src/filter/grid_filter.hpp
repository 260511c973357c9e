#pragma once
/// The filter of a one-dimensional model on a grid, as an oracle for all others.
///
/// Between rows Y is linear with slope y, and the unnormalised density obeys Zakai's equation in
/// Stratonovich's form (Bain and Crisan 2009, section 3.5; Kushner 1967),
///
///     d rho/dt = L* rho + U rho,    U = h.y - |h|^2/2,    L* rho = -(b rho)' + (sigma^2 rho)''/2,
///
/// which is solved in steps of length s by Suzuki's and Chin's splitting (Chin 1997, Phys. Lett. A 226,
/// 344-348, algorithm A), of order 4 with positive coefficients,
///
///     rho <- e^{sU/6} e^{sL* /2} e^{(2s/3) (U - s^2 G/48)} e^{sL* /2} e^{sU/6} rho,
///
/// where G = [U, [U, L*]] = sum_r (V_r U)^2 is a function again. e^{sL*} is that of fokker_planck's matrix.
/// Without continuous observations U = 0; a discrete one multiplies the density by its likelihood.
#include "wienertree/filter/filter.hpp"
#include "wienertree/filter/line_density.hpp"
#include "wienertree/filter/line_fields.hpp"

namespace wienertree {

/// A fixed start is a point mass on the grid, with all moments up to degree 7 right. What the filter reports
/// are integrals of smooth functions, and the transposed scheme transports these to order 8 in the width of a
/// cell whatever the density; the density itself is resolved after the first few steps.
///
/// The ends of the grid pass no mass, and a step that brings mass near one is repeated on a wider grid. A
/// bound of the state is an end of the grid: a reflecting wall where the signal can reach it.
class GridFilter final : public Filter {
 public:
  /// @throws InputError unless the model has one state and no explicit time, diffuses at a fixed start, and
  /// does not absorb at a bound
  GridFilter(const Model& model, const FilterOptions& options);
  /// @throws RunError naming step and time: if a coefficient is not finite on the grid, if an observation has
  /// no likelihood, or leaves mass only where rounding errors prevail, if the grid has too few points
  void advance(const ObservationWindow& window) override;
  /// A sum of Gaussians at the nodes, see gaussian_sum; a Dirac mass at a fixed start.
  const Posterior& posterior() override;
  std::string_view name() const override { return "grid"; }

 private:
  void exchange_state(StateArchive& archive) override;
  double spread_point(double length, std::span<const double> slope, const ObservationWindow& window);
  void evolve(double length, std::span<const double> slope, const ObservationWindow& window);
  void guarded_step(double s, std::span<const double> slope, const ObservationWindow& window);
  void step(double s, std::span<const double> slope, const ObservationWindow& window);
  void transport(double s);
  void weigh(const ObservationWindow& window);
  void multiply(double factor, double noise, const ObservationWindow& window);
  void prepare_fields(const ObservationWindow& window);
  void read_fields(const std::string& where);

  Model model_;
  double longest_step_;  // in units of 1/rate
  bool spread_ = false;  // else a point mass at start_
  double start_;
  LineDensity density_, before_;  // of mass 1
  double log_evidence_ = 0, log_evidence_before_ = 0;

  LineFields fields_;
  bool fields_current_ = false;  // at the nodes of density_
  BandedMatrix generator_;
  BandedExponential exponential_;
  double exponential_of_ = 0;  // the time it is factorised for
  std::vector<double> slope_, log_factor_, correction_;
  double bridge_ = 0;  ///< what |V h|^2 adds to the potential between rows

  Batch points_, covariance_;
  std::vector<double> weight_, scratch_;
  Posterior posterior_;
};

}  // namespace wienertree
