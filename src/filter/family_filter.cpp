#include "wienertree/filter/family_filter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "wienertree/filter/family_substeps.hpp"
#include "wienertree/filter/places.hpp"
#include "wienertree/tree/tree_size.hpp"

namespace wienertree {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

double normal_below(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

// log_weight -= log of their sum, which is returned.
double normalise(std::vector<double>& log_weight) {
  const double largest = *std::max_element(log_weight.begin(), log_weight.end());
  double sum = 0;
  for (const double w : log_weight) sum += std::exp(w - largest);
  const double log_mass = largest + std::log(sum);
  for (double& w : log_weight) w -= log_mass;
  return log_mass;
}

}  // namespace

FamilyFilter::FamilyFilter(const Model& model, const FilterOptions& options)
    : model_(model),
      options_(options),
      grower_(model_, options_.flow, options_.tolerance, options_.formula, options_.threads),
      thinning_(make_thinning(options.thinning)),
      affine_(model_),
      conditioning_(model_) {
  if (!model_.bounds.empty()) bounds_ = {model_.bounds[0].lower, model_.bounds[0].upper};
  if (model_.has_clock) clock_ = model_.initial.back();
  start();
  check_bounds_at_start();
}

void FamilyFilter::start() {
  families_.clear();
  const double variance = model_.initial_law ? model_.initial_law->covariance(0, 0) : 0;
  if (!(variance >= 0))
    throw InputError("the covariance of the initial law is negative", "model " + model_.name);
  families_.add(0, model_.initial_law ? model_.initial_law->mean(0) : model_.initial[0], std::sqrt(variance));
}

void FamilyFilter::check_bounds_at_start() {
  if (!bounds_.bounded()) return;
  const double m = families_.mean[0], sd = families_.sd[0];
  const double outside =
      sd > 0 ? normal_below((bounds_.lower - m) / sd) + normal_below((m - bounds_.upper) / sd) : 0.0;
  if (outside > 1e-3)
    warn(WarningKind::start_not_represented, time_,
         fmt::format("{:.2g} of the mass of the start lies outside the bounds of {}, and is left out",
                     outside, model_.state_names[0]));
  const std::size_t d = model_.state_dimension();
  Batch x(d, 1), drift(d, 1);
  increments_.assign(1 + model_.noise_dimension(), 0.0);
  increments_[0] = 1;
  for (const double bound : {bounds_.lower, bounds_.upper}) {
    if (!std::isfinite(bound)) continue;
    x(0, 0) = bound;
    if (d > 1) x(1, 0) = clock_;
    model_.fields->direct(x, increments_, drift);
    const double outward = bound == bounds_.lower ? -drift(0, 0) : drift(0, 0);
    if (outward > 0)
      warn(WarningKind::drift_leaves_bound, time_,
           fmt::format(
               "the drift between jumps of the noise (Stratonovich) leads out of the bound {} = {:g}, at the "
               "rate {:.3g}",
               model_.state_names[0], bound, outward));
  }
}

void FamilyFilter::warn(WarningKind kind, double time, std::string text) {
  const auto same = [&](const FilterWarning& w) { return w.kind == kind; };
  if (std::none_of(warnings_.begin(), warnings_.end(), same))
    warnings_.push_back({kind, time, std::move(text)});
}

bool FamilyFilter::observes(const ObservationWindow& window) const {
  return model_.observation == ObservationKind::discrete &&
         std::any_of(window.observation.begin(), window.observation.end(),
                     [](double y) { return !std::isnan(y); });
}

void FamilyFilter::advance(const ObservationWindow& window) {
  const bool observed = observes(window), first = window.at_start || !(window.length() > 0);
  clock_ = model_.clock(window.start);  // t is the time of the observations
  if (observed && first) take_in(window);
  if (window.length() > 0) {
    move(window);
    clock_ = model_.clock(window.end);
    if (observed && !first) take_in(window);
  }
  ++statistics_.steps;
  time_ = window.end;
  stale_ = true;
}

void FamilyFilter::take_in(const ObservationWindow& window) {
  const auto condition = [&] {
    conditioning_.condition(families_, window, clock_, 2 * options_.nodes, update_);
  };
  condition();
  // One Gaussian is conditioned exactly by quadrature; its pieces show the shape of the law that comes out,
  // as long as it lies where they do.
  constexpr double reach = 5;
  if (single_ && !update_.quadratic && families_.sd[0] > 0 && update_.far < reach) {
    split_start();
    condition();
  }
  exact_ = single_;
  single_ = single_ && update_.quadratic && families_.size() == 1 && update_.components.size() == 1;
  log_evidence_ += normalise(update_.components.log_weight);
  normalise(update_.points.log_weight);
  note_update(window);
  std::swap(families_, update_.components);
  std::swap(points_, update_.points);
  std::swap(law_of_families_, update_.law);
  has_points_ = law_is_known_ = true;
}

// N(m, P) = sum_k w_k N(m + sd k/4, P/16), |k| <= 28, w_k proportional to exp(-(k/4)^2 / (2 15/16)): its
// Gaussians are narrow enough for a likelihood that is not quadratic. The sum over k in place of an integral
// changes nothing that a double shows.
void FamilyFilter::split_start() {
  constexpr int most = 28;
  const double m = families_.mean[0], sd = families_.sd[0];
  families_.clear();
  for (int k = -most; k <= most; ++k) {
    const double z = k / 4.0;
    if (bounds_.holds(m + sd * z)) families_.add(-z * z / (2 * 15.0 / 16), m + sd * z, sd / 4);
  }
  if (families_.size() == 0) throw InputError("the start lies outside its bounds", "model " + model_.name);
  normalise(families_.log_weight);
  single_ = false;
}

void FamilyFilter::note_update(const ObservationWindow& window) {
  const double t = window.at_start ? window.start : window.end;
  if (exact_) return;
  if (update_.far * update_.far > 50)
    warn(WarningKind::out_of_reach, t,
         fmt::format(
             "at t = {:g} the observation lies {:.3g} standard deviations from all nodes, where their law is "
             "not known well",
             t, update_.far));
  if (update_.outside > 1e-3)
    warn(WarningKind::at_bound, t,
         fmt::format("at t = {:g} {:.2g} of the mass lay beyond a bound of {}", t, update_.outside,
                     model_.state_names[0]));
  if (update_.divided > 0.5)
    warn(WarningKind::one_family, t,
         fmt::format("at t = {:g} the weights of separate modes come from the tails of a single family that "
                     "has {:.2g} "
                     "of the mass",
                     t, update_.divided));
  double atoms = 0, squares = 0;
  for (std::size_t i = 0; i < update_.components.size(); ++i) {
    if (update_.components.sd[i] > 0) continue;
    const double w = std::exp(update_.components.log_weight[i]);
    atoms += w;
    squares += w * w;
  }
  if (atoms > 0.5 && atoms * atoms < 5 * squares)
    warn(WarningKind::few_atoms, t,
         fmt::format("at t = {:g} the law is carried by {:.2g} effective nodes", t, atoms * atoms / squares));
}

void FamilyFilter::move(const ObservationWindow& window) {
  law_is_known_ = false;
  if (single_ && carry(window.length())) return;
  lay_points(window);
  if (!move_by_transition(window)) move_by_tree(window);
}

// One exact family by its moments, where drift and diffusion are affine and constant as far as it reaches.
bool FamilyFilter::carry(double length) {
  constexpr double reach = 8;
  const double m = families_.mean[0], sd = families_.sd[0];
  double low = m - reach * sd, high = m + reach * sd;
  if (!(high > low)) {
    low = m - 1;
    high = m + 1;
  }
  // As far as it has spread, the second time.
  for (int pass = 0; pass < 3; ++pass) {
    const auto moved = affine_.transition(clock_, length, low, high);
    if (!moved) return false;
    const double mean = moved->F * m + moved->f, spread = std::hypot(moved->F * sd, std::sqrt(moved->Q));
    if (pass == 2 || (mean - reach * spread >= low && mean + reach * spread <= high)) {
      families_.mean[0] = mean;
      families_.sd[0] = spread;
      has_points_ = false;
      return true;
    }
    low = std::min(low, mean - reach * spread);
    high = std::max(high, mean + reach * spread);
  }
  return false;
}

// law_ becomes the points of the law.
void FamilyFilter::lay_points(const ObservationWindow& window) {
  if (!has_points_ && families_.sd[0] == 0 && families_.size() == 1) {
    points_ = {families_.mean, families_.log_weight};
  } else if (!has_points_) {
    if (single_) split_start();
    ObservationWindow unobserved = window;
    unobserved.observation.clear();
    conditioning_.condition(families_, unobserved, clock_, 2 * options_.nodes, update_);
    std::swap(points_, update_.points);
    normalise(points_.log_weight);
  }
  single_ = exact_ = false;
  has_points_ = false;
  Generation& g = law_;
  g.time = window.start;
  g.states.reshape(model_.state_dimension(), points_.size());
  std::copy(points_.x.begin(), points_.x.end(), g.states.component(0).begin());
  for (std::size_t i = 1; i < g.states.components(); ++i)
    std::fill(g.states.component(i).begin(), g.states.component(i).end(), clock_);
  g.log_weight.assign(points_.log_weight.begin(), points_.log_weight.end());
  g.log_likelihood.clear();
  g.parent.clear();
  g.branch.clear();
  g.count.clear();
}

// nodes_ become `from`, thinned for families that will spread over the time `left`.
void FamilyFilter::thin(const ObservationWindow& window, const Generation& from, std::size_t parents,
                        double left) {
  if (from.size() <= options_.nodes) {
    copy_generation(from, nodes_);
    return;
  }
  if (recombines(options_.thinning.method) && options_.thinning.recombination_degree == 0 &&
      !options_.thinning.own) {
    local_spread(from, left);
    overlap_.thin(from, spread_, options_.nodes, nodes_);
    return;
  }
  const Sites sites{from.states, from.log_weight, parents, &grower_.threads()};
  const RandomStream random{options_.seed, options_.launch, ++thinnings_, Purpose::thinning};
  try {
    thinning_->thin(sites, options_.nodes, random, selection_);
  } catch (const RunError& e) {
    throw RunError(e.message(), place(window), e.value());
  }
  select(from, selection_, nodes_, &grower_.threads());
  statistics_.discarded += selection_.discarded;
}

// spread_ becomes |sigma(x)| sqrt(time) for every node.
void FamilyFilter::local_spread(const Generation& nodes, double time) {
  const std::size_t d = model_.state_dimension(), p = model_.noise_dimension(), N = nodes.size();
  diffusion_.reshape(d * p, N);
  model_.fields->diffusion(nodes.states, diffusion_);
  spread_.assign(N, 0.0);
  for (std::size_t j = 0; j < p; ++j)
    for (std::size_t n = 0; n < N; ++n) spread_[n] += diffusion_(j, n) * diffusion_(j, n) * time;
  for (double& s : spread_) s = std::sqrt(s);
}

// Where the transition is Gaussian from every node.
bool FamilyFilter::move_by_transition(const ObservationWindow& window) {
  constexpr double reach = 8;
  const std::span<const double> all = law_.states.component(0);
  const auto [least, most] = std::minmax_element(all.begin(), all.end());
  double low = *least, high = *most;
  for (int pass = 0; pass < 3; ++pass) {
    if (!(high > low)) {
      low -= 1;
      high += 1;
    }
    const auto moved = affine_.transition(clock_, window.length(), low, high);
    if (!moved) return false;
    const double sd = std::sqrt(moved->Q),
                 ends[] = {moved->F * *least + moved->f, moved->F * *most + moved->f};
    const double to_low = std::min(ends[0], ends[1]) - reach * sd,
                 to_high = std::max(ends[0], ends[1]) + reach * sd;
    if (pass == 2 || (to_low >= low && to_high <= high)) {
      thin(window, law_, 0, window.length());
      const std::span<const double> x = nodes_.states.component(0);
      families_.clear();
      for (std::size_t n = 0; n < x.size(); ++n)
        families_.add(nodes_.log_weight[n], moved->F * x[n] + moved->f, sd);
      return true;
    }
    low = std::min(low, to_low);
    high = std::max(high, to_high);
  }
  return false;
}

void FamilyFilter::move_by_tree(const ObservationWindow& window) {
  constexpr double most_steps = 2000;
  const double gap = window.length();
  thin(window, law_, 0, gap);
  const double rate = relaxation_rate();
  double longest = rate > 0 ? tolerance() / rate : infinity;
  if (gap / longest > most_steps) {
    longest = gap / most_steps;
    if (longest * rate > 0.5)
      warn(WarningKind::step_exceeds_relaxation, window.end,
           fmt::format("at t = {:g} a step of {:.3g} is longer than half the relaxation time {:.3g}",
                       window.end, longest, 1 / rate));
  }
  const double last = choose_last_step(window, longest);
  if (last >= gap) return;
  graded_steps(gap, last, grading_ratio(options_.formula.degree), longest, steps_);
  double left = gap;
  for (std::size_t k = 0; k < steps_.size(); ++k) {
    if (k > 0) thin(window, children_, nodes_.size(), left);
    grow(window, steps_[k]);
    left -= steps_[k];
  }
  families_of(nodes_, children_, options_.formula, families_);
}

// Root mean square of |dV_0/dx| over the nodes.
double FamilyFilter::relaxation_rate() {
  const std::size_t d = model_.state_dimension(), N = nodes_.size();
  jacobian_.reshape(d * d, N);
  increments_.assign(1 + model_.noise_dimension(), 0.0);
  increments_[0] = 1;
  model_.fields->jacobian(nodes_.states, increments_, jacobian_);
  const double largest = *std::max_element(nodes_.log_weight.begin(), nodes_.log_weight.end());
  double mass = 0, sum = 0;
  for (std::size_t n = 0; n < N; ++n) {
    const double w = std::exp(nodes_.log_weight[n] - largest), slope = jacobian_(0, n);
    if (!std::isfinite(slope)) continue;
    mass += w;
    sum += w * slope * slope;
  }
  return mass > 0 ? std::sqrt(sum / mass) : 0;
}

void FamilyFilter::grow(const ObservationWindow& window, double step) {
  grower_.grow(nodes_, step, children_, failures_);
  statistics_.children += children_.size();
  statistics_.flow = flow_before_;
  statistics_.flow += grower_.statistics();
  if (failures_.empty()) return;
  if (options_.on_node_failure == OnNodeFailure::stop || failures_.size() == children_.size())
    throw_node_failure(failures_, model_, place(window));
  for (const NodeFailure& f : failures_) children_.log_weight[f.node] = -infinity;
  statistics_.dropped_nodes += failures_.size();
  failures_.clear();
}

// Steps are halved until the families from the present nodes are Gaussian to the tolerance. The step at which
// they just are is interpolated, so that it changes continuously with the law. Where it is the whole gap,
// families_ and children_ are those of this step.
double FamilyFilter::choose_last_step(const ObservationWindow& window, double longest) {
  constexpr int most_halvings = 6;
  double step = std::min(window.length(), longest), before = 0;
  for (int k = 0;; ++k, step /= 2) {
    grow(window, step);
    const double excess = families_of(nodes_, children_, options_.formula, families_) / tolerance();
    if (excess <= 1) {
      if (k == 0) return step;
      return step * std::exp2(-std::log(excess) / std::log(before / excess));
    }
    if (k == most_halvings) return step;
    before = excess;
  }
}

const Posterior& FamilyFilter::posterior() {
  posterior_.time = time_;
  posterior_.log_evidence = log_evidence_;
  if (!stale_) return posterior_;
  stale_ = false;
  const std::size_t d = model_.state_dimension(), N = families_.size();
  const bool points =
      std::all_of(families_.sd.begin(), families_.sd.end(), [](double sd) { return sd == 0; });
  posterior_points_.reshape(d, N);
  posterior_covariance_.reshape(points ? 0 : d * d, N);
  posterior_weight_.resize(N);
  for (std::size_t i = 1; i < d; ++i)
    std::fill(posterior_points_.component(i).begin(), posterior_points_.component(i).end(), clock_);
  for (std::size_t i = 0; i < posterior_covariance_.components(); ++i)
    std::fill(posterior_covariance_.component(i).begin(), posterior_covariance_.component(i).end(), 0.0);
  for (std::size_t n = 0; n < N; ++n) {
    posterior_weight_[n] = std::exp(families_.log_weight[n]);
    posterior_points_(0, n) = families_.mean[n];
    if (!points) posterior_covariance_(0, n) = families_.sd[n] * families_.sd[n];
  }
  posterior_.points = posterior_points_;
  posterior_.covariance = posterior_covariance_;
  posterior_.weight = posterior_weight_;
  posterior_.law = nullptr;
  if (!points) {
    if (!law_is_known_) law_of_families_.set(families_);
    law_of_families_.normalise(bounds_);
    posterior_.law = &law_of_families_;
  }
  posterior_.parents = 0;
  posterior_.kept = std::min(options_.nodes, single_ ? std::size_t{1} : std::max(N, points_.size()));
  return posterior_;
}

void FamilyFilter::exchange_state(StateArchive& archive) {
  archive(families_, single_, exact_, has_points_, points_.x, points_.log_weight, log_evidence_, time_,
          clock_, thinnings_, law_is_known_, law_of_families_);
  StateArchive::require(families_.size() > 0 && points_.x.size() == points_.log_weight.size() &&
                        (!has_points_ || points_.size() > 0) && (!single_ || families_.size() == 1) &&
                        (!law_is_known_ || law_of_families_.size() > 0));
  if (!archive.reading()) return;
  flow_before_ = statistics_.flow;
  stale_ = true;
}

}  // namespace wienertree
