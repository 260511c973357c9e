#include "tree_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace wienertree::app {
namespace {

constexpr int width = 860, title_height = 44, axis_height = 56, single_height = 380, panel_height = 230;
constexpr double largest_point = 3.4, smallest_point = 0.15;  // in gnuplot's sizes
constexpr double light = 1e-3;  ///< share of a generation that need not be on the picture

using Columns = std::vector<std::vector<double>>;

// exp(x - max x).
std::vector<double> relative(std::span<const double> logarithms) {
  const double largest = *std::max_element(logarithms.begin(), logarithms.end());
  std::vector<double> out(logarithms.size());
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = std::isfinite(largest) ? std::exp(logarithms[i] - largest) : 0;
  return out;
}

// The size of a node of average weight: neighbours do not touch.
double usual_point(const Genealogy& g) {
  const auto steps = static_cast<double>(g.generations());
  const double beside = static_cast<double>(g.nodes()) / steps;
  return std::clamp(std::min(28 / beside, 40 / steps), 0.2, 1.2) * std::sqrt(beside);
}

// Time, state, size, relative likelihood, share of the mass; the lightest nodes last, so that none hides
// behind a heavy one.
Columns nodes_of(const Genealogy& g, std::size_t component) {
  Columns nodes(5);
  const double usual = usual_point(g);
  for (std::size_t j = 0; j < g.generations(); ++j) {
    std::vector<double> share = relative(g.log_weights(j));
    const double mass = std::accumulate(share.begin(), share.end(), 0.0);
    const std::vector<double> likelihood =
        g.log_likelihoods(j).empty() ? std::vector<double>(g.size(j), 1.0) : relative(g.log_likelihoods(j));
    std::vector<std::size_t> order(g.size(j));
    std::iota(order.begin(), order.end(), 0U);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return share[a] > share[b]; });
    for (const std::size_t i : order) {
      nodes[0].push_back(g.time(j));
      nodes[1].push_back(g.states(j)(component, i));
      nodes[2].push_back(std::clamp(usual * std::sqrt(share[i] / mass), smallest_point, largest_point));
      nodes[3].push_back(likelihood[i]);
      nodes[4].push_back(share[i] / mass);
    }
  }
  return nodes;
}

// Start and extent of each edge.
Columns edges_of(const Genealogy& g, std::size_t component) {
  Columns edges(4);
  for (std::size_t j = 1; j < g.generations(); ++j)
    for (std::size_t i = 0; i < g.size(j); ++i) {
      const double from = g.states(j - 1)(component, g.parents(j)[i]);
      edges[0].push_back(g.time(j - 1));
      edges[1].push_back(from);
      edges[2].push_back(g.time(j) - g.time(j - 1));
      edges[3].push_back(g.states(j)(component, i) - from);
    }
  return edges;
}

// The first generation has none: no step led to it.
bool has_likelihoods(const Genealogy& g) { return g.generations() > 1 && !g.log_likelihoods(1).empty(); }

void draw_panel(Picture& picture, const Genealogy& g, std::size_t component, bool likely) {
  const Columns nodes = nodes_of(g, component);
  double low = INFINITY, high = -INFINITY;
  for (std::size_t i = 0; i < nodes[1].size(); ++i)
    if (nodes[4][i] >= light) {
      low = std::min(low, nodes[1][i]);
      high = std::max(high, nodes[1][i]);
    }
  const double margin = high > low ? 0.08 * (high - low) : std::max(1e-9, 0.1 * std::fabs(low));
  picture.add("set yrange [{:.9g}:{:.9g}]", low - margin, high + margin);
  picture.add(name_of_height(g.state_names()[component], 22.0 / width));
  const Script id = command("state{}", component);
  picture.add_data(id, nodes);
  picture.add_data(command("{}edges", id), edges_of(g, component));
  const Script fill = likely ? command("palette") : command("rgb \"{}\"", colour::blue);
  picture.add(
      "plot ${0}edges using 1:2:3:4 with vectors nohead lw 0.8 lc rgb \"#AAAAAA\", "
      "${0} using 1:2:3{1} with points pt 7 ps variable lc {2}, "
      "${0} using 1:2:3 with points pt 6 lw 0.3 ps variable lc rgb \"#777777\"",
      id, likely ? Literal(":4") : Literal(""), fill);
}

}  // namespace

std::string draw_tree(Picture picture, const std::string& title, const Genealogy& g) {
  const int count = static_cast<int>(g.state_names().size());
  const int each = count == 1 ? single_height : panel_height;
  const int height = title_height + count * each + axis_height;
  const bool likely = has_likelihoods(g);
  picture.begin(width, height);
  picture.add("set multiplot\nset label 1 {} at screen 0.5,{:.4f} center noenhanced", gnuplot_string(title),
              1 - 0.55 * title_height / height);
  picture.add("set lmargin at screen {:.4f}\nset rmargin at screen {:.4f}", 94.0 / width,
              1 - (likely ? 140.0 : 30.0) / width);
  const double end = g.time(g.generations() - 1), start = g.time(0);
  const double margin = std::max(1e-9, 0.03 * (end - start));
  picture.add("set xrange [{:.9g}:{:.9g}]", start - margin, end + margin);
  if (likely)  // the colours of cividis (Nunez, Anderton, Renslow 2018), the same to any colour vision
    picture.add(
        "set cbrange [0:1]\nset palette defined (0 \"#00224E\", 0.25 \"#434E6C\", 0.5 \"#7D7C78\", 0.75 "
        "\"#BCAF6F\", 1 \"#FEE838\")\nset cblabel \"relative likelihood\" offset "
        "0.5,0\nset cbtics 0.25 scale 0.4");
  else
    picture.add("unset colorbox");
  for (int i = 0; i < count; ++i) {
    const double top = 1 - static_cast<double>(title_height + i * each) / height;
    const double bottom = top - static_cast<double>(each - 12) / height;
    picture.add("set tmargin at screen {:.4f}\nset bmargin at screen {:.4f}", top, bottom);
    if (i > 0) picture.add("unset label\nunset colorbox");
    picture.add(i + 1 == count ? command("set format x \"%g\"\n{}", name_of_width("t", 14.0 / height))
                               : command("set format x \"\""));
    draw_panel(picture, g, static_cast<std::size_t>(i), likely);
  }
  picture.add("unset multiplot");
  return picture.draw();
}

}  // namespace wienertree::app
