#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>
#include <set>

#include "command_line.hpp"
#include "commands.hpp"
#include "data_directory.hpp"
#include "output.hpp"
#include "wienertree/model/jacobi.hpp"
#include "wienertree/model/text_model.hpp"

namespace wienertree::app {
namespace {

std::string observation_of(const Model& model) {
  switch (model.observation) {
    case ObservationKind::none:
      return "none";
    case ObservationKind::continuous:
      return fmt::format("continuous, {}", model.observation_dimension());
    case ObservationKind::discrete:
      return fmt::format("discrete, {}", model.observation_dimension());
  }
  return {};
}

std::string list_models() {
  std::string text = fmt::format("{:<24} {:<28} {:>8}  {:<14} {}\n", "name", "states", "Brownian",
                                 "observation", "exact filter");
  for (const std::string& name : bundled_names("models", ".toml")) {
    const TextModel model = TextModel::load(model_file(name).string());
    const Model& m = model.model();
    const std::span<const std::string> states{m.state_names.data(), m.reported_dimension()};
    text += fmt::format("{:<24} {:<28} {:>8}  {:<14} {}\n", name, fmt::format("{}", fmt::join(states, ", ")),
                        m.noise_dimension(), observation_of(m), model.analysis().exact_filter_name);
  }
  return text;
}

// "  d<state> = .." for each component, or one line when all are zero.
std::string components(const ModelAnalysis& a, const std::vector<std::string>& values) {
  if (std::set<std::string>(values.begin(), values.end()) == std::set<std::string>{"0"}) return "  0\n";
  std::string text;
  for (std::size_t i = 0; i < values.size(); ++i) text += fmt::format("  {} : {}\n", a.states[i], values[i]);
  return text;
}

std::string matrix(const ModelAnalysis& a, const std::vector<std::string>& entries) {
  std::string text;
  const std::size_t d = a.states.size();
  for (std::size_t i = 0; i < d; ++i)
    for (std::size_t l = 0; l < d; ++l)
      if (entries[i * d + l] != "0")
        text += fmt::format("  d{}/d{} : {}\n", a.states[i], a.states[l], entries[i * d + l]);
  return text.empty() ? "  0\n" : text;
}

std::string observation(const ModelAnalysis& a, const Model& model) {
  if (model.observation == ObservationKind::none) return "\nobservation: none\n";
  std::string text = fmt::format(
      "\nobservation: {}{}\n",
      model.observation == ObservationKind::continuous ? "continuous, dY = h dt + dW" : "discrete",
      model.timing == ObservationTiming::previous ? ", of the state one observation earlier" : "");
  if (!a.log_likelihood.empty()) text += fmt::format("  log likelihood : {}\n", a.log_likelihood);
  for (std::size_t i = 0; i < a.sensor.size(); ++i) text += fmt::format("  h_{} : {}\n", i + 1, a.sensor[i]);
  const std::size_t p = model.noise_dimension();
  for (std::size_t i = 0; i < a.sensor_derivative.size(); ++i)
    text += fmt::format("  V_{} h_{} : {}\n", i % p + 1, i / p + 1, a.sensor_derivative[i]);
  return text;
}

std::string show_model(const std::string& name, const Assignments& parameters) {
  const TextModel source = TextModel::load(model_file(name).string(), parameters);
  const Model& model = source.model();
  const ModelAnalysis a = source.analysis();
  std::string text = fmt::format("{}: {} state{}, {} Brownian motion{}\n", a.name, model.reported_dimension(),
                                 model.reported_dimension() == 1 ? "" : "s", model.noise_dimension(),
                                 model.noise_dimension() == 1 ? "" : "s");
  text += "\nparameters\n";
  if (a.parameters.empty()) text += "  none\n";
  for (const auto& [parameter, value] : a.parameters) text += fmt::format("  {} = {}\n", parameter, value);
  if (!a.inputs.empty()) text += "\ninputs, functions of time from a file (u' is the slope of u)\n";
  for (const auto& [input, between] : a.inputs)
    text += fmt::format("  {}: {}\n", input,
                        between == Between::linear ? "linear between its times" : "its previous value");
  text += "\nstart\n";
  for (std::size_t i = 0; i < model.reported_dimension(); ++i) {
    text += fmt::format("  {} = {}", a.states[i], model.initial[i]);
    if (model.initial_law) {
      const auto at = static_cast<Eigen::Index>(i);
      text += fmt::format(", variance {}", model.initial_law->covariance(at, at));
    }
    if (model.bounds[i].bounded())
      text += fmt::format(", within [{}, {}]", model.bounds[i].lower, model.bounds[i].upper);
    text += '\n';
  }
  text +=
      fmt::format("\nIto drift{}\n", a.convention == "ito" ? " (as given)" : "") + components(a, a.ito_drift);
  text += fmt::format("\nV_0, Stratonovich drift{}\n", a.convention == "ito" ? "" : " (as given)") +
          components(a, a.fields[0]);
  if (!a.correlation.empty()) {
    text += "\ncorrelation of the Brownian motions (V_1, V_2, .. are along independent ones)\n";
    for (const auto& row : a.correlation) text += fmt::format("  {}\n", fmt::join(row, ", "));
  }
  for (std::size_t k = 1; k < a.fields.size(); ++k)
    text += fmt::format("\nV_{}\n", k) + components(a, a.fields[k]);
  for (std::size_t k = 0; k < a.jacobians.size(); ++k)
    text += fmt::format("\nJacobian of V_{}\n", k) + matrix(a, a.jacobians[k]);
  for (const auto& bracket : a.brackets)
    text += fmt::format("\nbracket [V_{}, V_{}]\n", bracket.i, bracket.j) + components(a, bracket.components);
  text += observation(a, model);
  text += fmt::format("\nflow of a node: {}\nexact filter: {}{}\n",
                      a.has_exact_flow ? "in closed form" : "by an ODE solver", a.exact_filter_name,
                      a.exact_filter_reason.empty() ? "" : " (" + a.exact_filter_reason + ")");
  if (const auto jacobi = jacobi_process(model))
    text += fmt::format(
        "exact transition: {0}: Jacobi's, d{0} = ({1:g} + {2:g} {0}) dt + sqrt({3:g} ({0} - {4:g})({5:g} - "
        "{0})) dB\n",
        model.state_names[0], jacobi->a, jacobi->b, jacobi->c, jacobi->lower, jacobi->upper);
  else if (a.square_roots.empty())
    text += fmt::format("exact transition: none ({})\n", a.square_roots_reason);
  for (const std::string& line : a.square_roots) text += fmt::format("exact transition: {}\n", line);
  return text;
}

}  // namespace

void add_model_command(CLI::App& program) {
  CLI::App& app = *program.add_subcommand("model", "Models, and what follows from their coefficients");
  app.require_subcommand(1);
  app.footer("Example:\n  wienertree model show benes");

  CLI::App& list = *app.add_subcommand("list", "The bundled models");
  list.footer("Example:\n  wienertree model list");
  list.callback([] { write_to_stdout(list_models()); });

  struct ShowArguments {
    std::string model;
    Assignments parameters;
  };
  const auto a = std::make_shared<ShowArguments>();
  CLI::App& show = *app.add_subcommand(
      "show",
      "Vector fields in both conventions, Jacobians, brackets, sensor, and the exact filter that applies");
  show.add_option("MODEL", a->model, "A bundled model or a TOML file")->required();
  add_assignments(show, a->parameters);
  show.footer("Example:\n  wienertree model show benes --set mu=0.5");
  show.callback([a] { write_to_stdout(show_model(a->model, a->parameters)); });
}

}  // namespace wienertree::app
