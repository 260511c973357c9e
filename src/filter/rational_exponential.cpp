#include "wienertree/filter/rational_exponential.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>

namespace wienertree {
namespace {

using Complex = std::complex<long double>;

// Coefficients of the numerator (n = 6) or denominator (n = 7, with -z for z):
// sum_j (13-j)! n! / (13! j! (n-j)!) z^j.
std::vector<long double> pade_coefficients(int n, long double sign) {
  std::vector<long double> c = {1};
  for (int j = 0; j < n; ++j)
    c.push_back(c.back() * sign * static_cast<long double>(n - j) /
                static_cast<long double>((13 - j) * (j + 1)));
  return c;
}

Complex value(const std::vector<long double>& c, Complex z) {
  Complex sum = 0;
  for (auto it = c.rbegin(); it != c.rend(); ++it) sum = sum * z + *it;
  return sum;
}

std::vector<long double> derivative(const std::vector<long double>& c) {
  std::vector<long double> d;
  for (std::size_t j = 1; j < c.size(); ++j) d.push_back(c[j] * static_cast<long double>(j));
  return d;
}

RationalExponential make_rational_exponential() {
  const auto P = pade_coefficients(6, 1), Q = pade_coefficients(7, -1), dQ = derivative(Q);
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(7, 7);
  for (int j = 0; j < 7; ++j) companion(j, 6) = static_cast<double>(-Q[static_cast<std::size_t>(j)] / Q[7]);
  companion.diagonal(-1).setOnes();
  const auto roots = companion.eigenvalues();
  RationalExponential r;
  std::size_t kept = 0;
  for (Eigen::Index i = 0; i < 7; ++i) {
    Complex z(roots(i).real(), roots(i).imag());
    if (z.imag() < -1e-6L) continue;  // the conjugate is kept
    for (int newton = 0; newton < 4; ++newton) z -= value(Q, z) / value(dQ, z);
    const bool real = z.imag() < 1e-6L;
    const Complex residue = value(P, z) / value(dQ, z) * (real ? 1.0L : 2.0L);
    r.pole[kept] = {static_cast<double>(z.real()), static_cast<double>(z.imag())};
    r.residue[kept++] = {static_cast<double>(residue.real()), static_cast<double>(residue.imag())};
  }
  assert(kept == RationalExponential::poles);
  return r;
}

}  // namespace

const RationalExponential& RationalExponential::get() {
  static const RationalExponential r = make_rational_exponential();
  return r;
}

inline void BandedExponential::subtract_product(Lanes& a, const Lanes& b, const Lanes& c) {
  for (std::size_t l = 0; l < poles; ++l) {
    a.re[l] -= b.re[l] * c.re[l] - b.im[l] * c.im[l];
    a.im[l] -= b.re[l] * c.im[l] + b.im[l] * c.re[l];
  }
}

inline BandedExponential::Lanes BandedExponential::product(const Lanes& a, const Lanes& b) {
  Lanes c{};
  for (std::size_t l = 0; l < poles; ++l) {
    c.re[l] = a.re[l] * b.re[l] - a.im[l] * b.im[l];
    c.im[l] = a.re[l] * b.im[l] + a.im[l] * b.re[l];
  }
  return c;
}

inline BandedExponential::Lanes BandedExponential::inverse(const Lanes& a) {
  Lanes c{};
  for (std::size_t l = 0; l < poles; ++l) {
    const double n = a.re[l] * a.re[l] + a.im[l] * a.im[l];
    c.re[l] = a.re[l] / n;
    c.im[l] = -a.im[l] / n;
  }
  return c;
}

void BandedExponential::assign(const BandedMatrix& L, double tau) {
  const RationalExponential& r = RationalExponential::get();
  size_ = L.size;
  half_width_ = L.half_width;
  const std::size_t m = half_width_, row = 2 * m + 1;
  factor_.resize(size_ * row);
  work_.resize(size_ + 2 * m);
  for (std::size_t i = 0; i < size_; ++i)
    for (std::size_t b = 0; b < row; ++b) {
      Lanes& f = factor_[i * row + b];
      f.re.fill(tau * L.band[i * row + b]);
      f.im.fill(0.0);
      if (b != m) continue;
      for (std::size_t l = 0; l < poles; ++l) {
        f.re[l] -= r.pole[l].real();
        f.im[l] -= r.pole[l].imag();
      }
    }
  for (std::size_t i = 0; i < size_; ++i) {
    Lanes* const pivot_row = factor_.data() + i * row + m;  // indexed by column - i
    *pivot_row = inverse(*pivot_row);
    for (std::size_t below = 1; below <= m && i + below < size_; ++below) {
      Lanes* const target = factor_.data() + (i + below) * row + m - below;
      *target = product(*target, *pivot_row);
      for (std::size_t j = 1; j <= m && i + j < size_; ++j)
        subtract_product(target[j], *target, pivot_row[j]);
    }
  }
}

void BandedExponential::apply(std::span<double> u) {
  assert(u.size() == size_);
  const RationalExponential& r = RationalExponential::get();
  const std::size_t m = half_width_, row = 2 * m + 1;
  // m zeros on either side stand for the rows outside.
  std::fill(work_.begin(), work_.end(), Lanes{});
  for (std::size_t i = 0; i < size_; ++i) {
    Lanes sum;
    sum.re.fill(u[i]);
    sum.im.fill(0.0);
    const Lanes* f = factor_.data() + i * row;
    for (std::size_t b = 0; b < m; ++b) subtract_product(sum, f[b], work_[i + b]);
    work_[i + m] = sum;
  }
  for (std::size_t i = size_; i-- > 0;) {
    Lanes sum = work_[i + m];
    const Lanes* f = factor_.data() + i * row;
    for (std::size_t b = m + 1; b < row; ++b) subtract_product(sum, f[b], work_[i + b]);
    work_[i + m] = product(sum, f[m]);
    double value_of_u = 0;
    for (std::size_t l = 0; l < poles; ++l)
      value_of_u += r.residue[l].real() * work_[i + m].re[l] - r.residue[l].imag() * work_[i + m].im[l];
    u[i] = value_of_u;
  }
}

}  // namespace wienertree
