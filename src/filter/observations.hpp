#pragma once
/// Observations as they come in a file: CSV with header `t,y1[,y2..]`, t strictly increasing.
#include <istream>
#include <span>
#include <string>
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

/// Reads rows one at a time, so that a filter can follow a stream.
class ObservationReader {
 public:
  /// Reads the header. `origin` names the source in messages.
  /// @throws InputError if the header is not t,y1..yk with k = `dimension`
  ObservationReader(std::istream& in, std::string origin, std::size_t dimension, ObservationKind kind);
  /// Reads the next row into t and y (k values); false at the end of the stream.
  /// @throws InputError naming origin, line and column for a wrong number of fields, a field that is not a
  /// finite number, a time that does not increase, or a missing value where `kind` is continuous
  bool next(double& t, std::span<double> y);

 private:
  std::istream& in_;
  std::string origin_, line_;
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
/// (discrete)
ObservationPath read_observations(std::istream& in, const std::string& origin, std::size_t dimension,
                                  ObservationKind kind);
/// Reads a file. @throws InputError also when it cannot be opened
ObservationPath read_observations(const std::string& path, std::size_t dimension, ObservationKind kind);

/// Writes header and rows with 17 significant digits; NaN as an empty field.
void write_observations(std::ostream& out, const ObservationPath& path);

}  // namespace wienertree
