#pragma once
/// The formulas at hand: files in a directory of the caller's choice, and closed forms.
#include <filesystem>
#include <string>
#include <vector>

#include "wienertree/cubature/formula.hpp"
#include "wienertree/cubature/verification.hpp"

namespace wienertree {

struct CatalogueEntry {
  std::filesystem::path file;
  CubatureFormula formula;
  FormulaVerification verification;
};

/// Every *.json of the directory, read and verified, ordered by degree, dimension, name.
///
/// @throws InputError if the directory cannot be read, a file is not a formula or fails its moments, or two
///   formulas have the same name
std::vector<CatalogueEntry> bundled_formulas(const std::filesystem::path& directory);

/// The file of this degree and dimension that promises the least error for a given amount of work; if there
/// is none, the closed form (construct.hpp).
///
/// A step costs c = total_segments(formula) ODEs for each node and leaves an error proportional to the
/// moments missed at the next degree, of size R = next_residual. In n steps the error is about R n^{-(m-1)/2}
/// and the work n c, so that at equal work the error is proportional to R c^{(m-1)/2}: the formula with the
/// least such product is taken.
/// @throws InputError if there is neither, listing what there is; and as bundled_formulas
CubatureFormula find_formula(int degree, int p, const std::filesystem::path& directory);

/// R c^{(m-1)/2}, see find_formula.
double error_at_equal_work(const CubatureFormula& formula, const FormulaVerification& verification);

/// The file whose formula has this name, verified.
/// @throws InputError if there is none, listing the names there are; and as load_formula
CubatureFormula find_formula(const std::string& name, const std::filesystem::path& directory);

}  // namespace wienertree
