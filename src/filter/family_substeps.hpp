#pragma once
/// Over which steps a tree grows from one observation to the next, so that its last families are near
/// Gaussian.
#include <span>
#include <vector>

#include "wienertree/cubature/formula.hpp"
#include "wienertree/filter/family.hpp"
#include "wienertree/tree/generation.hpp"

namespace wienertree {

/// The families of children over their last step: weight of the parent, and mean m, standard deviation s,
/// skewness and excess kurtosis of its children under the formula's weights lambda_j.
/// @param parents N nodes  @param children c N nodes, branch-major, log-weight -infinity where one was
/// dropped
/// @param out shapes become those of skewness and kurtosis (FamilyShape::of)
/// @return the root mean squares of skewness and of excess kurtosis over the families, weighted: the larger
/// of the two
double families_of(const Generation& parents, const Generation& children, const CubatureFormula& formula,
                   Families& out);

/// Steps that add up to `gap`, the last of length `last`, those before in geometric grading: each at least
/// the part `ratio` < 1 of the time left before it is left after it, since a step that is the part theta of
/// the time left costs about theta^{(m+1)/2}, and none above `longest`. What a step far from the observation
/// does wrong is smoothed by what follows.
void graded_steps(double gap, double last, double ratio, double longest, std::vector<double>& steps);

/// The ratio for a formula of this degree: 0.85 (to 5), 0.75 (to 9), 0.65 beyond.
double grading_ratio(int degree);

}  // namespace wienertree
