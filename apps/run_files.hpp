#pragma once
/// The files that one run reads and writes: none of its outputs may take the place of an input or of another output.
#include <sys/types.h>

#include <cstddef>
#include <optional>
#include <string>
#include <tuple>

namespace wienertree::app {

/// A file by device and inode, so that links and other spellings of a name are seen through; one that does not exist
/// yet by device and inode of its directory, and its name there.
struct FileIdentity {
  dev_t device = 0;
  ino_t inode = 0;
  std::string name;  ///< empty for a file that exists
  bool operator==(const FileIdentity&) const = default;
};
/// None for what cannot be overwritten: a device, a pipe, a directory, a file whose directory does not exist. "-" is
/// standard input or output, whichever `descriptor` says.
std::optional<FileIdentity> identity_of_file(const std::string& name, int descriptor);

/// While such an object lives, inputs and outputs are noted; there is one for each run of the program.
class RunFiles {
 public:
  RunFiles();
  ~RunFiles();
  RunFiles(const RunFiles&) = delete;
  RunFiles& operator=(const RunFiles&) = delete;
};

/// Notes a file that this run reads. `option` names it in messages. Nothing is noted without RunFiles.
/// @throws InputError if an output of this run would overwrite it
void note_input(const std::string& option, const std::string& name);

/// A file that this run writes, noted while the object lives.
class NotedOutput {
 public:
  /// @throws InputError if it is an input or another output of this run. --checkpoint may write what --resume read.
  NotedOutput(const std::string& option, const std::string& name);
  ~NotedOutput();
  NotedOutput(const NotedOutput&) = delete;
  NotedOutput& operator=(const NotedOutput&) = delete;

 private:
  std::size_t number_ = 0;
};

}  // namespace wienertree::app
