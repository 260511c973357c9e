#include "wienertree/filter/simulate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "wienertree/filter/clock.hpp"
#include "wienertree/numeric/memory.hpp"
#include "wienertree/numeric/random.hpp"
#include "wienertree/tree/initial.hpp"

namespace wienertree {
namespace {

// Draws one signal step by step, in blocks of normals.
class SignalPath {
 public:
  SignalPath(const Model& model, double dt, RandomStream start, RandomStream noise)
      : model_(model),
        dt_(dt),
        noise_(noise),
        p_(model.noise_dimension()),
        x_(model.state_dimension(), 1),
        next_(model.state_dimension(), 1),
        dB_(p_, 1) {
    draw_initial(model, start, 1, x_);
    if (model.inputs) set_clock(model, x_, 0);
  }

  void step(std::size_t number) {
    if (used_ == normals_.size()) {
      normals_.resize(p_ * steps_a_block);
      noise_.normals(drawn_, normals_);
      drawn_ += normals_.size();
      used_ = 0;
    }
    for (std::size_t j = 0; j < p_; ++j) dB_(j, 0) = std::sqrt(dt_) * normals_[used_++];
    model_.fields->euler_step(x_, dt_, dB_, next_);
    for (std::size_t i = 0; i < model_.state_dimension(); ++i) keep_inside(i, number);
    x_.swap(next_);
    if (model_.inputs) set_clock(model_, x_, dt_ * static_cast<double>(number));
  }

  const Batch& state() const { return x_; }

 private:
  static constexpr std::size_t steps_a_block = 512;

  void keep_inside(std::size_t i, std::size_t number) {
    double& x = next_(i, 0);
    const StateBound& b = model_.bounds[i];
    if (std::isfinite(x) && x >= b.lower && x <= b.upper) return;
    if (std::isfinite(x) && b.boundary != Boundary::error) {
      x = std::clamp(x, b.lower, b.upper);
      return;
    }
    throw RunError(
        std::isfinite(x) ? "the simulated signal left its bounds" : "the simulated signal is not finite",
        fmt::format("state {} at t = {:g}", model_.state_names[i], dt_ * static_cast<double>(number)),
        fmt::format("{}", x));
  }

  const Model& model_;
  double dt_;
  RandomStream noise_;
  std::size_t p_;
  Batch x_, next_, dB_;
  std::vector<double> normals_;
  std::size_t used_ = 0;
  std::uint64_t drawn_ = 0;
};

}  // namespace

Simulation simulate(const Model& model, double horizon, std::size_t steps, std::size_t keep,
                    std::uint64_t seed, std::uint32_t launch) {
  if (!(horizon > 0) || !std::isfinite(horizon))
    throw InputError("must be a positive number", "horizon", fmt::format("{}", horizon));
  if (steps == 0) throw InputError("must be at least 1", "steps", "0");
  if (keep == 0 || steps % keep != 0)
    throw InputError(fmt::format("must divide the number of steps, {}", steps), "keep", std::to_string(keep));
  if (model.inputs) model.inputs->require_span(0, horizon, "the steps");
  const auto rows = static_cast<double>(keep);
  if (horizon > std::numeric_limits<double>::max() / rows ||
      horizon / static_cast<double>(steps) < std::numeric_limits<double>::min())
    throw InputError(
        fmt::format("the times of {} steps and {} rows up to it cannot be represented", steps, keep),
        "horizon", fmt::format("{}", horizon));
  const auto columns =
      static_cast<double>(2 + model.reported_dimension() +
                          (model.observation == ObservationKind::none ? 0 : model.observation_dimension()));
  // Vectors take up to three times their size while they grow.
  require_memory(3 * sizeof(double) * columns * rows, fmt::format("a simulation of {} rows", keep), "--keep");
  const auto stream = [&](Purpose purpose) { return RandomStream{seed, launch, 0, purpose}; };
  const double dt = horizon / static_cast<double>(steps);
  const std::size_t every = steps / keep,
                    k = model.observation == ObservationKind::none ? 0 : model.observation_dimension();
  SignalPath signal(model, dt, stream(Purpose::initial_state), stream(Purpose::signal_noise));

  Simulation out;
  out.signal.dimension = model.reported_dimension();
  out.observations.dimension = k;
  std::vector<double> y(k, 0.0), normals(k), uniforms(k), before(model.state_dimension());
  Batch h(k, 1);
  const RandomStream noise = stream(Purpose::observation_noise),
                     uniform = stream(Purpose::observation_uniform);
  const bool continuous = model.observation == ObservationKind::continuous;
  const bool previous = model.timing == ObservationTiming::previous;
  const auto record = [&](std::size_t row) {
    const double t = horizon * static_cast<double>(row) / static_cast<double>(keep);
    const std::span<const double> x = {signal.state().view().data(), model.state_dimension()};
    out.signal.append(t, x.first(out.signal.dimension));
    if (model.observation == ObservationKind::discrete) {
      if (previous && row == 0) {
        std::fill(y.begin(), y.end(), std::numeric_limits<double>::quiet_NaN());
      } else {
        noise.normals(row * k, normals);
        uniform.uniforms(row * k, uniforms);
        model.density->sample(previous ? std::span<const double>(before) : x, uniforms, normals, y);
      }
      std::copy(x.begin(), x.end(), before.begin());
    }
    for (std::size_t i = 0; i < k; ++i)
      if (!std::isfinite(y[i]) && !(previous && row == 0))
        throw RunError("the simulated observation is not finite", fmt::format("y{} at t = {:g}", i + 1, t),
                       fmt::format("{}", y[i]));
    if (k > 0) out.observations.append(t, y);
  };

  record(0);
  for (std::size_t m = 1; m <= steps; ++m) {
    if (continuous) {
      model.fields->sensor(signal.state(), h);
      noise.normals((m - 1) * k, normals);
      for (std::size_t i = 0; i < k; ++i) y[i] += h(i, 0) * dt + std::sqrt(dt) * normals[i];
    }
    signal.step(m);
    if (m % every == 0) record(m / every);
  }
  return out;
}

}  // namespace wienertree
