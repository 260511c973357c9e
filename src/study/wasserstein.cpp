#include "wienertree/study/wasserstein.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace wienertree {
namespace {

struct Atom {
  double x, weight;
};
struct Gaussian {
  double weight, mean, sd;
};

// F_a - F_b, taken apart: `sign` is -1 for the masses of b.
class Difference {
 public:
  void add(const Posterior& law, std::size_t i, double sign) {
    for (std::size_t n = 0; n < law.size(); ++n) {
      const double variance = law.variance_of(i, n), weight = sign * law.weight[n], x = law.points(i, n);
      if (variance > 0)
        gaussians_.push_back({weight, x, std::sqrt(variance)});
      else
        atoms_.push_back({x, weight});
    }
  }

  double distance() {
    std::vector<double> cuts = smooth_cuts();
    for (const Atom& atom : atoms_) cuts.push_back(atom.x);
    std::sort(cuts.begin(), cuts.end());
    std::sort(atoms_.begin(), atoms_.end(), [](const Atom& p, const Atom& q) { return p.x < q.x; });
    double sum = 0, constant = 0;
    std::size_t atom = 0;
    for (std::size_t c = 0; c + 1 < cuts.size(); ++c) {
      for (; atom < atoms_.size() && atoms_[atom].x <= cuts[c]; ++atom) constant += atoms_[atom].weight;
      if (cuts[c + 1] > cuts[c]) sum += cell(constant, cuts[c], cuts[c + 1]);
    }
    return sum;
  }

 private:
  // Beyond nine standard deviations 1e-19 of a Gaussian is left.
  static constexpr double reach = 9;
  static constexpr std::size_t most_cells = 20000;

  std::vector<double> smooth_cuts() const {
    if (gaussians_.empty()) return {};
    double low = INFINITY, high = -INFINITY, narrowest = INFINITY;
    for (const Gaussian& g : gaussians_) {
      low = std::min(low, g.mean - reach * g.sd);
      high = std::max(high, g.mean + reach * g.sd);
      narrowest = std::min(narrowest, g.sd);
    }
    for (const Atom& atom : atoms_) {
      low = std::min(low, atom.x);
      high = std::max(high, atom.x);
    }
    // In this order a quotient that is not a number asks for one cell.
    const double asked = std::max(1.0, std::ceil((high - low) / narrowest * 100));
    const auto cells = static_cast<std::size_t>(std::min(asked, static_cast<double>(most_cells)));
    std::vector<double> cuts;
    for (std::size_t c = 0; c <= cells; ++c)
      cuts.push_back(low + (high - low) * static_cast<double>(c) / static_cast<double>(cells));
    return cuts;
  }

  // sum w Phi(z), z = (x - m)/s
  double smooth(double x) const {
    double sum = 0;
    for (const Gaussian& g : gaussians_)
      sum += g.weight * 0.5 * std::erfc((g.mean - x) / (g.sd * std::numbers::sqrt2));
    return sum;
  }

  // Its antiderivative sum w s (z Phi(z) + phi(z)).
  double integral(double x) const {
    double sum = 0;
    for (const Gaussian& g : gaussians_) {
      const double z = (x - g.mean) / g.sd;
      sum += g.weight * g.sd *
             (z * 0.5 * std::erfc(-z / std::numbers::sqrt2) +
              std::exp(-z * z / 2) * std::numbers::inv_sqrtpi / std::numbers::sqrt2);
    }
    return sum;
  }

  double part(double constant, double low, double high) const {
    if (gaussians_.empty()) return std::fabs(constant) * (high - low);
    return std::fabs(constant * (high - low) + integral(high) - integral(low));
  }

  double cell(double constant, double low, double high) const {
    if (gaussians_.empty()) return part(constant, low, high);
    const double at_low = constant + smooth(low), at_high = constant + smooth(high);
    if (at_low * at_high >= 0) return part(constant, low, high);
    double a = low, b = high;
    for (int halving = 0; halving < 60; ++halving) {
      const double middle = (a + b) / 2;
      ((constant + smooth(middle)) * at_low > 0 ? a : b) = middle;
    }
    return part(constant, low, a) + part(constant, a, high);
  }

  std::vector<Atom> atoms_;
  std::vector<Gaussian> gaussians_;
};

}  // namespace

double wasserstein(const Posterior& a, const Posterior& b, std::size_t i) {
  Difference difference;
  difference.add(a, i, 1);
  difference.add(b, i, -1);
  return difference.distance();
}

}  // namespace wienertree
