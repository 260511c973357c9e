#pragma once
/// The law of the signal given the observations, as every filter hands it out: a weighted sum of Gaussians,
/// which are Dirac masses for node-based filters.
#include <span>
#include <vector>

#include "wienertree/model/model.hpp"
#include "wienertree/numeric/batch.hpp"
#include "wienertree/numeric/state_archive.hpp"

namespace wienertree {

class FamilyLaw;

/// pi = sum_n weight_n N(points_n, covariance_n). Views into the filter's memory, valid until its next step.
struct Posterior {
  double time = 0;
  double log_evidence = 0;         ///< log of the likelihood of the observations so far, log rho_t(1)
  ConstBatchView points;           ///< d x N
  std::span<const double> weight;  ///< N, sum 1
  ConstBatchView covariance;       ///< d*d x N, or d*d x 1 shared by all, or no components: Dirac masses
  /// Dirac masses that are the children of so many parents, branch after branch: node n is a child of parent
  /// n % parents. 0 where nodes have no parents. Marginal spreads each family.
  std::size_t parents = 0;
  std::span<const StateBound> bounds;  ///< d, of the states of families; or none
  std::size_t kept = 0;  ///< distinct nodes that thinning kept for the next step; N where nothing is thinned

  /// The law of the first component to more than its mean and variance, where the filter knows it, or null.
  const FamilyLaw* law = nullptr;

  std::size_t size() const { return points.nodes(); }
  bool dirac() const { return covariance.components() == 0; }
  /// Variance of component i of Gaussian n; 0 for Dirac masses.
  double variance_of(std::size_t i, std::size_t n) const;
};

double mean(const Posterior& posterior, std::size_t i);
/// Covariance of components i and j, computed about the mean.
double covariance(const Posterior& posterior, std::size_t i, std::size_t j);
/// Raw moment E[X_i^order], of the nodes or exact for each Gaussian.
double raw_moment(const Posterior& posterior, std::size_t i, int order);
/// Effective sample size 1/sum w^2 (Kong, Liu, Wong 1994).
double effective_sample_size(const Posterior& posterior);

/// The numbers reported for one time.
struct PosteriorSummary {
  double time = 0, log_evidence = 0, ess = 0;
  std::size_t nodes = 0;
  std::vector<double> mean, sd;              ///< per component
  std::vector<double> q05, q50, q95;         ///< per component
  std::vector<std::vector<double>> moments;  ///< moments[i][k-2] = E[X_i^k], k = 2..K
};

void exchange(StateArchive& archive, PosteriorSummary& summary);

/// @param components how many states to report, @param highest_moment K, 0 or 1 for none
/// @throws RunError naming time and state where a number is not finite
void summarise(const Posterior& posterior, std::size_t components, int highest_moment, PosteriorSummary& out);

}  // namespace wienertree
