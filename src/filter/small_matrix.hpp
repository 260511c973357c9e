#pragma once
/// Matrices of one Gaussian of a batch, on the stack.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <type_traits>

#include "wienertree/numeric/batch.hpp"

namespace wienertree {

/// Gaussians with covariances are kept for up to so many states.
inline constexpr int most_component_states = 16;

template <int D>
inline constexpr int most_rows = D == Eigen::Dynamic ? most_component_states : D;
template <int D>
using SmallSquare = Eigen::Matrix<double, D, D, Eigen::ColMajor, most_rows<D>, most_rows<D>>;
template <int D>
using SmallVector = Eigen::Matrix<double, D, 1, Eigen::ColMajor, most_rows<D>, 1>;

/// body(std::integral_constant<int, D>) with D = d where d is small, so that loops over states unroll, else
/// Eigen::Dynamic. @pre 1 <= d <= most_component_states
template <class Body>
void for_dimension(std::size_t d, Body&& body) {
  switch (d) {
    case 2:
      return body(std::integral_constant<int, 2>{});
    case 3:
      return body(std::integral_constant<int, 3>{});
    case 4:
      return body(std::integral_constant<int, 4>{});
    default:
      return body(std::integral_constant<int, Eigen::Dynamic>{});
  }
}

/// Matrix n of a d*d x N batch (component i*d + j), and vector n of a d x N batch.
template <int D>
SmallSquare<D> square_of(ConstBatchView batch, std::size_t d, std::size_t n) {
  const auto rows = static_cast<Eigen::Index>(d);
  SmallSquare<D> out(rows, rows);
  for (Eigen::Index i = 0; i < rows; ++i)
    for (Eigen::Index j = 0; j < rows; ++j) out(i, j) = batch(static_cast<std::size_t>(i * rows + j), n);
  return out;
}
template <int D>
SmallVector<D> vector_of(ConstBatchView batch, std::size_t d, std::size_t n) {
  SmallVector<D> out(static_cast<Eigen::Index>(d));
  for (std::size_t i = 0; i < d; ++i) out(static_cast<Eigen::Index>(i)) = batch(i, n);
  return out;
}
template <class Matrix>
void put_square(const Matrix& m, BatchView batch, std::size_t n) {
  const auto d = static_cast<std::size_t>(m.rows());
  for (std::size_t i = 0; i < d; ++i)
    for (std::size_t j = 0; j < d; ++j)
      batch(i * d + j, n) = m(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
}
template <class Vector>
void put_vector(const Vector& v, BatchView batch, std::size_t n) {
  for (Eigen::Index i = 0; i < v.size(); ++i) batch(static_cast<std::size_t>(i), n) = v(i);
}

/// Lower triangular L with L L^T = P for a positive semidefinite P: a pivot below 1e-13 of its diagonal element
/// is rounding, and its column is zero.
template <class Matrix>
Matrix semidefinite_root(const Matrix& P) {
  constexpr double rounding = 1e-13;
  const Eigen::Index d = P.rows();
  Matrix L = Matrix::Zero(d, d);
  for (Eigen::Index j = 0; j < d; ++j) {
    const double pivot = P(j, j) - L.row(j).head(j).squaredNorm();
    if (!(pivot > rounding * P(j, j))) continue;
    L(j, j) = std::sqrt(pivot);
    for (Eigen::Index i = j + 1; i < d; ++i)
      L(i, j) = (P(i, j) - L.row(i).head(j).dot(L.row(j).head(j))) / L(j, j);
  }
  return L;
}

/// Eigenvalues, ascending, and eigenvectors of a symmetric matrix. Instantiated for the D of for_dimension.
template <int D>
struct SymmetricEigen {
  SmallVector<D> values;
  SmallSquare<D> vectors;
  explicit SymmetricEigen(const SmallSquare<D>& M);
};

/// A = D V sqrt(e), whose columns span the principal axes of a covariance S = D C D, and its pseudo-inverse:
/// whitening S whitening^T = 1 on the range of S. Correlations C are decomposed, so that units do not matter;
/// eigenvalues below 1e-12 are rounding.
template <int D>
struct Whitening {
  SmallSquare<D> axes, whitening;
  explicit Whitening(const SmallSquare<D>& S);
};

}  // namespace wienertree
