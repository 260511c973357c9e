#include "study_directory.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <sstream>
#include <system_error>

#include "../output.hpp"
#include "../table.hpp"
#include "wienertree/numeric/error.hpp"

namespace wienertree::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* mark = "wienertree-study.json";
constexpr const char* program = "wienertree study";

std::string reason(int error) { return std::generic_category().message(error); }

[[noreturn]] void refuse(const std::string& message, const fs::path& place) {
  throw InputError(message, "--output", place.string());
}

void require_own_file(const fs::path& file) {
  struct stat status {};
  if (::lstat(file.c_str(), &status) != 0) {
    if (errno != ENOENT) refuse("cannot be written: " + reason(errno), file);
    return;
  }
  if (S_ISLNK(status.st_mode)) refuse("is a link: what it points to would be overwritten", file);
  if (!S_ISREG(status.st_mode)) refuse("is not a file", file);
  if (status.st_nlink > 1) refuse("is a hard link: the file of its other name would be overwritten", file);
}

// The name of the study that made the directory.
std::string marked_study(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  const Json json = Json::parse(text.str(), nullptr, false);
  const auto field = [&](const char* name) {
    return json.is_object() && json.contains(name) && json[name].is_string() ? json[name].get<std::string>()
                                                                             : std::string();
  };
  if (field("program") != program || field("study").empty())
    refuse("is not what a study left there: give another directory", file);
  return field("study");
}

}  // namespace

StudyDirectory::StudyDirectory(const std::string& directory, const std::string& study,
                               const std::vector<std::string>& files)
    : path_(directory) {
  if (directory.empty()) throw InputError("a directory is needed, and this name is empty", "--output", "''");
  std::error_code failure;
  fs::create_directories(path_, failure);
  if (failure || !fs::is_directory(path_, failure)) refuse("no directory can be made there", path_);
  path_ = fs::canonical(path_, failure);
  lock_ = ::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock_ < 0) refuse("cannot be opened: " + reason(errno), path_);
  try {
    claim(study, files);
  } catch (...) {
    ::close(lock_);
    throw;
  }
}

void StudyDirectory::claim(const std::string& study, const std::vector<std::string>& files) {
  if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) refuse("another study is running there", path_);
  const fs::path file = path_ / mark;
  remove_abandoned_temporaries(file);
  require_own_file(file);
  if (fs::exists(file)) {
    if (const std::string other = marked_study(file); other != study)
      refuse(fmt::format("belongs to the study {}, and this is {}: give another directory", other, study),
             path_);
    for (const std::string& name : files) require_own_file(path_ / name);
    return;
  }
  if (!fs::is_empty(path_))
    refuse("is not empty, and no study made it: give a new or an empty directory", path_);
  OutputFile output("--output", file.string());
  output.stage(
      Json{{"program", program}, {"study", study}}.dump(2, ' ', false, Json::error_handler_t::replace) +
      '\n');
  output.publish();
}

StudyDirectory::~StudyDirectory() { ::close(lock_); }

}  // namespace wienertree::app
