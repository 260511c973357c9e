#pragma once
/// Vector fields as tapes, from coefficients recorded once as functions of the state.
#include <functional>
#include <optional>
#include <vector>

#include "wienertree/model/affine_flow.hpp"
#include "wienertree/model/recorded.hpp"
#include "wienertree/model/vector_fields.hpp"

namespace wienertree {

/// Everything about a model at a recorded state x.
struct RecordedCoefficients {
  std::vector<std::vector<Recorded>> fields;     ///< V_0 .. V_p (Stratonovich), d entries each
  std::vector<std::vector<Recorded>> jacobians;  ///< of V_0 .. V_p; entry i*d + l is dV^i/dx_l
  std::vector<Recorded> ito_drift;               ///< d
  std::vector<Recorded> sensor;                  ///< k
  std::vector<Recorded> sensor_gradient;         ///< entry i*d + l is dh_i/dx_l
  std::vector<Recorded> sensor_derivative;       ///< entry i*p + r-1 is V_r h_i
};

/// Fields whose derivatives were all recorded as constants, without a jump, are found to be affine; their
/// flow is then known in closed form. So is an affine sensor.
class RecordedFields : public VectorFields {
 public:
  /// The coefficients at the state whose component i is `x[i]`.
  using Coefficients = std::function<RecordedCoefficients(std::span<const Recorded> x)>;
  RecordedFields(std::size_t d, std::size_t p, std::size_t k, const Coefficients& coefficients);

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
  /// One tape for each set of fields that a segment follows, so that those with D_k = 0 are not evaluated:
  /// for every set if there are at most 4 fields, otherwise for each single field and for all together.
  struct SegmentTapes {
    std::vector<Tape> tapes;
    std::size_t fields = 0;
    const Tape& of(std::span<const double> D) const;
  };
  SegmentTapes segment_tapes(const Coefficients& coefficients,
                             std::vector<std::vector<Recorded>> RecordedCoefficients::*part) const;
  Tape tape(const Coefficients& coefficients, std::vector<Recorded> RecordedCoefficients::*part) const;
  void find_affine(const Coefficients& coefficients);

  std::size_t d_, p_, k_;
  SegmentTapes direct_, jacobian_;
  Tape euler_step_, ito_drift_, diffusion_, sensor_, sensor_derivative_;
  std::optional<AffineFlow> flow_;
  std::optional<AffineSensor> affine_sensor_;
};

}  // namespace wienertree
