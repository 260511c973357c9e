#pragma once
/// The exact transition of a signal on the line whose drift is affine and whose diffusion does not depend on
/// the state, both of which may depend on time.
#include <optional>
#include <vector>

#include "wienertree/model/model.hpp"

namespace wienertree {

/// X_{t+s} = F X_t + f + N(0, Q).
struct LineTransition {
  double F = 1, f = 0, Q = 0;
};

/// dX = (A(t) X + a(t)) dt + sigma(t) dB:
///
///     F' = A F,   f' = A f + a,   Q' = 2 A Q + |sigma|^2,     F = 1, f = Q = 0 at the start;
///
/// in closed form where the fields are known to be affine, else (a clock, or fields that were not analysed)
/// by the classical Runge-Kutta method with steps halved until F, f and Q change by less than 1e-10 of
/// themselves.
class AffineLine {
 public:
  /// The model is kept by reference. @pre one state, and a clock if the model has one
  explicit AffineLine(const Model& model);
  /// Over [0, length] from the clock's `time`, for states within [low, high]: nothing where drift or
  /// diffusion are not affine and constant there (to 1e-10 of their size, at seven places and five times), or
  /// a state is bounded.
  std::optional<LineTransition> transition(double time, double length, double low, double high);

 private:
  struct Coefficients {
    double A, a, q;
  };
  std::optional<LineTransition> known(double length) const;
  bool affine_between(double time, double length, double low, double high);
  std::optional<LineTransition> integrate(double time, double length, double low, double high);
  void evaluate(std::size_t places, std::size_t times, double time, double length, double low, double high);
  Coefficients at(std::size_t place, double low, double high) const;

  const Model& model_;
  bool bounded_ = false, known_ = false;
  Batch x_, drift_, diffusion_;
};

}  // namespace wienertree
