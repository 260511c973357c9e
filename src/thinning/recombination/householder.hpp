#pragma once
/// The linear algebra of a Caratheodory step, on vectors over n points: rows of row-major matrices whose
/// stride is padded(n), with zeros beyond n.
#include <cstddef>

namespace wienertree::recombination {

/// Householder factorisation with pivoting: reflectors H_k = I - scale_k v_k v_k^T, v_k zero before entry k,
/// such that H_{rank-1} .. H_0 takes the space spanned by the rows into that of the first `rank` unit
/// vectors. Squared norms of what is left of the rows are downdated, and computed anew where that would
/// cancel (LAPACK's dgeqp3; Drmac, Bujanovic 2008, ACM Trans. Math. Softw. 35).
/// @param rows `count` rows, overwritten  @param v, scale  room for min(n, count) of each
/// @param norm, reference  room for `count` values
/// @return the rank: where the longest row left is below n epsilon times the longest row given
std::size_t pivoted_householder(double* rows, std::size_t count, std::size_t n, std::size_t stride, double* v,
                                double* scale, double* norm, double* reference);

/// The orthonormal vectors H_0 .. H_{rank-1} e_j, j = rank..n-1, which complete the rows' span: row j - rank
/// of `null`.
void last_columns(const double* v, const double* scale, std::size_t rank, std::size_t n, std::size_t stride,
                  double* null, std::size_t null_stride);

/// Appends to every null vector, from entry `stride` on, its products with the rows of `further`, and zeros.
void integrate_further(double* null, std::size_t nullity, std::size_t null_stride, std::size_t stride,
                       const double* further, std::size_t count);

}  // namespace wienertree::recombination
