#include "density_plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "wienertree/filter/marginal.hpp"

namespace wienertree::app {
namespace {

constexpr std::size_t points_a_curve = 400, most_ticks_of_a_rug = 400;

struct Interval {
  double low, high;
};

// Where nearly all of the law is.
Interval bulk(const Posterior& posterior, std::size_t i) {
  constexpr std::array levels = {0.002, 0.998};
  std::array<double, 2> q{};
  Marginal(posterior, i).quantiles(levels, q);
  const double margin = q[1] > q[0] ? 0.15 * (q[1] - q[0]) : std::max(1e-6, 0.1 * std::fabs(q[0]));
  return {q[0] - margin, q[1] + margin};
}

// Particles: about as many bins as their number allows to tell apart. Families of a tree: as many as the eye
// does. A sum of Gaussians: its density as a curve.
std::size_t bins_for(const Posterior& posterior, const Marginal& law) {
  if (!posterior.dirac()) return points_a_curve;
  if (law.has_density()) return 48;
  return static_cast<std::size_t>(std::clamp(2 * std::cbrt(effective_sample_size(posterior)) + 6, 8.0, 60.0));
}

Histogram histogram(const Posterior& posterior, std::size_t i) {
  const Interval range = bulk(posterior, i);
  const Marginal law(posterior, i);
  const std::size_t bins = bins_for(posterior, law);
  const double width = (range.high - range.low) / static_cast<double>(bins);
  Histogram h;
  for (std::size_t b = 0; b <= bins; ++b) h.edges.push_back(range.low + width * static_cast<double>(b));
  for (std::size_t b = 0; b < bins; ++b)
    h.heights.push_back((law.distribution(h.edges[b + 1]) - law.distribution(h.edges[b])) / width);
  return h;
}

Curve density_curve(const Posterior& posterior, std::size_t i) {
  const Interval range = bulk(posterior, i);
  const Marginal law(posterior, i);
  Curve curve;
  for (std::size_t j = 0; j < points_a_curve; ++j) {
    curve.x.push_back(range.low + (range.high - range.low) * static_cast<double>(j) / (points_a_curve - 1));
    curve.y.push_back(law.density(curve.x.back()));
  }
  return curve;
}

bool smooth(const Posterior& posterior, std::size_t i) {
  return !posterior.dirac() && posterior.variance_of(i, 0) > 0;
}

std::vector<double> rug_of(const Posterior& posterior, std::size_t i, RugOf which) {
  const double least_weight = which == RugOf::all_nodes ? 0 : 1e-6;
  std::vector<double> ticks;
  const std::size_t stride = 1 + posterior.size() / most_ticks_of_a_rug;
  for (std::size_t n = 0; n < posterior.size(); n += stride)
    if (posterior.weight[n] >= least_weight / static_cast<double>(stride))
      ticks.push_back(posterior.points(i, n));
  return ticks;
}

}  // namespace

std::vector<DensityPanel> density_panels(const std::vector<std::string>& states, const Posterior& posterior,
                                         const Posterior* exact, const Posterior* prior, RugOf rug) {
  std::vector<DensityPanel> panels;
  for (std::size_t i = 0; i < states.size(); ++i) {
    DensityPanel panel{states[i], histogram(posterior, i), {}, {}, {}, {}, {}, {}};
    if (posterior.dirac()) panel.rug = rug_of(posterior, i, rug);
    if (exact != nullptr && smooth(*exact, i)) panel.exact = density_curve(*exact, i);
    if (prior != nullptr && smooth(*prior, i)) panel.prior = density_curve(*prior, i);
    if (prior != nullptr && prior->dirac()) panel.prior_nodes = histogram(*prior, i);
    panels.push_back(std::move(panel));
  }
  return panels;
}

}  // namespace wienertree::app
