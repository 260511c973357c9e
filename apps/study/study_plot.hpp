#pragma once
/// Errors of a study as a picture.
#include <string>
#include <vector>

#include "../gnuplot.hpp"
#include "study_tables.hpp"

namespace wienertree::app {

/// Wide: labels stand where lines end. Narrow: under the picture, for a phone.
enum class PlotShape { wide, narrow };

/// Points with their intervals as bands, fitted slopes as dashed lines.
/// @returns the bytes of the picture  @throws RunError if gnuplot fails
std::string draw_study_plot(Picture picture, const StudyPlot& plot, const std::vector<PlotLine>& lines,
                            PlotShape shape);

/// "1.98 +- 0.03": with its half width where there is one.
std::string slope_text(const SlopeFit& fit);

}  // namespace wienertree::app
