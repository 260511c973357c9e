#pragma once
/// The keys of a model file, section by section.
#include <array>

#include "wienertree/model/file_key.hpp"

namespace wienertree::text {

inline constexpr std::array<FileKey, 11> model_keys{{
    {"name", "text", "the file's name", "what the model is called"},
    {"convention", "\"ito\" or \"stratonovich\"", "required", "how [drift] is meant"},
    {"parameters", "NAME = number or expression", "none", "of the parameters above it; --set changes them"},
    {"inputs", "NAME = table", "none", "known functions of time, given in a file"},
    {"state", "NAME = table", "required", "a component each, in the order of the file"},
    {"drift", "STATE = expression", "required", "one for each state"},
    {"diffusion", "STATE = list of expressions", "required", "for each state one for each Brownian motion"},
    {"noise", "table", "independent", "how the Brownian motions are correlated"},
    {"observation", "table", "nothing is observed", "what is observed of the signal"},
    {"initial", "table", "a fixed start", "a Gaussian start"},
    {"exact", "table", "found out", "an exact filter that the model is claimed to have, which is checked"},
}};

inline constexpr std::array<FileKey, 1> input_keys{{
    {"between", "\"linear\" or \"previous\"", "required",
     "what it is between two times: on the line from one value to the next, or still the previous value"},
}};

inline constexpr std::array<FileKey, 4> state_keys{{
    {"initial", "expression", "required without initial.mean", "where it starts"},
    {"lower", "expression", "unbounded", "least value"},
    {"upper", "expression", "unbounded", "largest value"},
    {"boundary", "\"error\", \"clamp\" or \"absorb\"", "error", "what a node does that leaves the bounds"},
}};

inline constexpr std::array<FileKey, 1> brownian_keys{{
    {"correlation", "list of lists of expressions", "required",
     "of the parameters, a row for each Brownian motion: of those that the columns of [diffusion] refer to"},
}};

inline constexpr std::array<FileKey, 5> observation_keys{{
    {"kind", "\"continuous\" or \"discrete\"", "required",
     "dY = h dt + dW, or y_k = h + noise at the times of the rows"},
    {"h", "list of expressions", "required without log_likelihood", "the sensor, of states and t"},
    {"noise", "table, or one for each of h", "required with a discrete h", "the law of the noise"},
    {"log_likelihood", "expression", "none",
     "discrete, instead of h and noise: log density of y1, y2, .. given the state"},
    {"timing", "\"current\" or \"previous\"", "current",
     "discrete: h of this state, or of that one observation earlier"},
}};

inline constexpr std::array<FileKey, 4> noise_keys{{
    {"law", "\"gaussian\", \"laplace\", \"student-t\" or \"log-chi-square\"", "required", "the family"},
    {"sd", "expression", "required for gaussian", "standard deviation, of states, inputs and t too"},
    {"scale", "expression", "required for laplace and student-t", "scale, of states, inputs and t too"},
    {"dof", "expression", "required for student-t", "degrees of freedom"},
}};

inline constexpr std::array<FileKey, 2> initial_keys{{
    {"mean", "list of expressions", "the states' initial", "of the parameters, one for each state"},
    {"covariance", "list of lists of expressions", "required", "of the parameters, a row for each state"},
}};

inline constexpr std::array<FileKey, 1> exact_keys{{
    {"filter", "\"benes\", \"kalman-bucy\" or \"kalman\"", "required", "the model's exact filter"},
}};

}  // namespace wienertree::text
