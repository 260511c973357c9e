#include "study_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace wienertree::app {
namespace {

struct Style {
  Literal colour;
  int point;  ///< gnuplot's filled circle, square, triangles, diamond; then the open ones
  Literal band;
  Literal text;  ///< darker where the colour is too light for letters on white
};
// Yellow of Okabe and Ito is left out: as a line on white it is hard to see.
constexpr std::array<Style, 7> styles = {{{colour::blue, 7, "#D00072B2", colour::blue},
                                          {colour::vermillion, 5, "#D0D55E00", "#B85000"},
                                          {colour::green, 9, "#D0009E73", "#007A59"},
                                          {colour::orange, 13, "#D0E69F00", "#946600"},
                                          {"#CC79A7", 11, "#D0CC79A7", "#A84E80"},
                                          {colour::sky, 7, "#D056B4E9", "#1A78AE"},
                                          {colour::black, 4, "#D0000000", colour::black}}};

struct Range {
  double low = INFINITY, high = -INFINITY;
  void include(double v, bool logarithmic) {
    if (!std::isfinite(v) || (logarithmic && v <= 0)) return;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  void widen(bool logarithmic, double part) {
    if (logarithmic) {
      const double factor = high > low ? std::pow(high / low, part) : 2;
      low /= factor;
      high *= factor;
    } else {
      const double margin = high > low ? part * (high - low) : std::max(1.0, std::fabs(low));
      low -= margin;
      high += margin;
    }
  }
  double fraction(double v, bool logarithmic) const {
    return logarithmic ? std::log(v / low) / std::log(high / low) : (v - low) / (high - low);
  }
};

bool drawable(const LinePoint& p, const StudyPlot& plot) {
  return std::isfinite(p.y.value) && (!plot.log_x || p.x > 0) && (!plot.log_y || p.y.value > 0);
}

bool is_power_of_ten(double v) {
  const double exponent = std::log10(v);
  return std::fabs(exponent - std::round(exponent)) < 1e-9;
}

std::string with_minus_sign(const std::string& number) {
  return number.starts_with('-') ? "\u2212" + number.substr(1) : number;
}

Script tic_text(double v) {
  if (v >= 1e-3 && v < 1e5) return command("{:g}", v);
  const double exponent = std::floor(std::log10(v) + 1e-9);
  const Script power =
      command("10^{{{}{:.0f}}}", exponent < 0 ? Literal("\u2212") : Literal(""), std::fabs(exponent));
  return is_power_of_ten(v) ? power : command("{:g}·{}", v / std::pow(10.0, exponent), power);
}

// Decades, and 2 and 5 between them where there are few.
Script logarithmic_tics(const Range& range, const std::vector<double>& wanted) {
  std::vector<double> at;
  if (!wanted.empty()) {
    // Powers of ten before others that stand too near to them.
    const double least = std::log(range.high / range.low) * 0.055;
    const auto take = [&](bool powers) {
      for (const double v : wanted)
        if (is_power_of_ten(v) == powers &&
            std::all_of(at.begin(), at.end(), [&](double a) { return std::fabs(std::log(v / a)) > least; }))
          at.push_back(v);
    };
    take(true);
    take(false);
  } else {
    const double decades = std::log10(range.high / range.low);
    const std::vector<double> steps = decades < 2.5 ? std::vector<double>{1, 2, 5} : std::vector<double>{1};
    const int every = std::max(1, static_cast<int>(std::ceil(decades / 9)));
    for (int e = static_cast<int>(std::floor(std::log10(range.low))); e <= std::log10(range.high) + 1; ++e)
      for (const double s : steps)
        if (const double v = s * std::pow(10.0, e); v >= range.low && v <= range.high && e % every == 0)
          at.push_back(v);
  }
  std::vector<Script> tics;
  for (const double v : at) {
    tics.push_back(command("\"{}\" {:.12g}", tic_text(v), v));
  }
  return command("({})", joined(tics));
}

const char* usual_x_label(const std::string& axis) {
  if (axis == "steps") return "steps n";
  if (axis == "nodes") return "nodes N";
  if (axis == "seconds") return "processor seconds a run";
  if (axis == "ode_solves") return "ODE solves a run";
  if (axis == "until") return "time t";
  return nullptr;
}

std::string x_label(const StudyPlot& plot) {
  if (!plot.x_label.empty()) return plot.x_label;
  const char* usual = usual_x_label(plot.x);
  return usual != nullptr ? usual : plot.x;
}

std::string y_label(const StudyPlot& plot) {
  return plot.y_label.empty() ? fmt::format("{} of {}", plot.y, plot.quantity) : plot.y_label;
}

// A band that reaches zero is cut at the bottom of a logarithmic axis.
void add_line(Picture& picture, const PlotLine& line, const StudyPlot& plot, double bottom,
              std::size_t number) {
  std::vector<std::vector<double>> columns(4);
  for (const LinePoint& p : line.points) {
    if (!drawable(p, plot)) continue;
    columns[0].push_back(p.x);
    columns[1].push_back(p.y.value);
    columns[2].push_back(std::isnan(p.y.low) ? p.y.value : std::max(p.y.low, bottom));
    columns[3].push_back(std::isnan(p.y.high) ? p.y.value : p.y.high);
  }
  picture.add_data(command("line{}", number), columns);
  if (!line.fit) return;
  std::vector<double> ends;
  for (const LinePoint& p : line.points)
    if (drawable(p, plot) &&
        (!plot.fit_range || (p.x >= plot.fit_range->first && p.x <= plot.fit_range->second)))
      ends.push_back(p.x);
  const auto [low, high] = std::minmax_element(ends.begin(), ends.end());
  picture.add_data(
      command("fit{}", number),
      std::array{std::vector{*low, *high}, std::vector{line.fit->at(*low), line.fit->at(*high)}});
}

// Lines of so many letters at most, where words allow it.
std::vector<std::string> wrapped(const std::string& text, std::size_t letters) {
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin < text.size();) {
    std::size_t end = text.size();
    if (end - begin > letters) {
      end = text.rfind(' ', begin + letters);
      if (end == std::string::npos || end <= begin) end = std::min(text.find(' ', begin), text.size());
    }
    lines.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return lines;
}

std::string text_of(const PlotLine& line) {
  return line.fit ? fmt::format("{}: {}", line.label, slope_text(*line.fit)) : line.label;
}

struct Frame {
  Range x, y;
  std::vector<double> x_values;
};

Frame frame_of(const StudyPlot& plot, const std::vector<PlotLine>& lines) {
  Frame frame;
  std::set<double> values;
  for (const PlotLine& line : lines)
    for (const LinePoint& p : line.points) {
      if (!drawable(p, plot)) continue;
      frame.x.include(p.x, plot.log_x);
      for (const double y : {p.y.value, p.y.low, p.y.high}) frame.y.include(y, plot.log_y);
      values.insert(p.x);
    }
  if (!(frame.x.low <= frame.x.high)) frame.x = frame.y = {1, 1};  // nothing to draw
  frame.x.widen(plot.log_x, 0.04);
  frame.y.widen(plot.log_y, 0.05);
  if (plot.x == plot.along && values.size() <= 12) frame.x_values.assign(values.begin(), values.end());
  return frame;
}

std::size_t longest(const std::vector<PlotLine>& lines) {
  std::size_t length = 0;
  for (const PlotLine& line : lines) length = std::max(length, text_of(line).size());
  return length;
}

}  // namespace

std::string slope_text(const SlopeFit& fit) {
  const double half = (fit.slope_high - fit.slope_low) / 2;
  const std::string slope = with_minus_sign(fmt::format("{:.2f}", fit.slope));
  return std::isnan(half) ? slope : fmt::format("{} ± {:.2f}", slope, half);
}

std::string draw_study_plot(Picture picture, const StudyPlot& asked, const std::vector<PlotLine>& lines,
                            PlotShape shape) {
  StudyPlot plot = asked;
  const bool positive = std::any_of(lines.begin(), lines.end(), [&](const PlotLine& line) {
    return std::any_of(line.points.begin(), line.points.end(),
                       [&](const auto& p) { return drawable(p, plot); });
  });
  plot.log_y = plot.log_y && positive;  // of nothing but values that are not positive there is no logarithm
  const bool wide = shape == PlotShape::wide;
  const Frame frame = frame_of(plot, lines);
  const int key_line = 20, key_height = wide ? 0 : key_line * static_cast<int>(lines.size()) + 10;
  const std::vector<std::string> title = wide ? std::vector{plot.title} : wrapped(plot.title, 46);
  const int title_height = wide ? (plot.title.empty() ? 16 : 44) : 18 * static_cast<int>(title.size()) + 34;
  const int width = wide ? 900 : 400, height = title_height + (wide ? 464 : 308) + key_height;
  const double left = wide ? 92 : 66,
               right = wide ? std::min(360.0, 20 + 7.4 * static_cast<double>(longest(lines))) : 14;
  picture.begin(width, height);
  const double top = 1 - static_cast<double>(title_height) / height,
               bottom = static_cast<double>(key_height + 64) / height;
  picture.add(
      "set lmargin at screen {:.4f}\nset rmargin at screen {:.4f}\nset tmargin at screen {:.4f}\n"
      "set bmargin at screen {:.4f}",
      left / width, 1 - right / width, top, bottom);
  for (std::size_t i = 0; i < title.size(); ++i)
    picture.add("set label {} at screen {:.4f},{:.4f} left noenhanced font \",{}\"", gnuplot_string(title[i]),
                wide ? left / width : 0.02,
                1 - (wide ? 0.5 * title_height : 14 + 18.0 * static_cast<double>(i)) / height,
                wide ? 15 : 12);
  if (plot.log_x) picture.add("set logscale x");
  if (plot.log_y) picture.add("set logscale y");
  picture.add("set xrange [{:.9g}:{:.9g}]\nset yrange [{:.9g}:{:.9g}]", frame.x.low, frame.x.high,
              frame.y.low, frame.y.high);
  if (plot.log_x) picture.add("set xtics {}", logarithmic_tics(frame.x, frame.x_values));
  if (plot.log_y) picture.add("set ytics {}", logarithmic_tics(frame.y, {}));
  picture.add("set grid xtics ytics lt 1 lw 0.6 lc rgb \"#E4E4E4\"");
  picture.add(name_of_width(x_label(plot), static_cast<double>(key_height + 16) / height));
  if (wide)
    picture.add(name_of_height(y_label(plot), 16.0 / width));
  else  // above the axis, where there is room for a long name
    picture.add("set tics font \",11\"\nset label {} at screen 0.02,{:.4f} left noenhanced font \",11\"",
                gnuplot_string(y_label(plot)), 1 - (title_height - 14.0) / height);
  std::vector<SideLabel> labels;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const Style& style = styles[i % styles.size()];
    double at = 0.5;
    for (const LinePoint& p : lines[i].points)
      if (drawable(p, plot)) at = frame.y.fraction(p.y.value, plot.log_y);
    labels.push_back({text_of(lines[i]), style.text, at});
    add_line(picture, lines[i], plot, frame.y.low, i);
    if (wide) continue;
    const double y = static_cast<double>(key_height - 12 - key_line * static_cast<int>(i)) / height;
    picture.add(
        "set label {} at screen 0.07,{:.4f} left textcolor rgb \"{}\" noenhanced font \",12\" "
        "point pt {} ps 0.8 lc "
        "rgb \"{}\" offset 1.2,0",
        gnuplot_string(text_of(lines[i])), y, style.text, style.point, style.colour);
  }
  if (wide) picture.add(labels_at_right(std::move(labels), 19.0 / (height - title_height - 64)));
  std::vector<Script> pieces;
  for (std::size_t i = 0; i < lines.size(); ++i)
    pieces.push_back(command("$line{} using 1:3:4 with filledcurves fillcolor rgb \"{}\"", i,
                             styles[i % styles.size()].band));
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const Style& style = styles[i % styles.size()];
    if (lines[i].fit)
      pieces.push_back(
          command("$fit{} using 1:2 with lines lw 1.3 dashtype (7,5) lc rgb \"{}\"", i, style.colour));
    pieces.push_back(command("$line{} using 1:2 with {} lw 1.8 pt {} ps {} lc rgb \"{}\"", i,
                             lines[i].fit ? Literal("points") : Literal("linespoints"), style.point,
                             wide ? 0.9 : 0.7, style.colour));
  }
  picture.add("plot {}", joined(pieces));
  return picture.draw();
}

}  // namespace wienertree::app
