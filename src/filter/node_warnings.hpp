#pragma once
/// Warnings of filters that keep nodes, each true without any comparison with other runs.
#include <cstddef>
#include <span>
#include <vector>

#include "wienertree/filter/posterior.hpp"
#include "wienertree/filter/warning.hpp"
#include "wienertree/model/model.hpp"

namespace wienertree {

/// Adds a warning unless there is one of its kind.
void warn(std::vector<FilterWarning>& warnings, WarningKind kind, double time, std::string text);

/// What is wrong with a model before any step: one Brownian motion that drives all of several components, a Stratonovich
/// drift that points out of a state's bound.
void warn_of_model(const Model& model, std::vector<FilterWarning>& warnings);

/// After an update by an observation: fewer than five effective nodes, unless the law is that of a start at a point
/// that has few nodes yet (`nodes` counts those that could carry it); mass on a bound.
void warn_of_law(const Model& model, const Posterior& law, double effective_size,
                 std::vector<FilterWarning>& warnings);

/// Additive Gaussian noise: every node predicts y farther away than (y - h(x))' R^{-1} (y - h(x)) = 50.
/// @param best the largest log-density of the observation over the nodes
void warn_of_reach(const Model& model, std::span<const double> y, double best, double time,
                   std::vector<FilterWarning>& warnings);

/// A step of length s times the fastest rate of relaxation of the drift at `node` (the largest -Re of an eigenvalue of
/// DV_0) above 1/2.
void warn_of_step(const Model& model, ConstBatchView node, double s, double time,
                  std::vector<FilterWarning>& warnings);

}  // namespace wienertree
