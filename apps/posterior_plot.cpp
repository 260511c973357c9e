#include "posterior_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace wienertree::app {
namespace {

constexpr int width = 860, title_height = 44, axis_height = 52;
constexpr std::size_t points_a_curve =
    1500;  // more than a screen has; longer curves are drawn by every k-th point

struct Range {
  double low = INFINITY, high = -INFINITY;
  void include(const std::vector<double>& values) {
    for (const double v : values)
      if (std::isfinite(v)) {
        low = std::min(low, v);
        high = std::max(high, v);
      }
  }
  void widen(double fraction) {
    const double margin = high > low ? fraction * (high - low) : std::max(1e-9, 0.1 * std::fabs(low));
    low -= margin;
    high += margin;
  }
  double part(double v) const { return (v - low) / (high - low); }
};

std::vector<double> every_kth(const std::vector<double>& values) {
  const std::size_t stride = 1 + values.size() / points_a_curve;
  std::vector<double> kept;
  for (std::size_t i = 0; i < values.size(); i += stride) kept.push_back(values[i]);
  if ((values.size() - 1) % stride != 0) kept.push_back(values.back());
  return kept;
}

void add_curves(Picture& picture, const Script& name,
                std::initializer_list<const std::vector<double>*> columns) {
  std::vector<std::vector<double>> kept;
  for (const std::vector<double>* column : columns) kept.push_back(every_kth(*column));
  picture.add_data(name, kept);
}

Range range_of(const PosteriorPanel& panel) {
  Range range;
  range.include(panel.filter.low);
  range.include(panel.filter.high);
  if (panel.exact) {
    range.include(panel.exact->low);
    range.include(panel.exact->high);
  }
  if (panel.signal) range.include(panel.signal->y);
  range.widen(0.04);
  return range;
}

// The signal of the panel's own time interval.
Curve within(const Curve& curve, double start, double end) {
  Curve kept;
  for (std::size_t i = 0; i < curve.x.size(); ++i)
    if (curve.x[i] >= start && curve.x[i] <= end) {
      kept.x.push_back(curve.x[i]);
      kept.y.push_back(curve.y[i]);
    }
  return kept;
}

Script labels_of(const PosteriorPanel& panel, const Range& range, double spacing) {
  std::vector<SideLabel> labels = {{"95 %", colour::blue, range.part(panel.filter.high.back())},
                                   {"posterior mean", colour::blue, range.part(panel.filter.mean.back())},
                                   {"5 %", colour::blue, range.part(panel.filter.low.back())}};
  if (panel.exact) labels.push_back({"exact (dashed)", colour::black, range.part(panel.exact->mean.back())});
  if (panel.signal && !panel.signal->y.empty())
    labels.push_back({"true signal", colour::vermillion, range.part(panel.signal->y.back())});
  return labels_at_right(std::move(labels), spacing);
}

void draw_panel(Picture& picture, const PosteriorPanel& panel, std::size_t number, int panel_height) {
  const Range range = range_of(panel);
  picture.add("set yrange [{:.9g}:{:.9g}]", range.low, range.high);
  picture.add(name_of_height(panel.state, 22.0 / width));
  picture.add(labels_of(panel, range, 18.0 / panel_height));
  const Script id = command("panel{}", number);
  add_curves(picture, id, {&panel.filter.time, &panel.filter.low, &panel.filter.high, &panel.filter.mean});
  Script plot = command("plot ${0} using 1:2:3 with filledcurves fillcolor rgb \"#B056B4E9\"", id);
  if (panel.signal && !panel.signal->x.empty()) {
    add_curves(picture, command("{}signal", id), {&panel.signal->x, &panel.signal->y});
    plot += command(", ${}signal using 1:2 with lines lw 1.0 lc rgb \"{}\"", id, colour::vermillion);
  }
  plot += command(", ${} using 1:4 with lines lw 2.2 lc rgb \"{}\"", id, colour::blue);
  if (panel.exact) {
    add_curves(picture, command("{}exact", id),
               {&panel.exact->time, &panel.exact->low, &panel.exact->high, &panel.exact->mean});
    for (const int column : {2, 3, 4})
      plot += command(", ${}exact using 1:{} with lines lw {} dashtype (9,6) lc rgb \"{}\"", id, column,
                      column == 4 ? 1.2 : 0.8, colour::black);
  }
  picture.add(plot);
}

}  // namespace

double nearest_value(const Curve& curve, double x) {
  const auto near = std::min_element(curve.x.begin(), curve.x.end(),
                                     [x](double a, double b) { return std::fabs(a - x) < std::fabs(b - x); });
  return curve.y[static_cast<std::size_t>(near - curve.x.begin())];
}

std::string draw_posterior(Picture picture, const std::string& title,
                           const std::vector<PosteriorPanel>& panels) {
  const int count = static_cast<int>(panels.size()), panel_height = count == 1 ? 320 : 250;
  const int height = title_height + count * panel_height + axis_height;
  picture.begin(width, height);
  picture.add("set multiplot\nset label 1 {} at screen 0.5,{:.4f} center noenhanced", gnuplot_string(title),
              1 - 0.55 * title_height / height);
  picture.add("set lmargin at screen {:.4f}\nset rmargin at screen {:.4f}", 94.0 / width, 1 - 136.0 / width);
  const std::vector<double>& time = panels.front().filter.time;
  picture.add("set xrange [{:.9g}:{:.9g}]", time.front(), std::max(time.back(), time.front() + 1e-9));
  for (int i = 0; i < count; ++i) {
    const double top = 1 - static_cast<double>(title_height + i * panel_height) / height;
    const double bottom = top - static_cast<double>(panel_height - 12) / height;
    picture.add("set tmargin at screen {:.4f}\nset bmargin at screen {:.4f}", top, bottom);
    if (i > 0) picture.add("unset label");
    picture.add(i + 1 == count ? command("set format x \"%g\"\n{}", name_of_width("t", 14.0 / height))
                               : command("set format x \"\""));
    PosteriorPanel panel = panels[static_cast<std::size_t>(i)];
    if (panel.signal) panel.signal = within(*panel.signal, time.front(), time.back());
    draw_panel(picture, panel, static_cast<std::size_t>(i), panel_height);
  }
  picture.add("unset multiplot");
  return picture.draw();
}

}  // namespace wienertree::app
