#pragma once
/// One family under any likelihood: its modes, and adaptive quadrature between and about them.
#include <span>
#include <vector>

#include "wienertree/filter/family_likelihood.hpp"
#include "wienertree/thinning/recombination/gauss.hpp"

namespace wienertree {

/// For g(z) = F(z) - z^2/2 of one family (family_conditioning.hpp):
/// - modes: on a grid of -9 .. 9 with spacing 1/4, which goes on geometrically where g is largest at its end,
///   every local maximum is enclosed ever closer, by 9 points at a time, until g varies by less than 1/2 over
///   the bracket, of half width delta;
/// - quadrature: of the modes within 45 of the largest, intervals with ends at mode +- 3^k delta are halved
///   until Gauss-Legendre quadrature of 8 points changes by less than 1e-9 of the whole.
/// A point where the density is not a number counts as zero unless it is the family's mean: tails of a family
/// may reach beyond the domain of a model.
class FamilyModes {
 public:
  /// What belongs to one mode, or to several without a valley of a depth of log 2 between them.
  struct Part {
    double log_weight;  ///< without the family's own
    double mean, variance;
    double z, square;  ///< means of z and z^2
    std::vector<double> x, share;
  };

  /// Finds the modes. @return the largest g, or -infinity if the likelihood vanishes
  /// @throws RunError naming the place if g is NaN at the mean or +infinity
  double find(FamilyLikelihood& likelihood, const Families& families, std::size_t i,
              const LineBounds& bounds);
  /// Integrates; to be called after `find` for the same family. Each part is put on at most `points` points.
  void integrate(std::size_t points);
  /// The distribution function and the density of z at the nodes of the quadrature and at its ends, for a mass of 1;
  /// after `integrate`. A family of sd 0, a point, has no use for it.
  void tabulate(std::vector<double>& z, std::vector<double>& below, std::vector<double>& density);
  std::span<const Part> parts() const { return {parts_.data(), count_}; }
  /// Mass of the family beyond the bounds.
  double outside() const { return outside_; }

 private:
  struct Mode {
    double z, g, delta;
  };
  struct Interval {
    double low, high, integral;
    int depth;
  };
  void evaluate(std::span<const double> z, std::vector<double>& g);
  void limit(const LineBounds& bounds);
  void lay_grid();
  void extend(int side);
  void enclose(double low, double high, int depth);
  double legendre(double low, double high, std::vector<double>& z, std::vector<double>& g,
                  std::vector<double>& length);
  void quadrature(std::span<const Mode> modes);
  void cut_at_valleys(std::span<const Mode> modes);
  void gather(std::size_t points);
  void compress(Part& part, std::span<const double> x, std::span<const double> w, std::size_t points);

  FamilyLikelihood* likelihood_ = nullptr;
  double mean_ = 0, sd_ = 0;
  FamilyShape shape_;
  double low_ = 0, high_ = 0, outside_ = 0, largest_ = 0;
  std::vector<double> grid_, value_, z_, g_, zb_, gb_, z_length_, zb_length_;
  std::vector<Mode> modes_, kept_;
  std::vector<double> ends_, cuts_;
  std::vector<Interval> stack_;
  std::vector<std::size_t> order_;
  std::vector<double> node_, height_, length_;  ///< accepted quadrature nodes, g there, their weights
  std::vector<double> x_, w_, zs_;
  recombination::DiscreteGauss gauss_;
  std::vector<Part> parts_;
  std::size_t count_ = 0;
};

}  // namespace wienertree
