#include "wienertree/filter/component_split.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "wienertree/filter/expectation.hpp"
#include "wienertree/filter/small_matrix.hpp"

namespace wienertree {
namespace {

constexpr std::size_t block = 64;
constexpr double spacing = 1.6, reach = 5;  // of a lattice, in kappa and standard deviations
constexpr double least = 0.02;              // residual that is worth a division, in kappa^2
constexpr int most_points = 201;            // of one direction

// Rules of Gauss and Hermite and the residuals, in kappa, up to which their points are no farther apart than a lattice's:
// the largest distances are 1.732, 1.356 and 1.154.
struct SmallRule {
  int points;
  double residual;
};
constexpr std::array small_rules = {SmallRule{3, spacing / 1.7321}, SmallRule{5, spacing / 1.3556},
                                    SmallRule{7, spacing / 1.1545}};

int points_for(double residual) {  // r/kappa
  for (const SmallRule& rule : small_rules)
    if (residual <= rule.residual) return rule.points;
  // Odd, so that the mean is one of them.
  return std::min(most_points, static_cast<int>(std::ceil(reach * residual / spacing)) * 2 + 1);
}

// The largest residual, in kappa, that so many points are used for where all there should be are too many: parts are
// then up to 2.4 * 1.6 kappa apart between neighbours of one parent (of few points there are many parents, whose parts
// lie between one another's), and 1.6 * 1.6 kappa in a lattice.
double residual_of(int points) {
  constexpr double few = 2.4, many = 1.6;
  for (const SmallRule& rule : small_rules)
    if (points <= rule.points) return few * rule.residual;
  return std::max(few * small_rules.back().residual, many * spacing * (points - 1) / (2 * reach));
}

// Equidistant points over +-5 standard deviations, weights those of the density: for spacings up to .8 the trapezoidal
// rule has all moments to 1e-12 but for what lies beyond.
GaussianCubature lattice(int points) {
  GaussianCubature out;
  out.points.resize(1, points);
  out.weights.resize(points);
  for (int q = 0; q < points; ++q) {
    out.points(0, q) = reach * (2.0 * q / (points - 1) - 1);
    out.weights(q) = std::exp(-out.points(0, q) * out.points(0, q) / 2);
  }
  out.weights /= out.weights.sum();
  // What is cut off at 5 standard deviations, 1e-5 of the variance, is given back by their scale.
  out.points /= std::sqrt(out.weights.dot(out.points.row(0).cwiseAbs2()));
  return out;
}

}  // namespace

const GaussianCubature& ComponentSplit::rule(int directions, int points) {
  const auto key = std::pair(directions, points);
  const auto found = rules_.find(key);
  if (found != rules_.end()) return found->second;
  return rules_
      .emplace(key, directions > 1                        ? gaussian_cubature_5(directions)
                    : points <= small_rules.back().points ? gauss_hermite(1, points)
                                                          : lattice(points))
      .first->second;
}

void ComponentSplit::split(const GaussianComponents& parents, const Eigen::MatrixXd& S, double kappa,
                           std::size_t wanted, std::size_t most, GaussianComponents& children,
                           ThreadPool* threads) {
  const std::size_t d = parents.states(), N = parents.size();
  const double cap = kappa * kappa;
  axes_.reshape(d * d, N);
  eigenvalues_.reshape(d, N);
  points_.resize(d * N);
  first_.resize(N + 1);
  for_dimension(d, [&](auto dimension) {
    constexpr int D = decltype(dimension)::value;
    const Whitening<D> law{SmallSquare<D>(S)};
    for_blocks(threads, N, block, [&](std::size_t begin, std::size_t count, std::size_t) {
      for (std::size_t n = begin; n < begin + count; ++n) {
        const SmallSquare<D> P = square_of<D>(parents.covariance, d, n);
        const SymmetricEigen<D> eigen(SmallSquare<D>(law.whitening * P * law.whitening.transpose()));
        put_vector(eigen.values, eigenvalues_, n);
        put_square(SmallSquare<D>(law.axes * eigen.vectors), axes_, n);
      }
    });
  });

  // Points of each direction, none above `limit`; the number of all parts.
  const auto count_parts = [&](int limit, double finer) {
    std::size_t total = 0;
    for (std::size_t n = 0; n < N; ++n) {
      first_[n] = total;
      std::size_t parts = 1, divided = 0, by_three = 0;
      for (std::size_t k = 0; k < d; ++k) {
        const double residual = eigenvalues_(k, n) - cap;
        const int points =
            residual > least * cap ? std::min(limit, points_for(finer * std::sqrt(residual) / kappa)) : 1;
        points_[n * d + k] = static_cast<std::uint8_t>(points);
        parts *= static_cast<std::size_t>(points);
        divided += points > 1 ? 1 : 0;
        by_three += points == 3 ? 1 : 0;
      }
      if (divided > 1 && by_three == divided)
        parts = static_cast<std::size_t>(rule(static_cast<int>(divided), 3).weights.size());
      total += parts;
    }
    first_[N] = total;
    return total;
  };
  double finer = 8;
  while (finer > 1 && count_parts(most_points, finer) > wanted) finer = std::max(1.0, finer / 1.25);
  int limit = most_points;
  while (count_parts(limit, finer) > most && limit > 3) limit = limit > 15 ? limit * 4 / 5 | 1 : limit - 2;

  // Every rule that is needed is made before the threads ask for it.
  for (std::size_t k = 1; k <= d; ++k) rule(static_cast<int>(k), 3);
  for (const std::uint8_t points : points_) rule(1, points > 1 ? points : 3);
  children.reshape(d, first_[N]);
  for_dimension(d, [&](auto dimension) {
    constexpr int D = decltype(dimension)::value;
    const auto rows = static_cast<Eigen::Index>(d);
    for_blocks(threads, N, block, [&](std::size_t begin, std::size_t count, std::size_t) {
      SmallSquare<D> axes = SmallSquare<D>::Zero(rows, rows);
      std::array<const GaussianCubature*, 16> along{};
      std::array<Eigen::Index, 16> at{};
      for (std::size_t n = begin; n < begin + count; ++n) {
        SmallSquare<D> narrow = square_of<D>(parents.covariance, d, n);
        const SmallSquare<D> v = square_of<D>(axes_, d, n);
        Eigen::Index a = 0;
        std::size_t product = 1;
        for (std::size_t k = 0; k < d; ++k) {
          const int points = points_[n * d + k];
          if (points == 1) continue;
          // Clipped to what the points suffice for: r^2 = e - kappa_k^2, r <= residual_of(points) kappa_k.
          const double e = eigenvalues_(k, n), widest = residual_of(points);
          const double clip = std::max(cap, e / (1 + widest * widest));
          axes.col(a) = std::sqrt(e - clip) * v.col(static_cast<Eigen::Index>(k));
          narrow.noalias() -= axes.col(a) * axes.col(a).transpose();
          along[static_cast<std::size_t>(a++)] = &rules_.at({1, points});
          product *= static_cast<std::size_t>(points);
        }
        const std::size_t parts = first_[n + 1] - first_[n];
        const GaussianCubature* together = parts == product ? nullptr : &rules_.at({static_cast<int>(a), 3});
        at.fill(0);
        for (std::size_t q = 0; q < parts; ++q) {
          const std::size_t child = first_[n] + q;
          double weight = 1;
          SmallVector<D> x = vector_of<D>(parents.mean, d, n);
          for (Eigen::Index k = 0; k < a; ++k) {
            const auto K = static_cast<std::size_t>(k);
            const double z = together != nullptr ? together->points(k, static_cast<Eigen::Index>(q))
                                                 : along[K]->points(0, at[K]);
            if (together == nullptr) weight *= along[K]->weights(at[K]);
            x += z * axes.col(k);
          }
          if (together != nullptr) weight = together->weights(static_cast<Eigen::Index>(q));
          for (std::size_t k = 0; k < static_cast<std::size_t>(a); ++k) {
            if (++at[k] < along[k]->weights.size()) break;
            at[k] = 0;
          }
          children.log_weight[child] = parents.log_weight[n] + std::log(weight);
          put_vector(x, children.mean, child);
          put_square(narrow, children.covariance, child);
        }
      }
    });
  });
}

}  // namespace wienertree
