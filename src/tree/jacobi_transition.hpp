#pragma once
/// Jacobi's diffusion moved by the Gauss rule of the exact moments of its transition.
///
///     dx = (a + b x) dt + sqrt(c (x - lower)(upper - x)) dB
///
/// The generator maps polynomials to such of the same degree, so that m_k(s) = E ((x_s - x)/h)^k, k < 2q, solve
/// linear equations with m_k(0) = 0, k > 0:
///
///     dm_k/ds = k ((A/h) m_{k-1} + b m_k) + k (k-1) c/2 ((P/h^2) m_{k-2} + (Q/h) m_{k-1} - m_k),
///     A = a + b x,   P = (x - lower)(upper - x),   Q = upper + lower - 2x.
///
/// Gauss's rule of q nodes reproduces 2q of them for every start and all parameters; its nodes lie in
/// [lower, upper], whether or not the process reaches the bounds. Weak order q - 1.
#include <array>

#include "wienertree/model/jacobi.hpp"
#include "wienertree/tree/transition.hpp"

namespace wienertree {

/// Degree 3, 5 and 7: 2, 3 and 4 nodes.
class JacobiTransition final : public TransitionRule {
 public:
  explicit JacobiTransition(const JacobiProcess& process) : process_(process) {}

  int highest_degree() const override { return 7; }
  std::size_t branches(int degree) const override;
  void grow(const Generation& parents, int degree, double s, ThreadPool* threads,
            Generation& children) const override;

  /// The child k < branches(degree) of x after a step of length s, and its weight; some weights may be shared by
  /// equal children where the law has fewer points.
  struct Child {
    double x, weight;
  };
  std::array<Child, 4> children(double x, int degree, double s) const;

 private:
  JacobiProcess process_;
};

}  // namespace wienertree
