#pragma once
/// Where a message says something happened.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>

#include "wienertree/filter/window.hpp"

namespace wienertree {

inline std::string place(const ObservationWindow& window) {
  return fmt::format("step {}, t = {:g}", window.step, window.end);
}

/// The same with what was observed.
inline std::string place_and_observation(const ObservationWindow& window) {
  if (!window.observation.empty())
    return fmt::format("{}, observation {}", place(window), fmt::join(window.observation, ", "));
  return fmt::format("{}, observation increment {}", place(window), fmt::join(window.increment, ", "));
}

}  // namespace wienertree
