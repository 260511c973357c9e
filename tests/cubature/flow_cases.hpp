#pragma once
/// The problems every flow is tested on, with reference solutions.
#include <cstring>
#include <string>
#include <vector>

#include "cubature/test_models.hpp"
#include "wienertree/cubature/flow.hpp"
#include "wienertree/numeric/batch.hpp"

namespace wienertree::test {

struct FlowCase {
  Model model;
  Batch nodes;                                ///< d x N
  std::vector<std::vector<double>> segments;  ///< increments D
  std::vector<Batch> ends;                    ///< where each segment leads: d x N each
};

/// Made once: tanh, Ornstein-Uhlenbeck, three linear equations, Heston, Lorenz, and two stiff ones.
const std::vector<FlowCase>& flow_cases();

inline const char* name_of(FlowMethod method) {
  switch (method) {
    case FlowMethod::exact:
      return "exact";
    case FlowMethod::cvode:
      return "cvode";
    default:
      return "explicit";
  }
}

/// The methods that apply to a model.
inline std::vector<FlowMethod> methods_for(const Model& model) {
  std::vector<FlowMethod> methods = {FlowMethod::explicit_, FlowMethod::cvode};
  if (model.fields->has_exact_flow()) methods.push_back(FlowMethod::exact);
  return methods;
}

inline Batch copy(ConstBatchView x) {
  Batch result(x.components(), x.nodes());
  for (std::size_t i = 0; i < x.components(); ++i)
    std::copy_n(x.component(i).data(), x.nodes(), result.component(i).data());
  return result;
}

/// max |x - reference| / (absolute + relative |reference|) over components and nodes.
inline double error_in_tolerances(ConstBatchView x, ConstBatchView reference, FlowTolerance tolerance) {
  double worst = 0;
  for (std::size_t i = 0; i < x.components(); ++i)
    for (std::size_t n = 0; n < x.nodes(); ++n) {
      const double error = std::abs(x(i, n) - reference(i, n)) /
                           (tolerance.absolute + tolerance.relative * std::abs(reference(i, n)));
      if (!(error <= worst)) worst = error;  // NaN counts
    }
  return worst;
}

inline bool same_bytes(ConstBatchView a, ConstBatchView b) {
  if (a.components() != b.components() || a.nodes() != b.nodes()) return false;
  for (std::size_t i = 0; i < a.components(); ++i)
    if (std::memcmp(a.component(i).data(), b.component(i).data(), a.nodes() * sizeof(double)) != 0)
      return false;
  return true;
}

}  // namespace wienertree::test
