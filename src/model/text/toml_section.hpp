#pragma once
/// A TOML table with errors that name file, line and key. The only header that shows toml++.
#include <toml++/toml.h>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "wienertree/model/file_key.hpp"
#include "wienertree/model/text/location.hpp"

namespace wienertree::text {

/// The file being read; `lines` are those of its text.
struct TomlFile {
  std::string name;
  std::vector<std::string_view> lines;
};

/// @returns the lines of `text`, views into it
std::vector<std::string_view> split_lines(std::string_view text);
/// @throws InputError naming file, line and column for a mistake in the syntax
toml::table parse_toml(std::string_view text, const std::string& file);

class Section {
 public:
  Section(const TomlFile& file, const toml::table& table, std::string path)
      : file_(file), table_(table), path_(std::move(path)) {}

  /// @throws InputError for a key that is not `known`, suggesting the nearest
  void only(std::span<const FileKey> known) const;
  bool has(std::string_view key) const { return table_.contains(key); }
  /// Keys in the order of the file.
  std::vector<std::string> keys() const;

  Location location() const;
  Location location(std::string_view key) const;
  /// @throws InputError when missing or no table
  Section section(std::string_view key) const;
  /// @throws InputError when missing or no string
  std::string string(std::string_view key) const;
  /// One of `choices`, as its index. @throws InputError suggesting the nearest
  std::size_t choice(std::string_view key, const std::vector<std::string>& choices) const;
  /// A string, or a finite number as its text. @throws InputError when missing or of another type
  SourceExpression expression(std::string_view key) const;
  std::vector<SourceExpression> expressions(std::string_view key) const;
  /// One or a list of strings, finite numbers and booleans, each as its text. @throws InputError for an empty
  /// list
  std::vector<SourceExpression> values(std::string_view key) const;
  /// @throws InputError when missing or no finite number
  double number(std::string_view key) const;
  /// @throws InputError when missing or no whole number in [least, most]
  std::uint64_t count(std::string_view key, std::uint64_t least, std::uint64_t most) const;
  bool is_table(std::string_view key) const;
  /// A list of lists.
  std::vector<std::vector<SourceExpression>> matrix(std::string_view key) const;
  /// A table, or a list of tables.
  std::vector<Section> sections(std::string_view key) const;

 private:
  const toml::node& node(std::string_view key) const;
  const toml::array& array(const toml::node& node, const std::string& key, const char* wanted) const;
  Location locate(const toml::node& node, std::string key) const;
  std::string path_of(std::string_view key) const;
  SourceExpression expression_of(const toml::node& node, const std::string& key) const;
  std::vector<SourceExpression> expressions_of(const toml::node& node, const std::string& key) const;
  [[noreturn]] void fail_type(const toml::node& node, const std::string& key,
                              const std::string& wanted) const;

  const TomlFile& file_;
  const toml::table& table_;
  std::string path_;
};

}  // namespace wienertree::text
