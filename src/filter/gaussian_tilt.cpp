#include "wienertree/filter/gaussian_tilt.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "wienertree/filter/small_matrix.hpp"

namespace wienertree {
namespace {

constexpr std::size_t block = 64;

// sign = 1 multiplies, -1 divides. False, and nothing changed, where B has a pivot below `least`.
template <int D>
bool apply(double sign, const SmallSquare<D>& H, const SmallVector<D>& f, const SmallVector<D>& centre,
           SmallVector<D>& m, SmallSquare<D>& P, double& log_weight, double least) {
  const Eigen::Index d = m.size();
  const SmallSquare<D> L = semidefinite_root(P);
  SmallSquare<D> B = SmallSquare<D>::Identity(d, d);
  B.noalias() += sign * (L.transpose() * (H * L));
  const Eigen::LLT<SmallSquare<D>> root(B);
  if (root.info() != Eigen::Success) return false;
  double log_determinant = 0;
  for (Eigen::Index i = 0; i < d; ++i) {
    const double pivot = root.matrixLLT()(i, i);
    if (!(pivot > least)) return false;
    log_determinant += std::log(pivot);
  }
  // P^ = G G^T with G = L R^{-T}, B = R R^T.
  const SmallSquare<D> G = root.matrixL().solve(L.transpose()).transpose();
  const SmallVector<D> u = m - centre, r = sign * (f - H * u), Gr = G.transpose() * r;
  log_weight += -log_determinant + sign * (f.dot(u) - 0.5 * u.dot(H * u)) + 0.5 * Gr.squaredNorm();
  m += G * Gr;
  P.noalias() = G * G.transpose();
  return true;
}

template <class Refuse>
void apply_to_all(GaussianComponents& c, const Tilt& h, double sign, double least, ThreadPool* threads,
                  Refuse refuse) {
  const std::size_t d = c.states();
  for_dimension(d, [&](auto dimension) {
    constexpr int D = decltype(dimension)::value;
    const SmallSquare<D> H = h.H;
    const SmallVector<D> f = h.f, centre = h.centre;
    for_blocks(threads, c.size(), block, [&](std::size_t first, std::size_t count, std::size_t) {
      for (std::size_t n = first; n < first + count; ++n) {
        SmallVector<D> m = vector_of<D>(c.mean, d, n);
        SmallSquare<D> P = square_of<D>(c.covariance, d, n);
        if (!apply<D>(sign, H, f, centre, m, P, c.log_weight[n], least)) {
          refuse(n);
          continue;
        }
        put_vector(m, c.mean, n);
        put_square(P, c.covariance, n);
      }
    });
  });
}

}  // namespace

Tilt Tilt::none(std::size_t d) {
  const auto n = static_cast<Eigen::Index>(d);
  return {Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)};
}

void multiply(GaussianComponents& components, const Tilt& h, ThreadPool* threads) {
  if (h.flat()) return;
  apply_to_all(components, h, 1, 0, threads, [](std::size_t) {});
}

void divide(GaussianComponents& components, const Tilt& h, std::vector<std::uint32_t>& wide,
            ThreadPool* threads) {
  wide.clear();
  if (h.flat()) return;
  // A pivot of .1 is a covariance within 1 % of H^{-1}: its quotient is a hundred times wider.
  std::vector<std::uint8_t> refused(components.size(), 0);
  apply_to_all(components, h, -1, 0.1, threads, [&](std::size_t n) { refused[n] = 1; });
  for (std::size_t n = 0; n < refused.size(); ++n)
    if (refused[n] != 0) wide.push_back(static_cast<std::uint32_t>(n));
}

void multiply(Eigen::VectorXd& m, Eigen::MatrixXd& P, const Tilt& h) {
  using Square = SmallSquare<Eigen::Dynamic>;
  using Vector = SmallVector<Eigen::Dynamic>;
  Vector mean = m;
  Square covariance = P;
  double log_weight = 0;
  apply<Eigen::Dynamic>(1, Square(h.H), Vector(h.f), Vector(h.centre), mean, covariance, log_weight, 0);
  m = mean;
  P = covariance;
}

}  // namespace wienertree
