#include "wienertree/model/text/location.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <utility>

namespace wienertree::text {

namespace {

std::string lower_case(std::string_view s) {
  std::string result(s);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

// Optimal string alignment distance: Levenshtein's with the exchange of two neighbours as one edit.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  const std::size_t width = b.size() + 1;
  std::vector<std::size_t> before(width), previous(width), current(width);
  for (std::size_t j = 0; j < width; ++j) previous[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    current[0] = i;
    for (std::size_t j = 1; j < width; ++j) {
      const std::size_t substitution = previous[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      current[j] = std::min({previous[j] + 1, current[j - 1] + 1, substitution});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        current[j] = std::min(current[j], before[j - 2] + 1);
    }
    before.swap(previous);
    previous.swap(current);
  }
  return previous[b.size()];
}

}  // namespace

std::string Location::text() const {
  std::string place = file;
  if (line > 0) place += fmt::format(":{}", line);
  if (line > 0 && column > 0) place += fmt::format(":{}", column);
  if (!key.empty()) place += (place.empty() ? "" : ", ") + key;
  return place;
}

Location SourceExpression::at(std::size_t offset) const {
  Location place = location;
  if (columns_known) {
    const std::string_view before = std::string_view(text).substr(0, offset);
    // Columns count characters: the continuation bytes of UTF-8 do not count.
    place.column += static_cast<std::size_t>(std::count_if(before.begin(), before.end(), [](char c) {
      return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
    }));
  }
  return place;
}

std::string nearest(std::string_view name, const std::vector<std::string>& candidates) {
  constexpr std::size_t longest_name = 64;  // a longer one is no slip of the pen
  if (name.empty() || name.size() > longest_name) return {};
  const std::string wanted = lower_case(name);
  // Of equally near names the one of the same length: an exchange of letters before an omission.
  const auto length_difference = [&](const std::string& candidate) {
    return std::max(candidate.size(), name.size()) - std::min(candidate.size(), name.size());
  };
  std::pair best{std::max<std::size_t>(1, name.size() / 3) + 1, std::size_t{0}};
  std::string result;
  for (const std::string& candidate : candidates) {
    if (candidate.size() > longest_name) continue;
    const std::pair distance{edit_distance(wanted, lower_case(candidate)), length_difference(candidate)};
    if (distance < best) {
      best = distance;
      result = candidate;
    }
  }
  return result;
}

std::string suggestion(std::string_view name, const std::vector<std::string>& candidates) {
  const std::string candidate = nearest(name, candidates);
  return candidate.empty() ? std::string() : fmt::format(", did you mean '{}'?", candidate);
}

}  // namespace wienertree::text
