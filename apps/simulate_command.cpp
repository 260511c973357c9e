#include <memory>
#include <sstream>

#include "command_line.hpp"
#include "commands.hpp"
#include "data_directory.hpp"
#include "input_files.hpp"
#include "output.hpp"
#include "signal_file.hpp"
#include "wienertree/filter/simulate.hpp"
#include "wienertree/model/text_model.hpp"

namespace wienertree::app {
namespace {

struct SimulateArguments {
  std::string model;
  Assignments parameters;
  std::optional<double> horizon;
  std::optional<std::uint64_t> steps, seed, keep;
  std::optional<std::string> observations, signal, inputs;
};

void simulate_and_write(const SimulateArguments& a) {
  const Model model =
      with_inputs(TextModel::load(model_file(a.model).string(), a.parameters), a.inputs).model();
  if (a.observations && model.observation == ObservationKind::none)
    throw InputError("the model has no [observation]: only --signal can be written", "--observations",
                     model.name);
  if (!a.observations && !a.signal) throw InputError("give --observations, --signal or both", "simulate");
  std::optional<OutputFile> observations, signal;
  if (a.observations) observations.emplace("--observations", *a.observations);
  if (a.signal) signal.emplace("--signal", *a.signal);
  if (a.observations == "-" && a.signal == "-")
    throw InputError("standard output takes one table only", "--signal", "-");
  const std::uint64_t steps = *a.steps;
  const Simulation simulation =
      simulate(model, *a.horizon, steps, a.keep.value_or(steps), a.seed.value_or(1));
  // Both files are whole before either takes its name.
  if (observations) {
    std::ostringstream csv;
    write_observations(csv, simulation.observations);
    observations->stage(csv.str());
  }
  if (signal) signal->stage(to_csv(signal_table(model, simulation.signal)));
  if (observations) observations->publish();
  if (signal) signal->publish();
}

}  // namespace

void add_simulate_command(CLI::App& program) {
  CLI::App& app = *program.add_subcommand("simulate", "A signal and its observations, drawn from a model");
  const auto a = std::make_shared<SimulateArguments>();
  app.add_option("MODEL", a->model, "A bundled model or a TOML file")->required();
  add_number(app, "--horizon", a->horizon, Sign::positive, "End of the time interval, which starts at 0")
      ->required();
  add_count(app, "--steps", a->steps, 1, "Euler steps", 1'000'000'000)->required();
  add_count(app, "--keep", a->keep, 1, "Rows kept after the first; divides --steps [all]");
  add_count(app, "--seed", a->seed, 0, "Seed [1]");
  add_text(app, "--observations", a->observations, "FILE",
           "Observations as CSV: t,y1,..; - is standard output");
  add_text(app, "--signal", a->signal, "FILE", "The signal as CSV: t,<state>,..; - is standard output");
  add_inputs(app, a->inputs);
  add_memory_limit(app);
  add_assignments(app, a->parameters);
  app.footer(
      "Example:\n"
      "  wienertree simulate benes --horizon 10 --steps 100000 --keep 10000 --seed 7 --observations Y.csv "
      "--signal X.csv");
  app.callback([a] { simulate_and_write(*a); });
}

}  // namespace wienertree::app
