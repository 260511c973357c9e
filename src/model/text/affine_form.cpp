#include "wienertree/model/text/affine_form.hpp"

namespace wienertree::text {

namespace {

using Eigen::Index;

AffineForm constant_form(double value, std::size_t d) {
  return {Eigen::VectorXd::Zero(static_cast<Index>(d)), value};
}

// A product is affine when at most one factor is not constant, and that one is affine.
std::optional<AffineForm> product_form(const std::vector<Expression>& factors, std::size_t d) {
  AffineForm result = constant_form(1, d);
  for (Expression factor : factors) {
    const std::optional<AffineForm> form = affine_form(factor, d);
    if (!form) return std::nullopt;
    if (form->is_constant()) {
      result.linear *= form->constant;
      result.constant *= form->constant;
    } else if (result.is_constant()) {
      result = {result.constant * form->linear, result.constant * form->constant};
    } else {
      return std::nullopt;
    }
  }
  return result;
}

}  // namespace

std::optional<AffineForm> affine_form(Expression e, std::size_t d) {
  switch (e->kind) {
    case Node::Kind::number:
      return constant_form(e->number, d);
    case Node::Kind::symbol: {
      if (e->role != Role::state) return std::nullopt;
      AffineForm form = constant_form(0, d);
      form.linear(static_cast<Index>(e->index)) = 1;
      return form;
    }
    case Node::Kind::sum: {
      AffineForm form = constant_form(0, d);
      for (Expression term : e->operands) {
        const std::optional<AffineForm> part = affine_form(term, d);
        if (!part) return std::nullopt;
        form.linear += part->linear;
        form.constant += part->constant;
      }
      return form;
    }
    case Node::Kind::product:
      return product_form(e->operands, d);
    case Node::Kind::pi:
    case Node::Kind::power:
    case Node::Kind::function:
      break;  // of constants they were folded
  }
  return std::nullopt;
}

std::optional<AffineFields> affine_fields(const FieldExpressions& bound) {
  AffineFields result;
  const auto d = static_cast<Index>(bound.d);
  for (const std::vector<Expression>& V : bound.fields) {
    result.linear.emplace_back(d, d);
    result.constant.emplace_back(d);
    for (std::size_t i = 0; i < bound.d; ++i) {
      const std::optional<AffineForm> form = affine_form(V[i], bound.d);
      if (!form) return std::nullopt;
      result.linear.back().row(static_cast<Index>(i)) = form->linear.transpose();
      result.constant.back()(static_cast<Index>(i)) = form->constant;
    }
  }
  return result;
}

std::optional<AffineSensor> affine_sensor(const FieldExpressions& bound) {
  if (bound.sensor.empty()) return std::nullopt;
  const auto k = static_cast<Index>(bound.sensor.size());
  AffineSensor result{Eigen::MatrixXd(k, static_cast<Index>(bound.d)), Eigen::VectorXd(k)};
  for (Index i = 0; i < k; ++i) {
    const std::optional<AffineForm> form = affine_form(bound.sensor[static_cast<std::size_t>(i)], bound.d);
    if (!form) return std::nullopt;
    result.linear.row(i) = form->linear.transpose();
    result.constant(i) = form->constant;
  }
  return result;
}

}  // namespace wienertree::text
