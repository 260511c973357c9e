#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "density_plot.hpp"

namespace wienertree::app {
namespace {

constexpr int title_height = 44, panel_height = 350;

// The outline of the bars as a curve.
Curve outline(const Histogram& h) {
  Curve curve{{h.edges.front()}, {0.0}};
  for (std::size_t b = 0; b < h.heights.size(); ++b)
    for (const std::size_t edge : {b, b + 1}) {
      curve.x.push_back(h.edges[edge]);
      curve.y.push_back(h.heights[b]);
    }
  curve.x.push_back(h.edges.back());
  curve.y.push_back(0.0);
  return curve;
}

struct Piece {
  Curve curve;
  Script style;
};

std::vector<Piece> pieces_of(const DensityPanel& panel) {
  const auto line = [](Literal style, Literal colour) {
    return command("with lines {} lc rgb \"{}\"", style, colour);
  };
  std::vector<Piece> pieces = {
      {outline(panel.nodes),
       command("with filledcurves y=0 fillcolor rgb \"{}\" fs solid 0.6 noborder", colour::sky)}};
  if (panel.prior) pieces.push_back({*panel.prior, line("lw 1.6 dashtype (8,5)", colour::grey)});
  if (panel.prior_nodes) pieces.push_back({outline(*panel.prior_nodes), line("lw 1.3", colour::grey)});
  if (panel.exact) pieces.push_back({*panel.exact, line("lw 2.2", colour::black)});
  return pieces;
}

// What is drawn, in its colour, from the top down: beside the panel, or in its corner where there is no room.
Script labels_of(const DensityPanel& panel, bool inside) {
  std::vector<SideLabel> labels;
  const auto add = [&](bool drawn, const char* text, Literal colour) {
    if (drawn) labels.push_back({text, colour, 1.0});
  };
  add(true, panel.rug.empty() ? "filter" : "nodes, weighted", colour::blue);
  add(panel.exact.has_value(), panel.prior || panel.prior_nodes ? "exact posterior" : "exact", colour::black);
  add(panel.prior.has_value(), "prior (dashed)", colour::grey);
  add(panel.prior_nodes.has_value(), "prior", colour::grey);
  add(panel.signal.has_value(), "true signal", colour::vermillion);
  if (!inside) return labels_at_right(std::move(labels), 20.0 / panel_height);
  Script commands;
  for (std::size_t i = 0; i < labels.size(); ++i)
    commands +=
        command("set label {} at graph 0.99,{:.3f} right textcolor rgb \"{}\" noenhanced font \",11\"\n",
                gnuplot_string(labels[i].text), 0.97 - 0.055 * static_cast<double>(i), labels[i].colour);
  return commands;
}

// A vertical line from the axis.
Script upright(const Script& data, double height, double line_width, Literal colour) {
  return command(", ${} using 1:(0):(0):({:.9g}) with vectors nohead lw {} lc rgb \"{}\"", data, height,
                 line_width, colour);
}

struct Extent {
  double low = INFINITY, high = -INFINITY;
  void include(double x) {
    low = std::min(low, x);
    high = std::max(high, x);
  }
};

// Of all panels of the state, so that they can be compared.
Extent extent_of(const std::vector<DensityPanel>& panels, const std::string& state) {
  Extent extent;
  for (const DensityPanel& panel : panels) {
    if (panel.state != state) continue;
    for (const Piece& piece : pieces_of(panel)) {
      extent.include(piece.curve.x.front());
      extent.include(piece.curve.x.back());
    }
    if (panel.signal) extent.include(*panel.signal);
  }
  return extent;
}

void draw_panel(Picture& picture, const DensityPanel& panel, const Extent& extent, std::size_t number,
                bool narrow) {
  const std::vector<Piece> pieces = pieces_of(panel);
  double top = 0;
  for (const Piece& piece : pieces)
    top = std::max(top, *std::max_element(piece.curve.y.begin(), piece.curve.y.end()));
  picture.add("set xrange [{:.9g}:{:.9g}]\nset yrange [0:{:.9g}]", extent.low, extent.high, 1.12 * top);
  picture.add(labels_of(panel, narrow));
  if (!panel.title.empty())
    picture.add("set label {} at graph 0.015,0.95 left noenhanced{}", gnuplot_string(panel.title),
                narrow ? Literal(" font \",11\"") : Literal(""));
  std::vector<Script> plots;
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    const Script name = command("panel{}piece{}", number, k);
    picture.add_data(name, std::array{pieces[k].curve.x, pieces[k].curve.y});
    plots.push_back(command("${} using 1:2 {}", name, pieces[k].style));
  }
  Script plot = command("plot {}", joined(plots));
  if (!panel.rug.empty()) {
    const Script name = command("panel{}rug", number);
    picture.add_data(name, std::array{panel.rug});
    plot += upright(name, 0.035 * top, 0.7, colour::blue);
  }
  if (panel.signal) {
    const Script name = command("panel{}signal", number);
    picture.add_data(name, std::array{std::vector{*panel.signal}});
    plot += upright(name, 1.12 * top, 1.6, colour::vermillion);
  }
  picture.add(plot);
}

}  // namespace

void exchange(StateArchive& archive, DensityPanel& p) {
  archive(p.state, p.nodes, p.rug, p.exact, p.prior, p.prior_nodes, p.signal);
}

std::string draw_density(Picture picture, const std::string& title, const std::vector<DensityPanel>& panels,
                         int width) {
  const int count = static_cast<int>(panels.size()), height = title_height + count * panel_height;
  const bool narrow = width < 640;
  picture.begin(width, height);
  picture.add("set label 1 {} at screen 0.5,{:.4f} center noenhanced font \",{}\"\nset multiplot",
              gnuplot_string(title), 1 - 0.55 * title_height / height, narrow ? 11 : 14);
  picture.add("set lmargin at screen {:.4f}\nset rmargin at screen {:.4f}", (narrow ? 60.0 : 86.0) / width,
              1 - (narrow ? 14.0 : 150.0) / width);
  if (narrow) picture.add("set tics font \",11\"");
  for (int i = 0; i < count; ++i) {
    const double top = 1 - static_cast<double>(title_height + i * panel_height) / height;
    const double bottom = top - static_cast<double>(panel_height - 60) / height;
    picture.add("set tmargin at screen {:.4f}\nset bmargin at screen {:.4f}", top, bottom);
    if (i > 0) picture.add("unset label");
    const DensityPanel& panel = panels[static_cast<std::size_t>(i)];
    picture.add(name_of_height("density", (narrow ? 9.0 : 16.0) / width));
    picture.add(name_of_width(panel.state, bottom - 44.0 / height));
    draw_panel(picture, panel, extent_of(panels, panel.state), static_cast<std::size_t>(i), narrow);
  }
  picture.add("unset multiplot");
  return picture.draw();
}

}  // namespace wienertree::app
