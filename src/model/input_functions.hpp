#pragma once
/// Known functions of time that the coefficients of a model depend on: a temperature, a rate, a volatility.
///
/// Between the times at which it is given an input is linear, or keeps its previous value. The second kind jumps. A
/// step of a filter or of a tree ends where one does, and inside of a step an input is what it is there: at the end of
/// a step that is not yet the value that begins at this time. So that vector fields remain functions of the state
/// alone, the clock of a model with inputs tells on which side of a jump it is: it is the time plus a gap for every
/// jump before it,
///
///     clock = t + i G on piece i = [j_i, j_{i+1}),     G = 2 (last time - first time),
///
/// j_1 < j_2 < .. the jumps. Along a path of a formula the clock may leave its piece by less than G/2, forwards or
/// backwards, and is still read as a time of this piece. J pieces take log_2 J bits from the precision of t.
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace wienertree {

enum class Between { linear, previous };

struct InputFunction {
  std::string name;
  Between between = Between::linear;
  std::vector<double> times, values;  ///< as many of each, times increasing; none: not yet known
};

class InputFunctions {
 public:
  /// `origin`: what errors call them, e.g. a file.
  /// @throws InputError naming origin, row and column: times that are not finite or do not increase, values that are
  /// not finite or not as many, some functions that are known beside some that are not
  InputFunctions(std::vector<InputFunction> functions, const std::string& origin);

  const std::vector<InputFunction>& functions() const { return functions_; }
  const std::string& origin() const { return origin_; }
  /// Whether values are known.
  bool known() const { return !functions_.front().times.empty(); }
  /// @throws InputError naming the inputs, if they are not
  void require_known() const;
  /// @throws InputError naming the input, the time it lacks and `what` it is needed for, e.g. "the observations", unless
  /// all are given from `start` to `end`
  void require_span(double start, double end, const std::string& what) const;

  /// The times at which an input jumps, in order.
  std::span<const double> jumps() const { return jumps_; }
  /// The clock at a time, from which a step begins: of a jump at this very time (up to rounding) the value after it.
  double clock(double time) const;
  /// The first time from which on all are known; 0 where that is not before.
  double first_time() const;

  /// How many numbers `evaluate` gives for a clock: the time t, then every input's value u and slope du/dt.
  std::size_t columns() const { return 1 + 2 * functions_.size(); }
  /// out[c][n], c < columns(), for clock n. Before their first and after their last time inputs keep their values.
  /// @throws InputError if they are not known
  void evaluate(std::span<const double> clock, std::span<double* const> out) const;
  /// The same, in memory of the thread, after what `columns` holds: to be given to a tape before the next call.
  void append(std::span<const double> clock, std::vector<const double*>& columns) const;

 private:
  std::size_t piece_of_clock(double clock) const;

  std::vector<InputFunction> functions_;
  std::string origin_;
  std::vector<double> jumps_;   ///< J
  std::vector<double> shift_;   ///< i G, J + 1
  std::vector<double> border_;  ///< clocks half way through the gaps, J
  std::vector<std::vector<double>>
      constant_;  ///< per function that jumps its value on each piece; else empty
};

}  // namespace wienertree
