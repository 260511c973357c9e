#pragma once
/// A model file as read: every key checked for its name and type, expressions still text.
#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "wienertree/model/input_functions.hpp"
#include "wienertree/model/model.hpp"
#include "wienertree/model/text/location.hpp"

namespace wienertree::text {

struct NamedExpression {
  std::string name;
  SourceExpression value;
};

struct InputSource {
  std::string name;
  Location location;
  Between between = Between::linear;
};

struct StateSource {
  std::string name;
  Location location;
  std::optional<SourceExpression> initial, lower, upper;
  Boundary boundary = Boundary::error;
};

/// A law of the observation noise with its parameters, e.g. {"student-t", {{"dof", ..}, {"scale", ..}}}.
struct NoiseSource {
  std::string law;
  Location location;
  std::vector<NamedExpression> parameters;  ///< in the order of `noise_laws`
  /// The parameter that multiplies: sd or scale. Null: the law has none.
  const SourceExpression* scale() const {
    for (const NamedExpression& parameter : parameters)
      if (parameter.name == "sd" || parameter.name == "scale") return &parameter.value;
    return nullptr;
  }
};

/// The laws of the language and the parameters each needs.
struct NoiseLawName {
  std::string_view law;
  std::array<std::string_view, 2> parameters;  ///< empty where it has fewer
};
inline constexpr std::array<NoiseLawName, 4> noise_laws{{{"gaussian", {"sd", ""}},
                                                         {"laplace", {"scale", ""}},
                                                         {"student-t", {"dof", "scale"}},
                                                         {"log-chi-square", {"", ""}}}};

struct ObservationSource {
  ObservationKind kind = ObservationKind::none;
  ObservationTiming timing = ObservationTiming::current;
  Location location;
  std::vector<SourceExpression> h;
  std::vector<NoiseSource> noise;  ///< one for all components, or one per component
  const NoiseSource& noise_of(std::size_t i) const { return noise[noise.size() == 1 ? 0 : i]; }
  std::optional<SourceExpression> log_likelihood;
};

struct InitialSource {
  Location location;
  std::vector<SourceExpression> mean;  ///< empty: the states' `initial`
  std::vector<std::vector<SourceExpression>> covariance;
};

struct ExactClaim {
  ExactFilter filter;
  Location location;
};

enum class Convention { ito, stratonovich };

struct ModelSource {
  std::string file, name;
  Convention convention = Convention::ito;
  std::vector<NamedExpression> parameters;
  std::vector<InputSource> inputs;
  std::vector<StateSource> states;                       ///< d
  std::vector<SourceExpression> drift;                   ///< d
  std::vector<std::vector<SourceExpression>> diffusion;  ///< d lists of p
  /// Of the Brownian motions that the columns of `diffusion` refer to, p lists of p; empty: independent.
  std::vector<std::vector<SourceExpression>> correlation;
  ObservationSource observation;
  std::optional<InitialSource> initial;
  std::optional<ExactClaim> exact;

  std::size_t noise_dimension() const { return diffusion.front().size(); }
  /// Where component i of field k was given; for the clock and for brackets of fields the last place there
  /// is.
  const SourceExpression& coefficient(std::size_t k, std::size_t i) const {
    const std::size_t row = std::min(i, states.size() - 1);
    return k == 0 ? drift[row] : diffusion[row][std::min(k, noise_dimension()) - 1];
  }
};

/// @throws InputError naming file, line and key: TOML syntax, unknown or missing keys, wrong types, wrong
/// shapes, duplicate or reserved names
ModelSource read_model(std::string_view toml, const std::string& file);

/// A further last state that starts from 0 and has this drift and no diffusion. `where` is how errors call
/// it. @throws InputError if the name is no identifier, reserved or taken
void add_integral(ModelSource& source, const std::string& name, const std::string& integrand,
                  const std::string& where);

}  // namespace wienertree::text
