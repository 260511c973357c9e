#include "wienertree/model/input_functions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "wienertree/numeric/error.hpp"

namespace wienertree {
namespace {

void check_function(const InputFunction& f, const std::string& origin) {
  if (f.times.size() != f.values.size())
    throw InputError(fmt::format("needs a value of the input {} for each time", f.name), origin,
                     fmt::format("{} values for {} times", f.values.size(), f.times.size()));
  for (std::size_t r = 0; r < f.times.size(); ++r) {
    const auto fail = [&](const char* message, const std::string& column, double value) {
      throw InputError(message, fmt::format("{}: row {}, column {}", origin, r + 1, column),
                       fmt::format("{}", value));
    };
    if (!std::isfinite(f.times[r])) fail("not a finite number", "t", f.times[r]);
    if (r > 0 && !(f.times[r] > f.times[r - 1])) fail("times must increase", "t", f.times[r]);
    if (!std::isfinite(f.values[r])) fail("not a finite number", f.name, f.values[r]);
  }
}

// The number of the last time that is not after t; 0 before the first.
std::size_t place_of(const std::vector<double>& times, double t) {
  const auto after = std::upper_bound(times.begin(), times.end(), t);
  return after == times.begin() ? 0 : static_cast<std::size_t>(after - times.begin()) - 1;
}

}  // namespace

InputFunctions::InputFunctions(std::vector<InputFunction> functions, const std::string& origin)
    : functions_(std::move(functions)), origin_(origin) {
  if (functions_.empty()) throw InputError("there are no inputs", origin);
  for (const InputFunction& f : functions_) {
    check_function(f, origin);
    if (f.times.empty() != functions_.front().times.empty())
      throw InputError("some inputs have values and some have none", origin, f.name);
  }
  if (!known()) return;
  double first = functions_.front().times.front(), last = functions_.front().times.back();
  for (const InputFunction& f : functions_) {
    first = std::min(first, f.times.front());
    last = std::max(last, f.times.back());
    for (std::size_t r = 1; f.between == Between::previous && r < f.times.size(); ++r)
      if (f.values[r] != f.values[r - 1]) jumps_.push_back(f.times[r]);
  }
  std::sort(jumps_.begin(), jumps_.end());
  jumps_.erase(std::unique(jumps_.begin(), jumps_.end()), jumps_.end());
  shift_.assign(1, 0.0);
  const double gap = 2 * (last - first);
  for (std::size_t i = 0; i < jumps_.size(); ++i) {
    border_.push_back(jumps_[i] + shift_.back() + gap / 2);
    shift_.push_back(shift_.back() + gap);
  }
  for (const InputFunction& f : functions_) {
    std::vector<double>& pieces = constant_.emplace_back();
    if (f.between == Between::linear) continue;
    pieces.push_back(f.values.front());
    for (const double jump : jumps_) pieces.push_back(f.values[place_of(f.times, jump)]);
  }
}

void InputFunctions::require_known() const {
  if (known()) return;
  std::string names;
  for (const InputFunction& f : functions_) names += (names.empty() ? "" : ", ") + f.name;
  throw InputError(fmt::format("the input{} {} of this model {} no values", functions_.size() == 1 ? "" : "s",
                               names, functions_.size() == 1 ? "has" : "have"),
                   origin_);
}

void InputFunctions::require_span(double start, double end, const std::string& what) const {
  require_known();
  // Times that are equal but for rounding.
  const double rounding =
      8 * std::numeric_limits<double>::epsilon() * std::max(std::abs(start), std::abs(end));
  for (const InputFunction& f : functions_) {
    const bool late = f.times.front() > start + rounding;
    if (!late && f.times.back() >= end - rounding) continue;
    throw InputError(
        fmt::format("the input {} is given from t = {:g} to t = {:g}, and {} {} t = {:g}", f.name,
                    f.times.front(), f.times.back(), what, late ? "begin at" : "end at", late ? start : end),
        fmt::format("{}: column {}", origin_, f.name));
  }
}

double InputFunctions::clock(double time) const {
  std::size_t i = place_of(jumps_, time);
  if (jumps_.empty()) return time;
  if (time >= jumps_.front()) ++i;
  // A time that is a jump but for the rounding of the arithmetic that led to it.
  const auto reached = [time](double jump) {
    return jump - time <=
           8 * std::numeric_limits<double>::epsilon() * std::max(std::abs(time), std::abs(jump));
  };
  if (i < jumps_.size() && reached(jumps_[i])) ++i;
  return time + shift_[i];
}

double InputFunctions::first_time() const {
  if (!known()) return 0;
  double first = functions_.front().times.front();
  for (const InputFunction& f : functions_) first = std::max(first, f.times.front());
  return std::max(first, 0.0);
}

std::size_t InputFunctions::piece_of_clock(double clock) const {
  return static_cast<std::size_t>(std::upper_bound(border_.begin(), border_.end(), clock) - border_.begin());
}

void InputFunctions::evaluate(std::span<const double> clock, std::span<double* const> out) const {
  require_known();
  for (std::size_t n = 0; n < clock.size(); ++n) {
    // The clock is the same for all nodes of a generation.
    if (n > 0 && clock[n] == clock[n - 1]) {
      for (double* const column : out) column[n] = column[n - 1];
      continue;
    }
    const std::size_t piece = piece_of_clock(clock[n]);
    const double t = clock[n] - shift_[piece];
    out[0][n] = t;
    for (std::size_t k = 0; k < functions_.size(); ++k) {
      const InputFunction& f = functions_[k];
      double &value = out[1 + 2 * k][n], &slope = out[2 + 2 * k][n];
      slope = 0;
      if (f.between == Between::previous) {
        value = constant_[k][piece];
      } else if (!(t > f.times.front()) || !(t < f.times.back())) {
        value = t < f.times.back() ? f.values.front() : f.values.back();
      } else {
        const std::size_t r = place_of(f.times, t);
        slope = (f.values[r + 1] - f.values[r]) / (f.times[r + 1] - f.times[r]);
        value = f.values[r] + slope * (t - f.times[r]);
      }
      if (t != t) value = t;
    }
  }
}

void InputFunctions::append(std::span<const double> clock, std::vector<const double*>& columns) const {
  thread_local std::vector<double> values;
  thread_local std::vector<double*> out;
  const std::size_t N = clock.size();
  if (values.size() < this->columns() * N) values.resize(this->columns() * N);
  out.clear();
  for (std::size_t c = 0; c < this->columns(); ++c) out.push_back(values.data() + c * N);
  evaluate(clock, out);
  columns.insert(columns.end(), out.begin(), out.end());
}

}  // namespace wienertree
