#pragma once
/// The Benes model's fields on the expression tape: dX = mu sigma tanh(mu X / sigma) dt + sigma o dB.
#include <array>

#include "wienertree/model/tape.hpp"
#include "wienertree/model/vector_fields.hpp"

namespace wienertree::bench {

class TanhFields final : public VectorFields {
 public:
  TanhFields(double mu, double sigma) {
    TapeBuilder t(1, 2);
    const auto times = [&](auto a, auto b) { return t.binary(Op::multiply, a, b); };
    const auto argument = times(t.constant(mu / sigma), t.input(0)),
               y = t.unary(Op::hyperbolic_tangent, argument);
    const auto value = t.binary(Op::add, times(times(t.constant(mu * sigma), t.uniform(0)), y),
                                times(t.constant(sigma), t.uniform(1)));
    const auto slope =
        times(times(t.constant(mu * mu), t.uniform(0)), t.binary(Op::subtract, t.constant(1.0), times(y, y)));
    direct_ = t.finish({&value, 1});
    jacobian_ = t.finish({&slope, 1});
  }
  std::size_t state_dimension() const override { return 1; }
  std::size_t noise_dimension() const override { return 1; }
  std::size_t sensor_dimension() const override { return 0; }
  void direct(ConstBatchView x, std::span<const double> D, BatchView out) const override {
    run(direct_, x, D, out);
  }
  void jacobian(ConstBatchView x, std::span<const double> D, BatchView out) const override {
    run(jacobian_, x, D, out);
  }
  void euler_step(ConstBatchView, double, ConstBatchView, BatchView) const override {}
  void ito_drift(ConstBatchView x, BatchView out) const override { direct(x, std::array{1.0, 0.0}, out); }
  void diffusion(ConstBatchView x, BatchView out) const override { direct(x, std::array{0.0, 1.0}, out); }
  void sensor(ConstBatchView, BatchView) const override {}
  void sensor_derivative(ConstBatchView, BatchView) const override {}

 private:
  static void run(const Tape& tape, ConstBatchView x, std::span<const double> D, BatchView out) {
    const double* input = x.data();
    double* output = out.data();
    tape.evaluate({&input, 1}, D, {&output, 1}, x.nodes());
  }
  Tape direct_, jacobian_;
};

}  // namespace wienertree::bench
