#include "wienertree/model/text/assembly.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "wienertree/model/observation_density.hpp"
#include "wienertree/model/text/bounded_states.hpp"
#include "wienertree/model/text/text_fields.hpp"

namespace wienertree::text {

namespace {

using Eigen::Index;

class Assembly {
 public:
  Assembly(const ModelSource& source, const FieldExpressions& bound, const std::vector<double>& parameters,
           std::shared_ptr<const InputFunctions> inputs)
      : source_(source), bound_(bound), parameters_(parameters) {
    model_.inputs = std::move(inputs);
  }

  Model operator()() {
    model_.name = source_.name;
    for (std::size_t i = 0; i < parameters_.size(); ++i)
      model_.parameters.emplace_back(source_.parameters[i].name, parameters_[i]);
    for (const StateSource& state : source_.states) add_state(state);
    model_.has_clock = bound_.has_clock;
    if (model_.has_clock) {
      model_.state_names.emplace_back("t");
      model_.bounds.emplace_back();
    }
    add_initial();
    model_.fields = std::make_shared<TextFields>(bound_, model_.bounds, model_.inputs);
    if (!model_.inputs || model_.inputs->known()) check_start();
    add_observation();
    return std::move(model_);
  }

 private:
  double value(const SourceExpression& expression) const {
    return constant_value(expression, source_, parameters_);
  }

  void add_state(const StateSource& state) {
    StateBound bound;
    bound.boundary = state.boundary;
    if (state.lower) bound.lower = value(*state.lower);
    if (state.upper) bound.upper = value(*state.upper);
    if (!(bound.lower < bound.upper))
      throw InputError("`lower` must be below `upper`", state.location.text(),
                       fmt::format("lower = {}, upper = {}", bound.lower, bound.upper));
    model_.state_names.push_back(state.name);
    model_.bounds.push_back(bound);
  }

  double start_value(const SourceExpression& expression, std::size_t i) const {
    const double x = value(expression);
    const StateBound& bound = model_.bounds[i];
    if (x < bound.lower || x > bound.upper)
      throw InputError(fmt::format("the start lies outside the bounds [{}, {}]", bound.lower, bound.upper),
                       expression.location.text(), fmt::format("{}", x));
    return x;
  }

  void add_initial() {
    const std::size_t d = source_.states.size();
    std::vector<double> start;
    for (std::size_t i = 0; i < d; ++i) {
      const auto& initial = source_.states[i].initial;
      const bool has_mean = source_.initial && !source_.initial->mean.empty();
      start.push_back(start_value(has_mean ? source_.initial->mean[i] : *initial, i));
      if (has_mean && initial && start_value(*initial, i) != start.back())
        throw InputError("the start is given twice, and differently in [initial]", initial->location.text(),
                         fmt::format("{} and {}", start_value(*initial, i), start.back()));
    }
    if (model_.has_clock) start.push_back(model_.inputs ? model_.clock(model_.inputs->first_time()) : 0);
    model_.initial = std::move(start);
    if (source_.initial) add_law(*source_.initial, d);
  }

  void add_law(const InitialSource& law, std::size_t d) {
    const auto size = static_cast<Index>(model_.initial.size());
    InitialLaw result{Eigen::Map<const Eigen::VectorXd>(model_.initial.data(), size),
                      Eigen::MatrixXd::Zero(size, size)};
    for (std::size_t i = 0; i < d; ++i)
      for (std::size_t l = 0; l < d; ++l) {
        double& entry = result.covariance(static_cast<Index>(i), static_cast<Index>(l));
        entry = value(law.covariance[i][l]);
        const double other = result.covariance(static_cast<Index>(l), static_cast<Index>(i));
        if (l < i && entry != other)
          throw InputError("the covariance is not symmetric", law.covariance[i][l].location.text(),
                           fmt::format("{} and {}", entry, other));
      }
    // Rounding moves an eigenvalue by about d eps times the largest; more than 100 times that is no rounding.
    const Eigen::VectorXd eigenvalues =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(result.covariance, Eigen::EigenvaluesOnly)
            .eigenvalues();
    const double tolerance = 2e-14 * static_cast<double>(d) * eigenvalues.cwiseAbs().maxCoeff();
    if (eigenvalues.minCoeff() < -tolerance)
      throw InputError("the covariance has a negative eigenvalue", law.location.text() + ".covariance",
                       fmt::format("{}", eigenvalues.minCoeff()));
    model_.initial_law = std::move(result);
  }

  // Every coefficient must have a value at the start.
  void check_start() const {
    Batch x(bound_.d, 1), V(bound_.d, 1), h(bound_.sensor.size(), 1);
    for (std::size_t i = 0; i < bound_.d; ++i) x(i, 0) = model_.initial[i];
    std::vector<double> D(1 + bound_.p, 0.0);
    for (std::size_t j = 1; j <= bound_.p + 1; ++j) {  // V_0 last: it inherits what the others have
      const std::size_t k = j % (bound_.p + 1);
      D[k] = 1;
      model_.fields->direct(x, D, V);
      D[k] = 0;
      for (std::size_t i = 0; i < source_.states.size(); ++i)
        require_finite(V(i, 0), source_.coefficient(k, i));
    }
    model_.fields->ito_drift(x, V);
    for (std::size_t i = 0; i < source_.states.size(); ++i) require_finite(V(i, 0), source_.drift[i]);
    model_.fields->sensor(x, h);
    for (std::size_t i = 0; i < h.components(); ++i) require_finite(h(i, 0), source_.observation.h[i]);
  }

  static void require_finite(double value, const SourceExpression& place) {
    if (!std::isfinite(value))
      throw InputError("not finite at the start (this or the Ito-Stratonovich correction)",
                       place.location.text(), std::isnan(value) ? "nan" : fmt::format("{}", value));
  }

  void add_observation() {
    const ObservationSource& observation = source_.observation;
    model_.observation = observation.kind;
    model_.timing = observation.timing;
    if (observation.kind != ObservationKind::discrete) return;
    if (bound_.log_likelihood) {
      const std::size_t columns = model_.inputs ? model_.inputs->columns() : 0;
      TapeBuilder builder(bound_.d + columns, bound_.observation_components);
      const BoundedStates states(model_.bounds, builder, model_.inputs.get(), bound_.d);
      TapeSymbols symbols = states.symbols();
      for (std::size_t i = 0; i < bound_.observation_components; ++i)
        symbols.observations.push_back(builder.uniform(i));
      const TapeBuilder::Value output = emit(*bound_.log_likelihood, symbols, builder, ZeroLogZero::zero);
      model_.density = make_tape_density(builder.finish(std::span(&output, 1)),
                                         observation.log_likelihood->location.text(), model_.inputs);
      return;
    }
    const bool varies = std::any_of(bound_.noise_scale.begin(), bound_.noise_scale.end(),
                                    [](Expression s) { return !s->is_number(); });
    std::vector<NoiseLaw> laws;
    for (std::size_t i = 0; i < bound_.sensor.size(); ++i)
      laws.push_back(law_of(observation.noise_of(i), varies));
    model_.density = varies ? make_scaled_noise(model_.fields, std::move(laws), noise_scales(),
                                                observation.noise[0].location.text(), model_.inputs)
                            : make_additive_noise(model_.fields, std::move(laws));
  }

  // The scales of the noise as functions of the states; at the start they must be positive.
  Tape noise_scales() const {
    const std::size_t columns = model_.inputs ? model_.inputs->columns() : 0;
    TapeBuilder builder(bound_.d + columns, 0);
    const BoundedStates states(model_.bounds, builder, model_.inputs.get(), bound_.d);
    std::vector<TapeBuilder::Value> outputs;
    for (Expression scale : bound_.noise_scale) outputs.push_back(emit(scale, states.symbols(), builder));
    Tape tape = builder.finish(outputs);
    if (model_.inputs && !model_.inputs->known()) return tape;
    std::vector<const double*> at;
    std::vector<double> scale(outputs.size());
    std::vector<double*> to;
    for (const double& x : model_.initial) at.push_back(&x);
    if (model_.inputs) model_.inputs->append({&model_.initial.back(), 1}, at);
    for (double& s : scale) to.push_back(&s);
    tape.evaluate(at, {}, to, 1);
    for (std::size_t i = 0; i < scale.size(); ++i)
      if (!(scale[i] > 0) || !std::isfinite(scale[i])) {
        const SourceExpression* place = source_.observation.noise_of(i).scale();
        throw InputError("must be positive, and is not at the start",
                         (place != nullptr ? *place : source_.observation.h[i]).location.text(),
                         std::isnan(scale[i]) ? "nan" : fmt::format("{}", scale[i]));
      }
    return tape;
  }

  // Without the scale where that is a function of the state.
  NoiseLaw law_of(const NoiseSource& noise, bool without_scale) const {
    constexpr std::array kinds{NoiseLaw::Kind::gaussian, NoiseLaw::Kind::laplace, NoiseLaw::Kind::student_t,
                               NoiseLaw::Kind::log_chi_square};
    NoiseLaw law;
    for (std::size_t i = 0; i < noise_laws.size(); ++i)
      if (noise_laws[i].law == noise.law) law.kind = kinds[i];
    for (const NamedExpression& parameter : noise.parameters) {
      if (without_scale && parameter.name != "dof") continue;
      const double x = value(parameter.value);
      if (!(x > 0))
        throw InputError("must be positive", parameter.value.location.text(), fmt::format("{}", x));
      (parameter.name == "dof" ? law.dof : law.scale) = x;
    }
    return law;
  }

  const ModelSource& source_;
  const FieldExpressions& bound_;
  const std::vector<double>& parameters_;
  Model model_;
};

}  // namespace

Model assemble(const ModelSource& source, const FieldExpressions& bound,
               const std::vector<double>& parameters, std::shared_ptr<const InputFunctions> inputs) {
  return Assembly(source, bound, parameters, std::move(inputs))();
}

}  // namespace wienertree::text
