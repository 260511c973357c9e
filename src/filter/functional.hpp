#pragma once
/// Seam 4: the observation over a step and the two ends of the step in, a log-weight out.
#include <memory>
#include <string_view>

#include "wienertree/filter/window.hpp"
#include "wienertree/model/batch.hpp"

namespace wienertree {

/// How the likelihood of the observation over a step [t, t+s] is computed from a node's two ends, h_0 =
/// h(x_t) and h_1 = h(x_{t+s}); D, I, C as in ObservationWindow, G = (V_r h_i)_{i,r} at x_t.
///  - picard (order 1):     log w = h_0.D - (s/2)|h_0|^2
///  - trapezoid (order 1):  log w = 1/2 (h_0 + h_1).D - (s/6)(|h_0|^2 + h_0.h_1 + |h_1|^2)
///  - second_order:         log w = h_0.D + (h_1 - h_0).I/s - (s/6)(|h_0|^2 + h_0.h_1 + |h_1|^2)
///                                  + 1/2 tr(G^T (C - (s^2/6) Id) G)
/// `picard` is the functional of Picard (1984) and of Crisan and Ghazali (2007). `second_order` interpolates
/// h linearly along the step and adds the conditional mean, given the two ends, of the Brownian-bridge
/// remainder.
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
  /// Adds the term of both ends to log_weight. h0, h1: k x N, log_weight: N.
  virtual void at_end(const ObservationWindow& window, ConstBatchView h0, ConstBatchView h1,
                      std::span<double> log_weight) const = 0;
};

std::unique_ptr<Functional> make_functional(FunctionalMethod method);

}  // namespace wienertree
