#pragma once
/// One generation of the tree: a weighted measure on nodes at one time, as a structure of arrays.
#include <cstdint>

#include "wienertree/numeric/batch.hpp"
#include "wienertree/numeric/state_archive.hpp"

namespace wienertree {

/// The measure is sum_i exp(log_weight_i + log_likelihood_i) delta_{x_i}, not normalised: its mass is the
/// evidence so far.
struct Generation {
  double time = 0;
  Batch states;                   ///< d x N
  Buffer<double> log_weight;      ///< N: the part of the weight that thinning sees
  Buffer<double> log_likelihood;  ///< N, or empty for all zero: the part that is only carried
  Buffer<std::uint32_t> parent;   ///< N: index in the generation before; empty at the root
  Buffer<std::uint16_t> branch;   ///< N: which path of the formula; empty at the root
  Buffer<std::uint32_t> count;    ///< N: particles at each node when thinning counts them; empty otherwise

  std::size_t size() const { return states.nodes(); }
  void exchange(StateArchive& archive) {
    archive(time, states, log_weight, log_likelihood, parent, branch, count);
  }
};

}  // namespace wienertree
