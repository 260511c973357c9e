#pragma once
/// Cubature formulas as JSON files:
///
///     { "name": "lyons-victoir-5-1", "degree": 5, "dimension": 1, "source": "Lyons, Victoir (2004), ..",
///       "paths": [ { "weight": 0.1666,
///                    "segments": [[0.3333, -0.1993], [0.3333, 2.1306], [0.3333, -0.1993]] }, .. ] }
///
/// `dimension` is p; a segment is [dw^0, dw^1, .., dw^p]. All keys are required, no other is known.
#include <filesystem>
#include <string>

#include "wienertree/cubature/formula.hpp"
#include "wienertree/cubature/verification.hpp"

namespace wienertree {

/// Parses a formula and checks its structure, but not its moments. `where` opens every message (a file name).
///
/// @throws InputError for what is not JSON (with line and column), a missing, unknown, repeated or wrongly
///   typed key, and whatever check_structure refuses; the message names file, path, segment and key
CubatureFormula parse_formula(const std::string& text, const std::string& where);

/// parse_formula on a file. @throws InputError also if the file cannot be read
CubatureFormula read_formula(const std::filesystem::path& file);

/// Reads a formula and refuses it unless every moment up to its stated degree holds to moment_tolerance.
/// @throws InputError as read_formula, or with the first failing word and both values
CubatureFormula load_formula(const std::filesystem::path& file);

/// One line per path, 17 significant digits, so that reading gives the same numbers back bit for bit.
/// @throws InputError if name or source are not UTF-8, or check_structure refuses
std::string format_formula(const CubatureFormula& formula);

/// Writes under a temporary name beside `file` and renames, so that a failure leaves what was there.
/// @throws InputError as format_formula  @throws RunError if the file cannot be written
void save_formula(const CubatureFormula& formula, const std::filesystem::path& file);

}  // namespace wienertree
