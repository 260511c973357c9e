#include "wienertree/filter/benes_filter.hpp"

#include <cmath>

namespace wienertree {
namespace {

double log_cosh(double x) {
  const double a = std::fabs(x);
  return a + std::log1p(std::exp(-2 * a)) - std::log(2.0);
}

// tanh(c t)/c, continuous at c = 0.
double tanh_over(double c, double t) { return c == 0 ? t : std::tanh(c * t) / c; }

}  // namespace

BenesFilter::BenesFilter(const Model& model) : observed_(model.observation != ObservationKind::none) {
  if (!model.benes)
    throw InputError("the exact Benes filter does not apply to this model", "model " + model.name);
  p_ = *model.benes;
  m_ = p_.x0;
}

// One gap of length delta between rows, Y linear on it. The driftless filter is
//     dm = h1 P (dY - (h1 m + h2) dt),   h1^2 P = c tanh(c t),
// so that (m cosh(c t))' = sigma sinh(c t) (Y' - h2) and
//     m_1 = m_0 cosh(c t0)/cosh(c t1) + (Y' - h2) (sigma/c) (1 - cosh(c t0)/cosh(c t1)).
// Evidence: int (h1 m + h2) dY - 1/2 int (h1 m + h2)^2 dt, the first as a Stratonovich integral less its Ito
// correction 1/2 h1^2 int P dt = 1/2 log(cosh(c t1)/cosh(c t0)); m is a cosh-weighted mean of two constants
// along the gap, and Simpson's rule is exact up to O(delta^5) for its square.
void BenesFilter::pass_row(double t0, double t1, double increment) {
  const double delta = t1 - t0, c = std::fabs(p_.h1 * p_.sigma);
  const double slope = increment / delta - p_.h2;
  const auto mean_at = [&](double t) {
    const double log_ratio = log_cosh(c * t0) - log_cosh(c * t);  // log of cosh(c t0)/cosh(c t)
    return m_ * std::exp(log_ratio) - (p_.h1 == 0 ? 0.0 : slope / p_.h1 * std::expm1(log_ratio));
  };
  const auto sensor = [&](double m) { return p_.h1 * m + p_.h2; };
  const double h0 = sensor(m_), hm = sensor(mean_at(t0 + delta / 2)), m1 = mean_at(t1), h1 = sensor(m1);
  const double integral_h = delta / 6 * (h0 + 4 * hm + h1);
  const double integral_h2 = delta / 6 * (h0 * h0 + 4 * hm * hm + h1 * h1);
  log_z_ += integral_h * increment / delta - integral_h2 / 2 - (log_cosh(c * t1) - log_cosh(c * t0)) / 2;
  m_ = m1;
}

void BenesFilter::advance(const ObservationWindow& window) {
  if (observed_)
    for (std::size_t r = 0; r + 1 < window.rows(); ++r) {
      const double delta = window.row_times[r + 1] - window.row_times[r];
      pass_row(elapsed_, elapsed_ + delta, window.row_values[r + 1] - window.row_values[r]);
      elapsed_ += delta;
    }
  if (observed_) log_z_ += p_.h1 * p_.h1 * p_.sigma * p_.sigma * window.bridge / 2;
  if (!observed_) elapsed_ += window.length();
  posterior_.time = window.end;
  P_ = p_.sigma * p_.sigma * tanh_over(observed_ ? std::fabs(p_.h1 * p_.sigma) : 0.0, elapsed_);
}

void BenesFilter::exchange_state(StateArchive& archive) {
  archive(elapsed_, m_, P_, log_z_, posterior_.time);
}

const Posterior& BenesFilter::posterior() {
  const double tilt = p_.mu / p_.sigma;
  points_(0, 0) = m_ + tilt * P_;
  points_(0, 1) = m_ - tilt * P_;
  covariance_(0, 0) = P_;
  weight_[0] = 1 / (1 + std::exp(-2 * tilt * m_));
  weight_[1] = 1 / (1 + std::exp(2 * tilt * m_));
  posterior_.log_evidence = observed_ ? log_z_ - p_.mu * p_.mu * elapsed_ / 2 - log_cosh(tilt * p_.x0) +
                                            tilt * tilt * P_ / 2 + log_cosh(tilt * m_)
                                      : 0.0;
  posterior_.points = points_;
  posterior_.covariance = covariance_;
  posterior_.weight = weight_;
  posterior_.kept = 2;
  return posterior_;
}

}  // namespace wienertree
