#pragma once
/// Vector fields whose coefficients are expressions, evaluated by tapes.
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "wienertree/model/affine_flow.hpp"
#include "wienertree/model/model.hpp"
#include "wienertree/model/tape.hpp"
#include "wienertree/model/text/field_expressions.hpp"

namespace wienertree::text {

/// One tape for each set of segments' nonzero increments D_k, so that a field that is not followed is not
/// evaluated: all sets for 1+p <= 4, otherwise each single field and all together.
class PatternTapes {
 public:
  /// `terms(builder, used)` gives the outputs; used[k] tells whether D_k may be nonzero, and uniform k is
  /// D_k.
  using Terms =
      std::function<std::vector<TapeBuilder::Value>(TapeBuilder& builder, const std::vector<bool>& used)>;
  PatternTapes() = default;
  PatternTapes(std::size_t inputs, std::size_t fields, const Terms& terms);
  const Tape& of(std::span<const double> D) const;

 private:
  std::size_t fields_ = 0;
  bool every_set_ = false;
  std::vector<Tape> tapes_;  // by bit set of the nonzero D_k; or single fields, then all
};

/// Where a bound with `boundary = "clamp"` or "absorb" is set, all expressions are evaluated at the nearest
/// point inside; an absorbed component has all its fields multiplied by the indicator of the open interval;
/// Euler steps end at the nearest point inside.
class TextFields final : public VectorFields {
 public:
  /// bounds: d entries. inputs: null without any.
  TextFields(const FieldExpressions& bound, const std::vector<StateBound>& bounds,
             std::shared_ptr<const InputFunctions> inputs);

  std::size_t state_dimension() const override { return d_; }
  std::size_t noise_dimension() const override { return p_; }
  std::size_t sensor_dimension() const override { return k_; }
  void direct(ConstBatchView x, std::span<const double> D, BatchView out) const override;
  void jacobian(ConstBatchView x, std::span<const double> D, BatchView out) const override;
  void euler_step(ConstBatchView x, double dt, ConstBatchView dB, BatchView out) const override;
  void ito_drift(ConstBatchView x, BatchView out) const override;
  void diffusion(ConstBatchView x, BatchView out) const override;
  void sensor(ConstBatchView x, BatchView out) const override;
  void sensor_derivative(ConstBatchView x, BatchView out) const override;
  const AffineFields* affine_fields() const override { return flow_ ? &flow_->fields() : nullptr; }
  const AffineSensor* affine_sensor() const override { return affine_sensor_ ? &*affine_sensor_ : nullptr; }
  bool has_exact_flow() const override { return flow_.has_value(); }
  void exact_flow(std::span<const double> D, BatchView x) const override;

 private:
  void run(const Tape& tape, ConstBatchView x, ConstBatchView more, std::span<const double> uniforms,
           BatchView out) const;
  void run(const Tape& tape, ConstBatchView x, BatchView out) const {
    run(tape, x, ConstBatchView(), {}, out);
  }
  void freeze(ConstBatchView x, std::size_t rows_per_component, BatchView out) const;

  std::size_t d_, p_, k_;
  std::shared_ptr<const InputFunctions> inputs_;
  std::vector<std::pair<std::size_t, StateBound>> absorbing_;
  PatternTapes direct_, jacobian_;
  Tape euler_step_, ito_drift_, diffusion_, sensor_, sensor_derivative_;
  std::optional<AffineFlow> flow_;
  std::optional<AffineSensor> affine_sensor_;
};

}  // namespace wienertree::text
