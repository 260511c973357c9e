#include "run_files.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <mutex>
#include <vector>

#include "wienertree/numeric/error.hpp"

namespace wienertree::app {
namespace {

namespace fs = std::filesystem;

struct Noted {
  std::size_t number;
  bool output;
  std::string option;
  FileIdentity file;
};

std::mutex mutex;
int runs = 0;
std::size_t last_number = 0;
std::vector<Noted> noted;

// Whether both may be one file.
bool may_meet(const std::string& input, const std::string& output) {
  return input == "--resume" && output == "--checkpoint";
}

// The number under which it is noted, or 0.
std::size_t note(bool output, const std::string& option, const std::string& name) {
  const std::lock_guard lock(mutex);
  if (runs == 0) return 0;
  const std::optional<FileIdentity> file = identity_of_file(name, output ? STDOUT_FILENO : STDIN_FILENO);
  if (!file) return 0;
  for (const Noted& other : noted) {
    if (other.file != *file) continue;
    if (!output && !other.output) return 0;  // an input may be read twice
    if (other.output && output)
      throw InputError("is the file that " + other.option + " writes as well", option, name);
    const std::string& reader = output ? other.option : option;
    const std::string& writer = output ? option : other.option;
    if (!may_meet(reader, writer))
      throw InputError("is the file that " + reader + " reads: it would be overwritten", writer, name);
  }
  noted.push_back({++last_number, output, option, *file});
  return last_number;
}

}  // namespace

std::optional<FileIdentity> identity_of_file(const std::string& name, int descriptor) {
  struct stat status {};
  if (name == "-" ? ::fstat(descriptor, &status) == 0 : ::stat(name.c_str(), &status) == 0) {
    if (!S_ISREG(status.st_mode)) return {};
    return FileIdentity{status.st_dev, status.st_ino, {}};
  }
  std::error_code failure;
  const fs::path path = fs::absolute(name, failure);
  if (failure || ::stat(path.parent_path().c_str(), &status) != 0) return {};
  return FileIdentity{status.st_dev, status.st_ino, path.filename().string()};
}

RunFiles::RunFiles() {
  const std::lock_guard lock(mutex);
  if (runs++ == 0) noted.clear();
}

RunFiles::~RunFiles() {
  const std::lock_guard lock(mutex);
  if (--runs == 0) noted.clear();
}

void note_input(const std::string& option, const std::string& name) { note(false, option, name); }

NotedOutput::NotedOutput(const std::string& option, const std::string& name)
    : number_(note(true, option, name)) {}

NotedOutput::~NotedOutput() {
  const std::lock_guard lock(mutex);
  if (number_ != 0) std::erase_if(noted, [&](const Noted& n) { return n.number == number_; });
}

}  // namespace wienertree::app
