#include "wienertree/thinning/recombination/householder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "wienertree/numeric/clones.hpp"
#include "wienertree/thinning/recombination/vectors.hpp"

namespace wienertree::recombination {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

/// x -= scale v (v . x) for the rows of x, v being zero before entry k. Four rows at a time share the loads
/// of v and hide each other's latency.
[[gnu::always_inline]] inline void reflect(double* x, std::size_t x_stride, std::size_t count,
                                           const double* v, double scale, std::size_t k, std::size_t stride) {
  const std::size_t first = k / lanes * lanes, n = stride - first;
  v += first;
  x += first;
  std::size_t c = 0;
  for (; c + 4 <= count; c += 4, x += 4 * x_stride) {
    double *x0 = x, *x1 = x0 + x_stride, *x2 = x1 + x_stride, *x3 = x2 + x_stride;
    Four s0{}, s1{}, s2{}, s3{};
    for (std::size_t i = 0; i < n; i += 4) {
      const Four w = four(v + i);
      s0 += w * four(x0 + i);
      s1 += w * four(x1 + i);
      s2 += w * four(x2 + i);
      s3 += w * four(x3 + i);
    }
    const double f0 = -scale * sum(s0), f1 = -scale * sum(s1), f2 = -scale * sum(s2), f3 = -scale * sum(s3);
    for (std::size_t i = 0; i < n; i += 4) {
      const Four w = four(v + i);
      four(x0 + i) += f0 * w;
      four(x1 + i) += f1 * w;
      four(x2 + i) += f2 * w;
      four(x3 + i) += f3 * w;
    }
  }
  for (; c < count; ++c, x += x_stride) add_multiple(x, -scale * dot(v, x, n), v, n);
}

}  // namespace

WIENERTREE_CLONES std::size_t pivoted_householder(double* rows, std::size_t count, std::size_t n,
                                                  std::size_t stride, double* v, double* scale, double* norm,
                                                  double* reference) {
  // Squared length of row c from entry k on; what lies before k belongs to R.
  const auto remaining = [&](std::size_t c, std::size_t k) {
    const double* x = rows + c * stride;
    double sum = 0;
    std::size_t i = k;
    for (; i % lanes != 0 && i < n; ++i) sum += x[i] * x[i];
    return i < n ? sum + dot(x + i, x + i, stride - i) : sum;
  };
  for (std::size_t c = 0; c < count; ++c) norm[c] = reference[c] = remaining(c, 0);
  const std::size_t most = std::min(n, count);
  double longest = 0;
  for (std::size_t k = 0; k < most; ++k, v += stride) {
    const auto pivot = static_cast<std::size_t>(std::max_element(norm + k, norm + count) - norm);
    double* x = rows + k * stride;
    if (pivot != k) {
      std::swap_ranges(x, x + stride, rows + pivot * stride);
      norm[pivot] = norm[k];
      reference[pivot] = reference[k];
    }
    const double length = std::sqrt(remaining(k, k));
    if (k == 0) longest = length;
    if (!(length > static_cast<double>(n) * epsilon * longest)) return k;
    std::fill_n(v, k, 0.0);
    std::copy(x + k, x + stride, v + k);
    scale[k] = 1 / (length * (length + std::abs(x[k])));  // 2 / v . v
    v[k] += std::copysign(length, x[k]);
    reflect(x + stride, stride, count - k - 1, v, scale[k], k, stride);
    for (std::size_t c = k + 1; c < count; ++c) {
      const double r = rows[c * stride + k];
      norm[c] -= r * r;
      if (norm[c] <= 1e-8 * reference[c]) norm[c] = reference[c] = remaining(c, k + 1);
    }
  }
  return most;
}

WIENERTREE_CLONES void last_columns(const double* v, const double* scale, std::size_t rank, std::size_t n,
                                    std::size_t stride, double* null, std::size_t null_stride) {
  std::fill_n(null, (n - rank) * null_stride, 0.0);
  for (std::size_t j = rank; j < n; ++j) null[(j - rank) * null_stride + j] = 1;
  for (std::size_t k = rank; k-- > 0;)
    reflect(null, null_stride, n - rank, v + k * stride, scale[k], k, stride);
}

WIENERTREE_CLONES void integrate_further(double* null, std::size_t nullity, std::size_t null_stride,
                                         std::size_t stride, const double* further, std::size_t count) {
  for (std::size_t j = 0; j < nullity; ++j) {
    double* x = null + j * null_stride;
    for (std::size_t f = 0; f < count; ++f) x[stride + f] = dot(x, further + f * stride, stride);
    std::fill(x + stride + count, x + null_stride, 0.0);
  }
}

}  // namespace wienertree::recombination
