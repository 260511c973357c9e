#pragma once
/// Models written in C++: coefficients as templates of the scalar, derivatives by automatic differentiation.
///
///     struct Heston : wienertree::CppModel<2, 2> {                    // d, p; a third number is k
///       static constexpr auto convention = wienertree::Convention::ito;
///       double r = 0.05, kappa = 2, theta = 0.09, xi = 0.1, rho = 0;
///       template <class T>
///       State<T> drift(const State<T>& x) const {
///         return {r * x[0], kappa * (theta - x[1])};
///       }
///       template <class T>
///       Diffusion<T> diffusion(const State<T>& x) const {
///         // a row for each component, a column for each B^j
///         const T v = sqrt(x[1]);
///         return {{{v * x[0], 0.0}, {rho * xi * v, std::sqrt(1 - rho * rho) * xi * v}}};
///       }
///     };
///     const Model heston = make_model(Heston{}, {.name = "heston", .initial = {1.0, 0.09}});
///
/// Call sqrt, exp, tanh, min, pow and so on without `std::`. As a rule the coefficients are called a few
/// times with recording scalars, and the tape they leave is what runs: coefficients must not branch on the
/// state, must be functions of it alone, and pay no price for derivatives or for the class they are in. A
/// model that does branch declares `static constexpr bool branches = true;` and is then called for each node
/// with numbers that know their derivatives.
#include <array>
#include <concepts>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "wienertree/model/differentiation.hpp"
#include "wienertree/model/model.hpp"
#include "wienertree/model/node_fields.hpp"
#include "wienertree/model/recorded_fields.hpp"

namespace wienertree {

/// The model's fields. An `exact_flow` of the model goes before one found from affine fields:
///
///     // x(1) of dx/du = sum_k V_k(x) D_k from x; D has 1+p entries
///     State<double> exact_flow(const std::array<double, 3>& D, const State<double>& x) const;
template <CppModelType M>
std::shared_ptr<const VectorFields> make_vector_fields(M model) {
  if constexpr (branches<M>)
    return std::make_shared<WithExactFlow<NodeFields<M>, M>>(model, NodeFields<M>(model));
  else
    return std::make_shared<WithExactFlow<RecordedFields, M>>(model, record(model));
}

/// A type that implements VectorFields itself.
template <std::derived_from<VectorFields> F>
std::shared_ptr<const VectorFields> make_vector_fields(F fields) {
  return std::make_shared<F>(std::move(fields));
}

/// What a model is beside its fields; every part may be left out but the start.
struct ModelDescription {
  std::string name = "unnamed";
  std::vector<std::string> state_names = {};  ///< by default x, or x1 .. xd, and t for a clock
  std::vector<double> initial = {};           ///< d values; by default the mean of `initial_law`
  std::vector<StateBound> bounds = {};        ///< by default none
  bool has_clock = false;                     ///< the last state is the time
  /// By default discrete if there is a density, else continuous if there is a sensor, else none.
  std::optional<ObservationKind> observation = {};
  ObservationTiming timing = ObservationTiming::current;
  std::shared_ptr<const ObservationDensity> density = {};
  std::optional<InitialLaw> initial_law = {};
  /// By default the Kalman filter that applies, or none. A claim is verified.
  std::optional<ExactFilter> exact_filter = {};
  std::optional<BenesParameters> benes = {};
};

/// @throws InputError naming the part that is missing, of the wrong size, or contradicts its claim
Model make_model(std::shared_ptr<const VectorFields> fields, ModelDescription description);

template <class M>
requires(CppModelType<M> || std::derived_from<M, VectorFields>) Model
    make_model(M model, ModelDescription description) {
  return make_model(make_vector_fields(std::move(model)), std::move(description));
}

}  // namespace wienertree
