#pragma once
/// The filter for discrete observations of signals in several dimensions: a sum of Gaussians with covariances.
#include <optional>

#include "wienertree/filter/component_merge.hpp"
#include "wienertree/filter/component_split.hpp"
#include "wienertree/filter/component_update.hpp"
#include "wienertree/filter/filter.hpp"
#include "wienertree/filter/kalman_filter.hpp"
#include "wienertree/filter/moment_equations.hpp"
#include "wienertree/filter/tilt_path.hpp"

namespace wienertree {

/// A window is the gap before an observation, and is crossed in one of three ways:
///
/// - An affine signal: every component by its exact transition.
/// - Where the drift is affine over the gap, but for a hundredth of a component's standard deviation: every component
///   by its moment equations.
/// - Otherwise in K substeps. The law is multiplied by the tilt h_0 towards the next observation; in each substep
///   components are split where they are wide in the tilted law, merged to N, divided by h_j, moved by their moment
///   equations and multiplied by h_{j+1}. The last are conditioned on the observation itself.
///
/// A linear sensor with Gaussian noise gives the tilt itself. For any other likelihood, which may have several modes
/// or heavy tails, a smaller filter without a tilt crosses the gap first, and the tilt is the Gaussian that leads from
/// the moments of its prediction to the mean and twice the covariance of its posterior, or more where the tolerance of
/// substeps is smaller than the default; with a larger tolerance there is no tilt. Where both filters disagree by more
/// than .5 in log evidence a warning says so.
///
/// Components too wide for the likelihood are divided where they are conditioned (component_update.hpp).
class ComponentFilter final : public Filter {
 public:
  ComponentFilter(const Model& model, const FilterOptions& options);
  void advance(const ObservationWindow& window) override;
  const Posterior& posterior() override;
  std::string_view name() const override { return "klv-components"; }

 private:
  void exchange_state(StateArchive& archive) override;

  void start();
  bool one_noise_for_all() const;
  void cross(const ObservationWindow& window, std::span<const double> y);
  void prepare_transition(double length);
  void forget_what_noise_hides(double length);
  void transit(double length);
  bool carry(const ObservationWindow& window);
  void cross_in_substeps(const ObservationWindow& window, std::span<const double> y);
  std::size_t substeps_for(const MixtureMoments& law, double length);
  std::vector<Tilt> plan(const ObservationWindow& window, std::span<const double> y,
                         const MixtureMoments& law, std::size_t substeps, unsigned steps);
  Tilt expanded_tilt(std::span<const double> y, double clock, const LawMoments& law);
  void substeps(const std::vector<Tilt>& tilts, double length, unsigned steps, std::size_t nodes);
  void divide_by(const Tilt& tilt);
  void narrow(std::size_t nodes);
  void move(double clock, double length, unsigned steps);
  unsigned steps_for(double length) const;
  void weigh(const ObservationWindow& window, std::span<const double> y, double clock);
  /// Returns what ComponentUpdate::condition does.
  double take_in(std::span<const double> y, double clock, std::size_t nodes);
  void check_reach(const ObservationWindow& window, std::span<const double> y, double clock);
  void check_bounds(double time);
  void warn(WarningKind kind, double time, std::string text);
  double departure(const GaussianComponents& components, double clock, double length);

  Model model_;
  FilterOptions options_;
  std::size_t d_;
  double kappa_;
  ThreadPool threads_;
  MomentEquations equations_;
  std::optional<ComponentUpdate> update_;
  std::optional<LinearGaussianModel> affine_;
  LinearTransition transition_;
  double transition_length_ = -1;
  TiltPath path_;
  ComponentSplit split_;
  ComponentMerge merge_;
  GaussianComponents components_, scratch_, predicted_;
  std::vector<MomentEquations::Scratch> moving_;  ///< one per thread
  std::vector<std::uint32_t> wide_;
  double rate_ = 0;  ///< of the drift, the largest over components that count
  double clock_ = 0, time_ = 0;
  bool nonlinear_ = false;  ///< the last gap was crossed in substeps
  bool shared_noise_ = false;
  std::optional<double> pilot_evidence_;  ///< of the filter without a tilt, where one ran over the last gap
  std::vector<double> weight_;
  Batch points_, covariance_;
  Posterior posterior_;
};

/// Components kept by default: 1 does for affine signals, whatever is asked.
std::size_t default_components(std::size_t dimension);

}  // namespace wienertree
