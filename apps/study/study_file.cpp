#include "study_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>

#include "study_keys.hpp"
#include "wienertree/model/text/toml_section.hpp"
#include "wienertree/numeric/read_all.hpp"

namespace wienertree::app {
namespace {

using text::Section;

constexpr std::uint64_t most = std::uint64_t{1} << 53, most_steps = 1'000'000'000;

const std::vector<std::pair<std::string, ErrorMeasure>> measures = {
    {"value", ErrorMeasure::value},
    {"absolute", ErrorMeasure::absolute},
    {"relative", ErrorMeasure::relative},
    {"rmse", ErrorMeasure::rmse},
    {"relative-rmse", ErrorMeasure::relative_rmse},
    {"deviation", ErrorMeasure::deviation}};

std::vector<std::string> measure_names() {
  std::vector<std::string> names;
  for (const auto& [name, measure] : measures) names.push_back(name);
  return names;
}

std::string contents_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError("cannot be read", "study", path);
  return read_all(in, largest_text_file, "study " + path);
}

// Values of [full] take the place of those outside it. Nodes are moved, since a copy would forget its place
// in the file.
void overlay(toml::table& onto, toml::table&& over) {
  for (auto&& [key, value] : over) {
    toml::node* there = onto.get(key.str());
    if (there != nullptr && there->is_table() && value.is_table())
      overlay(*there->as_table(), std::move(*value.as_table()));
    else
      value.visit([&onto, &key = key](auto& node) { onto.insert_or_assign(key, std::move(node)); });
  }
}

std::vector<std::string> texts(const Section& section, std::string_view key) {
  std::vector<std::string> values;
  for (const text::SourceExpression& value : section.values(key)) values.push_back(value.text);
  return values;
}

std::string string_or(const Section& section, std::string_view key, std::string otherwise) {
  return section.has(key) ? section.string(key) : std::move(otherwise);
}

bool flag_or(const Section& section, std::string_view key, bool otherwise) {
  if (!section.has(key)) return otherwise;
  const std::vector<std::string> value = texts(section, key);
  if (value.size() == 1 && (value[0] == "true" || value[0] == "false")) return value[0] == "true";
  throw InputError("must be true or false", section.location(key).text(), value[0]);
}

std::optional<std::pair<double, double>> range_of(const Section& section, std::string_view key) {
  const std::vector<std::string> ends = texts(section, key);
  const auto bad = [&] {
    return InputError("must be a list of two numbers, low and high", section.location(key).text());
  };
  if (ends.size() != 2) throw bad();
  try {
    const double low = std::stod(ends[0]), high = std::stod(ends[1]);
    if (!(low < high)) throw bad();
    return std::pair(low, high);
  } catch (const std::logic_error&) {
    throw bad();
  }
}

void put(StudyOptions& options, StudyOption option) {
  const auto there =
      std::find_if(options.begin(), options.end(), [&](const auto& o) { return o.name == option.name; });
  if (there == options.end())
    options.push_back(std::move(option));
  else
    *there = std::move(option);
}

StudyOptions read_options(const Section& section, std::span<const FileKey> other_keys = {}) {
  const std::vector<std::string> others = names_of(other_keys);
  StudyOptions options;
  for (const std::string& key : section.keys()) {
    if (std::find(others.begin(), others.end(), key) != others.end()) continue;
    if (key == "set") {
      const Section parameters = section.section(key);
      for (const std::string& name : parameters.keys())
        put(options, {"set." + name, texts(parameters, name), parameters.location(name).text()});
      continue;
    }
    put(options, {key, texts(section, key), section.location(key).text()});
  }
  return options;
}

StudyObservations read_observation_spec(const Section& section) {
  section.only(observations_keys);
  StudyObservations o;
  if (section.has("file")) {
    for (const std::string& key : section.keys())
      if (key != "file")
        throw InputError("belongs to simulated records; `file` stands alone", section.location(key).text());
    o.file = section.string("file");
    return o;
  }
  if (section.has("model")) o.model = section.string("model");
  o.horizon = section.number("horizon");
  o.steps = section.count("steps", 1, most_steps);
  o.keep = section.has("keep") ? section.count("keep", 1, most_steps) : o.steps;
  o.paths = section.has("paths") ? section.count("paths", 1, 1'000'000) : 1;
  o.seed = section.has("seed") ? section.count("seed", 0, most) : 1;
  return o;
}

StudyReference read_reference(const Section& root) {
  StudyReference reference;
  if (!root.has("reference")) return reference;
  reference.where = root.location("reference").text();
  using enum StudyReference::Kind;
  if (!root.is_table("reference")) {
    const text::SourceExpression value = root.expression("reference");
    reference.kind = value.text == "exact" ? exact : value.text == "none" ? none : expression;
    reference.expression = value.text;
    return reference;
  }
  const Section section = root.section("reference");
  section.only(reference_keys);
  if (section.has("run") == section.has("by_payoff"))
    throw InputError(
        "must be \"exact\", \"none\", a number, an expression, or a table with `run` or `by_payoff`",
        reference.where);
  reference.kind = section.has("run") ? run : expression;
  if (section.has("run")) reference.options = read_options(section.section("run"));
  if (section.has("by_payoff")) {
    const Section values = section.section("by_payoff");
    for (const std::string& payoff : values.keys())
      reference.by_payoff.emplace_back(payoff, values.expression(payoff).text);
  }
  return reference;
}

std::vector<StudySeries> read_series(const Section& root) {
  constexpr std::uint64_t most_launches = std::numeric_limits<std::uint32_t>::max();
  const StudyOptions shared = read_options(root.section("options"));
  const auto launches_of = [&](const Section& section, std::uint32_t otherwise) {
    return section.has("launches") ? static_cast<std::uint32_t>(section.count("launches", 1, most_launches))
                                   : otherwise;
  };
  const std::uint32_t launches = launches_of(root, 1);
  if (!root.has("series")) return {{"", shared, launches, root.location("options").text()}};
  std::vector<StudySeries> all;
  for (const Section& section : root.sections("series")) {
    StudySeries series{section.string("label"), shared, launches_of(section, launches),
                       section.location().text()};
    for (StudyOption& option : read_options(section, series_keys)) put(series.options, std::move(option));
    for (const StudySeries& other : all)
      if (other.label == series.label)
        throw InputError("two series have this label", series.where, series.label);
    all.push_back(std::move(series));
  }
  return all;
}

// None where the key is absent.
std::vector<std::string> series_labels(const Section& section, std::string_view key, const Study& study) {
  if (!section.has(key)) return {};
  const std::vector<std::string> labels = texts(section, key);
  std::vector<std::string> known;
  for (const StudySeries& series : study.series) known.push_back(series.label);
  for (const std::string& label : labels)
    if (std::find(known.begin(), known.end(), label) == known.end())
      throw InputError("no series has this label" + text::suggestion(label, known),
                       section.location(key).text(), label);
  return labels;
}

StudyPlot read_plot(const Section& section, const Study& study) {
  section.only(plot_keys);
  StudyPlot plot;
  plot.where = section.location().text();
  plot.title = string_or(section, "title", "");
  plot.density = section.has("kind") && section.choice("kind", {"error", "density"}) == 1;
  plot.series = series_labels(section, "series", study);
  plot.unfitted = series_labels(section, "unfitted", study);
  if (plot.density) return plot;
  plot.x = section.string("x");
  plot.along = string_or(section, "along", plot.x);
  if (plot.along == "seconds" || plot.along == "ode_solves")
    throw InputError("needs `along`: the option that runs along a line", plot.where, plot.x);
  std::vector<std::string> names;
  for (const auto& [name, measure] : study.measures) names.push_back(name);
  plot.y = section.has("y") ? names[section.choice("y", names)] : names.front();
  plot.quantity = section.has("quantity") ? study.quantities[section.choice("quantity", study.quantities)]
                                          : study.quantities.front();
  plot.x_label = string_or(section, "x_label", "");
  plot.y_label = string_or(section, "y_label", "");
  plot.log_x = flag_or(section, "log_x", true);
  plot.log_y = flag_or(section, "log_y", true);
  plot.fit = plot.log_x && plot.log_y;
  if (!section.has("fit")) return plot;
  const std::vector<std::string> fit = texts(section, "fit");
  if (fit.size() == 2)
    plot.fit_range = range_of(section, "fit");
  else
    plot.fit = flag_or(section, "fit", plot.fit);
  if (plot.fit && !(plot.log_x && plot.log_y))
    throw InputError("a slope is that of a plot with two logarithmic axes", section.location("fit").text());
  return plot;
}

StudyClaim read_claim(const Section& section, const Study& study) {
  section.only(claim_keys);
  StudyClaim claim;
  claim.where = section.location().text();
  claim.text = section.string("text");
  claim.plot =
      section.has("plot") ? section.count("plot", 1, std::max<std::size_t>(1, study.plots.size())) - 1 : 0;
  if (claim.plot >= study.plots.size() || study.plots[claim.plot].density)
    throw InputError("a claim is about the lines of a plot of errors", claim.where);
  if (section.has("slope") == section.has("ratio"))
    throw InputError("needs `slope`, or `ratio` and `to`: the labels of lines", claim.where);
  claim.ratio = section.has("ratio");
  claim.line = section.string(claim.ratio ? "ratio" : "slope");
  if (claim.ratio) claim.to = section.string("to");
  if (section.has("at")) claim.at = section.number("at");
  if (section.has("to_at")) claim.to_at = section.number("to_at");
  if (claim.at.has_value() != claim.to_at.has_value()) claim.to_at = claim.at;
  std::tie(claim.low, claim.high) = *range_of(section, "within");
  claim.holds = flag_or(section, "holds", true);
  return claim;
}

Study read(const Section& root, bool full) {
  root.only(std::span(study_keys).first(study_keys.size() - 1));  // [full] has been taken out
  Study study;
  study.full = full;
  study.title = root.string("title");
  study.paper = string_or(root, "paper", "");
  study.finding = string_or(root, "finding", "");
  study.weak = root.has("command") && root.choice("command", {"filter", "weak"}) == 1;
  study.quantities = root.has("quantity") ? texts(root, "quantity")
                                          : std::vector<std::string>{study.weak ? "value" : "mean_x"};
  const std::vector<std::string> known = measure_names();
  const std::vector<std::string> asked =
      root.has("measure") ? texts(root, "measure") : std::vector<std::string>{"rmse"};
  for (const std::string& name : asked) {
    const auto at = std::find(known.begin(), known.end(), name);
    if (at == known.end())
      throw InputError(
          fmt::format("must be one of {}{}", fmt::join(known, ", "), text::suggestion(name, known)),
          root.location("measure").text(), name);
    study.measures.push_back(measures[static_cast<std::size_t>(at - known.begin())]);
  }
  study.reference = read_reference(root);
  if (!study.weak) study.observations = read_observation_spec(root.section("observations"));
  if (study.weak && root.has("observations"))
    throw InputError("weak approximation observes nothing", root.location("observations").text());
  if (root.has("pool")) study.pool = texts(root, "pool");
  study.series = read_series(root);
  if (root.has("plot"))
    for (const Section& section : root.sections("plot")) study.plots.push_back(read_plot(section, study));
  if (root.has("claim"))
    for (const Section& section : root.sections("claim")) study.claims.push_back(read_claim(section, study));
  return study;
}

}  // namespace

const StudyOption* find_option(const StudyOptions& options, const std::string& name) {
  for (const StudyOption& option : options)
    if (option.name == name) return &option;
  return nullptr;
}

Study read_study(const std::string& path, bool full) {
  const std::string source = contents_of(path);
  const text::TomlFile file{path, text::split_lines(source)};
  toml::table table = text::parse_toml(source, path);
  if (toml::node* larger = table.get("full"); larger != nullptr) {
    if (!larger->is_table())
      throw InputError("must be a table: what the published size changes", path + ", full");
    toml::table changes = std::move(*larger->as_table());
    table.erase("full");
    if (full) overlay(table, std::move(changes));
  } else if (full) {
    throw InputError("the study has no [full] size", "--full", path);
  }
  Study study = read(Section(file, table, ""), full);
  study.source = source;
  study.name = std::filesystem::path(path).stem().string();
  study.directory = std::filesystem::path(path).parent_path().string();
  return study;
}

}  // namespace wienertree::app
