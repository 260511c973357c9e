#pragma once
/// Families: the laws on the line that a filter of d = 1 carries from one observation to the next.
#include <cstddef>
#include <limits>
#include <vector>

#include "wienertree/numeric/state_archive.hpp"

namespace wienertree {

/// Shape of a law of mean 0 and variance 1, as the map of a standard normal z
///
///     u(z) = a z + c (z^2 - 1) + d (z^3 - 3 z),
///     c = k3/6,   d = k4/24 - k3^2/18,   a = sqrt(1 - 2 c^2 - 6 d^2),
///
/// the expansion of Cornish and Fisher (1937, Rev. Inst. Int. Stat. 5, 307-320) to second order in skewness
/// k3 and first in excess kurtosis k4. Its density is positive everywhere, which the series of Gram and
/// Charlier does not promise. Beyond |z| = 4 the map goes on along its tangents. c and d are lowered together
/// where its slope would fall below 0.2, so that u increases.
struct FamilyShape {
  static constexpr double reach = 4;
  double a = 1, c = 0, d = 0;

  static FamilyShape of(double skewness, double excess_kurtosis);
  bool gaussian() const { return c == 0 && d == 0; }
  double operator()(double z) const {
    if (gaussian()) return z;
    const double inside = z < -reach ? -reach : z > reach ? reach : z;
    const double u = a * inside + c * (inside * inside - 1) + d * inside * (inside * inside - 3);
    return u + (a + 2 * c * inside + 3 * d * (inside * inside - 1)) * (z - inside);
  }
  /// du/dz.
  double slope(double z) const {
    if (gaussian()) return 1;
    const double inside = z < -reach ? -reach : z > reach ? reach : z;
    return a + 2 * c * inside + 3 * d * (inside * inside - 1);
  }
  /// The z of which u is the image.
  double inverse(double u) const;
};

/// A measure sum_i exp(log_weight_i) law(mean_i + sd_i u_i(z)), z standard normal, as a structure of arrays.
/// A family of sd 0 is a point.
struct Families {
  std::vector<double> log_weight, mean, sd;
  std::vector<FamilyShape> shape;  ///< one for each, or empty: all Gaussian

  std::size_t size() const { return mean.size(); }
  FamilyShape shape_of(std::size_t i) const { return shape.empty() ? FamilyShape{} : shape[i]; }
  void clear();
  void add(double log_weight_of_one, double mean_of_one, double sd_of_one);
  void exchange(StateArchive& archive);
};

/// Weighted points of the line.
struct LinePoints {
  std::vector<double> x, log_weight;
  std::size_t size() const { return x.size(); }
  void clear() {
    x.clear();
    log_weight.clear();
  }
};

/// Where the state may be; infinite where it is free.
struct LineBounds {
  double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
  bool bounded() const {
    return lower > -std::numeric_limits<double>::infinity() ||
           upper < std::numeric_limits<double>::infinity();
  }
  bool holds(double x) const { return x >= lower && x <= upper; }
};

}  // namespace wienertree
