#pragma once
/// Closed-form flow of affine vector fields.
///
/// On a segment with increments D the node solves dx/du = A x + b with
/// A = sum_k D_k A_k, b = sum_k D_k b_k, so
///
///     x(1) = x + E x + g,       [ E  g ]  =  exp [ A  b ]  -  Id ,
///                               [ 0  0 ]         [ 0  0 ]
///
/// the same affine map for every node. E and g are computed once per call, by Taylor's series of exp - Id
/// after halving and the doubling rule  exp(2M) - Id = F (2 Id + F), F = exp(M) - Id  (Higham, Functions of
/// Matrices, 2008, section 10.3); subtracting the identity first keeps small steps accurate.
#include <span>
#include <vector>

#include "wienertree/model/vector_fields.hpp"

namespace wienertree {

class AffineFlow {
 public:
  /// Keeps a copy of the fields. @pre 1+p matrices d x d and vectors d
  explicit AffineFlow(AffineFields fields);

  const AffineFields& fields() const { return fields_; }
  /// x <- x(1), in place.   D: 1+p values;  x: d x N. Free of allocation after the first call on a thread; a
  /// node's result does not depend on where it sits.
  void operator()(std::span<const double> D, BatchView x) const;

 private:
  void translate(std::span<const double> D, BatchView x) const;
  void flow_scalar(std::span<const double> D, BatchView x) const;
  void flow_general(std::span<const double> D, BatchView x) const;

  AffineFields fields_;
  bool translation_;  // all A_k = 0
};

/// F <- exp(M) - Id, both m x m in any storage order.
/// scratch: 2 m m values. @pre M is finite
void exponential_minus_identity(std::span<const double> M, std::size_t m, std::span<double> F,
                                std::span<double> scratch);

}  // namespace wienertree
