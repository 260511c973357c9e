#include "wienertree/thinning/recombination/polynomials.hpp"

#include <cassert>

#include "wienertree/numeric/clones.hpp"

namespace wienertree::recombination {
namespace {

// Row k of `table` becomes P_k(z), k = 0..rows-1:  (k+1) P_{k+1} = (2k+1) z P_k - k P_{k-1}.
WIENERTREE_CLONES void legendre_table(const double* z, std::size_t n, std::size_t rows, std::size_t block,
                                      double* table) {
  for (std::size_t j = 0; j < n; ++j) table[j] = 1;
  if (rows > 1)
    for (std::size_t j = 0; j < n; ++j) table[block + j] = z[j];
  for (std::size_t k = 1; k + 1 < rows; ++k) {
    const double next = static_cast<double>(k + 1), a = static_cast<double>(2 * k + 1) / next,
                 b = static_cast<double>(k) / next;
    const double *p = table + k * block, *q = p - block;
    double* out = table + (k + 1) * block;
    for (std::size_t j = 0; j < n; ++j) out[j] = a * z[j] * p[j] - b * q[j];
  }
}

WIENERTREE_CLONES void products(const PolynomialFactor* factor, std::size_t count, std::size_t n,
                                std::size_t block, const double* table, double* out) {
  for (std::size_t a = 1; a < count; ++a) {
    const double *p = out + factor[a].parent * block, *q = table + factor[a].row * block;
    double* product = out + a * block;
    for (std::size_t j = 0; j < n; ++j) product[j] = p[j] * q[j];
  }
}

}  // namespace

PolynomialBasis::PolynomialBasis(std::size_t dimension, int degree)
    : dimension_(dimension), table_rows_(static_cast<std::size_t>(degree) + 2) {
  assert(dimension >= 1 && degree >= 0);
  struct Index {
    std::size_t degree, first_free;  // components from first_free on have exponent 0
  };
  std::vector<Index> index{{0, 0}};
  factor_.push_back({0, 0});
  for (std::size_t total = 1; total < table_rows_; ++total) {
    if (total + 1 == table_rows_) kept_ = factor_.size();
    // A polynomial of degree `total` is one of smaller degree times a power of one further component.
    const std::size_t smaller = factor_.size();
    for (std::size_t parent = 0; parent < smaller; ++parent)
      for (std::size_t i = index[parent].first_free; i < dimension; ++i) {
        const std::size_t power = total - index[parent].degree;
        factor_.push_back(
            {static_cast<std::uint32_t>(parent), static_cast<std::uint32_t>(i * table_rows_ + power)});
        index.push_back({total, i + 1});
      }
  }
}

void PolynomialBasis::taylor_weights(std::span<const double> half, std::vector<double>& out) const {
  assert(half.size() == dimension_);
  out.resize(size() - kept_);
  for (std::size_t a = kept_; a < size(); ++a) {
    double weight = 1;
    for (std::size_t b = a; b != 0; b = factor_[b].parent) {
      const std::size_t i = factor_[b].row / table_rows_, power = factor_[b].row % table_rows_;
      for (std::size_t k = 1; k <= power; ++k) weight *= half[i] / static_cast<double>(2 * k - 1);
    }
    out[a - kept_] = weight;
  }
}

void PolynomialBasis::evaluate(const double* z, std::size_t stride, const double* w, std::size_t n,
                               double* scratch, double* out) const {
  assert(n <= block);
  for (std::size_t i = 0; i < dimension_; ++i)
    legendre_table(z + i * stride, n, table_rows_, block, scratch + i * table_rows_ * block);
  for (std::size_t j = 0; j < n; ++j) out[j] = w[j];
  products(factor_.data(), factor_.size(), n, block, scratch, out);
}

}  // namespace wienertree::recombination
