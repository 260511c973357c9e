#include "wienertree/cubature/square_root_rule.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "wienertree/cubature/gauss_moments.hpp"
#include "wienertree/numeric/error.hpp"

namespace wienertree {

namespace {

// v^i I^j
struct Monomial {
  int i, j;
  bool operator==(const Monomial&) const = default;
};

// exp(A) by 2^k-fold squaring of Taylor's polynomial of degree 18, |A|/2^k <= 1/2: relative error below 1e-16
// before squaring.
Eigen::MatrixXd exponential(Eigen::MatrixXd A) {
  int squarings = 0;
  for (double size = A.cwiseAbs().rowwise().sum().maxCoeff(); size > 0.5; size /= 2) ++squarings;
  A /= std::exp2(squarings);
  Eigen::MatrixXd term = Eigen::MatrixXd::Identity(A.rows(), A.cols()), sum = term;
  for (int k = 1; k <= 18; ++k) {
    term = term * A / k;
    sum += term;
  }
  for (; squarings > 0; --squarings) sum = (sum * sum).eval();
  return sum;
}

using Four = GaussRule::Values;

}  // namespace

SquareRootRule::SquareRootRule(const SquareRootProcess& process, double s, std::size_t q, bool nonnegative)
    : q_(q), nonnegative_(nonnegative) {
  const auto [a, b, c] = process;
  if (!(a >= 0) || !(c > 0) || !std::isfinite(a + b + c))
    throw InputError("needs a drift a + b v with a >= 0 and a variance c v with c > 0", "square-root process",
                     fmt::format("a = {}, b = {}, c = {}", a, b, c));
  if (!(s > 0) || !std::isfinite(s)) throw InputError("must be positive", "step", fmt::format("{}", s));
  if (q < 2 || q > most_nodes) throw InputError("must be 2 to 4", "nodes of the rule", fmt::format("{}", q));
  growth_ = std::exp(b * s);
  const double psi = b == 0 ? s : std::expm1(b * s) / b;
  mean_of_zero_ = a * psi;
  g_ = c * psi / 4;
  delta_ = 4 * a / c;

  // The generator (a + b v) d/dv + c v/2 d^2/dv^2 + v d/dJ on monomials v^i J^j of total degree at most q + 1.
  const int degree = static_cast<int>(q) + 1;
  std::vector<Monomial> monomials;
  for (int j = 0; j <= degree; ++j)
    for (int i = 0; i + j <= degree; ++i) monomials.push_back({i, j});
  const auto place = [&](int i, int j) {
    return std::find(monomials.begin(), monomials.end(), Monomial{i, j}) - monomials.begin();
  };
  const auto size = static_cast<Eigen::Index>(monomials.size());
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(size, size);
  for (const auto& [i, j] : monomials) {
    const Eigen::Index row = place(i, j);
    if (i >= 1) G(row, place(i - 1, j)) += i * a + i * (i - 1) * c / 2;
    if (i >= 1) G(row, row) += i * b;
    if (j >= 1) G(row, place(i + 1, j - 1)) += j;
  }
  const Eigen::MatrixXd E = exponential(G * s);
  for (std::size_t j = 0; j < 2; ++j)
    for (std::size_t i = 0; i < q; ++i)
      for (int k = 0; k <= degree; ++k)
        moments_[j][i][static_cast<std::size_t>(k)] =
            E(place(static_cast<int>(i), static_cast<int>(j) + 1), place(k, 0));
}

double SquareRootRule::deviation(double x) const {
  return std::sqrt(2 * g_ * (delta_ * g_ + 2 * x * growth_));
}

SquareRootRule::Children SquareRootRule::children(double x) const {
  Children result;
  const double expected = mean(x), sd = deviation(x);
  if (!(sd > 1e-150)) {  // nothing moves: a = 0 and x = 0
    result.v.fill(expected);
    result.weight.fill(1.0 / static_cast<double>(q_));
    const double I = moments_[0][0][0] + moments_[0][0][1] * x;
    result.integral.fill({I, I});
    result.share.fill({0.5, 0.5});
    return result;
  }
  // Standardised cumulants: kappa_j / sd^j with h = sd/g, kappa_j = 2^{j-1} (j-1)! (delta + j l) g^j. All are
  // sums of positive terms.
  const std::size_t n = 2 * q_;
  const long double l = static_cast<long double>(x) * growth_ / g_;
  const long double h = std::sqrt(2 * (delta_ + 2 * l));
  std::array<long double, 9> cumulant{}, m{};
  long double factor = 1, power = h;
  for (std::size_t j = 2; j < n; ++j) {
    factor *= 2 * static_cast<long double>(j - 1);
    power *= h;
    cumulant[j] = factor * (delta_ + static_cast<long double>(j) * l) / power;
  }
  // m_k = sum_j binom(k-1, j-1) kappa_j m_{k-j}
  m[0] = 1;
  for (std::size_t k = 2; k < n; ++k) {
    long double binomial = 1;
    for (std::size_t j = 1; j <= k; ++j) {
      m[k] += binomial * cumulant[j] * m[k - j];
      binomial = binomial * static_cast<long double>(k - j) / static_cast<long double>(j);
    }
  }
  const GaussRule rule = gauss_rule(m, q_);
  result.weight = rule.weight;
  for (std::size_t k = 0; k < q_; ++k) result.v[k] = std::max(0.0, expected + sd * rule.node[k]);
  // E[I^j v^i] at x, then E[I^j z^i], z = (v - mean)/sd.
  std::array<Four, 2> mixed{};
  for (std::size_t j = 0; j < 2; ++j) {
    Four raw{};
    for (std::size_t i = 0; i < q_; ++i)
      for (std::size_t k = q_ + 2; k-- > 0;) raw[i] = raw[i] * x + moments_[j][i][k];
    double scale = 1;
    for (std::size_t i = 0; i < q_; ++i, scale *= sd) {
      double binomial = 1;  // of i over k
      for (std::size_t k = 0; k <= i; ++k) {
        mixed[j][i] += binomial * std::pow(-expected, static_cast<double>(i - k)) * raw[k];
        binomial *= static_cast<double>(i - k) / static_cast<double>(k + 1);
      }
      mixed[j][i] /= scale;
    }
  }
  // Where sd is small against the mean, rounding would blur the higher coefficients, which are then negligible:
  // that of e_i in E[I|v] falls as (sd/mean)^i, in Var[I|v] as (sd/mean)^{2+i}, in units of E I and its square.
  const bool narrow = sd < narrow_law * expected;
  std::array<Four, 2> given{};  // E[I^j | v] at the nodes
  const auto project = [&](std::size_t j, std::size_t terms) {
    for (std::size_t i = 0; i < terms; ++i) {
      double coefficient = 0;
      for (std::size_t r = 0; r <= i; ++r) coefficient += rule.coefficient[i][r] * mixed[j][r];
      for (std::size_t k = 0; k < q_; ++k) given[j][k] += coefficient * rule.value[i][k];
    }
  };
  project(0, narrow ? std::min<std::size_t>(q_, 3) : q_);
  if (!narrow) project(1, q_);
  add_integral(mixed[0][0], mixed[1][0], narrow, given, result);
  return result;
}

void SquareRootRule::add_integral(double I, double II, bool narrow, const std::array<Four, 2>& given,
                                  Children& children) const {
  Four mu = given[0];
  const double least = *std::min_element(mu.begin(), mu.begin() + static_cast<std::ptrdiff_t>(q_));
  if (least < 0 && nonnegative_) {
    double sum = 0;
    for (std::size_t k = 0; k < q_; ++k) sum += children.weight[k] * (mu[k] = std::max(0.0, mu[k]));
    for (std::size_t k = 0; k < q_; ++k) mu[k] *= I / sum;
  }
  // The variances at the nodes, scaled to sum up to that of I not explained by v.
  Four variance{};
  double left = II, sum = 0;
  for (std::size_t k = 0; k < q_; ++k) {
    variance[k] = narrow ? 1 : std::max(0.0, given[1][k] - mu[k] * mu[k]);
    left -= children.weight[k] * mu[k] * mu[k];
    sum += children.weight[k] * variance[k];
  }
  for (std::size_t k = 0; k < q_; ++k) {
    const double r = sum > 0 ? std::sqrt(variance[k] * std::max(0.0, left) / sum) : 0;
    if (!(mu[k] > 0)) {
      children.integral[k] = nonnegative_ ? std::array{0.0, 0.0} : std::array{mu[k] - r, mu[k] + r};
      children.share[k] = {0.5, 0.5};
      continue;
    }
    const double rho = r / mu[k], t = 1 / (std::sqrt(1 + rho * rho) + rho);
    children.integral[k] = {mu[k] * (1 - rho * t), mu[k] * (1 + rho / t)};
    children.share[k] = {1 / (1 + t * t), t * t / (1 + t * t)};
  }
}

}  // namespace wienertree
