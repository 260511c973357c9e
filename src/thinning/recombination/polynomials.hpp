#pragma once
/// The polynomials whose integrals recombination keeps.
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace wienertree::recombination {

/// P_a = P_parent * P_k(z_i), where P_k(z_i) is row i * (r+2) + k of a table of Legendre polynomials.
struct PolynomialFactor {
  std::uint32_t parent, row;
};

/// Products of Legendre polynomials P_a(z) = P_{a_1}(z_1) .. P_{a_d}(z_d) on [-1,1]^d by ascending degree
/// |a|: first the `kept()` = (d+r choose r) of degree at most r, of which the first is 1, then those of
/// degree r + 1, the first that is not kept.
class PolynomialBasis {
 public:
  /// @pre dimension >= 1, degree r >= 0
  PolynomialBasis(std::size_t dimension, int degree);

  std::size_t dimension() const { return dimension_; }
  std::size_t kept() const { return kept_; }
  std::size_t size() const { return factor_.size(); }

  /// The weight of a change of the integral of P_a, |a| = r + 1, in the error of a smooth function on a box
  /// of half widths `half`: lower moments being kept, the leading term of Taylor's series leaves
  ///
  ///     d^a f / a! times the change of the integral of (x - centre)^a,
  ///
  /// which is that of P_a times  half^a / prod_i (2 a_i - 1)!!  times d^a f. One value for every such a.
  void taylor_weights(std::span<const double> half, std::vector<double>& out) const;

  static constexpr std::size_t block = 64;  ///< points evaluated at a time at most
  /// Doubles of scratch that `evaluate` wants.
  std::size_t scratch_size() const { return dimension_ * table_rows_ * block; }
  /// out(a * block + j) = w_j P_a(z_j), a < size(), j < n. z: component i of the points at z + i * stride.
  /// @pre n <= block
  void evaluate(const double* z, std::size_t stride, const double* w, std::size_t n, double* scratch,
                double* out) const;

 private:
  std::size_t dimension_, kept_ = 0, table_rows_;
  std::vector<PolynomialFactor> factor_;
};

}  // namespace wienertree::recombination
