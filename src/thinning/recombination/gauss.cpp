#include "wienertree/thinning/recombination/gauss.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>

#include "wienertree/numeric/clones.hpp"
#include "wienertree/numeric/error.hpp"
#include "wienertree/thinning/recombination/vectors.hpp"

namespace wienertree::recombination {
namespace {

constexpr double negligible = 1e-14;  ///< off-diagonal entries below this, for points in [-1,1]

// r -= Q^T Q r for the first k rows of Q.
[[gnu::always_inline]] inline void orthogonalise(const double* Q, std::size_t k, std::size_t stride,
                                                 double* r) {
  for (std::size_t l = 0; l < k; ++l)
    add_multiple(r, -dot(Q + l * stride, r, stride), Q + l * stride, stride);
}

// Step k of Lanczos' iteration: row k of Q is given, of length 1, and row k + 1 becomes the next one times
// its beta. Returns beta; alpha becomes the diagonal entry.
WIENERTREE_CLONES double lanczos_step(const double* z, double* Q, std::size_t k, std::size_t stride,
                                      double& alpha) {
  const double* q = Q + k * stride;
  double* r = Q + (k + 1) * stride;
  for (std::size_t i = 0; i < stride; ++i) r[i] = z[i] * q[i];
  alpha = dot(q, r, stride);
  const double before = dot(r, r, stride);
  // Nearest first: what the three-term recurrence takes away, then what rounding has left of the others.
  add_multiple(r, -alpha, q, stride);
  orthogonalise(Q, k + 1, stride, r);
  // What cancels by more than a digit is done twice (Daniel, Gragg, Kaufman, Stewart 1976, Math. Comp. 30).
  double after = dot(r, r, stride);
  if (after < 0.01 * before) {
    orthogonalise(Q, k + 1, stride, r);
    after = dot(r, r, stride);
  }
  return std::sqrt(after);
}

WIENERTREE_CLONES void divide(double* r, double divisor, std::size_t stride) {
  for (std::size_t i = 0; i < stride; ++i) r[i] /= divisor;
}

}  // namespace

std::size_t DiscreteGauss::compute(std::span<const double> z, std::span<const double> w, std::size_t s) {
  assert(z.size() == w.size() && s >= 1);
  recurrence(z, w, s);
  eigenvalues();
  const auto [low, high] = std::minmax_element(z.begin(), z.end());
  double sum = 0;
  for (std::size_t j = 0; j < count_; ++j) sum += first_[j] *= first_[j];
  for (std::size_t j = 0; j < count_; ++j) {
    first_[j] /= sum;
    diagonal_[j] = std::clamp(diagonal_[j], *low, *high);
  }
  return count_;
}

void DiscreteGauss::recurrence(std::span<const double> z, std::span<const double> w, std::size_t s) {
  const std::size_t n = z.size(), stride = padded(n);
  grow(vectors_, (s + 1) * stride);
  grow(padded_, stride);
  for (std::vector<double>* v : {&diagonal_, &off_diagonal_, &first_}) grow(*v, s);
  std::copy(z.begin(), z.end(), padded_.begin());
  std::fill_n(padded_.begin() + static_cast<std::ptrdiff_t>(n), stride - n, 0.0);
  const double total = std::accumulate(w.begin(), w.end(), 0.0);
  for (std::size_t i = 0; i < n; ++i) vectors_[i] = std::sqrt(w[i] / total);
  std::fill_n(vectors_.begin() + static_cast<std::ptrdiff_t>(n), stride - n, 0.0);
  first_change_ = 1;
  for (count_ = 0; count_ < s;) {
    const std::size_t k = count_++;
    const double beta = lanczos_step(padded_.data(), vectors_.data(), k, stride, diagonal_[k]);
    off_diagonal_[k] = beta;
    if (beta <= negligible) {
      first_change_ = 0;
      return;
    }
    first_change_ *= beta * beta;
    if (count_ < s) divide(vectors_.data() + count_ * stride, beta, stride);
  }
}

/// EISPACK's imtql2 for the first row of the eigenvectors only.
void DiscreteGauss::eigenvalues() {
  constexpr int most_iterations = 60;
  const std::size_t n = count_;
  double *d = diagonal_.data(), *e = off_diagonal_.data(), *u = first_.data();
  std::fill_n(u, n, 0.0);
  u[0] = 1;
  e[n - 1] = 0;
  for (std::size_t l = 0; l < n; ++l) {
    for (int iteration = 0;; ++iteration) {
      std::size_t m = l;
      while (m + 1 < n &&
             std::abs(e[m]) > std::numeric_limits<double>::epsilon() * (std::abs(d[m]) + std::abs(d[m + 1])))
        ++m;
      if (m == l) break;
      if (iteration == most_iterations)
        throw RunError(fmt::format("the nodes of a Gauss quadrature of {} nodes did not converge", n),
                       "recombination");
      double g = (d[l + 1] - d[l]) / (2 * e[l]);
      double r = std::sqrt(g * g + 1);
      g = d[m] - d[l] + e[l] / (g + std::copysign(r, g));
      double s = 1, c = 1, p = 0;
      bool deflated = false;
      for (std::size_t i = m; i-- > l;) {
        const double f = s * e[i], b = c * e[i];
        r = std::sqrt(f * f + g * g);
        e[i + 1] = r;
        if (r == 0) {
          d[i + 1] -= p;
          e[m] = 0;
          deflated = true;
          break;
        }
        s = f / r;
        c = g / r;
        g = d[i + 1] - p;
        r = (d[i] - g) * s + 2 * c * b;
        p = s * r;
        d[i + 1] = g + p;
        g = c * r - b;
        const double upper = u[i + 1];
        u[i + 1] = s * u[i] + c * upper;
        u[i] = c * u[i] - s * upper;
      }
      if (deflated) continue;
      d[l] -= p;
      e[l] = g;
      e[m] = 0;
    }
  }
  for (std::size_t i = 1; i < n; ++i)
    for (std::size_t j = i; j > 0 && d[j] < d[j - 1]; --j) {
      std::swap(d[j], d[j - 1]);
      std::swap(u[j], u[j - 1]);
    }
}

}  // namespace wienertree::recombination
