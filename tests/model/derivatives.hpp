#pragma once
/// Any vector fields against finite differences of themselves, and against the definitions that link their
/// functions.
#include <string>
#include <vector>

#include "wienertree/model/vector_fields.hpp"

namespace wienertree::test {

/// What is wrong at the nodes of x, one line for each kind of fault; empty when all is right:
///
///     direct(e_j) = V_j of diffusion, j = 1..p;  direct(D) = sum_k direct(e_k) D_k
///     jacobian(D) = derivative of direct(D), for each e_k and for one D without zeros
///     ito_drift = V_0 + 1/2 sum_j (DV_j) V_j
///     euler_step = x + ito_drift dt + sum_j V_j dB^j
///     sensor_derivative = derivative of h along V_1 .. V_p
///
/// Derivatives along a direction v are central differences E(h) = (f(x + h v) - f(x - h v))/2h, extrapolated:
/// R(h) = (4 E(h/2) - E(h))/3 is in error by O(h^4). The tolerance is 2 |R(h/2) - R(h)|, which bounds the
/// error of R(h/2) as soon as it falls at all with h, and the rounding error of a difference quotient: f is
/// known to `ulp` u (|f| + |x||f'|), u = 2^-53, which is divided by the step h/4. x must stay in the domain
/// when moved by h = `step` (1 + |x|) in every component.
std::vector<std::string> derivative_faults(const VectorFields& fields, ConstBatchView x, double step = 1e-3,
                                           double ulp = 64);

/// The same bytes for each node of x wherever it sits: every function is evaluated for each node alone and
/// then in batches of 1..130 nodes, at changing places, in changing company. One line for each function that
/// fails.
std::vector<std::string> position_faults(const VectorFields& fields, ConstBatchView x);

}  // namespace wienertree::test
