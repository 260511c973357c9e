#include "wienertree/cubature/block_diagonal.hpp"

#include <cassert>
#include <cmath>
#include <utility>

namespace wienertree {

BlockDiagonalLU::BlockDiagonalLU(std::size_t dimension, std::size_t capacity)
    : dimension_(dimension),
      capacity_(capacity),
      factors_(dimension * dimension * capacity),
      exchanged_(dimension * dimension * capacity) {}

bool BlockDiagonalLU::factor(double gamma, ConstBatchView jacobian) {
  const std::size_t d = dimension_, nodes = jacobian.nodes();
  assert(jacobian.components() == d * d && nodes <= capacity_);
  for (std::size_t i = 0; i < d; ++i)
    for (std::size_t l = 0; l < d; ++l) {
      const auto J = jacobian.component(i * d + l);
      double* A = entry(i, l);
      for (std::size_t n = 0; n < nodes; ++n) A[n] = (i == l ? 1.0 : 0.0) - gamma * J[n];
    }
  double poison = 0;
  for (std::size_t k = 0; k < d; ++k) {
    double* pivot = entry(k, k);
    // Comparing row k with each row below, and exchanging when the other is larger, leaves the largest in row
    // k.
    for (std::size_t r = k + 1; r < d; ++r) {
      std::uint8_t* swap = exchanged(k, r);
      const double* rival = entry(r, k);
      for (std::size_t n = 0; n < nodes; ++n) swap[n] = std::abs(rival[n]) > std::abs(pivot[n]);
      for (std::size_t l = k; l < d;
           ++l) {  // the multipliers to the left stay: `solve` repeats the exchanges in order
        double *upper = entry(k, l), *lower = entry(r, l);
        for (std::size_t n = 0; n < nodes; ++n) {
          const double a = upper[n], b = lower[n];
          upper[n] = swap[n] ? b : a;
          lower[n] = swap[n] ? a : b;
        }
      }
    }
    for (std::size_t n = 0; n < nodes; ++n) {
      pivot[n] = 1 / pivot[n];
      poison += pivot[n] - pivot[n];  // NaN for a pivot of 0 or NaN
    }
    for (std::size_t r = k + 1; r < d; ++r) {
      double* multiplier = entry(r, k);
      for (std::size_t n = 0; n < nodes; ++n) multiplier[n] *= pivot[n];
      for (std::size_t l = k + 1; l < d; ++l) {
        const double* upper = entry(k, l);
        double* lower = entry(r, l);
        for (std::size_t n = 0; n < nodes; ++n) lower[n] -= multiplier[n] * upper[n];
      }
    }
  }
  return poison == 0;
}

void BlockDiagonalLU::solve(BatchView x) const {
  const std::size_t d = dimension_, nodes = x.nodes();
  for (std::size_t k = 0; k < d; ++k) {
    double* b = x.component(k).data();
    for (std::size_t r = k + 1; r < d; ++r) {
      const std::uint8_t* swap = exchanged(k, r);
      double* c = x.component(r).data();
      for (std::size_t n = 0; n < nodes; ++n) {
        const double u = b[n], v = c[n];
        b[n] = swap[n] ? v : u;
        c[n] = swap[n] ? u : v;
      }
    }
    for (std::size_t r = k + 1; r < d; ++r) {
      const double* multiplier = entry(r, k);
      double* c = x.component(r).data();
      for (std::size_t n = 0; n < nodes; ++n) c[n] -= multiplier[n] * b[n];
    }
  }
  for (std::size_t k = d; k-- > 0;) {
    double* b = x.component(k).data();
    for (std::size_t l = k + 1; l < d; ++l) {
      const double *upper = entry(k, l), *c = x.component(l).data();
      for (std::size_t n = 0; n < nodes; ++n) b[n] -= upper[n] * c[n];
    }
    const double* inverse = entry(k, k);
    for (std::size_t n = 0; n < nodes; ++n) b[n] *= inverse[n];
  }
}

}  // namespace wienertree
