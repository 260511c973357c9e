#pragma once
/// Seam 4: the observation over a step and the two ends of the step in, a log-weight out.
#include <memory>
#include <string_view>

#include "wienertree/filter/window.hpp"
#include "wienertree/numeric/batch.hpp"

namespace wienertree {

/// How the likelihood of the observation over a step [t, t+s] is computed from a node's two ends,
/// h_0 = h(x_t) and h_1 = h(x_{t+s}); D, I, C, bridge_start, bridge_end as in ObservationWindow,
/// G = (V_r h_i)_{i,r} at x_t.
///  - picard (order 1):     log w = h_0.D - (s/2)|h_0|^2
///  - trapezoid (order 1):  log w = 1/2 (h_0 + h_1).D - (s/6)(|h_0|^2 + h_0.h_1 + |h_1|^2)
///  - second_order:         log w = h_0.D + (h_1 - h_0).I/s - (s/6)(|h_0|^2 + h_0.h_1 + |h_1|^2)
///                                  + 1/2 tr(G^T M G),  M = theta (C - (s^2/6) Id - c - c^T + R),
///      c = bridge_start h_0^T + bridge_end h_1^T,
///      R = (s^3/45) (h_0 h_0^T + h_1 h_1^T) + (7 s^3/360) (h_0 h_1^T + h_1 h_0^T),
///      theta = 1 / (1 + (s^2/pi^2) |G|^2).
/// `picard` is the functional of Picard (1984) and of Crisan and Ghazali (2007).
/// `second_order` is the mean, given the two ends, of exp(int h.dY - 1/2 int |h|^2) for h = l + G b, l linear
/// from h_0 to h_1 and b a Brownian bridge. That mean is
///     exp(int l.dY - 1/2 int |l|^2 + 1/2 Var(int (G b).(dY - l du)) - 1/2 int E|G b|^2)
/// up to terms of fourth degree in s: C, c and R are the covariances of int b dY and int b l du, and
/// s^2/6 = int E b^2; the bridge in C turns the likelihood of a path that is linear between rows into that of its
/// increments. Where h is linear and G constant its local error is O(s^4); else terms of curvature,
/// O(s^{5/2}) and random in sign, remain, and the order is 2. The exact mean has K (1 + G^T G K)^{-1} in place
/// of the covariance operator K of b: theta, with K's largest eigenvalue s^2/pi^2, changes log w by O(s^4) and
/// keeps it from growing with |h| when |G| s is large.
enum class FunctionalMethod { picard, trapezoid, second_order };

/// log w = (term of the start) + (term of both ends): the first is computed once for a parent, the second for
/// every child.
class Functional {
 public:
  virtual ~Functional() = default;
  virtual std::string_view name() const = 0;
  virtual bool uses_end() const = 0;         ///< whether at_end is to be called
  virtual bool uses_derivative() const = 0;  ///< whether G is to be computed
  /// Writes the start's term. h0: k x N, G: k*p x N (component i*p + r-1; may be empty if unused), out: N.
  virtual void at_start(const ObservationWindow& window, ConstBatchView h0, ConstBatchView G,
                        std::span<double> out) const = 0;
  /// Adds the term of both ends to log_weight. h0, h1: k x N, G: as at the start, log_weight: N.
  virtual void at_end(const ObservationWindow& window, ConstBatchView h0, ConstBatchView G, ConstBatchView h1,
                      std::span<double> log_weight) const = 0;
};

std::unique_ptr<Functional> make_functional(FunctionalMethod method);

}  // namespace wienertree
