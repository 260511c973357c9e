#include "wienertree/filter/posterior.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "wienertree/filter/marginal.hpp"
#include "wienertree/numeric/clones.hpp"
#include "wienertree/numeric/error.hpp"
#include "wienertree/numeric/lane_sum.hpp"
#include "wienertree/numeric/log_weights.hpp"

namespace wienertree {
namespace {

// E[(m + sqrt(v) Z)^k] by the recursion M_k = m M_{k-1} + (k-1) v M_{k-2}.
double gaussian_moment(double m, double v, int order) {
  double before = 1, now = m;
  if (order == 0) return 1;
  for (int k = 2; k <= order; ++k) {
    const double next = m * now + (k - 1) * v * before;
    before = now;
    now = next;
  }
  return now;
}

WIENERTREE_CLONES double weighted_sum(const double* w, const double* x, std::size_t n) {
  return lane_sum(0, n, [&](std::size_t k) { return w[k] * x[k]; });
}

WIENERTREE_CLONES double weighted_products(const double* w, const double* x, double x0, const double* y,
                                           double y0, std::size_t n) {
  return lane_sum(0, n, [&](std::size_t k) { return w[k] * ((x[k] - x0) * (y[k] - y0)); });
}

// A number that overflowed must not be handed out as a result.
void require_finite(double value, const Posterior& posterior, const std::string& what) {
  if (std::isfinite(value)) return;
  throw RunError("is not a finite number: it lies beyond what a double represents, or the model explodes",
                 fmt::format("t = {:g}, {}", posterior.time, what), fmt::format("{}", value));
}

}  // namespace

double Posterior::variance_of(std::size_t i, std::size_t n) const {
  if (dirac()) return 0;
  return covariance(i * points.components() + i, covariance.nodes() == 1 ? 0 : n);
}

double mean(const Posterior& posterior, std::size_t i) {
  return weighted_sum(posterior.weight.data(), posterior.points.component(i).data(), posterior.size());
}

double covariance(const Posterior& posterior, std::size_t i, std::size_t j) {
  const double mi = mean(posterior, i), mj = i == j ? mi : mean(posterior, j);
  const std::size_t d = posterior.points.components();
  double sum = weighted_products(posterior.weight.data(), posterior.points.component(i).data(), mi,
                                 posterior.points.component(j).data(), mj, posterior.size());
  if (!posterior.dirac())
    for (std::size_t n = 0; n < posterior.size(); ++n)
      sum += posterior.weight[n] * posterior.covariance(i * d + j, posterior.covariance.nodes() == 1 ? 0 : n);
  return sum;
}

double raw_moment(const Posterior& posterior, std::size_t i, int order) {
  double sum = 0;
  for (std::size_t n = 0; n < posterior.size(); ++n)
    sum += posterior.weight[n] * gaussian_moment(posterior.points(i, n), posterior.variance_of(i, n), order);
  return sum;
}

double effective_sample_size(const Posterior& posterior) { return 1 / sum_of_squares(posterior.weight); }

void exchange(StateArchive& archive, PosteriorSummary& s) {
  archive(s.time, s.log_evidence, s.ess, s.nodes, s.mean, s.sd, s.q05, s.q50, s.q95, s.moments);
}

void summarise(const Posterior& posterior, std::size_t components, int highest_moment,
               PosteriorSummary& out) {
  constexpr std::array levels = {0.05, 0.5, 0.95};
  out.time = posterior.time;
  out.log_evidence = posterior.log_evidence;
  out.ess = effective_sample_size(posterior);
  out.nodes = posterior.kept;
  require_finite(out.log_evidence, posterior, "log evidence");
  require_finite(out.ess, posterior, "effective sample size");
  for (auto* v : {&out.mean, &out.sd, &out.q05, &out.q50, &out.q95}) v->resize(components);
  out.moments.resize(highest_moment >= 2 ? components : 0);
  for (std::size_t i = 0; i < components; ++i) {
    out.mean[i] = mean(posterior, i);
    out.sd[i] = std::sqrt(std::max(0.0, covariance(posterior, i, i)));
    std::array<double, 3> q{};
    Marginal(posterior, i).quantiles(levels, q);
    out.q05[i] = q[0];
    out.q50[i] = q[1];
    out.q95[i] = q[2];
    const auto require = [&](double value, const std::string& name) {
      require_finite(value, posterior, fmt::format("{} of state {}", name, i + 1));
    };
    require(out.mean[i], "mean");
    require(out.sd[i], "standard deviation");
    for (const double quantile : q) require(quantile, "quantile");
    if (highest_moment < 2) continue;
    out.moments[i].clear();
    for (int k = 2; k <= highest_moment; ++k) {
      out.moments[i].push_back(raw_moment(posterior, i, k));
      require(out.moments[i].back(), fmt::format("moment {}", k));
    }
  }
}

}  // namespace wienertree
