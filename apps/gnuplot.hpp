#pragma once
/// Pictures by gnuplot, run as a program.
#include <fmt/format.h>

#include <concepts>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace wienertree::app {

/// A word that the program itself says: a literal of its source, such as a colour.
struct Literal {
  const char* text = "";
  template <std::size_t N>
  consteval Literal(const char (&literal)[N]) : text(literal) {}
};

/// Colours of Okabe and Ito (2008), which people with any colour vision tell apart.
namespace colour {
inline constexpr Literal black = "#000000";
inline constexpr Literal grey = "#777777";
inline constexpr Literal sky = "#56B4E9";
inline constexpr Literal blue = "#0072B2";
inline constexpr Literal green = "#009E73";
inline constexpr Literal orange = "#E69F00";
inline constexpr Literal vermillion = "#D55E00";
}  // namespace colour

class Script;

template <class T>
concept ScriptPart = std::same_as<T, Script> || std::same_as<T, Literal> ||
    (std::is_arithmetic_v<T> && !std::same_as<T, char>);

/// A piece of a gnuplot script. gnuplot runs commands: it takes what stands between backquotes, or after an
/// at-sign, as code. So text of others (names, labels, titles) has one way into a script, `gnuplot_string`; pieces
/// are made by `command` of literals of the program, numbers and other pieces, and of nothing else.
class Script {
 public:
  Script() = default;
  const std::string& text() const { return text_; }
  bool empty() const { return text_.empty(); }
  Script& operator+=(const Script& more) {
    text_ += more.text_;
    return *this;
  }

 private:
  template <class... Parts>
  requires(ScriptPart<std::remove_cvref_t<Parts>>&&...) friend Script
      command(fmt::format_string<Parts...> format, Parts&&... parts);
  friend Script gnuplot_string(std::string_view text);

  explicit Script(std::string text) : text_(std::move(text)) {}
  std::string text_;
};

/// Any text as a gnuplot string, for a place marked `noenhanced`: letters, spaces and what is beyond ASCII stand as
/// they are, every other character as its octal code, so that gnuplot finds nothing in it to interpret. What is not
/// printable (text::printable) is replaced.
Script gnuplot_string(std::string_view text);

/// Pieces with commas between.
Script joined(const std::vector<Script>& pieces);

}  // namespace wienertree::app

template <>
struct fmt::formatter<wienertree::app::Script> : fmt::formatter<std::string_view> {
  auto format(const wienertree::app::Script& script, fmt::format_context& context) const {
    return fmt::formatter<std::string_view>::format(script.text(), context);
  }
};

template <>
struct fmt::formatter<wienertree::app::Literal> : fmt::formatter<std::string_view> {
  auto format(const wienertree::app::Literal& literal, fmt::format_context& context) const {
    return fmt::formatter<std::string_view>::format(literal.text, context);
  }
};

namespace wienertree::app {

/// A piece of a script. `format` is fmt's, checked by the compiler.
template <class... Parts>
requires(ScriptPart<std::remove_cvref_t<Parts>>&&...) Script
    command(fmt::format_string<Parts...> format, Parts&&... parts) {
  return Script(fmt::format(format, std::forward<Parts>(parts)...));
}

/// A picture as a gnuplot script.
class Picture {
 public:
  /// Looks for what will be needed, before anything is computed. `file` ends in .svg or .png.
  /// @throws InputError for another ending, or if there is no gnuplot on the PATH
  explicit Picture(const std::string& file);
  /// Starts the script: size in pixels of the SVG; a PNG has twice as many each way.
  void begin(int width, int height);
  void add(const Script& commands) { script_ += commands.text() + '\n'; }
  template <class... Parts>
  void add(fmt::format_string<Parts...> format, Parts&&... parts) {
    add(command(format, std::forward<Parts>(parts)...));
  }
  /// A named block of data, one tuple of columns a line.
  void add_data(const Script& name, std::span<const std::vector<double>> columns);
  /// Runs gnuplot. @returns the bytes of the picture
  /// @throws RunError with gnuplot's complaint
  std::string draw() const;

 private:
  std::string file_, program_, script_;
  bool vector_graphics_ = true;
};

/// Names of the axes of a panel, in the middle of its side: `x` and `y` are parts of the picture, since where
/// gnuplot itself puts them depends on the terminal's idea of the font.
Script name_of_height(const std::string& text, double x);
Script name_of_width(const std::string& text, double y);

/// A text beside the place it names.
struct SideLabel {
  std::string text;
  Literal colour;
  double y;  ///< where it belongs, as a fraction of the panel's height
};

/// Moves labels apart so that neighbours are at least `spacing` from each other and all lie in [0,1], and
/// writes them just right of the panel. Labels of equal height keep their order.
Script labels_at_right(std::vector<SideLabel> labels, double spacing);

}  // namespace wienertree::app
