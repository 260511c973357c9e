#include "study_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <set>

namespace wienertree::app {
namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN();

bool pooled(const Study& study, const std::string& option) {
  return std::find(study.pool.begin(), study.pool.end(), option) != study.pool.end();
}

CellOptions unpooled(const Study& study, CellOptions options) {
  std::erase_if(options, [&](const auto& option) { return pooled(study, option.first); });
  return options;
}

// Runs of pooled cells count as runs on paths of their own.
struct Gathered {
  StudyPoint point;
  std::vector<const RunRecord*> runs;
  std::vector<std::size_t> path;
};

std::vector<Gathered> gather(const Study& study, const std::vector<StudyCell>& cells,
                             const std::vector<RunRecord>& records, std::size_t paths) {
  std::map<std::string, std::vector<const RunRecord*>> by_cell;
  for (const RunRecord& record : records) by_cell[record.cell].push_back(&record);
  std::vector<Gathered> all;
  std::map<std::pair<std::size_t, std::string>, std::size_t> place;
  std::vector<std::size_t> pooled_cells;
  for (const StudyCell& cell : cells) {
    const CellOptions options = unpooled(study, cell.options);
    const auto [at, fresh] = place.try_emplace({cell.series, words_of(options)}, all.size());
    if (fresh) {
      all.emplace_back();
      all.back().point.series = cell.series;
      all.back().point.options = options;
      pooled_cells.push_back(0);
    }
    Gathered& g = all[at->second];
    for (const RunRecord* record : by_cell[cell.key]) {
      if (record->launch >= cell.launches) continue;  // of another series that has more
      g.runs.push_back(record);
      g.path.push_back(pooled_cells[at->second] * paths + record->path);
    }
    ++pooled_cells[at->second];
  }
  return all;
}

void add_note(std::vector<std::string>& notes, std::string note) {
  if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(std::move(note));
}

std::string name_of(const Study& study, const StudyPoint& point) {
  const std::string& label = study.series[point.series].label;
  return label.empty() ? words_of(point.options) : fmt::format("the series {}", label);
}

// NaN, with the reason, where the measure does not apply.
MeasuredError measured_or_reason(ErrorMeasure measure, const std::vector<StudyRun>& runs,
                                 std::string& reason) {
  try {
    const MeasuredError error = measure_error(measure, runs);
    if (!std::isnan(error.value)) return error;
    reason = "there is no reference, or the method does not know it";
  } catch (const InputError& error) {
    reason = error.message();
  }
  return {none, none, none, runs.size()};
}

StudyPoint measured(const Study& study, Gathered g, std::vector<std::string>& notes) {
  StudyPoint point = std::move(g.point);
  point.runs = g.runs.size();
  const auto count = static_cast<double>(g.runs.size());
  for (const RunRecord* run : g.runs) {
    point.nodes += run->nodes / count;
    point.ode_solves += run->ode_solves / count;
    point.seconds += run->seconds / count;
  }
  for (std::size_t q = 0; q < study.quantities.size(); ++q) {
    std::vector<StudyRun> runs;
    for (std::size_t r = 0; r < g.runs.size(); ++r)
      runs.push_back({g.runs[r]->value[q], g.runs[r]->truth[q], g.path[r]});
    for (const auto& [name, measure] : study.measures) {
      std::string reason;
      point.errors.push_back(measured_or_reason(measure, runs, reason));
      if (!reason.empty())
        add_note(notes, fmt::format("{} has no {} of {}: {}", name_of(study, point), name,
                                    study.quantities[q], reason));
    }
  }
  return point;
}

double number_on_axis(const StudyPoint& point, const std::string& axis, const StudyPlot& plot) {
  if (axis == "seconds") return point.seconds;
  if (axis == "ode_solves") return point.ode_solves;
  const std::string text = option_of(point.options, axis);
  double number = 0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (text.empty() || status != std::errc() || end != text.data() + text.size())
    throw InputError(
        "an axis must be an option with numbers in every series that is drawn, seconds or ode_solves",
        plot.where, axis);
  if (axis == plot.x && plot.log_x && !(number > 0))
    throw InputError(fmt::format("{} has no place on a logarithmic axis: give log_x = false", axis),
                     plot.where, text);
  return number;
}

std::string label_of(const Study& study, const StudyPoint& point, const std::string& along) {
  const StudySeries& series = study.series[point.series];
  std::string label = series.label;
  for (const auto& [name, value] : point.options) {
    const StudyOption* option = find_option(series.options, name);
    if (name == along || option->values.size() < 2) continue;
    label += fmt::format("{}{} {}", label.empty() ? "" : ", ",
                         name.starts_with("set.") ? name.substr(4) : name, value);
  }
  return label.empty() ? study.quantities.front() : label;
}

void fit_line(const StudyPlot& plot, PlotLine& line) {
  std::vector<double> x, y;
  for (const LinePoint& point : line.points) {
    if (plot.fit_range && (point.x < plot.fit_range->first || point.x > plot.fit_range->second)) continue;
    if (!(point.x > 0 && point.y.value > 0)) continue;
    x.push_back(point.x);
    y.push_back(point.y.value);
  }
  if (std::set<double>(x.begin(), x.end()).size() >= 2) line.fit = fit_slope(x, y);
}

std::vector<PlotLine> lines_of(const Study& study, const StudyPlot& plot,
                               const std::vector<StudyPoint>& points) {
  std::vector<PlotLine> lines;
  std::vector<bool> fitted;
  if (plot.density) return lines;
  const auto quantity = static_cast<std::size_t>(
      std::find(study.quantities.begin(), study.quantities.end(), plot.quantity) - study.quantities.begin());
  std::size_t measure = 0;
  while (study.measures[measure].first != plot.y) ++measure;
  for (const StudyPoint& point : points) {
    const std::string& series = study.series[point.series].label;
    if (!plot.series.empty() &&
        std::find(plot.series.begin(), plot.series.end(), series) == plot.series.end())
      continue;
    const MeasuredError& error = point.errors[quantity * study.measures.size() + measure];
    if (std::isnan(error.value)) continue;
    const std::string label = label_of(study, point, plot.along);
    auto line = std::find_if(lines.begin(), lines.end(), [&](const PlotLine& l) { return l.label == label; });
    if (line == lines.end()) {
      line = lines.insert(lines.end(), {label, {}, {}});
      fitted.push_back(plot.fit &&
                       std::find(plot.unfitted.begin(), plot.unfitted.end(), series) == plot.unfitted.end());
    }
    line->points.push_back(
        {number_on_axis(point, plot.x, plot), number_on_axis(point, plot.along, plot), error});
  }
  for (std::size_t l = 0; l < lines.size(); ++l) {
    std::stable_sort(lines[l].points.begin(), lines[l].points.end(),
                     [](const auto& a, const auto& b) { return a.along < b.along; });
    if (fitted[l]) fit_line(plot, lines[l]);
  }
  return lines;
}

const PlotLine& line_named(const std::vector<PlotLine>& lines, const std::string& label,
                           const StudyClaim& claim) {
  std::vector<std::string> labels;
  for (const PlotLine& line : lines) {
    if (line.label == label) return line;
    labels.push_back(line.label);
  }
  throw InputError(fmt::format("no line of the plot has this label; there are: {}", fmt::join(labels, "; ")),
                   claim.where, label);
}

// With the numbers of a rehearsal a claim must be decided; those of runs may leave it undecided.
enum class Occasion { rehearsal, results };

double value_at(const PlotLine& line, double along, const StudyClaim& claim, Occasion occasion) {
  for (const LinePoint& point : line.points)
    if (point.along == along) return point.y.value;
  if (occasion == Occasion::results) return none;
  throw InputError("the line has no such point", claim.where, fmt::format("{} at {}", line.label, along));
}

// The geometric mean of the ratios where both lines have a point.
double ratio_along(const PlotLine& line, const PlotLine& to, const StudyClaim& claim, Occasion occasion) {
  double sum = 0;
  std::size_t count = 0;
  for (const LinePoint& a : line.points)
    for (const LinePoint& b : to.points)
      if (a.along == b.along) {
        sum += std::log(a.y.value / b.y.value);
        ++count;
      }
  if (count == 0 && occasion == Occasion::rehearsal)
    throw InputError("the two lines have no point in common: give `at` and `to_at`", claim.where);
  return std::exp(sum / static_cast<double>(count));
}

ClaimOutcome decide(const StudyClaim& claim, const std::vector<PlotLine>& lines, Occasion occasion) {
  ClaimOutcome outcome{none, none, none, false};
  const auto missing = [&](const std::string& label) {
    return std::none_of(lines.begin(), lines.end(), [&](const PlotLine& l) { return l.label == label; });
  };
  if (occasion == Occasion::results && (missing(claim.line) || (claim.ratio && missing(claim.to))))
    return outcome;
  const PlotLine& line = line_named(lines, claim.line, claim);
  if (claim.ratio) {
    const PlotLine& to = line_named(lines, claim.to, claim);
    outcome.value =
        claim.at ? value_at(line, *claim.at, claim, occasion) / value_at(to, *claim.to_at, claim, occasion)
                 : ratio_along(line, to, claim, occasion);
  } else if (line.fit) {
    outcome = {line.fit->slope, line.fit->slope_low, line.fit->slope_high, false};
  } else if (occasion == Occasion::rehearsal) {
    throw InputError("no slope is fitted to this line", claim.where, claim.line);
  }
  outcome.inside = outcome.value >= claim.low && outcome.value <= claim.high;
  return outcome;
}

void note_points_off_the_axis(const StudyPlot& plot, std::size_t number, const std::vector<PlotLine>& lines,
                              std::vector<std::string>& notes) {
  std::size_t off = 0, all = 0;
  for (const PlotLine& line : lines)
    for (const LinePoint& point : line.points) {
      off += point.y.value > 0 ? 0 : 1;
      ++all;
    }
  if (!plot.log_y || off == 0) return;
  add_note(notes, off == all
                      ? fmt::format("plot {}: no value is positive, so that its axis is linear", number)
                      : fmt::format("plot {}: {} of {} points are not positive, and have no place on its "
                                    "logarithmic axis",
                                    number, off, all));
}

StudyResults results_of(const Study& study, const std::vector<StudyCell>& cells,
                        const std::vector<RunRecord>& records, Occasion occasion) {
  StudyResults results;
  std::size_t paths = 0;
  for (const RunRecord& record : records) paths = std::max(paths, record.path + 1);
  for (Gathered& g : gather(study, cells, records, paths))
    results.points.push_back(measured(study, std::move(g), results.notes));
  for (const StudyPlot& plot : study.plots) {
    results.lines.push_back(lines_of(study, plot, results.points));
    note_points_off_the_axis(plot, results.lines.size(), results.lines.back(), results.notes);
  }
  for (const StudyClaim& claim : study.claims)
    results.claims.push_back(decide(claim, results.lines[claim.plot], occasion));
  return results;
}

// Numbers that depend on the cell, the path and the launch, where the run would have one at all.
RunRecord made_up(const Study& study, const StudyCell& cell, const StudyData& data, std::size_t path,
                  std::uint32_t launch, double unlike) {
  RunRecord record{cell.identity, cell.key, path, launch, {}, {}, 1, unlike, unlike};
  const StudyData::Reference reference = data.reference(cell);
  const bool compared = reference.value || reference.filter != nullptr || reference.weak != nullptr;
  for (std::size_t q = 0; q < study.quantities.size(); ++q) {
    bool known = true, true_value_known = compared;
    if (cell.filter) {
      using enum Quantity::Kind;
      const Quantity::Kind kind = data.quantities(cell)[q].kind;
      const auto tells_ratio = [](const FilterCell& c) {
        return c.setup.options.method == FilterMethod::weighted;
      };
      if (kind == log_bayes_factor || kind == variance) {
        known = tells_ratio(*cell.filter);
        if (reference.filter != nullptr) true_value_known = tells_ratio(*reference.filter);
      }
      if (kind == wasserstein) known = reference.filter != nullptr;
    }
    record.value.push_back(known ? 2 + 1 / unlike : none);
    record.truth.push_back(true_value_known ? 1 : none);
  }
  return record;
}

std::string number(double x) { return std::isnan(x) ? "" : fmt::format("{}", x); }

}  // namespace

void rehearse_results(const Study& study, const std::vector<StudyCell>& cells, const StudyData& data) {
  constexpr std::uint32_t most_launches = 2;  // as many as a deviation needs
  std::vector<RunRecord> records;
  double unlike = 1;
  for (const StudyCell& cell : cells)
    for (std::uint32_t launch = 0; launch < std::min(cell.launches, most_launches); ++launch)
      records.push_back(made_up(study, cell, data, 0, launch, unlike++));
  Study rehearsed = study;
  for (StudyPlot& plot : rehearsed.plots) {
    if (plot.density && study.weak) throw InputError("a density is that of a filter", plot.where);
    // What is measured is not known yet.
    if (plot.x == "seconds" || plot.x == "ode_solves") plot.fit_range.reset();
  }
  const StudyResults results = results_of(rehearsed, cells, records, Occasion::rehearsal);
  const std::string reason = results.notes.empty() ? "" : results.notes.front();
  for (std::size_t e = 0; e < study.quantities.size() * study.measures.size(); ++e)
    if (std::all_of(results.points.begin(), results.points.end(),
                    [e](const StudyPoint& point) { return std::isnan(point.errors[e].value); }))
      throw InputError(fmt::format("applies to no series: {}", reason), "study, measure",
                       fmt::format("{} of {}", study.measures[e % study.measures.size()].first,
                                   study.quantities[e / study.measures.size()]));
  for (std::size_t p = 0; p < study.plots.size(); ++p)
    if (!study.plots[p].density && results.lines[p].empty())
      throw InputError(fmt::format("nothing would be drawn: {}", reason), study.plots[p].where);
}

StudyResults study_results(const Study& study, const std::vector<StudyCell>& cells,
                           const std::vector<RunRecord>& records) {
  return results_of(study, cells, records, Occasion::results);
}

std::string points_table(const Study& study, const StudyResults& results) {
  std::string text = "series,options,runs";
  for (const std::string& q : study.quantities)
    for (const auto& [name, measure] : study.measures)
      text += fmt::format(",{0}_{1},{0}_{1}_low,{0}_{1}_high", name, q);
  text += ",nodes,ode_solves,seconds\n";
  for (const StudyPoint& point : results.points) {
    text += fmt::format("{},{},{}", csv_field(study.series[point.series].label),
                        csv_field(words_of(point.options)), point.runs);
    for (const MeasuredError& e : point.errors)
      text += fmt::format(",{},{},{}", number(e.value), number(e.low), number(e.high));
    text += fmt::format(",{},{},{}\n", point.nodes, point.ode_solves, point.seconds);
  }
  return text;
}

std::string slopes_table(const Study& study, const StudyResults& results) {
  std::string text = "plot,line,slope,slope_low,slope_high,points\n";
  for (std::size_t p = 0; p < study.plots.size(); ++p)
    for (const PlotLine& line : results.lines[p])
      if (line.fit)
        text += fmt::format("{},{},{},{},{},{}\n", p + 1, csv_field(line.label), line.fit->slope,
                            number(line.fit->slope_low), number(line.fit->slope_high), line.fit->points);
  return text;
}

std::string claims_table(const Study& study, const StudyResults& results) {
  std::string text = "claim,value,low,high,claimed_low,claimed_high,holds,as_stated\n";
  for (std::size_t c = 0; c < study.claims.size(); ++c) {
    const StudyClaim& claim = study.claims[c];
    const ClaimOutcome& o = results.claims[c];
    text += fmt::format("{},{},{},{},{},{},{},{}\n", csv_field(claim.text), number(o.value), number(o.low),
                        number(o.high), claim.low, claim.high, o.inside, o.inside == claim.holds);
  }
  return text;
}

}  // namespace wienertree::app
