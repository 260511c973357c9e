#include "data_directory.hpp"

#include <dlfcn.h>
#include <link.h>

#include <algorithm>
#include <cstdlib>
#include <system_error>

#include "run_files.hpp"
#include "wienertree/model/text/location.hpp"
#include "wienertree/numeric/error.hpp"

namespace wienertree::app {
namespace {

namespace fs = std::filesystem;

// The program or, where this code is part of one, the shared object.
fs::path this_binary() {
  static const char here = 0;
  Dl_info info;
  link_map* object = nullptr;
  std::error_code failure;
  if (::dladdr1(&here, &info, reinterpret_cast<void**>(&object), RTLD_DL_LINKMAP) != 0 && object != nullptr &&
      object->l_name[0] != '\0')
    return fs::canonical(object->l_name, failure);
  return fs::read_symlink("/proc/self/exe", failure);
}

bool is_below(const fs::path& file, const fs::path& directory) {
  const fs::path relative = file.lexically_relative(directory);
  return !relative.empty() && *relative.begin() != "..";
}

// share/wienertree beside bin/ or lib/, however deep below that the binary lies.
fs::path installed_data(const fs::path& binary) {
  std::error_code failure;
  for (fs::path above = binary.parent_path(); above.has_relative_path(); above = above.parent_path())
    if (fs::path data = above / "share" / "wienertree"; fs::is_directory(data, failure)) return data;
  return WIENERTREE_INSTALLED_DATA;
}

fs::path bundled_file(const std::string& name, const std::string& folder, const std::string& extension,
                      const std::string& what, const std::string& where) {
  if (name.empty()) throw InputError("the name is empty", where, "''");
  if (name.find('/') != std::string::npos || name.ends_with(extension)) {
    note_input(where, name);
    return name;
  }
  const std::vector<std::string> names = bundled_names(folder, extension);
  if (std::find(names.begin(), names.end(), name) == names.end())
    throw InputError("no bundled " + what + " of this name" + text::suggestion(name, names), where, name);
  fs::path file = data_directory() / folder / (name + extension);
  note_input(where, file.string());
  return file;
}

}  // namespace

namespace {

// Where the bundled data should be.
fs::path data_place() {
  if (const char* set = std::getenv("WIENERTREE_DATA"); set != nullptr && *set != '\0') return set;
  const fs::path binary = this_binary();
  const bool built = is_below(binary, WIENERTREE_BUILD_DIRECTORY "/apps") ||
                     is_below(binary, WIENERTREE_BUILD_DIRECTORY "/python");
  return built ? fs::path(WIENERTREE_SOURCE_DATA) : installed_data(binary);
}

}  // namespace

fs::path data_directory() {
  fs::path directory = data_place();
  if (std::error_code failure; !fs::is_directory(directory, failure))
    throw InputError("the bundled data is not there; WIENERTREE_DATA may name its directory", "data",
                     directory.string());
  return directory;
}

fs::path formulas_directory(bool needed) {
  return (needed ? data_directory() : data_place()) / "cubature_formulas";
}

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

fs::path study_file(const std::string& name_or_path) {
  return bundled_file(name_or_path, "studies", ".toml", "study", "study");
}

fs::path formula_path(const std::string& name_or_path, const std::string& option) {
  return bundled_file(name_or_path, "cubature_formulas", ".json", "formula", option);
}

}  // namespace wienertree::app
