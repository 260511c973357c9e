#pragma once
/// Pictures by gnuplot, run as a program.
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace wienertree::app {

/// Colours of Okabe and Ito (2008), which people with any colour vision tell apart.
namespace colour {
inline constexpr const char* black = "#000000";
inline constexpr const char* grey = "#777777";
inline constexpr const char* sky = "#56B4E9";
inline constexpr const char* blue = "#0072B2";
inline constexpr const char* green = "#009E73";
inline constexpr const char* orange = "#E69F00";
inline constexpr const char* vermillion = "#D55E00";
}  // namespace colour

/// A picture as a gnuplot script.
class Picture {
 public:
  /// Looks for what will be needed, before anything is computed. `file` ends in .svg or .png.
  /// @throws InputError for another ending, or if there is no gnuplot on the PATH
  explicit Picture(const std::string& file);
  /// Starts the script: size in pixels of the SVG; a PNG has twice as many each way.
  void begin(int width, int height);
  void add(const std::string& commands) { script_ += commands + '\n'; }
  /// A named block of data, one tuple of columns a line.
  void add_data(const std::string& name, std::span<const std::vector<double>> columns);
  /// Runs gnuplot. @returns the bytes of the picture
  /// @throws RunError with gnuplot's complaint
  std::string draw() const;

 private:
  std::string file_, program_, script_;
  bool vector_graphics_ = true;
};

/// Text between double quotes, for a place marked `noenhanced`.
std::string in_quotes(const std::string& text);

/// Names of the axes of a panel, in the middle of its side: `x` and `y` are parts of the picture, since where
/// gnuplot itself puts them depends on the terminal's idea of the font.
std::string name_of_height(const std::string& text, double x);
std::string name_of_width(const std::string& text, double y);

/// A text beside the place it names.
struct SideLabel {
  std::string text;
  const char* colour;
  double y;  ///< where it belongs, as a fraction of the panel's height
};

/// Moves labels apart so that neighbours are at least `spacing` from each other and all lie in [0,1], and
/// writes them just right of the panel. Labels of equal height keep their order.
std::string labels_at_right(std::vector<SideLabel> labels, double spacing);

}  // namespace wienertree::app
