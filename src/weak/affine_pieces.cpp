#include "wienertree/weak/affine_pieces.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace wienertree {
namespace {

double normal_cdf(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }

constexpr std::size_t places = 12;
using Piece = AffinePieces::Piece;

// Prices, with the other states moved along, at which functions are looked at.
class Places {
 public:
  Places(const std::vector<double>& start, std::size_t price, bool logarithmic) : x_(start.size(), places) {
    const double s = logarithmic ? std::exp(start[price]) : start[price];
    for (std::size_t n = 0; n < places; ++n) {
      // Irrational multiples from 1e-3 to 1e3.
      const double t = static_cast<double>(n) / (places - 1);
      s_[n] = s * std::pow(10, 6 * t - 3) * (1 + 0.1 * std::sin(1 + 7 * t));
      for (std::size_t i = 0; i < start.size(); ++i)
        x_(i, n) = i != price    ? start[i] + (0.1 * std::abs(start[i]) + 0.01) * (1 + std::sin(3 + 11 * t))
                   : logarithmic ? std::log(s_[n])
                                 : s_[n];
    }
  }

  std::optional<Piece> affine(const BatchFunction& f) const {
    std::array<double, places> value;
    f(x_, value);
    const double slope = (value[8] - value[3]) / (s_[8] - s_[3]), constant = value[3] - slope * s_[3];
    for (std::size_t n = 0; n < places; ++n) {
      // Rounding of the values at the places of the fit, and of those at the others.
      const double size =
          std::abs(constant) + std::abs(slope) * s_[n] + std::abs(value[3]) + std::abs(value[n]);
      if (!(std::abs(value[n] - constant - slope * s_[n]) <= 1e-12 * size)) return std::nullopt;
    }
    return Piece{constant, slope};
  }

 private:
  Batch x_;
  std::array<double, places> s_;
};

}  // namespace

double AffinePieces::average(double m, double S) const {
  if (S == 0) {
    const auto piece = static_cast<std::size_t>(std::lower_bound(end.begin(), end.end(), m) - end.begin());
    return pieces[piece].constant + pieces[piece].slope * std::exp(m);
  }
  const double forward = std::exp(m + S * S / 2);
  const Piece& top = pieces.back();
  double sum = top.constant + (top.slope == 0 ? 0 : top.slope * forward);
  for (std::size_t i = 0; i < end.size(); ++i) {
    const double z = (end[i] - m) / S;
    const double constant = pieces[i + 1].constant - pieces[i].constant,
                 slope = pieces[i + 1].slope - pieces[i].slope;
    if (constant != 0) sum -= constant * normal_cdf(z);
    if (slope == 0) continue;
    const double below = normal_cdf(z - S);
    if (below > 0) sum -= slope * forward * below;
  }
  return sum;
}

std::optional<AffinePieces> affine_pieces(const KinkedFunction& f, const std::vector<double>& start,
                                          std::size_t price, bool logarithmic) {
  const Places at(start, price, logarithmic);
  AffinePieces result;
  if (f.kinks.empty()) {
    const auto whole = at.affine(f.exact);
    if (!whole) return std::nullopt;
    result.pieces = {*whole};
    return result;
  }
  if (!f.with_argument) return std::nullopt;  // a kink inside the argument of another
  std::vector<Piece> argument;
  std::vector<double> roots;
  for (const BatchFunction& kink : f.kinks) {
    const auto u = at.affine(kink);
    if (!u) return std::nullopt;
    argument.push_back(*u);
    const double root = u->slope == 0 ? 0 : -u->constant / u->slope;
    if (root > 0) roots.push_back(root);
  }
  std::sort(roots.begin(), roots.end());
  roots.erase(std::unique(roots.begin(), roots.end()), roots.end());
  for (std::size_t i = 0; i <= roots.size(); ++i) {
    const double low = i == 0 ? 0 : roots[i - 1];
    const double inside = i < roots.size() ? (low + roots[i]) / 2 : 2 * low + 1;
    std::vector<double> above;
    for (const Piece& u : argument) above.push_back(u.constant + u.slope * inside > 0 ? 1.0 : 0.0);
    const auto piece = at.affine(f.branch(above));
    if (!piece) return std::nullopt;
    result.pieces.push_back(*piece);
  }
  for (const double root : roots) result.end.push_back(std::log(root));
  return result;
}

}  // namespace wienertree
