#pragma once
/// exp(tau L) u for a banded matrix L, by a rational function of it.
#include <array>
#include <complex>
#include <span>
#include <vector>

namespace wienertree {

/// A square banded matrix: entry (i, j), |i - j| <= half_width, at
/// band[i * (2 half_width + 1) + j - i + half_width]. Entries outside the matrix are zero.
struct BandedMatrix {
  std::size_t size = 0, half_width = 0;
  std::vector<double> band;
  double& operator()(std::size_t i, std::size_t j) {
    return band[i * (2 * half_width + 1) + j + half_width - i];
  }
};

/// The Pade approximation of exp with numerator of degree 6 and denominator of degree 7,
///
///     R(z) = P(z)/Q(z) = sum_i residue_i / (z - pole_i),   exp(z) - R(z) = 6! 7!/(13! 14!) z^14 + ..,
///
/// of order 13 and L-stable (Ehle 1973, SIAM J. Math. Anal. 4, 671-680). Its poles are one real number and
/// three conjugate pairs, of which one each is kept, with the residue doubled: for real z the sum's real part
/// is R(z).
struct RationalExponential {
  static constexpr std::size_t poles = 4;
  std::array<std::complex<double>, poles> pole, residue;
  static const RationalExponential& get();
};

/// u <- R(tau L) u = Re sum_i residue_i (tau L - pole_i)^{-1} u: four banded systems, side by side.
///
/// The factorisation does not exchange rows: the poles lie in the right half-plane and the numerical range of
/// tau L essentially in the left one, which keeps the pivots away from zero.
class BandedExponential {
 public:
  /// Factorises tau L - pole_i for all i.
  void assign(const BandedMatrix& L, double tau);
  /// @pre u.size() is that of L
  void apply(std::span<double> u);

 private:
  static constexpr std::size_t poles = RationalExponential::poles;
  struct Lanes {
    std::array<double, poles> re, im;
  };
  static void subtract_product(Lanes& a, const Lanes& b, const Lanes& c);
  static Lanes product(const Lanes& a, const Lanes& b);
  static Lanes inverse(const Lanes& a);

  std::size_t size_ = 0, half_width_ = 0;
  std::vector<Lanes> factor_;  // rows of L (strictly lower), of 1/diagonal, of U (strictly upper)
  std::vector<Lanes> work_;
};

}  // namespace wienertree
