#pragma once
/// The directory that a study writes to: new, empty, or one that this study made.
#include <filesystem>
#include <string>
#include <vector>

namespace wienertree::app {

/// A directory, locked for this process and marked as the study's.
///
/// The mark is a file `wienertree-study.json`, written before anything else. So nothing in a directory that somebody
/// else filled is ever overwritten, and two studies do not overwrite each other's pages.
class StudyDirectory {
 public:
  /// Makes the directory if there is none.
  /// @param study name of the study  @param files what will be written into it
  /// @throws InputError, before anything is written, if it can be neither made nor opened; if another process has it;
  /// if it is neither empty nor marked by a study of this name; if one of `files` is there as a link, symbolic or
  /// hard, which leads out of the directory, or as anything but a file
  StudyDirectory(const std::string& directory, const std::string& study,
                 const std::vector<std::string>& files);
  ~StudyDirectory();
  StudyDirectory(const StudyDirectory&) = delete;
  StudyDirectory& operator=(const StudyDirectory&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  void claim(const std::string& study, const std::vector<std::string>& files);

  std::filesystem::path path_;
  int lock_ = -1;
};

}  // namespace wienertree::app
