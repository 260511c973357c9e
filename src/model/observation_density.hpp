#pragma once
/// Densities of discrete observations: additive noise of the usual laws, or any expression on a tape.
#include <memory>
#include <vector>

#include "wienertree/model/model.hpp"
#include "wienertree/model/tape.hpp"

namespace wienertree {

/// Law of the noise v in y = h(x) + v, with density g:
///
///     gaussian        exp(-v^2/(2 sd^2)) / (sd sqrt(2 pi))
///     laplace         exp(-|v|/scale) / (2 scale)
///     student_t       Gamma((n+1)/2) / (Gamma(n/2) sqrt(n pi) scale) (1 + v^2/(n scale^2))^(-(n+1)/2), n=dof
///     log_chi_square  exp((v - e^v)/2) / sqrt(2 pi), the law of log Z^2 for Z standard normal
struct NoiseLaw {
  enum class Kind { gaussian, laplace, student_t, log_chi_square };
  Kind kind = Kind::gaussian;
  double scale = 1;  ///< sd, scale; unused by log_chi_square
  double dof = 1;    ///< of student_t
};

/// log g(v).
double log_noise(const NoiseLaw& law, double v);

/// y_i = h_i(x) + v_i with independent v_i of the given laws, h the sensor of the fields.
/// laws: one for every component.
/// @throws InputError for a scale or dof that is not positive, or a wrong number of laws
std::unique_ptr<ObservationDensity> make_additive_noise(std::shared_ptr<const VectorFields> fields,
                                                        std::vector<NoiseLaw> laws);

/// The same with scales that differ from state to state: v_i = s_i(x) w_i, w_i of law i with the scale 1.
/// scales: a tape of k outputs s_i; inputs the d states and, for functions of time that are not null, their columns. Where
/// s_i is not positive the density is NaN. There is no law of the noise alone.
/// @throws InputError as make_additive_noise
std::unique_ptr<ObservationDensity> make_scaled_noise(std::shared_ptr<const VectorFields> fields,
                                                      std::vector<NoiseLaw> laws, Tape scales,
                                                      std::string name,
                                                      std::shared_ptr<const InputFunctions> inputs = nullptr);

/// Log density by a tape: inputs the d states and, for functions of time that are not null, their columns at the last
/// state, which is the clock; uniforms y_1 .. y_k, one output. It cannot be sampled from, nor split when only some
/// components are missing. name: how errors call it, e.g. "model.toml, observation.log_likelihood"
std::unique_ptr<ObservationDensity> make_tape_density(Tape log_likelihood, std::string name,
                                                      std::shared_ptr<const InputFunctions> inputs = nullptr);

}  // namespace wienertree
