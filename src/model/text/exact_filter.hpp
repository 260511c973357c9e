#pragma once
/// Which exact filter a model admits, decided from its coefficients.
#include <optional>
#include <string>

#include "wienertree/model/model.hpp"
#include "wienertree/model/text/field_expressions.hpp"

namespace wienertree::text {

/// What the decision needs: the bound coefficients and the model built from them.
struct ExactFilterQuestion {
  const FieldExpressions& bound;
  const ModelSource& source;
  const Model& model;
};

struct ExactFilterAnswer {
  ExactFilter filter = ExactFilter::none;
  std::optional<BenesParameters> benes;
  std::string reason;  ///< why it applies, or why none does
};

/// Benes (d = p = k = 1):  dX = mu sigma tanh(mu X/sigma) dt + sigma dB,  h(x) = h1 x + h2,  fixed start.
/// Kalman-Bucy: affine drift, constant diffusion, affine h, continuous. Kalman: the same with discrete
/// observations in Gaussian noise. A claim in the source is verified.
/// @throws InputError at the claim, naming the coefficient that differs
ExactFilterAnswer exact_filter(const ExactFilterQuestion& question);

const char* name(ExactFilter filter);

}  // namespace wienertree::text
