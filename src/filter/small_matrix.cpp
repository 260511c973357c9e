#include "wienertree/filter/small_matrix.hpp"

#include <Eigen/Eigenvalues>

namespace wienertree {

template <int D>
SymmetricEigen<D>::SymmetricEigen(const SmallSquare<D>& M) {
  const Eigen::SelfAdjointEigenSolver<SmallSquare<D>> solver(M);
  values = solver.eigenvalues();
  vectors = solver.eigenvectors();
}

template <int D>
Whitening<D>::Whitening(const SmallSquare<D>& S) {
  const Eigen::Index d = S.rows();
  const SmallVector<D> scale = S.diagonal().cwiseMax(0.0).cwiseSqrt();
  SmallVector<D> inverse(d), root(d), inverse_root(d);
  for (Eigen::Index i = 0; i < d; ++i) inverse(i) = scale(i) > 0 ? 1 / scale(i) : 0.0;
  const SymmetricEigen<D> eigen(SmallSquare<D>(inverse.asDiagonal() * S * inverse.asDiagonal()));
  for (Eigen::Index i = 0; i < d; ++i) {
    const bool rounding = !(eigen.values(i) > 1e-12);
    root(i) = rounding ? 0.0 : std::sqrt(eigen.values(i));
    inverse_root(i) = rounding ? 0.0 : 1 / root(i);
  }
  axes = scale.asDiagonal() * eigen.vectors * root.asDiagonal();
  whitening = inverse_root.asDiagonal() * eigen.vectors.transpose() * inverse.asDiagonal();
}

template struct SymmetricEigen<2>;
template struct SymmetricEigen<3>;
template struct SymmetricEigen<4>;
template struct SymmetricEigen<Eigen::Dynamic>;
template struct Whitening<2>;
template struct Whitening<3>;
template struct Whitening<4>;
template struct Whitening<Eigen::Dynamic>;

}  // namespace wienertree
