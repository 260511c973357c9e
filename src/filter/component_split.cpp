#include "wienertree/filter/component_split.hpp"

#include <algorithm>
#include <cmath>

#include "wienertree/filter/expectation.hpp"
#include "wienertree/filter/small_matrix.hpp"

namespace wienertree {
namespace {

constexpr std::size_t block = 64;
constexpr int most_of_gauss = 13;  // points an axis

// Equidistant points over +-5 standard deviations, weights those of the density: for spacings up to .8 the trapezoidal
// rule has all moments to 1e-12 but for what lies beyond. More evenly laid than Gauss and Hermite's, whose spacing
// falls with the root of their number only, so that narrow components leave no gaps between them.
GaussianCubature lattice(int dimension, int points) {
  const double spacing = 10.0 / (points - 1);
  GaussianCubature out;
  const auto total = static_cast<Eigen::Index>(std::llround(std::pow(points, dimension)));
  out.points.resize(dimension, total);
  out.weights.resize(total);
  for (Eigen::Index q = 0; q < total; ++q) {
    Eigen::Index rest = q;
    for (int i = 0; i < dimension; ++i, rest /= points)
      out.points(i, q) = -5 + spacing * static_cast<double>(rest % points);
    out.weights(q) = std::exp(-out.points.col(q).squaredNorm() / 2);
  }
  out.weights /= out.weights.sum();
  // What is cut off at 5 standard deviations, 1e-5 of the variance, is given back by their scale.
  out.points /= std::sqrt(out.weights.dot(out.points.row(0).cwiseAbs2()));
  return out;
}

}  // namespace

const GaussianCubature& ComponentSplit::rule(int directions, int per_axis) {
  const auto key = std::pair(directions, per_axis);
  const auto found = rules_.find(key);
  if (found != rules_.end()) return found->second;
  return rules_
      .emplace(key, per_axis < 5                ? gaussian_cubature_5(directions)
                    : per_axis <= most_of_gauss ? gauss_hermite(directions, per_axis)
                                                : lattice(directions, per_axis))
      .first->second;
}

void ComponentSplit::split(const GaussianComponents& parents, const Eigen::MatrixXd& S, double kappa,
                           std::size_t most, GaussianComponents& children, ThreadPool* threads) {
  const std::size_t d = parents.states(), N = parents.size();
  axes_.reshape(d * d, N);
  narrow_.reshape(d * d, N);
  directions_.resize(N);
  first_.resize(N);
  const double cap = kappa * kappa, least = 0.02 * cap;
  for_dimension(d, [&](auto dimension) {
    constexpr int D = decltype(dimension)::value;
    const auto rows = static_cast<Eigen::Index>(d);
    const Whitening<D> law{SmallSquare<D>(S)};
    for_blocks(threads, N, block, [&](std::size_t begin, std::size_t count, std::size_t) {
      for (std::size_t n = begin; n < begin + count; ++n) {
        const SmallSquare<D> P = square_of<D>(parents.covariance, d, n);
        const SmallSquare<D> white = law.whitening * P * law.whitening.transpose();
        const SymmetricEigen<D> eigen(white);
        const SmallSquare<D> v = law.axes * eigen.vectors;
        SmallSquare<D> narrow = P, axes = SmallSquare<D>::Zero(rows, rows);
        std::uint8_t a = 0;
        for (Eigen::Index k = 0; k < rows; ++k) {  // eigenvalues ascend: the active ones are last
          const double residual = eigen.values(k) - cap;
          if (!(residual > least)) continue;
          ++a;
          axes.col(k) = std::sqrt(residual) * v.col(k);
          narrow.noalias() -= axes.col(k) * axes.col(k).transpose();
        }
        directions_[n] = a;
        put_square(narrow, narrow_, n);
        put_square(axes, axes_, n);
      }
    });
  });

  // The largest tensor rule whose children number at most `most`.
  int per_axis = 3;
  // A spacing of 1.6 kappa leaves ripples of exp(-2 pi^2/1.6^2) = 4e-4 in the density.
  const int wanted = std::max(most_of_gauss, static_cast<int>(std::ceil(10 / (1.6 * kappa))) + 1);
  for (int points = wanted; points >= 5; --points) {
    double total = 0;
    for (const std::uint8_t a : directions_) total += std::pow(points, a);
    if (total > static_cast<double>(most)) continue;
    per_axis = points;
    break;
  }
  std::vector<const GaussianCubature*> rules(d + 1, nullptr);
  for (int a = 1; a <= static_cast<int>(d); ++a)
    if (std::find(directions_.begin(), directions_.end(), a) != directions_.end())
      rules[static_cast<std::size_t>(a)] = &rule(a, per_axis);
  std::size_t total = 0;
  for (std::size_t n = 0; n < N; ++n) {
    first_[n] = total;
    total += directions_[n] == 0 ? 1 : static_cast<std::size_t>(rules[directions_[n]]->weights.size());
  }

  children.reshape(d, total);
  for_blocks(threads, N, block, [&](std::size_t begin, std::size_t count, std::size_t) {
    for (std::size_t n = begin; n < begin + count; ++n) {
      const std::size_t a = directions_[n];
      const std::size_t points = a == 0 ? 1 : static_cast<std::size_t>(rules[a]->weights.size());
      for (std::size_t q = 0; q < points; ++q) {
        const std::size_t child = first_[n] + q;
        children.log_weight[child] = parents.log_weight[n];
        if (a > 0) children.log_weight[child] += std::log(rules[a]->weights(static_cast<Eigen::Index>(q)));
        for (std::size_t i = 0; i < d; ++i) {
          double x = parents.mean(i, n);
          for (std::size_t k = 0; k < a; ++k)
            x += axes_(i * d + (d - a + k), n) *
                 rules[a]->points(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(q));
          children.mean(i, child) = x;
        }
        for (std::size_t c = 0; c < d * d; ++c) children.covariance(c, child) = narrow_(c, n);
      }
    }
  });
}

}  // namespace wienertree
