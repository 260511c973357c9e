#pragma once
/// The keys of a file as data: its reader accepts these and no others, and a program can print them.
#include <algorithm>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace wienertree {

struct FileKey {
  std::string_view name;
  std::string_view value;      ///< what it takes
  std::string_view otherwise;  ///< what holds without it; "required" if it must be there
  std::string_view meaning;
};

inline std::vector<std::string> names_of(std::span<const FileKey> keys) {
  std::vector<std::string> names;
  std::transform(keys.begin(), keys.end(), std::back_inserter(names),
                 [](const FileKey& key) { return std::string(key.name); });
  return names;
}

}  // namespace wienertree
