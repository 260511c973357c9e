#include "wienertree/filter/line_transition.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace wienertree {
namespace {

constexpr std::size_t fewest_steps = 8, most_steps = 1 << 14;

// (exp(A s) - 1)/A
double growth_integral(double A, double s) { return A == 0 ? s : std::expm1(A * s) / A; }

// Places that no symmetry or period shares, as parts of [low, high].
constexpr std::array<double, 7> places = {0, 0.1347, 0.2981, 0.5, 0.6413, 0.8329, 1};

}  // namespace

AffineLine::AffineLine(const Model& model) : model_(model) {
  bounded_ = !model.bounds.empty() && model.bounds[0].bounded();
  const AffineFields* fields = model.has_clock ? nullptr : model.fields->affine_fields();
  known_ = fields != nullptr;
  for (std::size_t j = 1; known_ && j < fields->linear.size(); ++j) known_ = fields->linear[j](0, 0) == 0;
}

std::optional<LineTransition> AffineLine::transition(double time, double length, double low, double high) {
  if (bounded_) return {};
  if (known_) return known(length);
  if (!(high > low) || !std::isfinite(low) || !std::isfinite(high)) return {};
  if (!affine_between(time, length, low, high)) return {};
  return integrate(time, length, low, high);
}

std::optional<LineTransition> AffineLine::known(double s) const {
  const AffineFields& fields = *model_.fields->affine_fields();
  const double A = fields.linear[0](0, 0), a = fields.constant[0](0);
  double q = 0;
  for (std::size_t j = 1; j < fields.constant.size(); ++j) q += fields.constant[j](0) * fields.constant[j](0);
  return LineTransition{std::exp(A * s), a * growth_integral(A, s), q * growth_integral(2 * A, s)};
}

// Drift and diffusion at `places_count` places of [low, high] (all of `places`, or its two ends) for each of
// `times` equidistant times, place by place.
void AffineLine::evaluate(std::size_t places_count, std::size_t times, double time, double length, double low,
                          double high) {
  const std::size_t d = model_.state_dimension(), N = places_count * times;
  x_.reshape(d, N);
  drift_.reshape(d, N);
  diffusion_.reshape(d * model_.noise_dimension(), N);
  for (std::size_t k = 0; k < times; ++k)
    for (std::size_t i = 0; i < places_count; ++i) {
      const double part = places_count == places.size() ? places[i] : static_cast<double>(i);
      x_(0, k * places_count + i) = low + part * (high - low);
      if (d > 1)
        x_(1, k * places_count + i) =
            time + (times > 1 ? length * static_cast<double>(k) / static_cast<double>(times - 1) : 0.0);
    }
  model_.fields->ito_drift(x_, drift_);
  model_.fields->diffusion(x_, diffusion_);
}

bool AffineLine::affine_between(double time, double length, double low, double high) {
  constexpr double negligible = 1e-10;
  constexpr std::size_t times = 5, n = places.size();
  evaluate(n, times, time, length, low, high);
  for (std::size_t k = 0; k < times; ++k) {
    const double first = drift_(0, k * n), last = drift_(0, k * n + n - 1);
    const double size = std::max(std::abs(first), std::abs(last));
    for (std::size_t i = 0; i < n; ++i) {
      const double line = first + places[i] * (last - first);
      if (!(std::abs(drift_(0, k * n + i) - line) <= negligible * size)) return false;
      for (std::size_t j = 0; j < model_.noise_dimension(); ++j) {
        const double here = diffusion_(j, k * n + i), there = diffusion_(j, k * n);
        if (!(std::abs(here - there) <= negligible * std::abs(there))) return false;
      }
    }
  }
  return true;
}

AffineLine::Coefficients AffineLine::at(std::size_t place, double low, double high) const {
  const double A = (drift_(0, 2 * place + 1) - drift_(0, 2 * place)) / (high - low);
  double q = 0;
  for (std::size_t j = 0; j < model_.noise_dimension(); ++j)
    q += diffusion_(j, 2 * place) * diffusion_(j, 2 * place);
  return {A, drift_(0, 2 * place) - A * low, q};
}

std::optional<LineTransition> AffineLine::integrate(double time, double length, double low, double high) {
  LineTransition before{NAN, NAN, NAN};
  for (std::size_t n = fewest_steps; n <= most_steps; n *= 2) {
    evaluate(2, 2 * n + 1, time, length, low, high);
    const double h = length / static_cast<double>(n);
    LineTransition x;
    const auto slope = [](const Coefficients& c, const LineTransition& y) {
      return LineTransition{c.A * y.F, c.A * y.f + c.a, 2 * c.A * y.Q + c.q};
    };
    const auto moved = [](const LineTransition& y, double by, const LineTransition& k) {
      return LineTransition{y.F + by * k.F, y.f + by * k.f, y.Q + by * k.Q};
    };
    for (std::size_t step = 0; step < n; ++step) {
      const Coefficients c0 = at(2 * step, low, high), c1 = at(2 * step + 1, low, high),
                         c2 = at(2 * step + 2, low, high);
      const LineTransition k1 = slope(c0, x), k2 = slope(c1, moved(x, h / 2, k1)),
                           k3 = slope(c1, moved(x, h / 2, k2)), k4 = slope(c2, moved(x, h, k3));
      x = {x.F + h / 6 * (k1.F + 2 * k2.F + 2 * k3.F + k4.F),
           x.f + h / 6 * (k1.f + 2 * k2.f + 2 * k3.f + k4.f),
           x.Q + h / 6 * (k1.Q + 2 * k2.Q + 2 * k3.Q + k4.Q)};
    }
    const double scale = std::abs(x.f) + std::sqrt(std::abs(x.Q)) + std::abs(x.F) * (high - low);
    const auto near = [](double a, double b, double size) { return std::abs(a - b) <= 1e-10 * size; };
    if (near(x.F * (high - low), before.F * (high - low), scale) && near(x.f, before.f, scale) && x.Q >= 0 &&
        near(x.Q, before.Q, std::abs(x.Q)))
      return x;
    before = x;
  }
  return {};
}

}  // namespace wienertree
