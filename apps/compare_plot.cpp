#include "compare_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace wienertree::app {
namespace {

constexpr int width = 940, title_height = 44, panel_height = 260, axis_height = 52, left = 78, right = 250;
constexpr std::size_t most_points = 1500;  // more than a screen has
constexpr std::array<Literal, 7> colours = {colour::black,  colour::blue, colour::vermillion, colour::green,
                                            colour::orange, colour::sky,  colour::grey};
constexpr std::array<Literal, 7> band_colours = {"#C8000000", "#C80072B2", "#C8D55E00", "#C8009E73",
                                                 "#C8E69F00", "#C856B4E9", "#C8777777"};

Literal colour_of(std::size_t model) { return colours[model % colours.size()]; }

// The same, nearly transparent.
Literal band_of(std::size_t model) { return band_colours[model % band_colours.size()]; }

std::vector<std::size_t> drawn_rows(std::size_t rows) {
  const std::size_t stride = 1 + rows / most_points;
  std::vector<std::size_t> drawn;
  for (std::size_t r = 0; r < rows; r += stride) drawn.push_back(r);
  if (drawn.back() + 1 != rows) drawn.push_back(rows - 1);
  return drawn;
}

// What there is room for beside a panel: of a long "MODEL:parameters" the parameters.
std::string short_label(const std::string& label) {
  constexpr std::size_t longest = 28;
  const std::size_t colon = label.rfind(':');
  const std::string text =
      label.size() <= longest || colon == std::string::npos ? label : label.substr(colon + 1);
  return text.size() <= longest ? text : text.substr(0, longest - 2) + "..";
}

struct Panel {
  Literal id, title;
  std::vector<std::vector<double>> value, low, high;  ///< a curve a model, empty where none is drawn
  double bottom = INFINITY, top = -INFINITY;

  void add(std::size_t model, double v, double error) {
    value[model].push_back(v);
    low[model].push_back(v - 2 * error);
    high[model].push_back(v + 2 * error);
    bottom = std::min(bottom, low[model].back());
    top = std::max(top, high[model].back());
  }
};

Panel empty_panel(Literal id, Literal title, std::size_t models) {
  Panel panel{id, title, {}, {}, {}};
  panel.value.resize(models);
  panel.low.resize(models);
  panel.high.resize(models);
  return panel;
}

void draw_panel(Picture& picture, const std::vector<Contender>& contenders, const std::vector<double>& time,
                Panel panel, bool bands) {
  const double margin = std::max(0.05 * (panel.top - panel.bottom), 1e-3);
  panel.bottom -= margin;
  panel.top += margin;
  std::vector<SideLabel> labels;
  std::vector<Script> plots;
  for (std::size_t m = 0; m < contenders.size(); ++m) {
    if (panel.value[m].empty()) continue;
    const Script id = command("{}{}", panel.id, m);
    picture.add_data(id, std::array{time, panel.value[m], panel.low[m], panel.high[m]});
    if (bands)
      plots.push_back(
          command("${} using 1:3:4 with filledcurves fillcolor rgb \"{}\" notitle", id, band_of(m)));
    plots.push_back(command("${} using 1:2 with lines lw 1.8 lc rgb \"{}\"", id, colour_of(m)));
    labels.push_back({short_label(contenders[m].label), colour_of(m),
                      (panel.value[m].back() - panel.bottom) / (panel.top - panel.bottom)});
  }
  picture.add("set yrange [{:.9g}:{:.9g}]", panel.bottom, panel.top);
  picture.add(name_of_height(panel.title.text, 16.0 / width));
  picture.add(labels_at_right(std::move(labels), 18.0 / panel_height));
  picture.add("plot {}", joined(plots));
}

}  // namespace

std::string draw_comparison(Picture picture, const std::vector<Contender>& contenders,
                            const std::vector<ComparisonRow>& rows) {
  const std::size_t models = contenders.size();
  Panel factors = empty_panel("factor", "log Bayes factor", models),
        chances = empty_panel("chance", "probability", models);
  std::vector<double> time;
  for (const std::size_t r : drawn_rows(rows.size())) {
    time.push_back(rows[r].time);
    const std::vector<double> p = rows[r].probabilities();
    for (std::size_t m = 0; m < models; ++m) {
      chances.add(m, p[m], 0);
      if (m > 0)
        factors.add(m, rows[r].log_bayes_factor(m),
                    std::hypot(rows[r].standard_error[m], rows[r].standard_error[0]));
    }
  }
  const int height = title_height + 2 * panel_height + axis_height;
  picture.begin(width, height);
  picture.add("set multiplot\nset label 1 {} at screen 0.5,{:.4f} center noenhanced",
              gnuplot_string("Bayes factors against " + contenders.front().label + ", " +
                             describe(contenders.front().setup)),
              1 - 0.55 * title_height / height);
  picture.add("set lmargin at screen {:.4f}\nset rmargin at screen {:.4f}", static_cast<double>(left) / width,
              1 - static_cast<double>(right) / width);
  picture.add("set xrange [{:.9g}:{:.9g}]\nset xzeroaxis lc rgb \"{}\" lw 0.6", time.front(),
              std::max(time.back(), time.front() + 1e-9), colour::grey);
  for (const int i : {0, 1}) {
    const double top = 1 - static_cast<double>(title_height + i * panel_height) / height;
    const double bottom = top - static_cast<double>(panel_height - 12) / height;
    picture.add("set tmargin at screen {:.4f}\nset bmargin at screen {:.4f}", top, bottom);
    picture.add(i == 1 ? command("set format x \"%g\"\nunset label\n{}", name_of_width("t", 14.0 / height))
                       : command("set format x \"\""));
    draw_panel(picture, contenders, time, i == 0 ? factors : chances,
               i == 0 && contenders.front().setup.launches > 1);
  }
  picture.add("unset multiplot");
  return picture.draw();
}

}  // namespace wienertree::app
