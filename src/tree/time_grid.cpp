#include "wienertree/tree/time_grid.hpp"

#include <fmt/format.h>

#include <cmath>

#include "wienertree/numeric/error.hpp"

namespace wienertree {

std::vector<double> time_grid(GridKind kind, double T, std::size_t n, double gamma) {
  if (!(T > 0) || !std::isfinite(T))
    throw InputError("must be a positive number", "horizon", fmt::format("{}", T));
  if (n == 0) throw InputError("must be at least 1", "steps", "0");
  if (!(gamma > 0) || !std::isfinite(gamma))
    throw InputError("must be a positive number", "gamma", fmt::format("{}", gamma));
  std::vector<double> t(n + 1, T);
  for (std::size_t i = 0; i < n; ++i) {
    const double u = static_cast<double>(i) / static_cast<double>(n);
    t[i] = kind == GridKind::uniform ? T * u : T * (1 - std::pow(1 - u, gamma));
  }
  for (std::size_t i = 0; i < n; ++i)
    if (!(t[i] < t[i + 1]))
      throw InputError(
          fmt::format("the times {} and {} of a grid of {} steps on [0, {:g}] are equal in doubles", i, i + 1,
                      n, T),
          kind == GridKind::uniform ? "horizon" : "gamma",
          fmt::format("{}", kind == GridKind::uniform ? T : gamma));
  return t;
}

}  // namespace wienertree
