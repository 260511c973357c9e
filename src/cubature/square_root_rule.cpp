#include "wienertree/cubature/square_root_rule.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

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

// Eigenvalues of the symmetric tridiagonal matrix with this diagonal and these squares beside it: the nodes
// (Golub, Welsch 1969). Weights are 1/sum_k p_k^2 with orthonormal polynomials p_k, which keeps the relative
// accuracy of small ones.
void gauss_rule(const std::array<long double, 4>& alpha, const std::array<long double, 4>& beta,
                std::size_t q, std::array<double, 4>& node, std::array<double, 4>& weight) {
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 4, 1>;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 4, 4>;
  const auto size = static_cast<Eigen::Index>(q);
  Vector diagonal(size), beside(size - 1);
  for (std::size_t k = 0; k < q; ++k) diagonal(static_cast<Eigen::Index>(k)) = static_cast<double>(alpha[k]);
  for (std::size_t k = 1; k < q; ++k)
    beside(static_cast<Eigen::Index>(k) - 1) = std::sqrt(static_cast<double>(beta[k]));
  Eigen::SelfAdjointEigenSolver<Matrix> solver(size);
  solver.computeFromTridiagonal(diagonal, beside, Eigen::EigenvaluesOnly);
  double total = 0;
  for (std::size_t m = 0; m < q; ++m) {
    node[m] = solver.eigenvalues()(static_cast<Eigen::Index>(m));
    double before = 0, p = 1, sum = 1, beside_before = 0;
    for (Eigen::Index k = 0; k + 1 < size; ++k) {
      const double next = ((node[m] - diagonal(k)) * p - beside_before * before) / beside(k);
      beside_before = beside(k);
      before = p;
      p = next;
      sum += p * p;
    }
    weight[m] = 1 / sum;
    total += weight[m];
  }
  for (std::size_t m = 0; m < q; ++m) weight[m] /= total;
}

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

  // The generator (a + b v) d/dv + c v/2 d^2/dv^2 + v d/dJ on monomials v^i J^j of total degree at most 3.
  std::vector<Monomial> monomials;
  for (int j = 0; j <= 3; ++j)
    for (int i = 0; i + j <= 3; ++i) monomials.push_back({i, j});
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
  constexpr std::array<Monomial, 4> wanted{{{0, 1}, {1, 1}, {2, 1}, {0, 2}}};
  for (std::size_t k = 0; k < wanted.size(); ++k)
    for (int i = 0; i <= 3; ++i)
      moments_[k][static_cast<std::size_t>(i)] = E(place(wanted[k].i, wanted[k].j), place(i, 0));
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
    const double I = moments_[0][0] + moments_[0][1] * x;
    result.integral.fill({I, I});
    result.share.fill(0.5);
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
  std::array<long double, 4> alpha{}, beta{};
  std::array<long double, 9> current = m, previous{};
  beta[0] = 1;
  for (std::size_t k = 1; k < q_; ++k) {
    std::array<long double, 9> next{};
    for (std::size_t j = k; j < n - k; ++j)
      next[j] = current[j + 1] - alpha[k - 1] * current[j] - (k > 1 ? beta[k - 1] * previous[j] : 0);
    beta[k] = next[k] / current[k - 1];
    alpha[k] = next[k + 1] / next[k] - current[k] / current[k - 1];
    previous = current;
    current = next;
  }
  gauss_rule(alpha, beta, q_, result.v, result.weight);
  for (std::size_t k = 0; k < q_; ++k) result.v[k] = std::max(0.0, expected + sd * result.v[k]);
  add_integral(x, result);
  return result;
}

void SquareRootRule::add_integral(double x, Children& children) const {
  std::array<double, 4> moment;
  for (std::size_t k = 0; k < 4; ++k)
    moment[k] = moments_[k][0] + x * (moments_[k][1] + x * (moments_[k][2] + x * moments_[k][3]));
  const auto [I, Iv, Ivv, II] = moment;
  const double m = mean(x), sd = deviation(x);
  std::array<double, most_nodes> z{};
  double M3 = 0, M4 = 0;
  for (std::size_t k = 0; k < q_; ++k) {
    z[k] = (children.v[k] - m) / sd;
    M3 += children.weight[k] * z[k] * z[k] * z[k];
    M4 += children.weight[k] * z[k] * z[k] * z[k] * z[k];
  }
  // e_1 = z, e_2 = (z^2 - 1 - M3 z)/|..|, |..|^2 = M4 - 1 - M3^2
  const double square = std::max(M4 - 1 - M3 * M3, 1e-12);
  const double b1 = (Iv - m * I) / sd;
  const double b2 = ((Ivv - 2 * m * Iv + m * m * I) / (sd * sd) - I - M3 * b1) / square;
  std::array<double, most_nodes> mu{}, trapezoid{};
  double sum = 0, least = 0;
  for (std::size_t k = 0; k < q_; ++k) {
    mu[k] = I + b1 * z[k] + (q_ > 2 ? b2 * (z[k] * z[k] - 1 - M3 * z[k]) : 0);
    trapezoid[k] = x + children.v[k];
    sum += children.weight[k] * trapezoid[k];
  }
  const double r = std::sqrt(std::max(0.0, II - I * I - b1 * b1 - (q_ > 2 ? b2 * b2 * square : 0)));
  for (std::size_t k = 0; k < q_; ++k) {
    children.integral[k] = {mu[k] - r, mu[k] + r};
    least = std::min(least, mu[k] - r);
  }
  children.share = {0.5, 0.5};
  if (nonnegative_ && least < 0) keep_nonnegative(I, II, sum, mu, trapezoid, children);
}

void SquareRootRule::keep_nonnegative(double I, double II, double sum, std::array<double, most_nodes> mu,
                                      std::array<double, most_nodes> trapezoid, Children& children) const {
  // (1 - part) mu + part trapezoid >= 0
  double part = 0, squares = 0;
  for (std::size_t k = 0; k < q_; ++k) {
    trapezoid[k] *= I / sum;
    if (mu[k] < 0) part = std::max(part, mu[k] / (mu[k] - trapezoid[k]));
  }
  for (std::size_t k = 0; k < q_; ++k) {
    mu[k] = std::max(0.0, mu[k] + part * (trapezoid[k] - mu[k]));
    squares += children.weight[k] * mu[k] * mu[k];
  }
  // F = 1 - rho t or 1 + rho/t with probabilities 1/(1 + t^2) and t^2/(1 + t^2): mean 1, variance rho^2.
  const double rho = squares > 0 ? std::sqrt(std::max(0.0, II / squares - 1)) : 0, t = rho > 1 ? 1 / rho : 1;
  children.share = {1 / (1 + t * t), t * t / (1 + t * t)};
  for (std::size_t k = 0; k < q_; ++k)
    children.integral[k] = {mu[k] * std::max(0.0, 1 - rho * t), mu[k] * (1 + rho / t)};
}

}  // namespace wienertree
