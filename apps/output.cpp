#include "output.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "wienertree/model/text/printable.hpp"
#include "wienertree/numeric/error.hpp"
#include "wienertree/run/checksum.hpp"

namespace wienertree::app {
namespace {

namespace fs = std::filesystem;

std::string reason(int error) { return std::generic_category().message(error); }

// Names that a signal handler may have to remove: fixed buffers, since a handler may not allocate.
struct TemporaryName {
  std::atomic<bool> taken{false}, complete{false};
  std::array<char, 4096> name{};
};
std::array<TemporaryName, 16> temporaries;

void remember(const std::string& name) {
  for (TemporaryName& t : temporaries) {
    if (name.size() >= t.name.size() || t.taken.exchange(true)) continue;
    std::memcpy(t.name.data(), name.c_str(), name.size() + 1);
    t.complete = true;
    return;
  }
}

void forget(const std::string& name) {
  for (TemporaryName& t : temporaries)
    if (t.complete && name == t.name.data()) {
      t.complete = false;
      t.taken = false;
    }
}

bool remembered(const std::string& name) {
  for (const TemporaryName& t : temporaries)
    if (t.complete && name == t.name.data()) return true;
  return false;
}

constexpr std::string_view suffix = ".tmp";

// ".out.csv.host.": what temporary names beside out.csv begin with, on this machine. A name that would get too long
// for the file system is replaced by its checksum.
std::string temporary_prefix(const fs::path& target) {
  std::array<char, 256> host{};
  if (::gethostname(host.data(), host.size() - 1) != 0) host[0] = 0;
  constexpr std::size_t longest_number = 20;
  const long limit = ::pathconf(target.parent_path().c_str(), _PC_NAME_MAX);
  const std::string name = target.filename().string(), prefix = fmt::format(".{}.{}.", name, host.data());
  if (limit <= 0 || prefix.size() + longest_number + suffix.size() <= static_cast<std::size_t>(limit))
    return prefix;
  return fmt::format(".{}.{}.", checksum_text(name), host.data());
}

// The file that will be written, through links, so that the file they point to is replaced and not the link; also
// where the last link points to nothing yet.
fs::path through_links(fs::path path) {
  std::error_code failure;
  constexpr int most_links = 40;  // as the kernel has it
  for (int links = 0; links < most_links && fs::is_symlink(fs::symlink_status(path, failure)); ++links) {
    const fs::path to = fs::read_symlink(path, failure);
    if (failure) break;
    path = to.is_absolute() ? to : path.parent_path() / to;
  }
  const fs::path directory = fs::weakly_canonical(path.parent_path(), failure);
  return failure ? path : directory / path.filename();
}

// A name is kept through a loss of power only when its directory is.
void sync_directory(const fs::path& directory) {
  const int opened = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (opened < 0) return;
  ::fsync(opened);
  ::close(opened);
}

}  // namespace

int write_all(int file, std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = ::write(file, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    content.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

// What a program that was killed has left: the process whose number the name holds is no more, or is this one,
// which knows its own.
void remove_abandoned_temporaries(const fs::path& target) {
  const std::string prefix = temporary_prefix(target);
  std::error_code failure;
  for (const auto& entry : fs::directory_iterator(target.parent_path(), failure)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(prefix) || !name.ends_with(suffix) || name.size() <= prefix.size() + suffix.size())
      continue;
    pid_t process = 0;
    const char* const end = name.data() + name.size() - suffix.size();
    const auto [stop, status] = std::from_chars(name.data() + prefix.size(), end, process);
    if (status != std::errc() || stop != end || process <= 0) continue;
    const bool ended = process == ::getpid() ? !remembered(entry.path().string())
                                             : ::kill(process, 0) != 0 && errno == ESRCH;
    if (ended) ::unlink(entry.path().c_str());
  }
}

OutputFile::OutputFile(std::string option, const std::string& target)
    : option_(std::move(option)), target_(target) {
  if (target == "-") {
    noted_.emplace(option_, target_);
    direct_ = true;
    return;
  }
  const auto refuse = [&](const std::string& message) { throw InputError(message, option_, target_); };
  if (target.empty()) throw InputError("a file name is needed, and this one is empty", option_, "''");
  std::error_code failure;
  struct stat status {};
  if (::stat(target_.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) refuse("is a directory");
    if (::access(target_.c_str(), W_OK) != 0) refuse("cannot be written: " + reason(errno));
    direct_ = !S_ISREG(status.st_mode);
    mode_ = status.st_mode & 07777U;
  } else if (errno != ENOENT && errno != ENOTDIR) {
    refuse("cannot be written: " + reason(errno));
  }
  if (direct_) return;
  target_ = through_links(fs::absolute(target)).string();
  const fs::path directory = fs::path(target_).parent_path();
  if (!fs::is_directory(directory, failure)) refuse("there is no such directory");
  if (::access(directory.c_str(), W_OK | X_OK) != 0)
    refuse("its directory cannot be written: " + reason(errno));
  noted_.emplace(option_, fs::exists(target, failure) ? target : target_);
  remove_abandoned_temporaries(target_);
  // Whatever else may be wrong with the name or the file system is found out now.
  const std::string name = temporary_name();
  const int file = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (file < 0) refuse("cannot be written: " + reason(errno));
  ::close(file);
  ::unlink(name.c_str());
}

std::string OutputFile::temporary_name() const {
  const fs::path path(target_);
  return (path.parent_path() / fmt::format("{}{}{}", temporary_prefix(path), ::getpid(), suffix)).string();
}

OutputFile::~OutputFile() {
  if (temporary_.empty()) return;
  ::unlink(temporary_.c_str());
  forget(temporary_);
}

void OutputFile::stage(std::string content) {
  if (direct_) {
    direct_content_ = std::move(content);
    return;
  }
  const auto fail = [&](int error) {
    throw RunError("cannot be written: " + reason(error), option_, target_);
  };
  const std::string name = temporary_name();
  const int file = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (file < 0) fail(errno);
  temporary_ = name;
  remember(temporary_);
  int error = write_all(file, content);
  if (error == 0 && mode_ != 0 && ::fchmod(file, mode_) != 0) error = errno;
  // Some file systems report a full disk only when asked to keep the bytes.
  if (error == 0 && ::fsync(file) != 0 && errno != EINVAL) error = errno;
  if (::close(file) != 0 && error == 0) error = errno;
  if (error != 0) fail(error);
}

void OutputFile::publish() {
  const auto fail = [&](int error) {
    throw RunError("cannot be written: " + reason(error), option_, target_);
  };
  if (target_ == "-") {
    write_to_stdout(direct_content_);
  } else if (direct_) {
    const int file = ::open(target_.c_str(), O_WRONLY | O_CLOEXEC);
    if (file < 0) fail(errno);
    const int error = write_all(file, direct_content_);
    if (::close(file) != 0 || error != 0) fail(error != 0 ? error : errno);
  } else {
    if (std::rename(temporary_.c_str(), target_.c_str()) != 0) fail(errno);
    forget(temporary_);
    temporary_.clear();
    sync_directory(fs::path(target_).parent_path());
  }
}

void write_to_stdout(std::string_view content) {
  const int error = write_all(STDOUT_FILENO, content);
  if (error == EPIPE) throw BrokenPipe();
  if (error != 0) throw RunError("cannot be written: " + reason(error), "standard output");
}

void tell(std::string_view message) {
  std::fputs(text::printable(message, text::LineEnds::kept).c_str(), stderr);
}

void remove_temporary_files() {
  for (TemporaryName& t : temporaries)
    if (t.complete) ::unlink(t.name.data());
}

}  // namespace wienertree::app
