#pragma once
/// Observations as they come in a file: CSV with header `t,y1[,y2..]`, t strictly increasing.
#include <functional>
#include <istream>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "wienertree/model/model.hpp"

namespace wienertree {

/// Rows of an observation record, where the caller keeps them. Continuous observations: row r is Y at
/// times[r], row 0 its start. Discrete ones: row r is the observation at times[r], NaN where missing.
struct ObservationRows {
  std::size_t dimension = 0;       ///< k
  std::span<const double> times;   ///< M, strictly increasing
  std::span<const double> values;  ///< M x k, row after row
  std::size_t rows() const { return times.size(); }
  std::span<const double> row(std::size_t r) const { return values.subspan(r * dimension, dimension); }
};

/// The same, owned.
struct ObservationPath {
  std::size_t dimension = 0;
  std::vector<double> times;
  std::vector<double> values;
  std::size_t rows() const { return times.size(); }
  std::span<const double> row(std::size_t r) const { return {values.data() + r * dimension, dimension}; }
  operator ObservationRows() const {
    return {dimension, times, values};
  }  // NOLINT: a record is used as its rows
  void append(double time, std::span<const double> value);
};

/// A line of an observations file that is longer, in bytes, is refused: a device, or no text.
inline constexpr std::size_t longest_line = std::size_t{1} << 20;

/// Reads rows one at a time, so that a filter can follow a stream.
class ObservationReader {
 public:
  /// Reads the header. `origin` names the source in messages.
  /// @throws InputError if the header is not t,y1..yk with k = `dimension`
  ObservationReader(std::istream& in, std::string origin, std::size_t dimension, ObservationKind kind);
  /// The same of a table whose columns have other names; the first of them is the time.
  /// @param skips whether a further column of this name is passed over; then columns may stand in any order. Empty: the
  /// header is the columns
  ObservationReader(std::istream& in, std::string origin, std::vector<std::string> columns,
                    ObservationKind kind, const std::function<bool(std::string_view)>& skips = {});
  /// Reads the next row into t and y (k values); false at the end of the stream.
  /// @throws InputError naming origin, line and column for a wrong number of fields, a field that is not a
  /// finite number, a time that does not increase, a missing value where `kind` is continuous, a line longer
  /// than longest_line, or a last line without its end whose last field looks cut off: empty, or ending in
  /// a point, an e or a sign
  bool next(double& t, std::span<double> y);

 private:
  bool read_line();
  void read_header(const std::function<bool(std::string_view)>& skips);
  std::string name_of_field(std::size_t field) const;
  std::istream& in_;
  std::string origin_;
  std::vector<std::string> columns_;
  std::vector<std::size_t> fields_;  // the column of each field of a line; columns_.size(): passed over
  std::unique_ptr<char[]> buffer_;   // longest_line + 1; what is not written is not memory
  std::string_view line_;            // in buffer_
  bool ended_ = false;               // whether line_ has its end
  std::size_t dimension_, line_number_ = 0;
  ObservationKind kind_;
  double last_time_;
};

/// What a reader verifies of a file, of rows that are in memory.
/// @throws InputError naming `origin` and the row, from 1: values that are not M x k, fewer than two rows
/// (continuous) or none (discrete), a time that is not finite or does not increase, a value that is infinite,
/// or missing where `kind` is continuous
void check_observations(const ObservationRows& rows, const std::string& origin, ObservationKind kind);

/// Reads a whole record from `in`.
/// @throws InputError as ObservationReader, and if there are fewer than two rows (continuous) or none
/// (discrete), or more than memory_limit() holds
ObservationPath read_observations(std::istream& in, const std::string& origin, std::size_t dimension,
                                  ObservationKind kind);
/// The rows after the header of any reader.
ObservationPath read_rows(ObservationReader& reader, const std::string& origin, std::size_t dimension,
                          ObservationKind kind);
/// Reads a file. @throws InputError also when it cannot be opened
ObservationPath read_observations(const std::string& path, std::size_t dimension, ObservationKind kind);
/// Reads a file. Columns called as an input of the model are passed over. @throws InputError also when it cannot be
/// opened
ObservationPath read_observations(const std::string& path, const Model& model);
/// t, y1 .. yk
std::vector<std::string> observation_columns(std::size_t dimension);
/// What is passed over in the observations of a model: columns of its inputs; empty where it has none.
std::function<bool(std::string_view)> skips_inputs(const Model& model);

/// Writes header and rows with 17 significant digits; NaN as an empty field.
void write_observations(std::ostream& out, const ObservationPath& path);

}  // namespace wienertree
