#include "saved_run.hpp"

#include <fmt/format.h>

#include <fstream>
#include <sstream>

#include "data_directory.hpp"
#include "wienertree/run/checksum.hpp"
#include "wienertree/version.hpp"

namespace wienertree::app {

void add_checkpoint_options(CLI::App& app, CheckpointArguments& a) {
  add_text(app, "--checkpoint", a.checkpoint, "FILE",
           "Save the run here now and then, on SIGTERM and SIGINT, and at its end");
  add_number(app, "--checkpoint-every", a.every, Sign::positive, "Seconds between two checkpoints [5]");
  add_text(app, "--resume", a.resume, "FILE", "Go on from a checkpoint of this same run");
}

Json run_identity(const std::string& command) {
  Json run;
  run["program"] = "wienertree " WIENERTREE_VERSION;
  run["command"] = command;
  return run;
}

Json model_identity(const std::string& name, const Model& model) {
  std::ifstream in(model_file(name), std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  Json identity;
  identity["model"] = model.name;
  identity["model file's checksum"] = checksum_text(text.str());
  for (const auto& [parameter, value] : model.parameters) identity["parameters"][parameter] = value;
  const auto bytes = [](const std::vector<double>& numbers) {
    return std::string_view(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(double));
  };
  if (model.inputs)
    for (const InputFunction& f : model.inputs->functions())
      identity["checksums of inputs"][f.name] =
          checksum_text(bytes(f.times)) + " " + checksum_text(bytes(f.values));
  return identity;
}

SavedRun::SavedRun(const CheckpointArguments& a, const Json& identity) {
  if (a.every && !a.checkpoint)
    throw InputError("is the time between two of --checkpoint, which is missing", "--checkpoint-every");
  if (a.checkpoint) checkpoint_.emplace(*a.checkpoint, a.every.value_or(5), identity);
  if (a.resume) state_ = read_checkpoint(*a.resume, identity);
  if (checkpoint_) deferred_.emplace();
}

void SavedRun::resume(const Exchange& exchange) const {
  if (!state_) return;
  StateArchive archive(*state_);
  exchange(archive);
  archive.finish();
}

void SavedRun::after_step(const Exchange& exchange) {
  if (!checkpoint_ || !checkpoint_->due()) return;
  StateArchive archive;
  exchange(archive);
  checkpoint_->write(archive.bytes());
}

void SavedRun::finish(const Exchange& exchange, const std::string& place) {
  if (!checkpoint_) return;
  StateArchive archive;
  exchange(archive);
  checkpoint_->write(archive.bytes());
  const int signal = noted_interruption();
  if (signal != 0)
    throw Interrupted(
        fmt::format("stopped at {}; --resume {} goes on from there", place, checkpoint_->file()), signal);
  deferred_.reset();
}

}  // namespace wienertree::app
