#pragma once
/// A batch of nodes as one SUNDIALS vector whose norm is the worst node's.
///
/// The weighted root-mean-square norm of a serial vector averages over all nodes, so that one hard node among
/// N easy ones is given sqrt(N) times its tolerance. Here
///
///     ||x||_w = max_n sqrt( (1/d) sum_i (x_i^n w_i^n)^2 ).
#include <sundials/sundials_context.h>
#include <sundials/sundials_nvector.h>

#include <cstddef>

#include "wienertree/numeric/batch.hpp"

namespace wienertree {

/// Shared by a vector and all its clones, so that `nodes` can change between two solves without allocating
/// anew.
struct BatchShape {
  std::size_t components = 0;  ///< d
  std::size_t capacity = 0;    ///< components lie this many doubles apart; a multiple of 8
  std::size_t nodes = 0;       ///< at most capacity: the operations see these alone
};

/// Uninitialised vector; destroy with N_VDestroy. `shape` must outlive it and its clones.
/// @throws std::bad_alloc
N_Vector make_batch_nvector(const BatchShape& shape, SUNContext context);

/// The data of a vector made above: d x nodes.
BatchView batch_of(N_Vector x);

}  // namespace wienertree
