#pragma once
/// Where results go: files that appear whole or not at all, and standard output with every failure noticed.
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "run_files.hpp"

namespace wienertree::app {

/// The reader of standard output is gone: nobody is left to be told, so the program ends with 1 and no
/// message.
class BrokenPipe : public std::runtime_error {
 public:
  BrokenPipe() : std::runtime_error("broken pipe") {}
};

/// A file that appears under its name only when all its content is on disk.
///
/// `stage` writes beside the target under a temporary name, `publish` renames; until then, and after any
/// failure, what was there before is there still. A target that is no regular file (a device, a pipe) has no
/// name to spare and is written directly by `publish`. "-" is standard output.
class OutputFile {
 public:
  /// `option` names the target in messages, e.g. "--output".
  /// @throws InputError if nothing could be written there (no such directory, no permission, a directory itself, a
  /// name that is too long) or if it is an input or another output of this run. Called before a computation starts,
  /// so that it does not run in vain; a temporary file is made and removed, to be sure.
  OutputFile(std::string option, const std::string& target);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// @throws RunError if the content cannot be written (a full disk, a quota)
  void stage(std::string content);
  /// @throws RunError if the file cannot take its name, or the device refuses the content
  void publish();
  const std::string& target() const { return target_; }

 private:
  std::string temporary_name() const;

  std::string option_, target_, temporary_, direct_content_;
  std::optional<NotedOutput> noted_;
  bool direct_ = false;
  unsigned mode_ = 0;
};

/// Writes all of it, going on after a short write, as on a disk that is nearly full.
/// Returns 0, or errno of the write that failed.
int write_all(int file, std::string_view content);

/// Writes to standard output and waits until it is taken.
/// @throws BrokenPipe, or RunError for any other failure
void write_to_stdout(std::string_view content);

/// Writes a message to standard error, where a terminal may be: what is not printable is replaced.
void tell(std::string_view message);

/// Removes what programs that were killed have left beside this target.
void remove_abandoned_temporaries(const std::filesystem::path& target);

/// Removes the temporary files of all OutputFiles. May be called by a signal handler.
void remove_temporary_files();

}  // namespace wienertree::app
