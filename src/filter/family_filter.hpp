#pragma once
/// The KLV filter of a signal on the line seen at discrete times, with families conditioned on each
/// observation.
///
/// Between two observations the tree of cubature paths grows over a few steps, thinned after each but the
/// last. The children of a node over the last step, its family, stand for a law that is near Gaussian when
/// the step is short: N(m_i, C_i) corrected by skewness and kurtosis. It is this law that the observation
/// conditions, and not the children: noise much narrower than a step does no harm. The length of the last
/// step is chosen so that the root mean square of skewness and kurtosis over the families is at most a
/// tolerance, whatever the noise; steps before it are graded (family_substeps.hpp). The posterior is the sum
/// of the conditioned families, and its quadrature points, thinned, are the nodes of the next gap.
///
/// Recombination puts nodes no farther apart than families spread in the time that is left
/// (overlapping_nodes.hpp), N of them or more.
///
/// Where drift and sensor are affine, noise Gaussian and the start Gaussian or fixed, one family is carried
/// by its own moments, and this is Kalman's filter. Where only drift and diffusion are so, nodes have
/// Gaussian families over the whole gap, and no path is grown.
#include "wienertree/filter/family_conditioning.hpp"
#include "wienertree/filter/filter.hpp"
#include "wienertree/filter/line_transition.hpp"
#include "wienertree/filter/overlapping_nodes.hpp"
#include "wienertree/tree/growth.hpp"

namespace wienertree {

class FamilyFilter final : public Filter {
 public:
  /// @throws InputError unless the model has one state (and perhaps a clock) and is seen at discrete times or
  /// not at all, and likelihoods decide at every step
  FamilyFilter(const Model& model, const FilterOptions& options);
  void advance(const ObservationWindow& window) override;
  const Posterior& posterior() override;
  std::string_view name() const override { return "klv"; }

 private:
  void exchange_state(StateArchive& archive) override;
  void start();
  void check_bounds_at_start();
  bool observes(const ObservationWindow& window) const;
  void take_in(const ObservationWindow& window);
  void split_start();
  void note_update(const ObservationWindow& window);
  void warn(WarningKind kind, double time, std::string text);

  void move(const ObservationWindow& window);
  bool carry(double length);
  void lay_points(const ObservationWindow& window);
  bool move_by_transition(const ObservationWindow& window);
  void move_by_tree(const ObservationWindow& window);
  double relaxation_rate();
  /// Of the root mean squares of skewness and excess kurtosis over the last step, and of the longest step in
  /// units of 1/|dV_0/dx|.
  double tolerance() const { return 0.5 * options_.substep_tolerance; }
  void grow(const ObservationWindow& window, double step);
  double choose_last_step(const ObservationWindow& window, double longest);
  void thin(const ObservationWindow& window, const Generation& from, std::size_t parents, double left);
  void local_spread(const Generation& nodes, double time);

  Model model_;
  FilterOptions options_;
  TreeGrower grower_;
  std::unique_ptr<Thinning> thinning_;
  AffineLine affine_;
  FamilyConditioning conditioning_;
  LineBounds bounds_;

  Families families_;        ///< the law, of mass 1
  bool single_ = true;       ///< it is one family whose law is exact: Gaussian, or a point
  bool exact_ = true;        ///< so it was before the last observation
  bool has_points_ = false;  ///< points_ stand for it
  LinePoints points_;
  double log_evidence_ = 0, time_ = 0, clock_ = 0;
  std::uint32_t thinnings_ = 0;  ///< so far: streams of random numbers are counted by it

  FamilyLaw law_of_families_;  ///< what quantiles and densities are read from
  bool law_is_known_ = false;  ///< it is that of families_
  FamilyUpdate update_;
  Generation law_, nodes_, children_;  ///< law_: all points at the start of a gap
  Selection selection_;
  std::vector<NodeFailure> failures_;
  std::vector<double> steps_, increments_;
  Batch jacobian_, diffusion_;
  std::vector<double> spread_;
  OverlappingNodes overlap_;
  FlowStatistics flow_before_;
  bool stale_ = true;
  Batch posterior_points_, posterior_covariance_;
  std::vector<double> posterior_weight_;
  Posterior posterior_;
};

}  // namespace wienertree
