#pragma once
/// Which Runge-Kutta pair to try first over a whole segment.
#include <span>

#include "wienertree/cubature/runge_kutta_block.hpp"
#include "wienertree/cubature/segment_field.hpp"

namespace wienertree {

/// Most segments of a filter are short enough for one step of the pair of order 5, at half the evaluations of
/// the pair of order 8. How short depends on the model and the tolerance: this is found once, at the model's
/// initial state, so that the choice is a function of D alone and costs nothing. A wrong choice costs time,
/// never accuracy.
///
/// A segment belongs to a step of length max(|D_0|, max_i D_i^2 / 3): on [0, 1] the increments of a formula
/// are about 1 in time and sqrt(3) in the Brownian motions.
class PairChoice {
 public:
  /// `low` is never chosen for formulas of a degree above its order: their segments are long and their errors
  /// small.
  PairChoice(const RungeKuttaBlock::Method& low, const RungeKuttaBlock::Method& high, int degree,
             SegmentField& field, RungeKuttaBlock& block);
  PairChoice(const PairChoice&) = delete;
  PairChoice& operator=(const PairChoice&) = delete;

  const RungeKuttaBlock::Method& operator()(std::span<const double> D) const;

 private:
  bool one_step_suffices(double s, SegmentField& field, RungeKuttaBlock& block) const;

  const RungeKuttaBlock::Method &low_, &high_;
  double longest_ = 0;  // the longest step for which one step of `low` suffices
};

}  // namespace wienertree
