#pragma once
/// Formulas of Lie polynomials as JSON files:
///
///     { "kind": "lie", "name": "..", "degree": 5, "dimension": 1, "source": "..",
///       "elements": [ { "weight": 0.6666,
///                       "terms": [ { "bracket": "0", "coefficient": 1 },
///                                  { "bracket": "[[0,1],1]", "coefficient": 0.25 } ] }, .. ] }
///
/// All keys are required, no other is known.
#include <filesystem>
#include <string>

#include "wienertree/cubature/lie_formula.hpp"

namespace wienertree {

/// Parses a formula and checks its structure, but not its moments. `where` opens every message (a file name).
/// @throws InputError naming file, element, term and key
LieFormula parse_lie_formula(const std::string& text, const std::string& where);

/// Whether the file is JSON with "kind": "lie". @throws InputError if it cannot be read or is not JSON
bool is_lie_formula(const std::filesystem::path& file);

/// parse_lie_formula on a file. @throws InputError also if the file cannot be read
LieFormula read_lie_formula(const std::filesystem::path& file);

/// Reads a formula and refuses it unless every moment up to its stated degree holds to moment_tolerance.
/// @throws InputError as parse_lie_formula, or with the first failing word and both values
LieFormula load_lie_formula(const std::filesystem::path& file);

/// One line per element, 17 significant digits. @throws InputError if name or source are not UTF-8, or
/// check_structure refuses
std::string format_formula(const LieFormula& formula);

/// As for formulas of paths. @throws InputError as format_formula  @throws RunError if the file cannot be
/// written
void save_formula(const LieFormula& formula, const std::filesystem::path& file);

}  // namespace wienertree
