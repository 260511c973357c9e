#pragma once
/// A good model file, and mistakes made in it: each gives one InputError that says what, where
/// (file:line:column, key) and the value.
#include <catch2/catch.hpp>
#include <string>

#include "wienertree/model/text_model.hpp"

namespace wienertree::mistakes {

inline const std::string good =
    "name = \"good\"\n"                                        // 1
    "convention = \"ito\"\n"                                   // 2
    "[parameters]\n"                                           // 3
    "kappa = 1.5\n"                                            // 4
    "theta = \"kappa/2\"\n"                                    // 5
    "[state]\n"                                                // 6
    "x = { initial = 0.5, lower = 0.0, upper = 9.0 }\n"        // 7
    "v = { initial = 1.0 }\n"                                  // 8
    "[drift]\n"                                                // 9
    "x = \"kappa*(theta - x)\"\n"                              // 10
    "v = \"-v\"\n"                                             // 11
    "[diffusion]\n"                                            // 12
    "x = [\"sqrt(x)\", \"0\"]\n"                               // 13
    "v = [\"0.1\", \"0.2*v\"]\n"                               // 14
    "[observation]\n"                                          // 15
    "kind = \"discrete\"\n"                                    // 16
    "h = [\"x\", \"v\"]\n"                                     // 17
    "noise = { law = \"student-t\", dof = 5, scale = 1.0 }\n"  // 18
    "timing = \"current\"\n"                                   // 19
    "[initial]\n"                                              // 20
    "mean = [0.5, 1.0]\n"                                      // 21
    "covariance = [[0.2, 0.1], [0.1, 0.3]]\n";                 // 22

struct Mistake {
  std::string from, to;     // the first `from` is replaced by `to`
  std::string where;        // the whole place
  std::string message;      // part of the message
  std::string value = "*";  // the whole value; "*": any
};

inline Error error_of(const std::string& text, const ParameterOverrides& overrides = {}) {
  try {
    parse_model(text, "m.toml", overrides);
  } catch (const InputError& error) {
    return error;
  }
  FAIL("no InputError");
  return {"", ""};
}

inline void require_error(const Mistake& mistake) {
  INFO(mistake.from << " -> " << mistake.to);
  const std::size_t place = good.find(mistake.from);
  REQUIRE(place != std::string::npos);
  std::string text = good;
  text.replace(place, mistake.from.size(), mistake.to);
  const Error error = error_of(text);
  INFO(error.what());
  CHECK(error.where() == mistake.where);
  CHECK(error.message().find(mistake.message) != std::string::npos);
  if (mistake.value != "*") CHECK(error.value() == mistake.value);
  CHECK(std::string(error.what()).find('\n') == std::string::npos);
}

}  // namespace wienertree::mistakes
