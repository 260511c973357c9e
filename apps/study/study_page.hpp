#pragma once
/// The study as one HTML page that needs no other file and no network.
#include <string>
#include <vector>

#include "study_tables.hpp"

namespace wienertree::app {

struct StudyPicture {
  std::string wide, narrow;  ///< SVG; narrow may be empty
  std::string png;           ///< name of the file beside the page
};

/// What the page offers for download: embedded, and linked by name.
struct StudyDownload {
  std::string name, content;
  bool embedded = true;
};

std::string study_page(const Study& study, const StudyResults& results,
                       const std::vector<StudyPicture>& pictures,
                       const std::vector<StudyDownload>& downloads);

}  // namespace wienertree::app
