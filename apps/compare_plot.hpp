#pragma once
/// Bayes factors through time as a picture.
#include <string>
#include <vector>

#include "compare_run.hpp"
#include "gnuplot.hpp"

namespace wienertree::app {

/// Two panels: log Bayes factors against the first model, with bands of two standard errors where there are
/// several launches, and the probabilities of the models.
/// @returns the bytes of the picture  @throws RunError if gnuplot fails
std::string draw_comparison(Picture picture, const std::vector<Contender>& contenders,
                            const std::vector<ComparisonRow>& rows);

}  // namespace wienertree::app
