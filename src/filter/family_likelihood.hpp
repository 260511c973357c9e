#pragma once
/// The log-likelihood of one observation along the families: what their conditioning integrates.
#include <span>
#include <vector>

#include "wienertree/filter/family.hpp"
#include "wienertree/filter/window.hpp"
#include "wienertree/model/model.hpp"

namespace wienertree {

/// F_i(z) = log p(y | x = mean_i + sd_i u_i(z)), at points of many families at once.
class FamilyLikelihood {
 public:
  /// The model is kept by reference. @pre one state, and a clock if the model has one
  explicit FamilyLikelihood(const Model& model) : model_(model) {}

  /// @param clock the time that the model's clock shows
  /// @param window whose observation it is; without one F = 0
  void observe(const ObservationWindow& window, double clock);
  /// The observation is affine in the state, with Gaussian noise: F is quadratic wherever a family is
  /// Gaussian.
  bool quadratic() const;
  /// Points that `evaluate` takes; to be filled by the caller.
  std::span<double> places(std::size_t count);
  /// F at the places, valid until the next call.
  std::span<const double> evaluate();
  const ObservationWindow& window() const { return *window_; }

 private:
  const Model& model_;
  const ObservationWindow* window_ = nullptr;
  double clock_ = 0;
  Batch x_;
  std::vector<double> value_;
};

}  // namespace wienertree
