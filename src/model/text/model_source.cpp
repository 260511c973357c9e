#include "wienertree/model/text/model_source.hpp"

#include "wienertree/model/text/printable.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "wienertree/model/text/function_names.hpp"
#include "wienertree/model/text/lexer.hpp"
#include "wienertree/model/text/model_keys.hpp"
#include "wienertree/model/text/toml_section.hpp"

namespace wienertree::text {

namespace {

void check_name(const std::string& name, const Location& location) {
  if (!is_identifier(name))
    throw InputError("a name is made of letters, digits and _ and does not start with a digit",
                     location.text(), name.substr(0, 80));
  if (std::find(reserved_words.begin(), reserved_words.end(), name) != reserved_words.end())
    throw InputError(fmt::format("'{}' is a word of the language", name), location.text());
  if (name == "t" || name == "pi")
    throw InputError(fmt::format("'{}' is the name of {}", name, name == "t" ? "the time" : "the constant"),
                     location.text());
}

std::vector<NamedExpression> read_parameters(const Section& section) {
  std::vector<NamedExpression> result;
  for (const std::string& name : section.keys()) {
    check_name(name, section.location(name));
    result.push_back({name, section.expression(name)});
  }
  return result;
}

bool is_observation_name(std::string_view name) {
  return name.size() > 1 && name[0] == 'y' &&
         name.find_first_not_of("0123456789", 1) == std::string_view::npos;
}

std::vector<InputSource> read_inputs(const Section& section, const std::vector<NamedExpression>& parameters) {
  std::vector<InputSource> result;
  for (const std::string& name : section.keys()) {
    const Section entry = section.section(name);
    InputSource input{name, section.location(name), Between::linear};
    check_name(name, input.location);
    for (const NamedExpression& parameter : parameters)
      if (parameter.name == name)
        throw InputError("this name is already that of a parameter", input.location.text(), name);
    if (is_observation_name(name))
      throw InputError("y1, y2, .. are the columns of observations; rename this", input.location.text(),
                       name);
    entry.only(input_keys);
    constexpr std::array kinds{Between::linear, Between::previous};
    input.between = kinds.at(entry.choice("between", {"linear", "previous"}));
    result.push_back(std::move(input));
  }
  if (result.empty()) throw InputError("names at least one input", section.location().text());
  return result;
}

std::vector<StateSource> read_states(const Section& section, const std::vector<NamedExpression>& parameters,
                                     const std::vector<InputSource>& inputs) {
  std::vector<StateSource> result;
  for (const std::string& name : section.keys()) {
    const Section entry = section.section(name);
    StateSource state;
    state.name = name;
    state.location = section.location(name);
    check_name(name, state.location);
    for (const NamedExpression& parameter : parameters)
      if (parameter.name == name)
        throw InputError("this name is already that of a parameter", state.location.text(), name);
    for (const InputSource& input : inputs)
      if (input.name == name)
        throw InputError("this name is already that of an input", state.location.text(), name);
    entry.only(state_keys);
    if (entry.has("initial")) state.initial = entry.expression("initial");
    if (entry.has("lower")) state.lower = entry.expression("lower");
    if (entry.has("upper")) state.upper = entry.expression("upper");
    if (entry.has("boundary")) {
      constexpr std::array kinds{Boundary::error, Boundary::clamp, Boundary::absorb};
      state.boundary = kinds.at(entry.choice("boundary", {"error", "clamp", "absorb"}));
      if (!state.lower && !state.upper)
        throw InputError("a boundary needs `lower` or `upper`", entry.location("boundary").text());
    }
    result.push_back(std::move(state));
  }
  if (result.empty()) throw InputError("a model has at least one state", section.location().text());
  return result;
}

// Checks that the keys of [drift] and [diffusion] are the states, no more and no fewer.
void check_components(const Section& section, const std::vector<StateSource>& states) {
  std::vector<std::string> names;
  for (const StateSource& state : states) names.push_back(state.name);
  for (const std::string& key : section.keys())
    if (std::find(names.begin(), names.end(), key) == names.end())
      throw InputError("no such state" + suggestion(key, names), section.location(key).text(), key);
}

void read_dynamics(const Section& root, ModelSource& model) {
  const Section drift = root.section("drift"), diffusion = root.section("diffusion");
  check_components(drift, model.states);
  check_components(diffusion, model.states);
  for (const StateSource& state : model.states) {
    model.drift.push_back(drift.expression(state.name));
    model.diffusion.push_back(diffusion.expressions(state.name));
    const std::size_t entries = model.diffusion.back().size(), p = model.diffusion.front().size();
    const std::string place = diffusion.location(state.name).text();
    if (entries == 0) throw InputError("needs an entry for every Brownian motion, at least one", place);
    if (entries != p)
      throw InputError(fmt::format("wrong shape: one entry per Brownian motion, {} as for {}", p,
                                   model.states.front().name),
                       place, std::to_string(entries));
  }
}

std::vector<std::vector<SourceExpression>> read_correlation(const Section& section, std::size_t p) {
  section.only(brownian_keys);
  std::vector<std::vector<SourceExpression>> rows = section.matrix("correlation");
  const std::string place = section.location("correlation").text();
  if (rows.size() != p)
    throw InputError(fmt::format("needs {} rows, one per Brownian motion", p), place,
                     std::to_string(rows.size()));
  for (const auto& row : rows)
    if (row.size() != p)
      throw InputError(fmt::format("needs {} entries in every row, one per Brownian motion", p), place,
                       std::to_string(row.size()));
  return rows;
}

NoiseSource read_noise(const Section& section) {
  section.only(noise_keys);
  std::vector<std::string> names;
  for (const NoiseLawName& known : noise_laws) names.emplace_back(known.law);
  const NoiseLawName& law = noise_laws.at(section.choice("law", names));
  NoiseSource result{std::string(law.law), section.location(), {}};
  for (const std::string_view parameter : law.parameters)
    if (!parameter.empty())
      result.parameters.push_back({std::string(parameter), section.expression(parameter)});
  for (const std::string& key : section.keys())
    if (key != "law" && key != law.parameters[0] && key != law.parameters[1])
      throw InputError(fmt::format("the law {} has no such parameter", law.law), section.location(key).text(),
                       key);
  return result;
}

void forbid(const Section& section, std::initializer_list<const char*> keys, const char* reason) {
  for (const char* key : keys)
    if (section.has(key)) throw InputError(reason, section.location(key).text());
}

ObservationSource read_observation(const Section& section) {
  section.only(observation_keys);
  ObservationSource result;
  result.location = section.location();
  const bool continuous = section.choice("kind", {"continuous", "discrete"}) == 0;
  result.kind = continuous ? ObservationKind::continuous : ObservationKind::discrete;
  if (continuous)
    forbid(section, {"noise", "timing", "log_likelihood"},
           "belongs to discrete observations; the noise of continuous ones is a unit Brownian motion");
  if (section.has("timing"))
    result.timing = section.choice("timing", {"current", "previous"}) == 0 ? ObservationTiming::current
                                                                           : ObservationTiming::previous;
  if (section.has("log_likelihood")) {
    forbid(section, {"h", "noise"}, "`log_likelihood` stands instead of `h` and `noise`");
    result.log_likelihood = section.expression("log_likelihood");
    return result;
  }
  result.h = section.expressions("h");
  if (result.h.empty()) throw InputError("needs at least one expression", section.location("h").text());
  if (continuous) return result;
  for (const Section& noise : section.sections("noise")) result.noise.push_back(read_noise(noise));
  if (result.noise.size() != 1 && result.noise.size() != result.h.size())
    throw InputError(
        fmt::format("needs one law for all components of h, or one for each of {}", result.h.size()),
        section.location("noise").text(), std::to_string(result.noise.size()));
  return result;
}

void check_size(const std::vector<SourceExpression>& list, std::size_t d, const Location& location) {
  if (list.size() != d)
    throw InputError(fmt::format("needs {} entries, one per state", d), location.text(),
                     std::to_string(list.size()));
}

InitialSource read_initial(const Section& section, std::size_t d) {
  section.only(initial_keys);
  InitialSource result;
  result.location = section.location();
  if (section.has("mean")) {
    result.mean = section.expressions("mean");
    check_size(result.mean, d, section.location("mean"));
  }
  result.covariance = section.matrix("covariance");
  const Location place = section.location("covariance");
  if (result.covariance.size() != d)
    throw InputError(fmt::format("needs {} rows, one per state", d), place.text(),
                     std::to_string(result.covariance.size()));
  for (const auto& row : result.covariance) check_size(row, d, place);
  return result;
}

ExactClaim read_exact(const Section& section) {
  section.only(exact_keys);
  constexpr std::array filters{ExactFilter::benes, ExactFilter::kalman_bucy, ExactFilter::kalman};
  return {filters.at(section.choice("filter", {"benes", "kalman-bucy", "kalman"})),
          section.location("filter")};
}

std::string stem(std::string file) {
  file.erase(0, file.find_last_of('/') + 1);
  if (const std::size_t dot = file.find_last_of('.'); dot != std::string::npos && dot > 0) file.resize(dot);
  return file;
}

ModelSource read(const toml::table& table, const TomlFile& file) {
  const Section root(file, table, "");
  root.only(model_keys);
  ModelSource model;
  model.file = file.name;
  model.name = root.has("name") ? root.string("name") : printable(stem(file.name));
  if (model.name != printable(model.name))
    throw InputError("must be one line of printable characters", root.location("name").text(), model.name);
  model.convention =
      root.choice("convention", {"ito", "stratonovich"}) == 0 ? Convention::ito : Convention::stratonovich;
  if (root.has("parameters")) model.parameters = read_parameters(root.section("parameters"));
  if (root.has("inputs")) model.inputs = read_inputs(root.section("inputs"), model.parameters);
  model.states = read_states(root.section("state"), model.parameters, model.inputs);
  read_dynamics(root, model);
  if (root.has("noise")) model.correlation = read_correlation(root.section("noise"), model.noise_dimension());
  if (root.has("observation")) model.observation = read_observation(root.section("observation"));
  if (root.has("initial")) model.initial = read_initial(root.section("initial"), model.states.size());
  if (root.has("exact")) model.exact = read_exact(root.section("exact"));
  const bool has_mean = model.initial && !model.initial->mean.empty();
  for (const StateSource& state : model.states)
    if (!state.initial && !has_mean)
      throw InputError("missing key `initial`", state.location.text(), state.name);
  return model;
}

}  // namespace

void add_integral(ModelSource& source, const std::string& name, const std::string& integrand,
                  const std::string& where) {
  const Location place{where, 0, 0, ""};
  check_name(name, place);
  const auto has_name = [&](const auto& named) { return named.name == name; };
  if (std::any_of(source.states.begin(), source.states.end(), has_name) ||
      std::any_of(source.parameters.begin(), source.parameters.end(), has_name) ||
      std::any_of(source.inputs.begin(), source.inputs.end(), has_name))
    throw InputError("this name is already that of a state, a parameter or an input", place.text(), name);
  const SourceExpression zero{"0", place, false};
  StateSource state;
  state.name = name;
  state.location = place;
  state.initial = zero;
  const std::size_t p = source.noise_dimension();
  source.states.push_back(std::move(state));
  source.drift.push_back({integrand, {where, 1, 1, ""}, true});
  source.diffusion.emplace_back(p, zero);
  if (!source.initial) return;
  if (!source.initial->mean.empty()) source.initial->mean.push_back(zero);
  for (auto& row : source.initial->covariance) row.push_back(zero);
  source.initial->covariance.emplace_back(source.states.size(), zero);
}

ModelSource read_model(std::string_view text, const std::string& file) {
  const TomlFile toml_file{file, split_lines(text)};
  return read(parse_toml(text, file), toml_file);
}

}  // namespace wienertree::text
