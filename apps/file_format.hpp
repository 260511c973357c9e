#pragma once
/// The files that the program reads and writes, as it prints them: `wienertree format`.
#include <span>
#include <string>
#include <vector>

#include "wienertree/model/file_key.hpp"

namespace wienertree::app {

struct FormatSection {
  std::string name;  ///< where the keys stand: "[state]"
  std::string says;  ///< a line before the keys, or none
  std::span<const FileKey> keys;
};

struct FileFormat {
  std::string name;          ///< "model"
  std::string introduction;  ///< lines
  std::vector<FormatSection> sections;
  std::string example;  ///< a whole file that its reader accepts; empty for what only the program writes
};

const std::vector<FileFormat>& file_formats();

/// Introduction, the keys of each section with values, meanings and defaults, the example.
std::string format_text(const FileFormat& format);

}  // namespace wienertree::app
