#include "wienertree/cubature/json_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>
#include <system_error>
#include <vector>

#include "wienertree/numeric/error.hpp"
#include "wienertree/numeric/read_all.hpp"

namespace wienertree::json {
namespace {

// A formula is four levels deep. Deeper text would be printed recursively in a message.
constexpr int max_depth = 16;

// "line 3, column 7" of the byte at which the parser stopped (counted from 1, as nlohmann does).
std::string line_and_column(const std::string& json, std::size_t byte) {
  const auto end = json.begin() + static_cast<std::ptrdiff_t>(std::min(byte, json.size() + 1) - (byte > 0));
  const auto line = 1 + std::count(json.begin(), end, '\n');
  const auto newline = std::find(std::make_reverse_iterator(end), json.rend(), '\n');
  return fmt::format("line {}, column {}", line, 1 + (end - newline.base()));
}

}  // namespace

Json parse(const std::string& text, const std::string& where) {
  using Event = Json::parse_event_t;
  std::vector<std::set<std::string>> keys;  // of the objects that are open
  const auto callback = [&](int depth, Event event, Json& parsed) {
    if (depth > max_depth) throw InputError("the JSON is nested too deeply", where);
    if (event == Event::object_start) keys.emplace_back();
    if (event == Event::object_end) keys.pop_back();
    // nlohmann keeps the last of two equal keys; here the second is an error.
    if (event == Event::key && !keys.back().insert(parsed.get<std::string>()).second)
      throw InputError("a key appears twice in an object", where, parsed.get<std::string>());
    return true;
  };
  try {
    return Json::parse(text, callback);
  } catch (const Json::parse_error& error) {
    throw InputError("this is not JSON", fmt::format("{}: {}", where, line_and_column(text, error.byte)));
  } catch (const Json::out_of_range&) {
    throw InputError("a number is too large", where);
  }
}

std::string brief(const Json& value) {
  std::string text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  return text.size() <= 40 ? text : text.substr(0, 37) + "...";
}

void check_keys(const Json& object, std::span<const FileKey> keys, const std::string& where) {
  const std::vector<std::string> names = names_of(keys);
  if (!object.is_object()) throw InputError("an object was expected", where, brief(object));
  for (const auto& [key, value] : object.items()) {
    if (std::find(names.begin(), names.end(), key) == names.end())
      throw InputError(fmt::format("unknown key; the keys are {}", fmt::join(names, ", ")), where, key);
  }
  for (const std::string& key : names) {
    if (!object.contains(key)) throw InputError(fmt::format("the key \"{}\" is missing", key), where);
  }
}

std::string string_at(const Json& object, const char* key, const std::string& where) {
  const Json& value = object.at(key);
  if (!value.is_string()) throw InputError(fmt::format("\"{}\" must be a string", key), where, brief(value));
  return value.get<std::string>();
}

int positive_integer_at(const Json& object, const char* key, const std::string& where) {
  const Json& value = object.at(key);
  if (!value.is_number_integer() || value.get<double>() < 1 || value.get<double>() > 1e6)
    throw InputError(fmt::format("\"{}\" must be a positive integer", key), where, brief(value));
  return value.get<int>();
}

const Json& array_at(const Json& object, const char* key, const std::string& where) {
  const Json& value = object.at(key);
  if (!value.is_array() || value.empty())
    throw InputError(fmt::format("\"{}\" must be a non-empty array", key), where, brief(value));
  return value;
}

double number(const Json& value, const std::string& what, const std::string& where) {
  if (!value.is_number()) throw InputError(fmt::format("{} must be a number", what), where, brief(value));
  // -0.0 becomes 0: as text it would be the integer -0, which reads back as 0.
  return value.get<double>() + 0.0;
}

std::string quoted(const std::string& text, const char* key, const std::string& where) {
  try {
    return Json(text).dump();
  } catch (const Json::type_error&) {
    throw InputError(fmt::format("\"{}\" is not UTF-8", key), where);
  }
}

std::string text_of_file(const std::filesystem::path& file) {
  try {
    std::ifstream stream;
    stream.exceptions(std::ios::failbit | std::ios::badbit);
    stream.open(file, std::ios::binary);
    stream.exceptions(std::ios::badbit);
    return read_all(stream, largest_text_file, file.string());
  } catch (const std::ios::failure&) {  // thrown by the buffer itself where the file is a directory
    throw InputError("the formula file cannot be read", file.string());
  }
}

void replace_file(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::path temporary = file;
  temporary += ".tmp";
  std::error_code failure;
  {
    std::ofstream stream(temporary, std::ios::binary | std::ios::trunc);
    stream << text;
    stream.close();
    if (!stream) failure = std::make_error_code(std::errc::io_error);
  }
  if (!failure) std::filesystem::rename(temporary, file, failure);
  if (failure) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw RunError("the formula file cannot be written", file.string(), failure.message());
  }
}

}  // namespace wienertree::json
