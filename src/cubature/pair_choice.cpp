#include "wienertree/cubature/pair_choice.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace wienertree {

PairChoice::PairChoice(const RungeKuttaBlock::Method& low, const RungeKuttaBlock::Method& high, int degree,
                       SegmentField& field, RungeKuttaBlock& block)
    : low_(low), high_(high) {
  if (degree > low.pair().order) return;
  // Bisection over powers of sqrt(2), from 2^-32 to 2^16.
  int enough = -64, too_long = 32;
  while (too_long - enough > 1) {
    const int middle = (enough + too_long) / 2;
    (one_step_suffices(std::exp2(middle / 2.0), field, block) ? enough : too_long) = middle;
  }
  longest_ = std::exp2(enough / 2.0);
}

/// From the initial state along (s, +-sqrt(3 s) e_i), and once more from where that leads.
bool PairChoice::one_step_suffices(double s, SegmentField& field, RungeKuttaBlock& block) const {
  constexpr double margin = 0.25 * 0.25;  // other states are harder than the initial one
  const std::vector<double>& initial = field.model().initial;
  std::vector<double> D(1 + field.model().noise_dimension(), 0.0);
  D[0] = s;
  for (std::size_t i = std::min<std::size_t>(1, D.size() - 1); i < D.size(); ++i)
    for (const double sign : {1.0, -1.0}) {
      if (i > 0) D[i] = sign * std::sqrt(3.0 * s);
      for (std::size_t l = 0; l < initial.size(); ++l) block.states(1)(l, 0) = initial[l];
      block.step_sizes(1)[0] = 1.0;
      for (int step = 0; step < 2; ++step) {
        block.attempt(low_, field, D, 1);
        if (!(block.squared_errors(1)[0] <= margin)) return false;
        for (std::size_t l = 0; l < initial.size(); ++l) block.states(1)(l, 0) = block.results(1)(l, 0);
      }
      if (i > 0) D[i] = 0.0;
    }
  return true;
}

const RungeKuttaBlock::Method& PairChoice::operator()(std::span<const double> D) const {
  double s = std::abs(D[0]);
  for (const double increment : D.subspan(1)) s = std::max(s, increment * increment / 3.0);
  return s <= longest_ ? low_ : high_;
}

}  // namespace wienertree
