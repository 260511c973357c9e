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

#include "wienertree/numeric/error.hpp"

namespace wienertree::app {
namespace {

namespace fs = std::filesystem;

std::string reason(int error) { return std::generic_category().message(error); }

// Names that a signal handler may have to remove: fixed buffers, since a handler may not allocate.
struct TemporaryName {
  std::atomic<bool> taken{false}, complete{false};
  std::array<char, 4096> name{};
};
std::array<TemporaryName, 4> temporaries;

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

// ".out.csv.host.": what temporary names beside out.csv begin with, on this machine.
std::string temporary_prefix(const fs::path& target) {
  std::array<char, 256> host{};
  if (::gethostname(host.data(), host.size() - 1) != 0) host[0] = 0;
  return fmt::format(".{}.{}.", target.filename().string(), host.data());
}

// What a program that was killed has left: the process whose number the name holds is no more.
void remove_abandoned(const fs::path& target) {
  const std::string prefix = temporary_prefix(target), suffix = ".tmp";
  std::error_code failure;
  for (const auto& entry : fs::directory_iterator(target.parent_path(), failure)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(prefix) || !name.ends_with(suffix) || name.size() <= prefix.size() + suffix.size())
      continue;
    pid_t process = 0;
    const char* const end = name.data() + name.size() - suffix.size();
    const auto [stop, status] = std::from_chars(name.data() + prefix.size(), end, process);
    if (status == std::errc() && stop == end && process > 0 && ::kill(process, 0) != 0 && errno == ESRCH)
      ::unlink(entry.path().c_str());
  }
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

OutputFile::OutputFile(std::string option, const std::string& target)
    : option_(std::move(option)), target_(target) {
  if (target == "-") {
    direct_ = true;
    return;
  }
  const auto refuse = [&](const std::string& message) { throw InputError(message, option_, target_); };
  if (target.empty()) refuse("a file name is needed");
  std::error_code failure;
  // Through links, so that the file they point to is replaced and not the link.
  if (const fs::path resolved = fs::weakly_canonical(fs::absolute(target), failure); !failure)
    target_ = resolved.string();
  struct stat status {};
  if (::stat(target_.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) refuse("is a directory");
    if (::access(target_.c_str(), W_OK) != 0) refuse("cannot be written: " + reason(errno));
    direct_ = !S_ISREG(status.st_mode);
    mode_ = status.st_mode & 07777U;
  }
  if (direct_) return;
  const fs::path directory = fs::path(target_).parent_path();
  if (!fs::is_directory(directory, failure)) refuse("there is no such directory");
  if (::access(directory.c_str(), W_OK | X_OK) != 0)
    refuse("its directory cannot be written: " + reason(errno));
  remove_abandoned(target_);
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
  const fs::path path(target_);
  const std::string name =
      (path.parent_path() / fmt::format("{}{}.tmp", temporary_prefix(path), ::getpid())).string();
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

void remove_temporary_files() {
  for (TemporaryName& t : temporaries)
    if (t.complete) ::unlink(t.name.data());
}

}  // namespace wienertree::app
