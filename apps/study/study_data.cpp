#include "study_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "../run_files.hpp"
#include "wienertree/filter/simulate.hpp"
#include "wienertree/numeric/memory.hpp"
#include "wienertree/run/window_source.hpp"
#include "wienertree/study/wasserstein.hpp"

namespace wienertree::app {
namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN();

// What must be the same for two cells to have the same observations.
std::string observation_key(const Study& study, const StudyCell& cell) {
  if (study.observations.file) return *study.observations.file;
  if (study.observations.model) return *study.observations.model;
  CellOptions model;
  for (const auto& option : cell.options)
    if (option.first == "model" || option.first.starts_with("set.")) model.push_back(option);
  return words_of(model);
}

// What must be the same for two cells to have the same truth: of a weak approximation, the problem.
CellOptions weak_problem_options(const CellOptions& options) {
  CellOptions problem;
  for (const auto& option : options)
    for (const char* name : {"model", "payoff", "horizon", "average", "integral", "discount"})
      if (option.first == name) problem.push_back(option);
  for (const auto& option : options)
    if (option.first.starts_with("set.")) problem.push_back(option);
  return problem;
}

std::string truth_key(const StudyCell& cell) {
  return cell.filter ? cell.filter->problem : words_of(weak_problem_options(cell.options));
}

FilterCell reference_filter(const Study& study, const StudyCell& cell, ModelShelf& models) {
  CellOptions options;
  for (const auto& option : cell.options)
    if (option.first == "model" || option.first == "until" || option.first.starts_with("set."))
      options.push_back(option);
  if (study.reference.kind == StudyReference::Kind::exact) {
    const std::optional<FilterMethod> exact = exact_method(*cell.filter->model);
    if (!exact)
      throw InputError("no exact filter is known for this model", study.reference.where,
                       cell.filter->model->name);
    options.emplace_back("method", method_name(*exact));
  }
  return parse_filter_cell(with(options, study.reference.options), models, study.reference.where);
}

double constant_of(const TextModel& model, const std::string& expression, const std::string& where) {
  const std::optional<double> value = model.constant(expression, where);
  if (!value) throw InputError("must not contain a state: it is a number", where, expression);
  return *value;
}

}  // namespace

Quantity parse_quantity(const std::string& name, const Model& model) {
  using enum Quantity::Kind;
  if (name == "log_evidence") return {log_evidence, 0, 0};
  if (name == "log_bayes_factor") return {log_bayes_factor, 0, 0};
  if (name == "variance") return {variance, 0, 0};
  const std::size_t underscore = name.find('_');
  const std::string what = name.substr(0, underscore),
                    state = underscore == std::string::npos ? "" : name.substr(underscore + 1);
  Quantity quantity;
  const auto end = model.state_names.begin() + static_cast<std::ptrdiff_t>(model.reported_dimension());
  const auto at = std::find(model.state_names.begin(), end, state);
  if (what == "sd")
    quantity.kind = sd;
  else if (what == "wasserstein")
    quantity.kind = wasserstein;
  else if (what.size() == 2 && what[0] == 'm' && what[1] >= '2' && what[1] <= '9')
    quantity = {moment, 0, what[1] - '0'};
  else if (what != "mean")
    throw InputError(
        "must be mean_, sd_, m2_ .. m9_ or wasserstein_ with the name of a state, log_evidence, "
        "log_bayes_factor or "
        "variance",
        "quantity", name);
  if (at == end) throw InputError("the model " + model.name + " has no state of this name", "quantity", name);
  quantity.component = static_cast<std::size_t>(at - model.state_names.begin());
  return quantity;
}

KeptPosterior::KeptPosterior(const Posterior& p)
    : scalars_(p),
      points_(p.points.components(), p.points.nodes()),
      covariance_(p.covariance.components(), p.covariance.components() == 0 ? 0 : p.covariance.nodes()),
      weight_(p.weight.begin(), p.weight.end()) {
  for (std::size_t i = 0; i < points_.components(); ++i)
    std::copy(p.points.component(i).begin(), p.points.component(i).end(), points_.component(i).begin());
  for (std::size_t i = 0; i < covariance_.components(); ++i)
    std::copy(p.covariance.component(i).begin(), p.covariance.component(i).end(),
              covariance_.component(i).begin());
}

Posterior KeptPosterior::view() const {
  Posterior posterior = scalars_;
  posterior.points = points_;
  posterior.weight = weight_;
  posterior.covariance = covariance_;
  return posterior;
}

void run_until(Filter& filter, const ObservationWindows& windows, std::optional<double> until) {
  ObservationWindow window;
  for (std::size_t j = 0; j < windows.size(); ++j) {
    // 1e-9 relative: a step that ends at the asked time up to rounding.
    if (until && windows.time(j) > *until + 1e-9 * std::fabs(*until)) return;
    windows.get(j, window);
    window.step = j + 1;
    filter.advance(window);
  }
}

double quantity_of(const Quantity& quantity, Filter& filter, const KeptPosterior* truth) {
  using enum Quantity::Kind;
  const Posterior& posterior = filter.posterior();
  const std::optional<LikelihoodRatio> ratio = filter.likelihood_ratio();
  switch (quantity.kind) {
    case mean:
      return wienertree::mean(posterior, quantity.component);
    case sd:
      return std::sqrt(std::max(0.0, covariance(posterior, quantity.component, quantity.component)));
    case moment:
      return raw_moment(posterior, quantity.component, quantity.order);
    case wasserstein:
      return truth == nullptr ? none : wienertree::wasserstein(posterior, truth->view(), quantity.component);
    case log_evidence:
      return posterior.log_evidence;
    case log_bayes_factor:
      return ratio ? ratio->log_mean : none;
    case variance:
      return ratio ? std::exp(ratio->log_variance) : none;
  }
  return none;
}

struct StudyData::Path {
  std::once_flag made;
  ObservationPath path;
};

struct StudyData::Truth {
  std::once_flag made;
  StudyTruth truth;
};

struct StudyData::Problem {
  std::optional<FilterCell> reference;
  std::optional<WeakCell> weak_reference;
  std::optional<double> value;
  std::vector<Quantity> quantities;
  std::vector<std::unique_ptr<Truth>> truths;  ///< one a path
};

StudyData::StudyData(const Study& study, const std::vector<StudyCell>& cells, ModelShelf& models)
    : study_(study) {
  using enum StudyReference::Kind;
  if (!study.weak && !study.observations.file) paths_ = study.observations.paths;
  if (!study.weak && study.observations.file) note_input("observations", observation_file(study));
  for (const StudyCell& cell : cells) {
    if (cell.filter) {
      const std::string key = observation_key(study, cell);
      if (!records_.contains(key)) {
        if (!study.observations.file)
          require_memory(sizeof(double) * static_cast<double>(study.observations.keep) *
                             static_cast<double>(paths_ * (1 + cell.filter->model->observation_dimension())),
                         fmt::format("{} simulated records of {} rows", paths_, study.observations.keep),
                         "observations");
        for (std::size_t p = 0; p < paths_; ++p) records_[key].push_back(std::make_unique<Path>());
        simulated_[key] = study.observations.model ? models.get(models.file_of(*study.observations.model), {})
                                                   : cell.filter->model;
      }
    }
    const std::string key = truth_key(cell);
    if (problems_.contains(key)) continue;
    auto problem = std::make_unique<Problem>();
    for (std::size_t p = 0; p < paths_; ++p) problem->truths.push_back(std::make_unique<Truth>());
    if (cell.filter) {
      for (const std::string& name : study.quantities)
        problem->quantities.push_back(parse_quantity(name, *cell.filter->model));
      if (study.reference.kind == exact || study.reference.kind == run)
        problem->reference = reference_filter(study, cell, models);
      if (study.reference.kind == expression) {
        const TextModel text = TextModel::load(cell.filter->model_file, cell.filter->parameters);
        problem->value = constant_of(text, study.reference.expression, study.reference.where);
      }
    } else {
      const std::vector<std::string> known = {"value", "extrapolated"};
      for (const std::string& name : study.quantities) choose("quantity", name, known);
      if (study.reference.kind == exact)
        throw InputError("weak approximation knows no exact answer: give a number, an expression or a run",
                         study.reference.where);
      if (study.reference.kind == run)
        problem->weak_reference = parse_weak_cell(
            with(weak_problem_options(cell.options), study.reference.options), models, study.reference.where);
      if (study.reference.kind == expression) {
        std::string text = study.reference.expression;
        const std::string payoff = option_of(cell.options, "payoff");
        for (const auto& [of, value] : study.reference.by_payoff)
          if (of == payoff) text = value;
        if (text.empty()) throw InputError("no reference for this payoff", study.reference.where, payoff);
        problem->value = constant_of(cell.weak->problem.source, text, study.reference.where);
      }
    }
    problems_[key] = std::move(problem);
  }
  for (const StudyCell& cell : cells)
    if (cell.filter && cell.filter->until) require_inside_record(cell, *cell.filter->until);
}

// A time that the record does not reach would stand for another in the tables.
void StudyData::require_inside_record(const StudyCell& cell, double until) {
  const bool simulated = !study_.observations.file.has_value();
  const double first = simulated ? 0 : observations(cell, 0).times.front(),
               last = simulated ? study_.observations.horizon : observations(cell, 0).times.back();
  const double slack = 1e-9 * std::max(std::fabs(first), std::fabs(last));
  if (until > first - slack && until < last + slack) return;
  throw InputError(fmt::format("must lie within the record, {:g} .. {:g}", first, last),
                   study_.series[cell.series].where + ", until", fmt::format("{:g}", until));
}

StudyData::~StudyData() = default;

std::string observation_file(const Study& study) {
  const std::string& file = *study.observations.file;
  return file.starts_with("/") || study.directory.empty() ? file : study.directory + "/" + file;
}

StudyData::Reference StudyData::reference(const StudyCell& cell) const {
  const Problem& problem = *problems_.at(truth_key(cell));
  return {problem.reference ? &*problem.reference : nullptr,
          problem.weak_reference ? &*problem.weak_reference : nullptr, problem.value};
}

const std::vector<Quantity>& StudyData::quantities(const StudyCell& cell) const {
  return problems_.at(truth_key(cell))->quantities;
}

const ObservationPath& StudyData::observations(const StudyCell& cell, std::size_t number) {
  const std::string key = observation_key(study_, cell);
  Path& path = *records_.at(key)[number];
  std::call_once(path.made, [&] {
    const StudyObservations& o = study_.observations;
    const Model& model = *simulated_.at(key);
    if (o.file) {
      path.path =
          read_observations(observation_file(study_), model.observation_dimension(), model.observation);
    } else {
      path.path = simulate(model, o.horizon, o.steps, o.keep, o.seed, static_cast<std::uint32_t>(number))
                      .observations;
    }
  });
  return path.path;
}

ObservationWindows StudyData::windows(const FilterCell& cell, const ObservationPath& path) const {
  const ObservationKind kind = cell.model->observation;
  return {path, kind, cell.model->timing,
          steps_in_force(cell.setup, cell.steps).value_or(default_steps(path, kind))};
}

StudyTruth StudyData::filter_truth(const StudyCell& cell, std::size_t path) {
  const Problem& problem = *problems_.at(truth_key(cell));
  StudyTruth truth{std::vector<double>(problem.quantities.size(), problem.value.value_or(none)), {}};
  if (!problem.reference) return truth;
  const FilterCell& reference = *problem.reference;
  const ObservationPath& record = observations(cell, path);
  const auto filter = make_filter(*reference.model, reference.setup.options);
  // Exact filters take every row.
  const ObservationWindows windows =
      study_.reference.kind == StudyReference::Kind::exact
          ? ObservationWindows(record, reference.model->observation, reference.model->timing, 0)
          : this->windows(reference, record);
  run_until(*filter, windows, reference.until);
  truth.posterior.emplace(filter->posterior());
  for (std::size_t q = 0; q < problem.quantities.size(); ++q)
    truth.values[q] = problem.quantities[q].kind == Quantity::Kind::wasserstein
                          ? 0
                          : quantity_of(problem.quantities[q], *filter, nullptr);
  return truth;
}

StudyTruth StudyData::weak_truth(const StudyCell& cell) {
  const Problem& problem = *problems_.at(truth_key(cell));
  StudyTruth truth{std::vector<double>(study_.quantities.size(), problem.value.value_or(none)), {}};
  if (!problem.weak_reference) return truth;
  const WeakOutcome outcome = run_weak_cell(*problem.weak_reference, 0);
  const double extrapolated = number_named(outcome.rows.front(), "extrapolated");
  truth.values.assign(study_.quantities.size(),
                      std::isnan(extrapolated) ? number_named(outcome.rows.front(), "value") : extrapolated);
  return truth;
}

const StudyTruth& StudyData::truth(const StudyCell& cell, std::size_t path) {
  Truth& truth = *problems_.at(truth_key(cell))->truths[path];
  std::call_once(truth.made,
                 [&] { truth.truth = cell.filter ? filter_truth(cell, path) : weak_truth(cell); });
  return truth.truth;
}

}  // namespace wienertree::app
