#include "wienertree/model/text/toml_section.hpp"

#include "wienertree/model/text/printable.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "wienertree/model/text/toml_depth.hpp"

namespace wienertree::text {

namespace {

const char* type_name(toml::node_type type) {
  switch (type) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "a list";
    case toml::node_type::string:
      return "a string";
    case toml::node_type::integer:
    case toml::node_type::floating_point:
      return "a number";
    case toml::node_type::boolean:
      return "a boolean";
    default:
      return "a date or time";
  }
}

// Byte offset of the `column`-th character (from 1) of a line.
std::size_t byte_offset(std::string_view line, std::size_t column) {
  std::size_t i = 0;
  for (std::size_t passed = 1; passed < column && i < line.size(); ++passed) {
    ++i;
    while (i < line.size() && (static_cast<unsigned char>(line[i]) & 0xC0U) == 0x80U) ++i;
  }
  return i;
}

// Names and labels go to terminals, pictures and pages. Line ends and tabs may stand in an expression.
void refuse_control_characters(const toml::node& node, const std::string& file) {
  const auto check = [&file](const std::string& text, const toml::source_region& place) {
    if (const std::string found = unprintable_character(text); !found.empty())
      throw InputError("a text must not hold the character " + found,
                       Location{file, place.begin.line, place.begin.column, ""}.text(), text.substr(0, 80));
  };
  if (const toml::array* array = node.as_array())
    for (const toml::node& element : *array) refuse_control_characters(element, file);
  if (const toml::table* table = node.as_table())
    for (const auto& [key, value] : *table) {
      check(std::string(key.str()), key.source());
      refuse_control_characters(value, file);
    }
  if (const auto* text = node.as_string()) check(text->get(), node.source());
}

}  // namespace

std::vector<std::string_view> split_lines(std::string_view text) {
  std::vector<std::string_view> lines;
  while (true) {
    const std::size_t end = text.find('\n');
    lines.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return lines;
    text.remove_prefix(end + 1);
  }
}

toml::table parse_toml(std::string_view text, const std::string& file) {
  limit_toml_depth(text, file);
  try {
    toml::table table = toml::parse(text, file);
    refuse_control_characters(table, file);
    return table;
  } catch (const toml::parse_error& error) {
    const Location place{file, error.source().begin.line, error.source().begin.column, ""};
    throw InputError("TOML syntax: " + std::string(error.description()), place.text());
  }
}

std::string Section::path_of(std::string_view key) const {
  return path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key);
}

Location Section::locate(const toml::node& node, std::string key) const {
  return {file_.name, node.source().begin.line, node.source().begin.column, std::move(key)};
}

Location Section::location() const { return locate(table_, path_); }

Location Section::location(std::string_view key) const { return locate(node(key), path_of(key)); }

std::vector<std::string> Section::keys() const {
  std::vector<std::pair<toml::source_position, std::string>> found;
  for (const auto& [key, value] : table_) found.emplace_back(key.source().begin, std::string(key.str()));
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::string> result;
  for (auto& [position, key] : found) result.push_back(std::move(key));
  return result;
}

void Section::only(std::span<const FileKey> known) const {
  const std::vector<std::string> names = names_of(known);
  for (const auto& [key, value] : table_) {
    if (std::find(names.begin(), names.end(), key.str()) != names.end()) continue;
    Location place = locate(value, path_of(key.str()));
    place.line = key.source().begin.line;
    place.column = key.source().begin.column;
    throw InputError("unknown key" + suggestion(key.str(), names), place.text(), std::string(key.str()));
  }
}

const toml::node& Section::node(std::string_view key) const {
  const toml::node* found = table_.get(key);
  if (found == nullptr) throw InputError("missing key", locate(table_, path_of(key)).text());
  return *found;
}

void Section::fail_type(const toml::node& node, const std::string& key, const std::string& wanted) const {
  std::string value;
  if (const auto* text = node.as_string()) value = text->get();
  if (const auto* integer = node.as_integer()) value = fmt::format("{}", integer->get());
  if (const auto* floating = node.as_floating_point()) value = fmt::format("{}", floating->get());
  if (const auto* boolean = node.as_boolean()) value = fmt::format("{}", boolean->get());
  throw InputError(fmt::format("must be {}, not {}", wanted, type_name(node.type())),
                   locate(node, key).text(), value.substr(0, 80));
}

Section Section::section(std::string_view key) const {
  const toml::node& found = node(key);
  if (!found.is_table()) fail_type(found, path_of(key), "a table");
  return {file_, *found.as_table(), path_of(key)};
}

std::string Section::string(std::string_view key) const {
  const toml::node& found = node(key);
  if (!found.is_string()) fail_type(found, path_of(key), "a string");
  return found.as_string()->get();
}

std::size_t Section::choice(std::string_view key, const std::vector<std::string>& choices) const {
  const std::string value = string(key);
  const auto found = std::find(choices.begin(), choices.end(), value);
  if (found == choices.end())
    throw InputError(fmt::format("must be one of {}{}", fmt::join(choices, ", "), suggestion(value, choices)),
                     location(key).text(), value.substr(0, 80));
  return static_cast<std::size_t>(found - choices.begin());
}

SourceExpression Section::expression_of(const toml::node& node, const std::string& key) const {
  SourceExpression result;
  result.location = locate(node, key);
  if (const auto* integer = node.as_integer()) {
    result.text = fmt::format("{}", integer->get());
  } else if (const auto* floating = node.as_floating_point()) {
    if (!std::isfinite(floating->get()))
      throw InputError("must be a finite number", result.location.text(), fmt::format("{}", floating->get()));
    result.text = fmt::format("{}", floating->get());
  } else if (const auto* text = node.as_string()) {
    result.text = text->get();
    // Where the string stands in the file letter by letter, a place in it is a place in the file.
    if (result.location.line >= 1 && result.location.line <= file_.lines.size()) {
      const std::string_view line = file_.lines[result.location.line - 1];
      const std::size_t quote = byte_offset(line, result.location.column);
      if (quote < line.size() && (line[quote] == '"' || line[quote] == '\'') &&
          line.substr(quote + 1, result.text.size()) == result.text) {
        ++result.location.column;
        result.columns_known = true;
      }
    }
  } else {
    fail_type(node, key, "an expression or a number");
  }
  return result;
}

SourceExpression Section::expression(std::string_view key) const {
  return expression_of(node(key), path_of(key));
}

std::vector<SourceExpression> Section::values(std::string_view key) const {
  const std::string path = path_of(key);
  const auto value_of = [this](const toml::node& node, const std::string& where) {
    if (const auto* boolean = node.as_boolean())
      return SourceExpression{boolean->get() ? "true" : "false", locate(node, where), false};
    if (!node.is_string() && !node.is_number()) fail_type(node, where, "a string, a number or a boolean");
    return expression_of(node, where);
  };
  const toml::node& found = node(key);
  if (!found.is_array()) return {value_of(found, path)};
  std::vector<SourceExpression> result;
  for (const toml::node& element : *found.as_array())
    result.push_back(value_of(element, fmt::format("{}[{}]", path, result.size() + 1)));
  if (result.empty()) throw InputError("must not be an empty list", locate(found, path).text());
  return result;
}

double Section::number(std::string_view key) const {
  const toml::node& found = node(key);
  if (!found.is_number()) fail_type(found, path_of(key), "a number");
  const double number = *found.value<double>();
  if (!std::isfinite(number))
    throw InputError("must be a finite number", locate(found, path_of(key)).text(),
                     fmt::format("{}", number));
  return number;
}

std::uint64_t Section::count(std::string_view key, std::uint64_t least, std::uint64_t most) const {
  const toml::node& found = node(key);
  if (!found.is_integer()) fail_type(found, path_of(key), "a whole number");
  const std::int64_t number = found.as_integer()->get();
  if (number < 0 || static_cast<std::uint64_t>(number) < least || static_cast<std::uint64_t>(number) > most)
    throw InputError(fmt::format("must be from {} to {}", least, most), locate(found, path_of(key)).text(),
                     fmt::format("{}", number));
  return static_cast<std::uint64_t>(number);
}

bool Section::is_table(std::string_view key) const {
  const toml::node* found = table_.get(key);
  return found != nullptr && found->is_table();
}

const toml::array& Section::array(const toml::node& node, const std::string& key, const char* wanted) const {
  if (!node.is_array()) fail_type(node, key, wanted);
  return *node.as_array();
}

std::vector<SourceExpression> Section::expressions_of(const toml::node& node, const std::string& key) const {
  std::vector<SourceExpression> result;
  for (const toml::node& element : array(node, key, "a list of expressions"))
    result.push_back(expression_of(element, fmt::format("{}[{}]", key, result.size() + 1)));
  return result;
}

std::vector<SourceExpression> Section::expressions(std::string_view key) const {
  return expressions_of(node(key), path_of(key));
}

std::vector<std::vector<SourceExpression>> Section::matrix(std::string_view key) const {
  std::vector<std::vector<SourceExpression>> result;
  const std::string path = path_of(key);
  for (const toml::node& row : array(node(key), path, "a list of lists"))
    result.push_back(expressions_of(row, fmt::format("{}[{}]", path, result.size() + 1)));
  return result;
}

std::vector<Section> Section::sections(std::string_view key) const {
  const toml::node& found = node(key);
  const std::string path = path_of(key);
  if (found.is_table()) return {Section(file_, *found.as_table(), path)};
  std::vector<Section> result;
  for (const toml::node& element : array(found, path, "a table or a list of tables")) {
    const std::string element_path = fmt::format("{}[{}]", path, result.size() + 1);
    if (!element.is_table()) fail_type(element, element_path, "a table");
    result.emplace_back(file_, *element.as_table(), element_path);
  }
  return result;
}

}  // namespace wienertree::text
