#include "wienertree/cubature/formula_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <system_error>
#include <vector>

#include "wienertree/model/error.hpp"

namespace wienertree {
namespace {

using Json = nlohmann::json;

// Short text of an offending value.
std::string text_of(const Json& value) {
  std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
  return text.size() <= 40 ? text : text.substr(0, 37) + "...";
}

// "line 3, column 7" of the byte at which the parser stopped (counted from 1, as nlohmann does).
std::string line_and_column(const std::string& json, std::size_t byte) {
  const auto end = json.begin() + static_cast<std::ptrdiff_t>(std::min(byte, json.size() + 1) - (byte > 0));
  const auto line = 1 + std::count(json.begin(), end, '\n');
  const auto newline = std::find(std::make_reverse_iterator(end), json.rend(), '\n');
  return fmt::format("line {}, column {}", line, 1 + (end - newline.base()));
}

// nlohmann keeps the last of two equal keys; here the second is an error.
Json parse_without_repeated_keys(const std::string& json, const std::string& where) {
  std::vector<std::set<std::string>> keys;  // of the objects that are open
  const auto callback = [&](int, Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::object_start) keys.emplace_back();
    if (event == Json::parse_event_t::object_end) keys.pop_back();
    if (event == Json::parse_event_t::key) {
      const std::string key = parsed.get<std::string>();
      if (!keys.back().insert(key).second) throw InputError("a key appears twice in an object", where, key);
    }
    return true;
  };
  try {
    return Json::parse(json, callback);
  } catch (const Json::parse_error& error) {
    throw InputError("this is not JSON", fmt::format("{}: {}", where, line_and_column(json, error.byte)));
  } catch (const Json::out_of_range&) {
    throw InputError("a number is too large", where);
  }
}

void check_keys(const Json& object, std::initializer_list<std::string_view> known, const std::string& where) {
  if (!object.is_object()) throw InputError("an object was expected", where, text_of(object));
  for (const auto& [key, value] : object.items()) {
    if (std::find(known.begin(), known.end(), key) == known.end())
      throw InputError(fmt::format("unknown key; the keys are {}", fmt::join(known, ", ")), where, key);
  }
  for (const std::string_view key : known) {
    if (!object.contains(key)) throw InputError(fmt::format("the key \"{}\" is missing", key), where);
  }
}

std::string string_at(const Json& object, const char* key, const std::string& where) {
  const Json& value = object.at(key);
  if (!value.is_string())
    throw InputError(fmt::format("\"{}\" must be a string", key), where, text_of(value));
  return value.get<std::string>();
}

int positive_integer_at(const Json& object, const char* key, const std::string& where) {
  const Json& value = object.at(key);
  if (!value.is_number_integer() || value.get<double>() < 1 || value.get<double>() > 1e6)
    throw InputError(fmt::format("\"{}\" must be a positive integer", key), where, text_of(value));
  return value.get<int>();
}

double number(const Json& value, const std::string& what, const std::string& where) {
  if (!value.is_number()) throw InputError(fmt::format("{} must be a number", what), where, text_of(value));
  return value.get<double>();
}

const Json& array_at(const Json& object, const char* key, const std::string& where) {
  const Json& value = object.at(key);
  if (!value.is_array() || value.empty())
    throw InputError(fmt::format("\"{}\" must be a non-empty array", key), where, text_of(value));
  return value;
}

CubaturePath path_from(const Json& json, int p, const std::string& where) {
  check_keys(json, {"weight", "segments"}, where);
  CubaturePath path;
  path.weight = number(json.at("weight"), "\"weight\"", where);
  const Json& segments = array_at(json, "segments", where);
  // Widths are checked before anything is allocated: a huge stated dimension must not exhaust the memory.
  for (std::size_t s = 0; s < segments.size(); ++s) {
    if (!segments[s].is_array() || segments[s].size() != static_cast<std::size_t>(p) + 1)
      throw InputError(fmt::format("a segment of dimension {} is an array of {} numbers", p, p + 1),
                       fmt::format("{}, segment {}", where, s + 1), text_of(segments[s]));
  }
  path.increments.resize(p + 1, static_cast<Eigen::Index>(segments.size()));
  for (std::size_t s = 0; s < segments.size(); ++s) {
    for (std::size_t i = 0; i < segments[s].size(); ++i)
      path.increments(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(s)) =
          number(segments[s][i], "an increment", fmt::format("{}, segment {}", where, s + 1));
  }
  return path;
}

}  // namespace

CubatureFormula parse_formula(const std::string& json, const std::string& where) {
  const Json root = parse_without_repeated_keys(json, where);
  check_keys(root, {"name", "degree", "dimension", "source", "paths"}, where);
  CubatureFormula formula;
  formula.name = string_at(root, "name", where);
  formula.source = string_at(root, "source", where);
  formula.degree = positive_integer_at(root, "degree", where);
  formula.dimension = positive_integer_at(root, "dimension", where);
  for (const Json& path : array_at(root, "paths", where)) {
    const std::string here = fmt::format("{}: path {}", where, formula.paths.size() + 1);
    formula.paths.push_back(path_from(path, formula.dimension, here));
  }
  check_structure(formula, where);
  return formula;
}

CubatureFormula read_formula(const std::filesystem::path& file) {
  std::string json;
  try {
    std::ifstream stream;
    stream.exceptions(std::ios::failbit | std::ios::badbit);
    stream.open(file, std::ios::binary);
    json.assign(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
  } catch (const std::ios::failure&) {  // thrown by the buffer itself where the file is a directory
    throw InputError("the formula file cannot be read", file.string());
  }
  return parse_formula(json, file.string());
}

CubatureFormula load_formula(const std::filesystem::path& file) {
  CubatureFormula formula = read_formula(file);
  require_holds(verify(formula, moment_tolerance, false), file.string());
  return formula;
}

std::string format_formula(const CubatureFormula& formula) {
  check_structure(formula, formula.name);
  const auto quoted = [&](const std::string& text, const char* key) {
    try {
      return Json(text).dump();
    } catch (const Json::type_error&) {
      throw InputError(fmt::format("\"{}\" is not UTF-8", key), formula.name);
    }
  };
  std::string json = fmt::format(
      "{{\"name\": {}, \"degree\": {}, \"dimension\": {}, \"source\": {}, \"paths\": [\n",
      quoted(formula.name, "name"), formula.degree, formula.dimension, quoted(formula.source, "source"));
  for (std::size_t j = 0; j < formula.paths.size(); ++j) {
    const CubaturePath& path = formula.paths[j];
    json += fmt::format("  {{\"weight\": {:.17g}, \"segments\": [", path.weight);
    for (Eigen::Index s = 0; s < path.increments.cols(); ++s) {
      const auto column = path.increments.col(s);
      json += fmt::format("{}[{:.17g}]", s == 0 ? "" : ", ", fmt::join(column.begin(), column.end(), ", "));
    }
    json += j + 1 < formula.paths.size() ? "]},\n" : "]}\n";
  }
  return json + "]}\n";
}

void save_formula(const CubatureFormula& formula, const std::filesystem::path& file) {
  const std::string json = format_formula(formula);
  std::filesystem::path temporary = file;
  temporary += ".tmp";
  std::error_code failure;
  {
    std::ofstream stream(temporary, std::ios::binary | std::ios::trunc);
    stream << json;
    stream.flush();
    if (!stream) failure = std::make_error_code(std::errc::io_error);
  }
  if (!failure) std::filesystem::rename(temporary, file, failure);
  if (failure) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw RunError("the formula file cannot be written", file.string(), failure.message());
  }
}

}  // namespace wienertree
