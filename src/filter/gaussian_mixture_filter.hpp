#pragma once
/// The Gaussian-mixture filter (Crisan, Li 2015, Generalised particle filters with Gaussian mixtures,
/// Stochastic Process. Appl. 125, 2643-2673): N Gaussians N(v_j, om_j) of weight a_j. Between corrections
///
///     d v_j = V~_0(v_j) dt + sqrt(1 - alpha) sum_r V_r(v_j) dB^{j,r},
///     om_j(t) = alpha (beta Id + int V V^T(v_j) ds),     a_j = exp(int h(v_j).dY - 1/2 int |h(v_j)|^2 ds),
///
/// solved by Euler-Maruyama and a functional at the means. At a correction the number of offspring of each
/// comes from a counting `Thinning`; an offspring's mean is drawn from N(v_j, om_j), its covariance is
/// alpha beta Id. alpha = 0 is the Euler particle filter; alpha of order N^{-1/2} is the best rate. beta = 0
/// is the earlier version, where offspring are Dirac masses; beta > 0 adds the variance alpha beta at each
/// correction.
///
/// A discrete observation conditions every Gaussian (gaussian_conditioning.hpp): weighing by g(y|v_j) alone
/// would leave the Gaussians' own spread, a part alpha of the prediction, blind to y.
#include "wienertree/cubature/gaussian_cubature.hpp"
#include "wienertree/filter/filter.hpp"
#include "wienertree/filter/gaussian_conditioning.hpp"
#include "wienertree/numeric/parallel.hpp"

namespace wienertree {

/// options.alpha, or N^{-1/2}.
double mixture_alpha(const FilterOptions& options);

/// A correction comes before every step but the first: over longer intervals the Gaussians' spread, which
/// knows neither drift nor sensor, would bias the evidence by the order of alpha. With beta = 0 the means
/// after a correction are those of Euler particles, and with `picard` or discrete observations the evidence
/// is that of Euler's chain, unbiased but for the Gaussian form that conditioning gives the spread. Weights
/// are unnormalised throughout. Posteriors are those before the correction.
class GaussianMixtureFilter final : public Filter {
 public:
  GaussianMixtureFilter(const Model& model, const FilterOptions& options);
  void advance(const ObservationWindow& window) override;
  const Posterior& posterior() override;
  std::string_view name() const override { return "gaussian-mixture"; }

 private:
  void exchange_state(StateArchive& archive) override;
  /// What a thread needs for a block.
  struct Scratch {
    Batch noise, diffusion, sensor, derivative, end_sensor, root;
    std::vector<double> term;
    GaussianConditioning conditioning;
  };
  template <class Body>
  void for_each_block(Body body);
  void correct(const ObservationWindow& window);
  void replicate(const Batch& from, Batch& to) const;
  void draw_offspring(const ObservationWindow& window, std::size_t first, std::size_t count,
                      Scratch& scratch);
  void step(const ObservationWindow& window, std::size_t first, std::size_t count, Scratch& scratch);
  void move(const ObservationWindow& window, std::size_t first, ConstBatchView v, BatchView next,
            BatchView covariance, Scratch& scratch) const;
  void observe(const ObservationWindow& window, bool spread, BatchView v, BatchView covariance,
               std::span<double> log_weight, Scratch& scratch) const;
  void normalise();

  Model model_;
  FilterOptions options_;
  double alpha_;
  std::unique_ptr<Functional> functional_;
  std::unique_ptr<Thinning> thinning_;
  GaussianCubature rule_;
  ThreadPool pool_;
  std::vector<Scratch> scratch_;
  Batch v_, next_;                      ///< means, d x N
  Batch covariance_, next_covariance_;  ///< d*d x N, component i*d + j
  bool spread_;                         ///< whether covariances are not all zero
  std::vector<double> log_weight_;
  Selection selection_;
  NormalisedWeights normalised_;  ///< of log_weight_, unless stale
  bool stale_ = true;
  double time_ = 0;
  bool weighed_ = false;  ///< whether an observation came since the last correction
  std::size_t kept_;
  Posterior posterior_;
};

}  // namespace wienertree
