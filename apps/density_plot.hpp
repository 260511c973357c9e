#pragma once
/// The law of the signal at one time as a picture.
#include <optional>
#include <string>
#include <vector>

#include "gnuplot.hpp"
#include "posterior_plot.hpp"
#include "wienertree/filter/posterior.hpp"

namespace wienertree::app {

/// Density as bars: heights[b] on [edges[b], edges[b+1]].
struct Histogram {
  std::vector<double> edges, heights;
  void exchange(StateArchive& archive) { archive(edges, heights); }
};

struct DensityPanel {
  std::string state;
  Histogram nodes;             ///< probabilities of the filter
  std::vector<double> rug;     ///< where the nodes are
  std::optional<Curve> exact;  ///< exact posterior density
  std::optional<Curve> prior;  ///< exact prior density, where there is one
  std::optional<Histogram> prior_nodes;
  std::optional<double> signal;
  std::string title;  ///< written into the panel, if not empty
};

void exchange(StateArchive& archive, DensityPanel& panel);

/// Nodes of next to no weight, which a tree keeps in its tails, hide those that carry the law.
enum class RugOf { nodes_of_weight, all_nodes };

/// One panel for each of the first `states.size()` components. `exact` and `prior` may be null.
std::vector<DensityPanel> density_panels(const std::vector<std::string>& states, const Posterior& posterior,
                                         const Posterior* exact, const Posterior* prior,
                                         RugOf rug = RugOf::nodes_of_weight);

/// Panels of one and the same state share the axis.
/// `width` in pixels: below 640, names of curves stand inside the panel.
/// @returns the bytes of the picture  @throws RunError if gnuplot fails
std::string draw_density(Picture picture, const std::string& title, const std::vector<DensityPanel>& panels,
                         int width = 860);

}  // namespace wienertree::app
