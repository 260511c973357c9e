#include "wienertree/model/affine_flow.hpp"

#include <algorithm>
#include <cmath>

namespace wienertree {

namespace {

// C <- A B, m x m. Both operands are polynomials of one matrix, so that row and column order do not matter.
void multiply(std::span<const double> A, std::span<const double> B, std::size_t m, std::span<double> C) {
  std::fill(C.begin(), C.end(), 0.0);
  for (std::size_t i = 0; i < m; ++i)
    for (std::size_t k = 0; k < m; ++k) {
      const double a = A[i * m + k];
      for (std::size_t j = 0; j < m; ++j) C[i * m + j] += a * B[k * m + j];
    }
}

double infinity_norm(std::span<const double> M, std::size_t m) {
  double norm = 0;
  for (std::size_t i = 0; i < m; ++i) {
    double row = 0;
    for (std::size_t j = 0; j < m; ++j) row += std::abs(M[i * m + j]);
    norm = std::max(norm, row);
  }
  return norm;
}

// Buffers of a thread, grown once.
std::span<double> thread_buffer(std::size_t size) {
  thread_local std::vector<double> buffer;
  if (buffer.size() < size) buffer.resize(size);
  return {buffer.data(), size};
}

}  // namespace

void exponential_minus_identity(std::span<const double> M, std::size_t m, std::span<double> F,
                                std::span<double> scratch) {
  // Halved until its norm is at most 1/2, where the first omitted term is below 2^-17/17! = 2e-20.
  constexpr int terms = 16;
  const double norm = infinity_norm(M, m);
  const int halvings = norm > 0.5 && std::isfinite(norm) ? std::max(0, std::ilogb(norm) + 2) : 0;
  const std::span<double> power = scratch.subspan(0, m * m), next = scratch.subspan(m * m, m * m);
  const double scale = std::ldexp(1.0, -halvings);
  // Horner: F = M (Id + M/2 (Id + M/3 (..)))
  for (std::size_t i = 0; i < m * m; ++i) power[i] = scale * M[i];
  std::copy(power.begin(), power.end(), F.begin());
  for (std::size_t i = 0; i < m * m; ++i) F[i] /= terms;
  for (int n = terms - 1; n >= 1; --n) {
    multiply(power, F, m, next);
    for (std::size_t i = 0; i < m * m; ++i) F[i] = (power[i] + next[i]) / n;
  }
  for (int doubling = 0; doubling < halvings; ++doubling) {
    multiply(F, F, m, next);
    for (std::size_t i = 0; i < m * m; ++i) F[i] = 2.0 * F[i] + next[i];
  }
}

AffineFlow::AffineFlow(AffineFields fields)
    : fields_(std::move(fields)),
      translation_(std::all_of(fields_.linear.begin(), fields_.linear.end(),
                               [](const Eigen::MatrixXd& A) { return (A.array() == 0.0).all(); })) {}

void AffineFlow::operator()(std::span<const double> D, BatchView x) const {
  if (translation_)
    translate(D, x);
  else if (x.components() == 1)
    flow_scalar(D, x);
  else
    flow_general(D, x);
}

void AffineFlow::translate(std::span<const double> D, BatchView x) const {
  for (std::size_t i = 0; i < x.components(); ++i) {
    double shift = 0;
    for (std::size_t k = 0; k < D.size(); ++k)
      shift += D[k] * fields_.constant[k](static_cast<Eigen::Index>(i));
    for (double& value : x.component(i)) value += shift;
  }
}

void AffineFlow::flow_scalar(std::span<const double> D, BatchView x) const {
  double a = 0, b = 0;
  for (std::size_t k = 0; k < D.size(); ++k) {
    a += D[k] * fields_.linear[k](0, 0);
    b += D[k] * fields_.constant[k](0);
  }
  const double growth = std::expm1(a);
  const double shift = a == 0 ? b : b * (growth / a);
  for (double& value : x.component(0)) value += growth * value + shift;
}

void AffineFlow::flow_general(std::span<const double> D, BatchView x) const {
  const std::size_t d = x.components(), m = d + 1;
  constexpr std::size_t block = 128;
  const std::span<double> buffer = thread_buffer(4 * m * m + d * block);
  const std::span<double> M = buffer.subspan(0, m * m), F = buffer.subspan(m * m, m * m);
  const std::span<double> old = buffer.subspan(4 * m * m);
  std::fill(M.begin(), M.end(), 0.0);
  for (std::size_t k = 0; k < D.size(); ++k) {
    if (D[k] == 0) continue;
    for (std::size_t i = 0; i < d; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      for (std::size_t l = 0; l < d; ++l)
        M[i * m + l] += D[k] * fields_.linear[k](row, static_cast<Eigen::Index>(l));
      M[i * m + d] += D[k] * fields_.constant[k](row);
    }
  }
  exponential_minus_identity(M, m, F, buffer.subspan(2 * m * m, 2 * m * m));
  for (std::size_t first = 0; first < x.nodes(); first += block) {
    const std::size_t count = std::min(block, x.nodes() - first);
    const BatchView nodes = x.nodes(first, count);
    for (std::size_t l = 0; l < d; ++l) std::copy_n(nodes.component(l).data(), count, old.data() + l * block);
    for (std::size_t i = 0; i < d; ++i) {
      double* const out = nodes.component(i).data();
      for (std::size_t l = 0; l < d; ++l) {
        const double factor = F[i * m + l];
        const double* const in = old.data() + l * block;
        if (factor == 0) continue;
        for (std::size_t n = 0; n < count; ++n) out[n] += factor * in[n];
      }
      const double shift = F[i * m + d];
      for (std::size_t n = 0; n < count; ++n) out[n] += shift;
    }
  }
}

}  // namespace wienertree
