#pragma once
/// The thinned tree as a picture: time to the right, a panel a state, one above the other.
#include <string>

#include "gnuplot.hpp"
#include "wienertree/tree/genealogy.hpp"

namespace wienertree::app {

/// Nodes by time and state, their area the share of their generation's mass, their colour the likelihood of
/// the step that led to them, relative to the largest of their generation (where likelihoods were kept);
/// edges from parents to children.
/// @param genealogy keeps states and weights
/// @returns the bytes of the picture  @throws RunError if gnuplot fails
std::string draw_tree(Picture picture, const std::string& title, const Genealogy& genealogy);

}  // namespace wienertree::app
