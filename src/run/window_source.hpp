#pragma once
/// Observation windows from a file, or from standard input row by row.
#include <cstddef>
#include <functional>
#include <istream>
#include <memory>
#include <optional>
#include <string>

#include "wienertree/filter/window.hpp"
#include "wienertree/numeric/state_archive.hpp"

namespace wienertree {

/// One window after the other.
class WindowSource {
 public:
  virtual ~WindowSource() = default;
  /// The next window, or false at the end. What it refers to is valid until the next call.
  /// @throws InputError for a row that cannot be read
  virtual bool next(ObservationWindow& window) = 0;
  virtual double start() const = 0;
  /// Whether the first window has length zero: an observation at the start.
  virtual bool observed_at_start() const = 0;
  virtual std::optional<double> end() const = 0;  ///< of the last window, where it is known beforehand
  virtual std::size_t size() const = 0;           ///< number of windows, 0 where it is not known beforehand
  virtual std::size_t rows() const = 0;           ///< read so far
  virtual bool streams() const = 0;
  /// All rows, where they are known beforehand.
  virtual std::optional<ObservationRows> record() const { return {}; }
  /// What tells a record from another one.
  virtual std::string identity() const = 0;
  /// How far it has come. A stream that has read this takes rows after the last one it had and passes over
  /// those before.
  virtual void exchange(StateArchive& archive) = 0;
};

/// Outputs of a continuous record for which no steps are given, and steps at least of a discrete one.
inline constexpr std::size_t usual_steps = 200;
/// The steps of a record for which none are given.
std::size_t default_steps(const ObservationRows& rows, ObservationKind kind);

/// A file, cut into `steps` windows; without `steps` into default_steps.
/// @throws InputError for a file that cannot be read, or steps that do not fit it
std::unique_ptr<WindowSource> open_windows(const std::string& file, const Model& model,
                                           std::optional<std::size_t> steps);

/// A record in memory, which must outlive what is returned, cut in the same way.
/// @throws InputError for steps that do not fit it
std::unique_ptr<WindowSource> cut_windows(ObservationRows rows, const Model& model,
                                          std::optional<std::size_t> steps);

/// A stream, of which every row ends a window.
/// @param origin names it in messages
/// @param resumed its `exchange` will read, so that the stream may have no row to begin with
/// @param interrupted whether a failure to read comes from an interruption, which is no error
/// @throws InputError for a row that cannot be read
std::unique_ptr<WindowSource> follow_windows(std::istream& in, const std::string& origin, const Model& model,
                                             bool resumed, std::function<bool()> interrupted);

}  // namespace wienertree
