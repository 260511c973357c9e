#pragma once
/// Where something stands in a model file, for error messages.
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "wienertree/numeric/error.hpp"

namespace wienertree::text {

/// A place in a file; line and column count from 1, 0 means unknown.
struct Location {
  std::string file;
  std::size_t line = 0, column = 0;
  std::string key;  ///< the key as a user would write it, e.g. "drift.v"; may be empty
  /// "file:line:column, key" without the parts that are unknown.
  std::string text() const;
};

/// An expression as it stands in the file.
struct SourceExpression {
  std::string text;
  Location location;
  /// True when `location.column` is the column of the expression's first character, so that a place inside
  /// the expression is a place in the file.
  bool columns_known = false;
  /// The place of the character at `offset`.
  Location at(std::size_t offset) const;
};

/// The candidate nearest to `name` in edit distance (insertions, deletions, substitutions, exchanges of
/// neighbours, case ignored), or an empty string when none is within a third of the name's length (at least
/// one edit).
std::string nearest(std::string_view name, const std::vector<std::string>& candidates);

/// ", did you mean 'candidate'?" or an empty string.
std::string suggestion(std::string_view name, const std::vector<std::string>& candidates);

}  // namespace wienertree::text
