#include "study_cells.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <limits>
#include <numeric>
#include <set>

#include "../data_directory.hpp"
#include "../input_files.hpp"
#include "wienertree/model/text/printable.hpp"
#include "wienertree/model/text_model.hpp"

namespace wienertree::app {
namespace {

// A word that a shell would take apart is put in quotes.
std::string shell_word(const std::string& text) {
  const bool plain = !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("._-+/:=,").find(c) != std::string_view::npos;
  });
  if (plain) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

bool is_flag(const CLI::App& app, const std::string& name) {
  const CLI::Option* option = app.get_option_no_throw("--" + name);
  return option != nullptr && option->get_items_expected_max() == 0;
}

// The options as a command line. "until" belongs to the study and has been taken out.
std::vector<std::string> command_words(const CLI::App& app, const CellOptions& options,
                                       const ModelShelf& models) {
  std::vector<std::string> words;
  for (const auto& [name, value] : options) {
    if (name == "model") continue;
    if (name.starts_with("set."))
      words.push_back("--set=" + name.substr(4) + "=" + value);
    else if (!is_flag(app, name))
      words.push_back("--" + name + "=" + value);
    else if (value == "true")
      words.push_back("--" + name);
    else if (value != "false")
      throw InputError("must be true or false", name, value);
  }
  words.push_back(models.file_of(option_of(options, "model")));
  return words;
}

// What goes wrong inside gets the study's place in front.
template <class F>
auto at_place(const std::string& where, F&& f) {
  try {
    return f();
  } catch (const InputError& error) {
    throw InputError(error.message(), where + (error.where().empty() ? "" : ": " + error.where()),
                     error.value());
  }
}

double number_of(const std::string& text, const std::string& option) {
  double number = 0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (status != std::errc() || end != text.data() + text.size())
    throw InputError("must be a number", option, text);
  return number;
}

CellOptions without(CellOptions options, const std::string& name) {
  std::erase_if(options, [&](const auto& option) { return option.first == name; });
  return options;
}

bool draws(const StudyCell& cell) {
  if (cell.filter) return cell.filter->setup.random;
  return cell.weak->driven &&
         is_random(weak_run(cell.weak->arguments, cell.weak->problem, cell.weak->driven->formula).options);
}

// Calls body with every choice of one value an option.
template <class Body>
void for_every_choice(const StudyOptions& options, Body body) {
  std::vector<std::size_t> at(options.size(), 0);
  while (true) {
    CellOptions choice;
    for (std::size_t o = 0; o < options.size(); ++o)
      choice.emplace_back(options[o].name, options[o].values[at[o]]);
    body(choice);
    std::size_t o = options.size();
    while (o > 0 && ++at[o - 1] == options[o - 1].values.size()) at[--o] = 0;
    if (o == 0) return;
  }
}

}  // namespace

std::string option_of(const CellOptions& options, const std::string& name) {
  for (const auto& [key, value] : options)
    if (key == name) return value;
  return {};
}

std::string words_of(const CellOptions& options) {
  std::string words = shell_word(option_of(options, "model"));
  for (const auto& [name, value] : options) {
    if (name == "model" || value == "false") continue;
    if (name.starts_with("set."))
      words += fmt::format(" --set {}", shell_word(fmt::format("{}={}", name.substr(4), value)));
    else
      words += value == "true" ? " --" + name : fmt::format(" --{} {}", name, shell_word(value));
  }
  return text::printable(words);
}

CellOptions with(CellOptions options, const StudyOptions& over) {
  for (const StudyOption& option : over) {
    if (option.values.size() != 1) throw InputError("must have one value", option.where);
    options = without(std::move(options), option.name);
    options.emplace_back(option.name, option.values.front());
  }
  return options;
}

std::string ModelShelf::file_of(const std::string& name) const {
  const bool path = name.find('/') != std::string::npos || name.ends_with(".toml");
  if (path && !std::filesystem::path(name).is_absolute() && !directory_.empty())
    return directory_ + "/" + name;
  return path && name.find('/') == std::string::npos ? "./" + name : name;
}

std::shared_ptr<const Model> ModelShelf::get(const std::string& name, const Assignments& parameters) {
  std::string key = name;
  for (const auto& [parameter, value] : parameters) key += fmt::format(" {}={}", parameter, value);
  for (const auto& [known, model] : models_)
    if (known == key) return model;
  models_.emplace_back(key, std::make_shared<const Model>(load_model(model_file(name).string(), parameters)));
  refuse_inputs(*models_.back().second, "a study");
  return models_.back().second;
}

FilterCell parse_filter_cell(const CellOptions& options, ModelShelf& models, const std::string& where) {
  return at_place(where, [&] {
    FilterCell cell;
    CLI::App app("", "filter");
    std::string model;
    Assignments parameters;
    FilterArguments arguments;
    std::optional<std::uint64_t> steps;
    app.add_option("MODEL", model)->required();
    add_count(app, "--steps", steps, 1, "", 1'000'000'000);
    add_filter_options(app, arguments);
    add_assignments(app, parameters);
    CellOptions of_filter = without(options, "until");
    if (of_filter.size() != options.size()) cell.until = number_of(option_of(options, "until"), "until");
    parse_words(app, command_words(app, of_filter, models));
    cell.model = models.get(model, parameters);
    cell.model_file = model_file(model).string();
    cell.parameters = parameters;
    if (cell.model->observation == ObservationKind::none)
      throw InputError("the model has no [observation]: there is nothing to filter by",
                       "model " + cell.model->name);
    // A study measures approximations: it has the exact filter for its truth.
    if (!arguments.method) arguments.method = FilterMethod::klv;
    // It varies the steps of one tree.
    if (arguments.method == FilterMethod::klv && !arguments.conditioning)
      arguments.conditioning = Conditioning::children;
    cell.setup = filter_setup(arguments, *cell.model);
    cell.setup.options.threads = static_cast<unsigned>(arguments.threads.value_or(1));
    cell.steps = steps;
    CellOptions problem;
    for (const auto& option : options)
      if (option.first == "model" || option.first == "until" || option.first.starts_with("set."))
        problem.push_back(option);
    cell.problem = words_of(problem);
    return cell;
  });
}

WeakCell parse_weak_cell(const CellOptions& options, const ModelShelf& models, const std::string& where) {
  return at_place(where, [&] {
    WeakArguments a;
    CLI::App app("", "weak");
    add_weak_options(app, a);
    parse_words(app, command_words(app, options, models));
    if (!a.threads) a.threads = 1;
    const TextModel source = TextModel::load(model_file(a.model).string(), a.parameters);
    refuse_inputs(source.model(), "a study");
    WeakProblem problem = weak_problem(a, source);
    WeakCell cell{a, std::move(problem), {}};
    if (!a.tolerance) {
      cell.driven = weak_formula(cell.arguments, cell.problem);
      weak_run(cell.arguments, cell.problem, cell.driven->formula);  // for what it refuses
    }
    return cell;
  });
}

WeakOutcome run_weak_cell(const WeakCell& cell, std::uint32_t launch) {
  return cell.driven ? weak_with_steps(cell.arguments, cell.problem, *cell.driven, launch, {})
                     : weak_to_tolerance(cell.arguments, cell.problem, {});
}

double number_named(const NamedNumbers& numbers, const std::string& name) {
  for (const auto& [key, value] : numbers)
    if (key == name) return value;
  return std::numeric_limits<double>::quiet_NaN();
}

constexpr double most_cells = 5000;

std::vector<StudyCell> study_cells(const Study& study, ModelShelf& models) {
  std::vector<StudyCell> cells;
  double combinations = 0;
  for (std::size_t s = 0; s < study.series.size(); ++s) {
    const StudySeries& series = study.series[s];
    std::set<std::string> keys;
    if (find_option(series.options, "model") == nullptr)
      throw InputError("needs the option `model`", series.where);
    if (const StudyOption* launches = find_option(series.options, "launches"))
      throw InputError("belongs beside `label`, or on top: a launch is a run of its own", launches->where);
    if (const StudyOption* threads = find_option(series.options, "threads"))
      throw InputError(
          "has no place in a study, whose runs share the threads: give --threads on the command line",
          threads->where);
    combinations += std::accumulate(
        series.options.begin(), series.options.end(), 1.0,
        [](double all, const StudyOption& o) { return all * static_cast<double>(o.values.size()); });
    if (combinations > most_cells)
      throw InputError(
          fmt::format("a study of {:g} combinations of options, more than {}", combinations, most_cells),
          series.where);
    for_every_choice(series.options, [&](const CellOptions& options) {
      StudyCell cell;
      cell.series = s;
      cell.options = options;
      cell.key = words_of(options);
      const std::string where = fmt::format("{} ({})", series.where, cell.key);
      if (!keys.insert(cell.key).second) throw InputError("these options appear twice in the series", where);
      if (study.weak)
        cell.weak = std::make_shared<const WeakCell>(parse_weak_cell(options, models, where));
      else
        cell.filter = std::make_shared<const FilterCell>(parse_filter_cell(options, models, where));
      cell.launches = draws(cell) ? series.launches : 1;
      cells.push_back(std::move(cell));
    });
  }
  return cells;
}

}  // namespace wienertree::app
