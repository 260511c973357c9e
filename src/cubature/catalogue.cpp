#include "wienertree/cubature/catalogue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <system_error>
#include <tuple>

#include "wienertree/cubature/construct.hpp"
#include "wienertree/cubature/formula_file.hpp"
#include "wienertree/numeric/error.hpp"

namespace wienertree {
namespace {

// Read, not yet verified.
std::vector<CatalogueEntry> read_directory(const std::filesystem::path& directory) {
  std::vector<CatalogueEntry> entries;
  std::error_code failure;
  for (auto it = std::filesystem::directory_iterator(directory, failure);
       !failure && it != std::filesystem::directory_iterator(); it.increment(failure)) {
    if (it->path().extension() == ".json") entries.push_back({it->path(), read_formula(it->path()), {}});
  }
  if (failure)
    throw InputError("the directory of formulas cannot be read", directory.string(), failure.message());
  const auto key = [](const CatalogueEntry& entry) {
    return std::tie(entry.formula.degree, entry.formula.dimension, entry.formula.name, entry.file);
  };
  std::sort(entries.begin(), entries.end(), [&](const auto& a, const auto& b) { return key(a) < key(b); });
  std::map<std::string, std::filesystem::path> files;
  for (const CatalogueEntry& entry : entries) {
    const auto [other, is_new] = files.emplace(entry.formula.name, entry.file);
    if (!is_new)
      throw InputError(fmt::format("the name of the formula is that of {} too", other->second.string()),
                       entry.file.string(), entry.formula.name);
  }
  return entries;
}

void verify_entry(CatalogueEntry& entry) {
  entry.verification = verify(entry.formula);
  require_holds(entry.verification, entry.file.string());
}

// "degree 5: p = 1, 2; degree 7: p = 1" over the files.
std::string degrees_and_dimensions(const std::vector<CatalogueEntry>& entries) {
  std::map<int, std::set<int>> dimensions;
  for (const CatalogueEntry& entry : entries)
    dimensions[entry.formula.degree].insert(entry.formula.dimension);
  std::string text;
  for (const auto& [degree, ps] : dimensions)
    text += fmt::format("; degree {}: p = {}", degree, fmt::join(ps, ", "));
  return text;
}

}  // namespace

std::vector<CatalogueEntry> bundled_formulas(const std::filesystem::path& directory) {
  std::vector<CatalogueEntry> entries = read_directory(directory);
  for (CatalogueEntry& entry : entries) verify_entry(entry);
  return entries;
}

double error_at_equal_work(const CubatureFormula& formula, const FormulaVerification& verification) {
  // The residual is absent for all formulas of this degree and dimension or for none.
  return verification.next_residual.value_or(1) *
         std::pow(static_cast<double>(total_segments(formula)), (formula.degree - 1) / 2.0);
}

CubatureFormula find_formula(int degree, int p, const std::filesystem::path& directory) {
  std::vector<CatalogueEntry> entries = read_directory(directory);
  const CatalogueEntry* best = nullptr;
  for (CatalogueEntry& entry : entries) {
    if (entry.formula.degree != degree || entry.formula.dimension != p) continue;
    verify_entry(entry);
    if (best == nullptr || error_at_equal_work(entry.formula, entry.verification) <
                               error_at_equal_work(best->formula, best->verification))
      best = &entry;
  }
  if (best != nullptr) return best->formula;
  const bool closed_form = p >= 1 && (degree == 3 || (degree == 5 && p <= gaussian_cubature_5_max_dimension));
  if (closed_form) return construct(degree, p);
  throw InputError(
      fmt::format("there is no such formula; there are degree 3: any p; degree 5: p = 1..{} (constructed){}",
                  gaussian_cubature_5_max_dimension, degrees_and_dimensions(entries)),
      directory.string(), fmt::format("degree {}, p = {}", degree, p));
}

CubatureFormula find_formula(const std::string& name, const std::filesystem::path& directory) {
  std::vector<CatalogueEntry> entries = read_directory(directory);
  std::vector<std::string> names;
  for (CatalogueEntry& entry : entries) {
    names.push_back(entry.formula.name);
    if (entry.formula.name != name) continue;
    verify_entry(entry);
    return entry.formula;
  }
  throw InputError(fmt::format("there is no formula of this name; there are {}", fmt::join(names, ", ")),
                   directory.string(), name);
}

}  // namespace wienertree
