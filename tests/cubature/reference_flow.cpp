#include "cubature/reference_flow.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace wienertree::test {
namespace {

using Real = long double;
using State = std::vector<Real>;

State midpoint(const ExtendedField& field, const State& x, Real H, std::size_t substeps) {
  const Real h = H / static_cast<Real>(substeps);
  State before = x, now = x, f(x.size());
  field(x.data(), f.data());
  for (std::size_t i = 0; i < x.size(); ++i) now[i] = x[i] + h * f[i];
  for (std::size_t m = 1; m < substeps; ++m) {
    field(now.data(), f.data());
    for (std::size_t i = 0; i < x.size(); ++i) {
      const Real next = before[i] + 2 * h * f[i];
      before[i] = now[i];
      now[i] = next;
    }
  }
  return now;
}

/// One step of length H; false if the last two rows disagree.
bool extrapolate(const ExtendedField& field, State& x, Real H) {
  constexpr std::size_t rows = 10;
  std::vector<State> row, previous;
  for (std::size_t j = 0; j < rows; ++j) {
    previous = std::move(row);
    row = {midpoint(field, x, H, 2 * (j + 1))};
    for (std::size_t k = 1; k <= j; ++k) {
      const Real ratio = static_cast<Real>(j + 1) / static_cast<Real>(j + 1 - k);
      row.push_back(row[k - 1]);
      for (std::size_t i = 0; i < x.size(); ++i)
        row[k][i] += (row[k - 1][i] - previous[k - 1][i]) / (ratio * ratio - 1);
    }
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Real value = row[rows - 1][i], difference = std::abs(value - row[rows - 2][i]);
    if (!(difference <= Real(1e-16) * (Real(1e-3) + std::abs(value)))) return false;
  }
  x = row[rows - 1];
  return true;
}

}  // namespace

std::vector<double> reference_flow(const ExtendedField& field, const std::vector<double>& start) {
  State x(start.begin(), start.end());
  Real u = 0, H = 1;
  while (u < 1) {
    H = std::min(H, 1 - u);
    if (extrapolate(field, x, H)) {
      u += H;
      H *= 2;
    } else {
      H /= 2;
      if (H < Real(1e-9)) throw std::runtime_error("the reference solution does not converge");
    }
  }
  std::vector<double> result;
  for (const Real value : x) result.push_back(static_cast<double>(value));
  return result;
}

}  // namespace wienertree::test
