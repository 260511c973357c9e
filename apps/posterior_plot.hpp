#pragma once
/// The posterior through time as a picture: a panel a state, one above the other.
#include <optional>
#include <string>
#include <vector>

#include "gnuplot.hpp"
#include "wienertree/numeric/state_archive.hpp"

namespace wienertree::app {

/// Mean and 5-95 % band at each time; all of one length.
struct Band {
  std::vector<double> time, mean, low, high;
};

struct Curve {
  std::vector<double> x, y;
  void exchange(StateArchive& archive) { archive(x, y); }
};

/// The value at the point of the curve nearest to x.
double nearest_value(const Curve& curve, double x);

struct PosteriorPanel {
  std::string state;
  Band filter;
  std::optional<Band> exact;
  std::optional<Curve> signal;
};

/// Band and mean of the filter, those of the exact filter as thin dashed lines, the true signal, labelled
/// where they end.
/// @returns the bytes of the picture  @throws RunError if gnuplot fails
std::string draw_posterior(Picture picture, const std::string& title,
                           const std::vector<PosteriorPanel>& panels);

}  // namespace wienertree::app
