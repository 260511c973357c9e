#pragma once
/// The keys of a file with a cubature formula, of paths or of Lie polynomials. All are required.
#include <array>

#include "wienertree/model/file_key.hpp"

namespace wienertree {

inline constexpr std::array<FileKey, 5> formula_keys{{
    {"name", "text", "required", "what the formula is called"},
    {"degree", "whole number", "required",
     "m: moments of words up to this degree are exact, which is checked"},
    {"dimension", "whole number", "required", "p, the number of Brownian motions"},
    {"source", "text", "required", "where it comes from"},
    {"paths", "list of paths", "required", "piecewise linear, on a step of length 1"},
}};

inline constexpr std::array<FileKey, 2> path_keys{{
    {"weight", "number", "required", "positive; all together 1"},
    {"segments", "list of lists of p + 1 numbers", "required",
     "increments of (t, B1, .., Bp), one after the other"},
}};

inline constexpr std::array<FileKey, 6> lie_formula_keys{{
    {"kind", "\"lie\"", "required", "what tells it from a formula of paths"},
    formula_keys[0],
    formula_keys[1],
    formula_keys[2],
    formula_keys[3],
    {"elements", "list of Lie polynomials", "required", "whose exponentials take the place of paths"},
}};

inline constexpr std::array<FileKey, 2> lie_element_keys{{
    {"weight", "number", "required", "positive; all together 1"},
    {"terms", "list of terms", "required", "that add up to the polynomial"},
}};

inline constexpr std::array<FileKey, 2> lie_term_keys{{
    {"bracket", "text", "required", "a letter, \"0\" for time, or nested as \"[[0,1],1]\""},
    {"coefficient", "number", "required", "what it is multiplied by"},
}};

}  // namespace wienertree
