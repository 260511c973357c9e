#include "wienertree/filter/family_likelihood.hpp"

#include <algorithm>

namespace wienertree {

void FamilyLikelihood::observe(const ObservationWindow& window, double clock) {
  window_ = &window;
  clock_ = clock;
}

bool FamilyLikelihood::quadratic() const {
  if (window_->observation.empty()) return true;
  return model_.fields->affine_sensor() != nullptr && !model_.density->gaussian_variances().empty();
}

std::span<double> FamilyLikelihood::places(std::size_t count) {
  x_.reshape(model_.state_dimension(), count);
  return x_.component(0);
}

std::span<const double> FamilyLikelihood::evaluate() {
  value_.resize(x_.nodes());
  if (window_->observation.empty()) {
    std::fill(value_.begin(), value_.end(), 0.0);
    return value_;
  }
  for (std::size_t i = 1; i < x_.components(); ++i)
    std::fill(x_.component(i).begin(), x_.component(i).end(), clock_);
  model_.density->log_density(window_->observation, x_, value_);
  return value_;
}

}  // namespace wienertree
