#include "wienertree/filter/component_merge.hpp"

#include <algorithm>
#include <cmath>

#include "wienertree/filter/small_matrix.hpp"
#include "wienertree/numeric/log_weights.hpp"

namespace wienertree {

MixtureMoments moments(const GaussianComponents& c) {
  const std::size_t d = c.states();
  const auto rows = static_cast<Eigen::Index>(d);
  const double largest = largest_log_weight(c.log_weight).value;
  MixtureMoments out;
  out.mean = Eigen::VectorXd::Zero(rows);
  out.covariance = Eigen::MatrixXd::Zero(rows, rows);
  double mass = 0, squares = 0;
  for (std::size_t n = 0; n < c.size(); ++n) {
    const double w = std::exp(c.log_weight[n] - largest);
    mass += w;
    squares += w * w;
    for (std::size_t i = 0; i < d; ++i) out.mean(static_cast<Eigen::Index>(i)) += w * c.mean(i, n);
  }
  out.mean /= mass;
  for (std::size_t n = 0; n < c.size(); ++n) {
    const double w = std::exp(c.log_weight[n] - largest) / mass;
    if (!(w > 0)) continue;
    for (std::size_t i = 0; i < d; ++i)
      for (std::size_t j = 0; j <= i; ++j) {
        const auto I = static_cast<Eigen::Index>(i), J = static_cast<Eigen::Index>(j);
        out.covariance(I, J) +=
            w * (c.covariance(i * d + j, n) + (c.mean(i, n) - out.mean(I)) * (c.mean(j, n) - out.mean(J)));
      }
  }
  out.covariance.triangularView<Eigen::StrictlyUpper>() = out.covariance.transpose();
  out.log_mass = largest + std::log(mass);
  out.effective_size = mass * mass / squares;
  return out;
}

void ComponentMerge::drop_negligible(GaussianComponents& c, double part) {
  const double least = largest_log_weight(c.log_weight).value + std::log(part);
  std::size_t kept = 0;
  for (const double w : c.log_weight) kept += w >= least ? 1 : 0;
  if (kept == c.size()) return;
  GaussianComponents out;
  out.reshape(c.states(), kept);
  std::size_t to = 0;
  for (std::size_t n = 0; n < c.size(); ++n) {
    if (!(c.log_weight[n] >= least)) continue;
    out.log_weight[to] = c.log_weight[n];
    for (std::size_t i = 0; i < c.mean.components(); ++i) out.mean(i, to) = c.mean(i, n);
    for (std::size_t i = 0; i < c.covariance.components(); ++i) out.covariance(i, to) = c.covariance(i, n);
    ++to;
  }
  c.swap(out);
}

// Orders the patch so that what lies below the cut comes first; returns where it is.
std::size_t ComponentMerge::cut(const Patch& patch) {
  const std::size_t d = white_.components();
  double total = 0;
  for_dimension(d, [&](auto dimension) {
    constexpr int D = decltype(dimension)::value;
    const auto rows = static_cast<Eigen::Index>(d);
    SmallVector<D> mean = SmallVector<D>::Zero(rows);
    for (std::size_t k = patch.first; k < patch.last; ++k) {
      const std::size_t n = order_[k];
      total += share_[n];
      for (std::size_t i = 0; i < d; ++i) mean(static_cast<Eigen::Index>(i)) += share_[n] * white_(i, n);
    }
    mean /= total;
    SmallSquare<D> covariance = SmallSquare<D>::Zero(rows, rows);
    for (std::size_t k = patch.first; k < patch.last; ++k) {
      const std::size_t n = order_[k];
      const SmallVector<D> e = vector_of<D>(white_, d, n) - mean;
      covariance.noalias() += share_[n] * e * e.transpose();
    }
    const SymmetricEigen<D> eigen(covariance);
    SmallVector<D> axis = eigen.vectors.col(rows - 1);
    Eigen::Index leading = 0;
    axis.cwiseAbs().maxCoeff(&leading);
    if (axis(leading) < 0) axis = -axis;
    for (std::size_t k = patch.first; k < patch.last; ++k)
      place_[order_[k]] = axis.dot(vector_of<D>(white_, d, order_[k]) - mean);
  });
  const double wanted = total * static_cast<double>(patch.parts / 2) / static_cast<double>(patch.parts);
  // Weighted selection: the side that holds the wanted share is searched on.
  const auto begin = order_.begin();
  std::size_t low = patch.first, high = patch.last;
  double below = 0;
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    return place_[a] < place_[b] || (place_[a] == place_[b] && a < b);
  };
  while (high - low > 16) {
    const std::size_t middle = low + (high - low) / 2;
    std::nth_element(begin + static_cast<std::ptrdiff_t>(low), begin + static_cast<std::ptrdiff_t>(middle),
                     begin + static_cast<std::ptrdiff_t>(high), before);
    double half = 0;
    for (std::size_t k = low; k < middle; ++k) half += share_[order_[k]];
    if (below + half < wanted) {
      below += half;
      low = middle;
    } else {
      high = middle;
    }
  }
  std::sort(begin + static_cast<std::ptrdiff_t>(low), begin + static_cast<std::ptrdiff_t>(high), before);
  while (low < high && below + share_[order_[low]] / 2 < wanted) below += share_[order_[low++]];
  // Each side keeps a component for every part, or at least one.
  const std::size_t left = patch.parts / 2, right = patch.parts - left;
  const std::size_t least = std::min(left, patch.last - patch.first - 1);
  low = std::clamp(low, patch.first + std::max<std::size_t>(least, 1),
                   std::max(patch.first + 1, patch.last - std::min(right, patch.last - patch.first - 1)));
  return low;
}

void ComponentMerge::gather(const Patch& patch, const GaussianComponents& from, std::size_t to) {
  const std::size_t d = from.states();
  double mass = 0;
  for (std::size_t k = patch.first; k < patch.last; ++k) mass += weight_[order_[k]];
  const auto part = [&](std::size_t k) {
    return mass > 0 ? weight_[order_[k]] / mass : 1.0 / static_cast<double>(patch.last - patch.first);
  };
  const std::size_t origin = order_[patch.first];
  for (std::size_t i = 0; i < d; ++i) {
    double sum = 0;
    for (std::size_t k = patch.first; k < patch.last; ++k)
      sum += part(k) * (from.mean(i, order_[k]) - from.mean(i, origin));
    merged_.mean(i, to) = from.mean(i, origin) + sum;
  }
  for (std::size_t i = 0; i < d; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = 0;
      for (std::size_t k = patch.first; k < patch.last; ++k) {
        const std::size_t n = order_[k];
        sum += part(k) * (from.covariance(i * d + j, n) +
                          (from.mean(i, n) - merged_.mean(i, to)) * (from.mean(j, n) - merged_.mean(j, to)));
      }
      merged_.covariance(i * d + j, to) = merged_.covariance(j * d + i, to) = sum;
    }
  merged_.log_weight[to] = std::log(mass);
}

// Weights, shares, and the means in coordinates W (m - origin).
void ComponentMerge::lay_out(const GaussianComponents& c, const Eigen::MatrixXd& W,
                             const Eigen::VectorXd& origin, double log_mass) {
  const std::size_t d = c.states(), N = c.size();
  white_.reshape(d, N);
  weight_.resize(N);
  share_.resize(N);
  place_.resize(N);
  order_.resize(N);
  double roots = 0;
  for (std::size_t n = 0; n < N; ++n) {
    weight_[n] = std::exp(c.log_weight[n] - log_mass);
    roots += std::sqrt(weight_[n]);
    order_[n] = static_cast<std::uint32_t>(n);
  }
  for (std::size_t n = 0; n < N; ++n)
    share_[n] = 0.7 * std::sqrt(weight_[n]) / roots + 0.3 / static_cast<double>(N);
  for (std::size_t i = 0; i < d; ++i) {
    double* out = white_.component(i).data();
    std::fill_n(out, N, 0.0);
    for (std::size_t j = 0; j < d; ++j) {
      const double factor = W(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      const double mean = origin(static_cast<Eigen::Index>(j));
      const double* x = c.mean.component(j).data();
      for (std::size_t n = 0; n < N; ++n) out[n] += factor * (x[n] - mean);
    }
  }
}

// Each patch becomes one component.
void ComponentMerge::join(GaussianComponents& c, double log_mass) {
  merged_.reshape(c.states(), patches_.size());
  for (std::size_t k = 0; k < patches_.size(); ++k) gather(patches_[k], c, k);
  for (double& w : merged_.log_weight) w += log_mass;
  c.swap(merged_);
}

void ComponentMerge::merge(GaussianComponents& c, std::size_t most) {
  if (c.size() <= most) return;
  const MixtureMoments law = moments(c);
  const Whitening<Eigen::Dynamic> white{SmallSquare<Eigen::Dynamic>(law.covariance)};
  lay_out(c, white.whitening, law.mean, law.log_mass);
  patches_.clear();
  open_.assign(1, {0, c.size(), most});
  while (!open_.empty()) {
    const Patch patch = open_.back();
    open_.pop_back();
    const std::size_t count = patch.last - patch.first;
    if (patch.parts == 1 || count == 1) {
      patches_.push_back(patch);
    } else if (count <= patch.parts) {
      for (std::size_t k = patch.first; k < patch.last; ++k) patches_.push_back({k, k + 1, 1});
    } else {
      const std::size_t at = cut(patch);
      open_.push_back({at, patch.last, patch.parts - patch.parts / 2});
      open_.push_back({patch.first, at, patch.parts / 2});
    }
  }
  join(c, law.log_mass);
}

bool ComponentMerge::is_close(const Patch& patch, const GaussianComponents& c, const Eigen::MatrixXd& W,
                              double width) const {
  const auto d = static_cast<Eigen::Index>(c.states());
  double mass = 0;
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(d);
  Eigen::MatrixXd P = Eigen::MatrixXd::Zero(d, d);
  const auto covariance = [&](std::size_t n) {
    return Eigen::MatrixXd(square_of<Eigen::Dynamic>(c.covariance, c.states(), n));
  };
  for (std::size_t k = patch.first; k < patch.last; ++k) {
    const std::size_t n = order_[k];
    mass += weight_[n];
    mean += weight_[n] * vector_of<Eigen::Dynamic>(white_, c.states(), n);
    P += weight_[n] * covariance(n);
  }
  if (!(mass > 0)) return true;
  mean /= mass;
  P /= mass;
  Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(d, d);
  double square = 0;
  for (std::size_t k = patch.first; k < patch.last; ++k) {
    const std::size_t n = order_[k];
    const Eigen::VectorXd e = vector_of<Eigen::Dynamic>(white_, c.states(), n) - mean;
    spread += weight_[n] / mass * e * e.transpose();
    square += weight_[n] / mass * (W * (covariance(n) - P) * W.transpose()).squaredNorm();
  }
  return square <= width * width * width &&
         SymmetricEigen<Eigen::Dynamic>(spread).values(d - 1) <= width * width;
}

void ComponentMerge::merge_close(GaussianComponents& c, const Eigen::MatrixXd& W, double width) {
  if (c.size() < 2) return;
  const MixtureMoments law = moments(c);
  lay_out(c, W, law.mean, law.log_mass);
  patches_.clear();
  open_.assign(1, {0, c.size(), 2});
  while (!open_.empty()) {
    const Patch patch = open_.back();
    open_.pop_back();
    if (patch.last - patch.first == 1 || is_close(patch, c, W, width)) {
      patches_.push_back(patch);
      continue;
    }
    const std::size_t at = cut(patch);
    open_.push_back({at, patch.last, 2});
    open_.push_back({patch.first, at, 2});
  }
  if (patches_.size() < c.size()) join(c, law.log_mass);
}

}  // namespace wienertree
