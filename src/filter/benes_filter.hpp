#pragma once
/// The exact filter of Benes' model, dX = mu sigma tanh(mu X/sigma) dt + sigma dB, dY = (h1 X + h2) dt + dW,
/// X_0 = x0 (Benes 1981, Stochastics 5, 65-92; Bain and Crisan 2009, section 6.1).
///
/// With c = h1 sigma and Psi_t = int_0^t sinh(c s)/sinh(c t) dY_s,
///     A+- = +-mu/sigma + h1 Psi_t + (h2 + h1 x0)/(sigma sinh(c t)) - (h2/sigma) coth(c t),
///     B = (h1/(2 sigma)) coth(c t),
///     pi_t = w+ N(A+/(2B), 1/(2B)) + w- N(A-/(2B), 1/(2B)),   w+- proportional to exp((A+-)^2/(4B)).
/// In other words pi_t is the law N(m, P) of the Kalman-Bucy filter of the driftless model X = x0 + sigma B,
/// tilted by cosh(mu x/sigma): P = tanh(c t) sigma/h1, the two means are m +- mu P/sigma, and
/// log(w+/w-) = 2 mu m/sigma. With Z the evidence of that driftless model,
///     log rho_t(1) = log Z - mu^2 t/2 - log cosh(mu x0/sigma) + mu^2 P/(2 sigma^2) + log cosh(mu m/sigma).
/// This form neither cancels nor overflows, and is the prior law where h1 = 0.
#include "wienertree/filter/filter.hpp"

namespace wienertree {

/// Y is taken to be linear between its rows, with the Ito correction in the evidence; the finest rows decide
/// the accuracy.
class BenesFilter final : public Filter {
 public:
  /// @throws InputError unless model.benes is set
  explicit BenesFilter(const Model& model);
  void advance(const ObservationWindow& window) override;
  const Posterior& posterior() override;
  std::string_view name() const override { return "benes"; }

 private:
  void exchange_state(StateArchive& archive) override;
  void pass_row(double t0, double t1, double increment);

  BenesParameters p_;
  bool observed_;
  double elapsed_ = 0;  ///< time since the start
  double m_, P_ = 0, log_z_ = 0;
  Batch points_{1, 2}, covariance_{1, 1};
  std::vector<double> weight_ = {0.5, 0.5};
  Posterior posterior_;
};

}  // namespace wienertree
