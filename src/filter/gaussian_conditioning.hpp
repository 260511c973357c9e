#pragma once
/// Gaussians conditioned on a discrete observation.
#include <span>
#include <vector>

#include "wienertree/cubature/gaussian_cubature.hpp"
#include "wienertree/model/model.hpp"
#include "wienertree/numeric/batch.hpp"

namespace wienertree {

/// Multiplies N(v, om) by the likelihood g(y|x), and replaces the product by the Gaussian of its mass, mean
/// and covariance (Ito, Xiong 2000, Gaussian filters for nonlinear filtering problems, IEEE Trans. Autom.
/// Control 45, 910-927). With om = L L^T and a rule of points z_q and weights w_q for the standard Gaussian,
/// the moments of z are
///
///     m_0 = sum_q w_q g(y|v + L z_q),  m_k = sum_q w_q g z_q^k / m_0,  m_kl = sum_q w_q g z_q^k z_q^l / m_0,
///     log-weight += log m_0,   v += L (m_k),   om <- L (m_kl - m_k m_l) L^T,
///
/// exact to the degree of the rule: for a linear Gaussian sensor up to terms in (om/noise variance)^points.
class GaussianConditioning {
 public:
  /// Batches of N Gaussians: v d x N, covariance d*d x N (component i*d + j), log_weight N. A Gaussian on
  /// which g vanishes gets log-weight -infinity and stays where it is. Allocates nothing once buffers have
  /// grown.
  void condition(const ObservationDensity& density, const GaussianCubature& rule, std::span<const double> y,
                 BatchView v, BatchView covariance, std::span<double> log_weight);

 private:
  void evaluate(const ObservationDensity& density, const GaussianCubature& rule, std::span<const double> y,
                ConstBatchView v);
  void sum_moments(const GaussianCubature& rule, std::size_t d, std::size_t N);

  Batch root_;         ///< L, d*d x N
  Batch points_;       ///< v + L z_q, d x N
  Batch log_density_;  ///< log(w_q g), points x N
  Batch moments_;      ///< m_0, m_k, m_kl (k >= l, component 1 + d + k*d + l), not divided by m_0
  std::vector<double> largest_, part_;
};

}  // namespace wienertree
