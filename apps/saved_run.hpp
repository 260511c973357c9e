#pragma once
/// The options that put a run down and take it up again, and a run that does so.
#include <functional>
#include <optional>
#include <string>

#include "checkpoint.hpp"
#include "command_line.hpp"
#include "interruption.hpp"
#include "wienertree/model/model.hpp"
#include "wienertree/numeric/state_archive.hpp"

namespace wienertree::app {

struct CheckpointArguments {
  std::optional<std::string> checkpoint, resume;
  std::optional<double> every;  ///< seconds
};

void add_checkpoint_options(CLI::App& app, CheckpointArguments& arguments);

/// What makes it this run and no other: the program, the command and the model; commands add what else their
/// results depend on.
Json run_identity(const std::string& command);
/// Name, checksum of the file, parameters. `name` as on the command line.
Json model_identity(const std::string& name, const Model& model);

/// Passes the whole state of a run to or from an archive.
using Exchange = std::function<void(StateArchive&)>;

/// A run with checkpoints, where they are asked for. While it lives and has a file to write, the first SIGINT
/// or SIGTERM is noted, and taken up between steps.
class SavedRun {
 public:
  /// @throws InputError for a file that cannot be written, or is no checkpoint of this run
  SavedRun(const CheckpointArguments& arguments, const Json& identity);
  bool resumes() const { return state_.has_value(); }
  /// Reads the state to go on from, if there is one.
  void resume(const Exchange& exchange) const;
  /// Between two steps: saves if it is time. @throws RunError if it cannot be written
  void after_step(const Exchange& exchange);
  /// Whether the run is to stop now.
  bool interrupted() const { return noted_interruption() != 0; }
  /// At the last step, which is not the end if the run was interrupted: saves.
  /// @throws Interrupted, naming `place` ("t = 3") and how to go on, if it was
  void finish(const Exchange& exchange, const std::string& place);

 private:
  std::optional<Checkpoint> checkpoint_;
  std::optional<std::string> state_;
  std::optional<DeferredInterruption> deferred_;
};

}  // namespace wienertree::app
