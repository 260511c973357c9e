#pragma once
/// What of a model is made of square-root processes, so that its transition is known (Heston's model and the
/// like; Cox, Ingersoll, Ross 1985; Heston 1993, Rev. Financ. Stud. 6).
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace wienertree {

/// dw = (a + b w) dt + sqrt(c w) dB,  w >= 0
struct SquareRootProcess {
  double a = 0, b = 0, c = 1;  ///< a >= 0, c > 0
};

/// All states are of one of three kinds; components are driven by independent Brownian motions B_k.
struct SquareRootStructure {
  /// w_k = x_state + shift
  struct Component {
    std::size_t state;
    SquareRootProcess process;
    double shift;
  };
  /// dx_state = (constant + sum_k of_component[k] w_k) dt
  struct Integral {
    std::size_t state;
    double constant;
    std::vector<double> of_component;
  };
  /// u = log x_state, or x_state itself where `logarithmic`:
  ///   du = (rate + sum_k drift[k] w_k) dt + sum_k sqrt(w_k) (correlated[k] dB_k + sqrt(independent[k]) dZ_k),
  /// the Z_k independent of each other and of the B_k. Given the paths of the w_k, with I_k = int_0^T w_k dt,
  ///   u_T - u_0 ~ N( rate T + sum_k drift[k] I_k + correlated[k] c_k^{-1/2} (w_k(T) - w_k(0) - a_k T - b_k I_k),
  ///                  sum_k independent[k] I_k ).
  struct Price {
    std::size_t state;
    bool logarithmic;
    double rate;
    std::vector<double> drift, correlated, independent;
  };
  /// Whether integrals of components must not be negative, as the variances of a price must not.
  bool nonnegative_integrals = true;
  std::vector<Component> components;
  std::vector<Integral> integrals;
  std::optional<Price> price;
};

}  // namespace wienertree
