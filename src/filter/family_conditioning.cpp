#include "wienertree/filter/family_conditioning.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "wienertree/filter/weights.hpp"

namespace wienertree {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double unresolved = 1e-3;  // of the mean, in the two highest Hermite coefficients
constexpr double rounding = 1e-5;    // of a quadratic log-likelihood that is not known to be one
constexpr int most_passes = 12;
constexpr double negligible_depth = 60;

double log_sum(double a, double b) {
  if (a < b) std::swap(a, b);
  return a == -infinity ? a : a + std::log1p(std::exp(b - a));
}

// Two parts of 1 % of the family or more, 3 of its sd or more apart.
bool apart(std::span<const FamilyModes::Part> parts, double family_weight) {
  double low = infinity, high = -infinity;
  for (const FamilyModes::Part& part : parts) {
    if (part.log_weight < family_weight + std::log(0.01)) continue;
    low = std::min(low, part.z);
    high = std::max(high, part.z);
  }
  return high - low >= 3;
}

}  // namespace

void FamilyUpdate::clear() {
  components.clear();
  points.clear();
  law.clear();
  quadratic = true;
  far = outside = divided = 0;
}

FamilyConditioning::FamilyConditioning(const Model& model) : likelihood_(model) {
  if (!model.bounds.empty()) bounds_ = {model.bounds[0].lower, model.bounds[0].upper};
}

// Points a family: an odd number from 7 (or 5 of many families) to 31.
const HermiteRule& FamilyConditioning::rule_for(std::size_t families, std::size_t points) {
  constexpr std::size_t many = 128, most = 31;
  const std::size_t n =
      std::clamp(points / families | 1, families > many ? std::size_t{5} : std::size_t{7}, most);
  for (const HermiteRule& rule : rules_)
    if (rule.size() == n) return rule;
  rules_.reserve(most);  // references stay valid
  return rules_.emplace_back(hermite_rule(n));
}

void FamilyConditioning::place(const Families& prior, const HermiteRule& rule) {
  const std::size_t n = rule.size();
  const std::span<double> x = likelihood_.places(n * active_.size());
  for (std::size_t a = 0; a < active_.size(); ++a) {
    const Active& active = active_[a];
    const FamilyShape shape = prior.shape_of(active.family);
    const double m = prior.mean[active.family], s = prior.sd[active.family];
    for (std::size_t j = 0; j < n; ++j) x[a * n + j] = m + s * shape(active.mu + active.s * rule.z[j]);
  }
}

// Whether F - z^2/2 has no inflection between the points of N(0, 1).
bool FamilyConditioning::concave(const HermiteRule& rule, std::span<const double> F) const {
  for (std::size_t j = 1; j + 1 < rule.size(); ++j) {
    const double up = (F[j + 1] - F[j]) / (rule.z[j + 1] - rule.z[j]);
    const double down = (F[j] - F[j - 1]) / (rule.z[j] - rule.z[j - 1]);
    if (!(2 * (up - down) < rule.z[j + 1] - rule.z[j - 1])) return false;
  }
  return true;
}

// ratio_ becomes log of exp(g) / N(mu, s^2) at the points, but for the constant log s that is added where it
// is used.
FamilyConditioning::Fit FamilyConditioning::examine(const Families& prior, const HermiteRule& rule,
                                                    Active& active, std::span<const double> F, int pass) {
  const std::size_t n = rule.size();
  const double mu = active.mu, s = active.s;
  double largest = -infinity;
  for (std::size_t j = 0; j < n; ++j) {
    if (!std::isfinite(F[j])) return Fit::hard;
    const double z = mu + s * rule.z[j];
    ratio_[j] = F[j] - z * z / 2 + rule.z[j] * rule.z[j] / 2;
    largest = std::max(largest, ratio_[j]);
    if (bounds_.bounded() && !bounds_.holds(prior.mean[active.family] +
                                            prior.sd[active.family] * prior.shape_of(active.family)(z)))
      return Fit::hard;
  }
  double sum = 0, last = 0, before_last = 0;
  for (std::size_t j = 0; j < n; ++j) {
    const double r = std::exp(ratio_[j] - largest);
    sum += rule.weight[j] * r;
    last += rule.last[j] * r;
    before_last += rule.before_last[j] * r;
  }
  // A single family is fitted to the end, since it may turn out to be conditioned exactly.
  const bool resolved = std::abs(last) <= unresolved * sum && std::abs(before_last) <= unresolved * sum;
  if (resolved && (prior.size() > 1 || pass > 0)) return Fit::accepted;
  if (pass == most_passes || (pass == 0 && !likelihood_.quadratic() && !concave(rule, F))) return Fit::hard;
  // F = .. + b z~ + e (z~^2 - 1)/sqrt 2 + .. in the points z~ of the rule; the next Gaussian has the
  // precision s^2 - sqrt(2) e and the slope b - mu s there.
  double b = 0, e = 0;
  for (std::size_t j = 0; j < n; ++j) {
    b += rule.first[j] * F[j];
    e += rule.second[j] * F[j];
  }
  const double precision = s * s - std::sqrt(2.0) * e;
  if (!(precision > 0)) return Fit::hard;
  active.mu = mu + s * (b - mu * s) / precision;
  active.s = s / std::sqrt(precision);
  // Beyond the points of N(0, 1), and between them, nothing has been seen of F.
  if (!likelihood_.quadratic() && (std::abs(active.mu) + 2 * active.s > rule.z.back() || active.s < 0.5))
    return Fit::hard;
  return Fit::again;
}

void FamilyConditioning::add_smooth(const Families& prior, const HermiteRule& rule, const Active& active) {
  const std::size_t n = rule.size(), i = active.family;
  const FamilyShape shape = prior.shape_of(i);
  const double m = prior.mean[i], sd = prior.sd[i];
  const double largest = *std::max_element(ratio_.begin(), ratio_.begin() + static_cast<std::ptrdiff_t>(n));
  double sum = 0, mean = 0, second = 0, square = 0, middle = 0, spread = 0;
  for (std::size_t j = 0; j < n; ++j) {
    const double z = active.mu + active.s * rule.z[j], w = rule.weight[j] * std::exp(ratio_[j] - largest);
    part_[j] = shape(z);
    sum += w;
    mean += w * part_[j];
    square += w * z * z;
    middle += rule.weight[j] * ratio_[j];
  }
  mean /= sum;
  for (std::size_t j = 0; j < n; ++j) {
    const double w = rule.weight[j] * std::exp(ratio_[j] - largest);
    second += w * (part_[j] - mean) * (part_[j] - mean);
    spread += rule.weight[j] * (ratio_[j] - middle) * (ratio_[j] - middle);
  }
  const double log_weight = prior.log_weight[i] + std::log(active.s);
  out_->components.add(log_weight + largest + std::log(sum), m + sd * mean, sd * std::sqrt(second / sum));
  out_->law.add_smooth(prior, i, active.mu, active.s, log_weight, rule, {ratio_.data(), n});
  const bool quadratic = shape.gaussian() && (likelihood_.quadratic() || spread <= rounding * rounding);
  out_->quadratic = out_->quadratic && quadratic;
  if (sd > 0) {
    for (std::size_t j = 0; j < n; ++j) {
      out_->points.x.push_back(m + sd * part_[j]);
      out_->points.log_weight.push_back(log_weight + ratio_[j] + rule.log_weight[j]);
    }
  } else {
    out_->points.x.push_back(m);
    out_->points.log_weight.push_back(out_->components.log_weight.back());
  }
  far_.push_back(square / sum);
  outside_.push_back(0);
  divided_.push_back(0);
}

// A family whose Gaussian fit failed. Those of less than e^-60 of the heaviest component are left out.
void FamilyConditioning::condition_hard(const Families& prior, std::size_t points) {
  if (hard_.empty()) return;
  out_->quadratic = false;
  const std::vector<double>& w = out_->components.log_weight;
  double best = w.empty() ? -infinity : *std::max_element(w.begin(), w.end());
  for (const std::size_t i : hard_) {
    const double height = modes_.find(likelihood_, prior, i, bounds_);
    if (height == -infinity || prior.log_weight[i] + height < best - negligible_depth) continue;
    modes_.integrate(points);
    const std::size_t first = out_->components.size();
    double family_weight = -infinity;
    for (const FamilyModes::Part& part : modes_.parts())
      family_weight = log_sum(family_weight, part.log_weight);
    modes_.tabulate(table_z_, table_below_, table_density_);
    out_->law.add_table(prior, i, prior.log_weight[i] + family_weight, table_z_, table_below_,
                        table_density_);
    const bool divided = apart(modes_.parts(), family_weight);
    for (const FamilyModes::Part& part : modes_.parts()) {
      const double log_weight = prior.log_weight[i] + part.log_weight;
      best = std::max(best, log_weight);
      out_->components.add(log_weight, part.mean, std::sqrt(part.variance));
      for (std::size_t k = 0; k < part.x.size(); ++k) {
        out_->points.x.push_back(part.x[k]);
        out_->points.log_weight.push_back(log_weight + std::log(part.share[k]));
      }
      far_.push_back(part.square);
      outside_.push_back(modes_.outside());
      // Counted once for the family.
      divided_.push_back(
          divided && out_->components.size() == first + 1 ? std::exp(family_weight - part.log_weight) : 0.0);
    }
  }
}

void FamilyConditioning::finish(FamilyUpdate& out) {
  const std::vector<double>& w = out.components.log_weight;
  double largest = -infinity, sum = 0;
  for (const double v : w) largest = std::max(largest, v);
  for (std::size_t k = 0; k < w.size(); ++k) {
    const double share = std::exp(w[k] - largest);
    sum += share;
    out.far += share * far_[k];
    out.outside += share * outside_[k];
    out.divided = std::max(out.divided, share * divided_[k]);
  }
  out.far = std::sqrt(out.far / sum);
  out.outside /= sum;
  out.divided /= sum;
}

void FamilyConditioning::condition(const Families& prior, const ObservationWindow& window, double clock,
                                   std::size_t points, FamilyUpdate& out) {
  out.clear();
  out_ = &out;
  far_.clear();
  outside_.clear();
  divided_.clear();
  hard_.clear();
  active_.clear();
  likelihood_.observe(window, clock);
  const HermiteRule& rule = rule_for(prior.size(), points);
  const std::size_t n = rule.size();
  ratio_.resize(n);
  part_.resize(n);
  for (std::size_t i = 0; i < prior.size(); ++i)
    if (prior.log_weight[i] > -infinity) active_.push_back({i, 0, 1});
  for (int pass = 0; !active_.empty(); ++pass) {
    place(prior, rule);
    const std::span<const double> F = likelihood_.evaluate();
    std::size_t kept = 0;
    for (std::size_t a = 0; a < active_.size(); ++a) {
      Active next = active_[a];
      switch (examine(prior, rule, next, F.subspan(a * n, n), pass)) {
        case Fit::accepted:
          add_smooth(prior, rule, active_[a]);
          break;
        case Fit::again:
          active_[kept++] = next;
          break;
        case Fit::hard:
          hard_.push_back(next.family);
          break;
      }
    }
    active_.resize(kept);
  }
  condition_hard(prior, n);
  check_log_weights(out.components.log_weight, window);
  finish(out);
}

}  // namespace wienertree
