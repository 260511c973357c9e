#pragma once
/// Reading JSON with messages that name the place and the key, for formula_file.cpp and lie_formula_file.cpp.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>

#include "wienertree/model/file_key.hpp"

namespace wienertree::json {

using Json = nlohmann::json;

/// The text as JSON.
/// @throws InputError at `where` with line and column if the text is not JSON, has a key twice in an object,
///   a number too large for double, or is nested deeper than any formula
Json parse(const std::string& text, const std::string& where);

/// The value as JSON, cut to 40 characters.
std::string brief(const Json& value);

/// @throws InputError unless `object` is an object with exactly these keys
void check_keys(const Json& object, std::span<const FileKey> keys, const std::string& where);

/// The value of a key that is there. @throws InputError naming the key if it is not of the type asked for
std::string string_at(const Json& object, const char* key, const std::string& where);
int positive_integer_at(const Json& object, const char* key, const std::string& where);
const Json& array_at(const Json& object, const char* key, const std::string& where);  ///< not empty

/// @throws InputError "`what` must be a number"
double number(const Json& value, const std::string& what, const std::string& where);

/// The string as JSON, quotes included. @throws InputError "`key` is not UTF-8"
std::string quoted(const std::string& text, const char* key, const std::string& where);

/// @throws InputError if the file cannot be read
std::string text_of_file(const std::filesystem::path& file);

/// Writes under a temporary name beside `file` and renames. @throws RunError if that fails; `file` is then as
/// it was
void replace_file(const std::filesystem::path& file, const std::string& text);

}  // namespace wienertree::json
