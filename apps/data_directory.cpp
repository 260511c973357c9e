#include "data_directory.hpp"

#include <algorithm>
#include <cstdlib>
#include <system_error>

#include "wienertree/model/error.hpp"
#include "wienertree/model/text/location.hpp"

namespace wienertree::app {
namespace {

namespace fs = std::filesystem;

fs::path directory_of_program() {
  std::error_code failure;
  return fs::read_symlink("/proc/self/exe", failure).parent_path();
}

fs::path bundled_file(const std::string& name, const std::string& folder, const std::string& extension,
                      const std::string& what, const std::string& where) {
  if (name.find('/') != std::string::npos || name.ends_with(extension)) return name;
  const std::vector<std::string> names = bundled_names(folder, extension);
  if (std::find(names.begin(), names.end(), name) == names.end())
    throw InputError("no bundled " + what + " of this name" + text::suggestion(name, names), where, name);
  return data_directory() / folder / (name + extension);
}

}  // namespace

fs::path data_directory() {
  fs::path directory;
  if (const char* set = std::getenv("WIENERTREE_DATA"); set != nullptr && *set != '\0') {
    directory = set;
  } else if (const fs::path here = directory_of_program(); here == WIENERTREE_BUILD_DIRECTORY) {
    directory = WIENERTREE_SOURCE_DATA;
  } else {
    directory = here.parent_path() / "share" / "wienertree";
    if (std::error_code failure; !fs::is_directory(directory, failure)) directory = WIENERTREE_INSTALLED_DATA;
  }
  if (std::error_code failure; !fs::is_directory(directory, failure))
    throw InputError("the bundled data is not there; WIENERTREE_DATA may name its directory", "data",
                     directory.string());
  return directory;
}

fs::path formulas_directory() { return data_directory() / "cubature_formulas"; }

std::vector<std::string> bundled_names(const std::string& folder, const std::string& extension) {
  std::vector<std::string> names;
  std::error_code failure;
  for (const fs::directory_entry& entry : fs::directory_iterator(data_directory() / folder, failure))
    if (entry.path().extension() == extension) names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

fs::path model_file(const std::string& name_or_path) {
  return bundled_file(name_or_path, "models", ".toml", "model", "model");
}

fs::path formula_path(const std::string& name_or_path, const std::string& option) {
  return bundled_file(name_or_path, "cubature_formulas", ".json", "formula", option);
}

}  // namespace wienertree::app
