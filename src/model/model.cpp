#include "wienertree/model/model.hpp"

#include <fmt/format.h>

#include <cmath>

namespace wienertree {

void VectorFields::exact_flow(std::span<const double>, BatchView) const {
  throw InputError("these vector fields have no closed-form flow", "flow", "exact");
}

std::size_t Model::observation_dimension() const {
  return observation == ObservationKind::discrete ? density->observation_dimension()
                                                  : fields->sensor_dimension();
}

void check(const Model& model) {
  const std::size_t d = model.state_dimension();
  const auto require = [&](bool condition, const char* part, std::size_t size) {
    if (!condition)
      throw InputError("wrong number of entries", fmt::format("model {}: {}", model.name, part),
                       std::to_string(size));
  };
  require(model.state_names.size() == d, "state_names", model.state_names.size());
  require(model.initial.size() == d, "initial", model.initial.size());
  require(model.bounds.size() == d, "bounds", model.bounds.size());
  if (model.inputs && !model.inputs->known()) return;
  Batch x(d, 1), out(d, 1);
  for (std::size_t i = 0; i < d; ++i) x(i, 0) = model.initial[i];
  std::vector<double> D(1 + model.noise_dimension(), 0.0);
  for (std::size_t k = 0; k < D.size(); ++k) {
    D[k] = 1.0;
    model.fields->direct(x, D, out);
    D[k] = 0.0;
    for (std::size_t i = 0; i < d; ++i)
      if (!std::isfinite(out(i, 0)))
        throw InputError(fmt::format("V_{} is not finite at the initial state", k),
                         fmt::format("model {}: state {}", model.name, model.state_names[i]),
                         fmt::format("{} at {} = {}", out(i, 0), model.state_names[i], model.initial[i]));
  }
}

}  // namespace wienertree
