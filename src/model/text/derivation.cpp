#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "wienertree/model/text/checked_algebra.hpp"
#include "wienertree/model/text/correlation.hpp"
#include "wienertree/model/text/field_expressions.hpp"
#include "wienertree/model/text/parse_in_place.hpp"
#include "wienertree/model/text/symbolic_size.hpp"

namespace wienertree::text {

namespace {

using GiNaC::ex;
using GiNaC::exvector;
using GiNaC::numeric;

// An upper bound for the number of terms after expansion, at most `limit`.
std::size_t expanded_terms(const ex& e, std::size_t limit) {
  if (GiNaC::is_exactly_a<GiNaC::add>(e)) {
    std::size_t terms = 0;
    for (const ex& term : e) terms = std::min(limit, terms + expanded_terms(term, limit));
    return terms;
  }
  if (GiNaC::is_exactly_a<GiNaC::mul>(e)) {
    std::size_t terms = 1;
    for (const ex& factor : e) terms = std::min(limit, terms * expanded_terms(factor, limit));
    return terms;
  }
  if (!GiNaC::is_exactly_a<GiNaC::power>(e)) return 1;
  const std::size_t base = expanded_terms(e.op(0), limit);
  if (base == 1 || !e.op(1).info(GiNaC::info_flags::posint)) return 1;
  std::size_t terms = 1;
  for (int i = 0; i < GiNaC::ex_to<numeric>(e.op(1)).to_int() && terms < limit; ++i)
    terms = std::min(limit, terms * base);
  return terms;
}

class Derivation {
 public:
  Derivation(const ModelSource& source, const BrownianCorrelation& correlation)
      : source_(source),
        correlation_(correlation),
        symbols_(symbols_of(source)),
        scope_{symbols_, source.parameters.size(), true, false} {}

  SymbolicModel operator()(bool with_brackets,
                           const std::vector<std::pair<std::size_t, std::size_t>>& further) {
    read();
    add_clock();
    derive_fields();
    for (const auto& [i, j] : further) add_field(i, j);
    result_.coefficients.d = d_;
    result_.coefficients.p = p_;
    convert_fields();
    convert_sensor();
    if (with_brackets) derive_brackets();
    return std::move(result_);
  }

 private:
  void read() {
    d_ = source_.states.size();
    p_ = source_.noise_dimension();
    limit_jacobians(d_, p_, source_.states.front().location.text());
    for (const SourceExpression& drift : source_.drift) given_drift_.push_back(parse(drift, scope_));
    diffusion_.assign(p_, exvector(d_));
    for (std::size_t i = 0; i < d_; ++i)
      for (std::size_t j = 0; j < p_; ++j) diffusion_[j][i] = parse(source_.diffusion[i][j], scope_);
    if (!source_.correlation.empty()) make_independent();
    for (const SourceExpression& h : source_.observation.h) sensor_.push_back(parse(h, scope_));
    if (!source_.observation.noise.empty())
      for (std::size_t i = 0; i < sensor_.size(); ++i) {
        const SourceExpression* scale = source_.observation.noise_of(i).scale();
        noise_scale_.push_back(scale != nullptr ? parse(*scale, scope_) : ex(1));
      }
    if (source_.observation.log_likelihood) {
      Scope with_observations = scope_;
      with_observations.observations = true;
      log_likelihood_ = parse(*source_.observation.log_likelihood, with_observations);
    }
  }

  // The entries of R, as expressions of the parameters.
  std::vector<exvector> correlation_entries() {
    Scope numbers = scope_;
    numbers.states = false;
    std::vector<exvector> R(p_, exvector(p_));
    for (std::size_t j = 0; j < p_; ++j)
      for (std::size_t k = 0; k < p_; ++k) R[j][k] = parse(source_.correlation[j][k], numbers);
    return R;
  }

  // L as in correlation.hpp. With more than `most_symbolic` Brownian motions its expressions would grow beyond
  // reading: then its numbers.
  std::vector<exvector> correlation_factor(const std::vector<exvector>& R) const {
    constexpr std::size_t most_symbolic = 3;
    std::vector<exvector> L(p_, exvector(p_)), M = L;
    exvector D(p_);
    for (std::size_t k = 0; k < p_; ++k) {
      if (!correlation_.present[k]) continue;
      if (p_ > most_symbolic) {
        for (std::size_t j = k; j < p_; ++j) {
          const double value =
              correlation_.factor(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(k));
          L[j][k] = exact_number(fmt::format("{:.17g}", std::abs(value))) * (value < 0 ? -1 : 1);
        }
        continue;
      }
      D[k] = 1;
      for (std::size_t m = 0; m < k; ++m) D[k] -= GiNaC::pow(M[k][m], 2) * D[m];
      D[k] = D[k].normal();
      M[k][k] = 1;
      for (std::size_t j = k + 1; j < p_; ++j) {
        M[j][k] = R[j][k];
        for (std::size_t m = 0; m < k; ++m) M[j][k] -= M[j][m] * M[k][m] * D[m];
        M[j][k] = (M[j][k] / D[k]).normal();
      }
      for (std::size_t j = k; j < p_; ++j) L[j][k] = M[j][k] * GiNaC::sqrt(D[k]);
    }
    return L;
  }

  // The fields along independent Brownian motions, V_k = sum_j V^W_j L_jk.
  void make_independent() {
    const SourceExpression& place = source_.correlation[0][0];
    const std::vector<exvector> R = correlation_entries();
    const std::vector<exvector> L = at_place(place, [&] { return correlation_factor(R); });
    std::vector<exvector> independent(p_, exvector(d_));
    for (std::size_t k = 0; k < p_; ++k)
      for (std::size_t i = 0; i < d_; ++i)
        for (std::size_t j = k; j < p_; ++j) independent[k][i] += diffusion_[j][i] * L[j][k];
    diffusion_ = std::move(independent);
    for (std::size_t j = 0; j < p_; ++j) {
      auto& row = result_.coefficients.correlation.emplace_back();
      for (std::size_t k = 0; k < p_; ++k) row.push_back(converted(R[j][k], source_.correlation[j][k]));
    }
  }

  void add_clock() {
    const ex t = symbols_.state(d_);
    bool used = !source_.inputs.empty() || log_likelihood_.has(t);
    for (const ex& e : given_drift_) used = used || e.has(t);
    for (const exvector& V : diffusion_)
      for (const ex& e : V) used = used || e.has(t);
    for (const ex& e : sensor_) used = used || e.has(t);
    for (const ex& e : noise_scale_) used = used || e.has(t);
    result_.coefficients.has_clock = used;
    if (!used) return;
    given_drift_.push_back(1);
    for (exvector& V : diffusion_) V.push_back(0);
    ++d_;
  }

  const SourceExpression& source_of(std::size_t k, std::size_t i) const { return source_.coefficient(k, i); }

  // By the clock also along the inputs, which are functions of it, linear or constant piece by piece.
  ex derivative(const ex& e, std::size_t l, const SourceExpression& place) {
    ex result = budget_.derivative(e, symbols_.state(l), place);
    if (l == source_.states.size())
      for (std::size_t k = 0; k < symbols_.inputs(); ++k)
        if (e.has(symbols_.input(2 * k)))
          result += budget_.derivative(e, symbols_.input(2 * k), place) * symbols_.input(2 * k + 1);
    return result;
  }

  // What derivatives leave often cancels when it is expanded: the shorter of the two forms.
  ex simpler(const ex& e) {
    constexpr std::size_t most_terms = 200;
    if (expanded_terms(e, most_terms) >= most_terms) return e;
    const ex expanded = e.expand();
    Conversion convert(symbols_, *result_.arena);
    return size(convert(expanded)) < size(convert(e)) ? expanded : e;
  }

  void derive_fields() {
    // 1/2 sum_{j,l} V_j^l dV_j^i/dx_l
    exvector correction(d_);
    for (std::size_t i = 0; i < d_; ++i)
      for (std::size_t j = 0; j < p_; ++j)
        for (std::size_t l = 0; l < d_; ++l)
          if (!diffusion_[j][l].is_zero())
            correction[i] += at_place(source_of(j + 1, i), [&]() -> ex {
              return diffusion_[j][l] * derivative(diffusion_[j][i], l, source_of(j + 1, i)) * numeric(1, 2);
            });
    for (std::size_t i = 0; i < d_; ++i)
      correction[i] = at_place(source_of(1, i), [&] { return simpler(correction[i]); });
    const bool ito = source_.convention == Convention::ito;
    exvector stratonovich(d_);
    for (std::size_t i = 0; i < d_; ++i) {
      stratonovich[i] = ito ? given_drift_[i] - correction[i] : given_drift_[i];
      ito_drift_.push_back(ito ? given_drift_[i] : given_drift_[i] + correction[i]);
    }
    V_.push_back(std::move(stratonovich));
    V_.insert(V_.end(), diffusion_.begin(), diffusion_.end());
  }

  void convert_fields() {
    FieldExpressions& c = result_.coefficients;
    for (std::size_t i = 0; i < d_; ++i) c.ito_drift.push_back(converted(ito_drift_[i], source_of(0, i)));
    for (std::size_t k = 0; k <= p_; ++k) {
      std::vector<Expression> V, jacobian;
      for (std::size_t i = 0; i < d_; ++i) V.push_back(converted(V_[k][i], source_of(k, i)));
      for (std::size_t i = 0; i < d_; ++i)
        for (std::size_t l = 0; l < d_; ++l) {
          const bool depends =
              contains(V[i], Role::state, l) || (l == source_.states.size() && contains(V[i], Role::input));
          jacobian.push_back(depends ? converted_derivative(V_[k][i], l, source_of(k, i))
                                     : result_.arena->number(0));
        }
      c.fields.push_back(std::move(V));
      c.jacobians.push_back(std::move(jacobian));
    }
  }

  void convert_sensor() {
    FieldExpressions& c = result_.coefficients;
    for (std::size_t i = 0; i < sensor_.size(); ++i) {
      const SourceExpression& place = source_.observation.h[i];
      c.sensor.push_back(converted(sensor_[i], place));
      exvector gradient;
      for (std::size_t l = 0; l < d_; ++l) {
        gradient.push_back(at_place(place, [&] { return derivative(sensor_[i], l, place); }));
        c.sensor_gradient.push_back(converted(gradient.back(), place));
      }
      for (std::size_t r = 1; r <= p_; ++r) {
        ex along = 0;
        for (std::size_t l = 0; l < d_; ++l) along += V_[r][l] * gradient[l];
        c.sensor_derivative.push_back(converted(at_place(place, [&] { return simpler(along); }), place));
      }
    }
    for (std::size_t i = 0; i < noise_scale_.size(); ++i) {
      const SourceExpression* scale = source_.observation.noise_of(i).scale();
      c.noise_scale.push_back(
          converted(noise_scale_[i], scale != nullptr ? *scale : source_.observation.h[i]));
    }
    if (!source_.observation.log_likelihood) return;
    const SourceExpression& place = *source_.observation.log_likelihood;
    c.log_likelihood = converted(log_likelihood_, place);
    c.observation_components = symbols_.observations();
    if (c.observation_components == 0)
      throw InputError("must depend on the observation, y1, y2, ..", place.location.text());
    for (const Symbols::Entry& entry : symbols_.entries())
      if (entry.name.size() > 1 && entry.name[0] == 'y' &&
          entry.name.find_first_not_of("0123456789", 1) == std::string::npos)
        throw InputError("with `log_likelihood`, y1, y2, .. are the observation; rename this",
                         place.location.text(), entry.name);
  }

  exvector bracket_of(std::size_t i, std::size_t j) {
    exvector components(d_);
    for (std::size_t m = 0; m < d_; ++m)
      components[m] = at_place(source_of(j, m), [&] {
        ex component = 0;
        for (std::size_t l = 0; l < d_; ++l)
          component += V_[i][l] * derivative(V_[j][m], l, source_of(j, m)) -
                       V_[j][l] * derivative(V_[i][m], l, source_of(i, m));
        return simpler(component);
      });
    return components;
  }

  void add_field(std::size_t i, std::size_t j) {
    V_.push_back(bracket_of(i, j));
    ++p_;
  }

  void derive_brackets() {
    for (std::size_t i = 0; i <= p_; ++i)
      for (std::size_t j = i + 1; j <= p_; ++j) {
        Bracket bracket{i, j, {}};
        const exvector components = bracket_of(i, j);
        for (std::size_t m = 0; m < d_; ++m)
          bracket.components.push_back(converted(components[m], source_of(j, m)));
        result_.brackets.push_back(std::move(bracket));
      }
  }

  Expression converted(const ex& e, const SourceExpression& place) {
    return at_place(place, [&] { return Conversion(symbols_, *result_.arena)(e); });
  }
  Expression converted_derivative(const ex& e, std::size_t l, const SourceExpression& place) {
    return converted(at_place(place, [&] { return simpler(derivative(e, l, place)); }), place);
  }

  const ModelSource& source_;
  const BrownianCorrelation& correlation_;
  Symbols symbols_;
  Scope scope_;
  SymbolicBudget budget_;
  std::size_t d_ = 0, p_ = 0;
  exvector given_drift_, ito_drift_, sensor_, noise_scale_;
  std::vector<exvector> diffusion_, V_;  // V_j of the source; V_0 .. V_p in Stratonovich form
  ex log_likelihood_;
  SymbolicModel result_{std::make_shared<Arena>(), {}, {}};
};

}  // namespace

SymbolicModel derive(const ModelSource& source, const std::vector<double>& parameters, bool with_brackets,
                     const std::vector<std::pair<std::size_t, std::size_t>>& further) {
  const BrownianCorrelation correlation = brownian_correlation(source, parameters);
  const std::lock_guard lock(symbolic_mutex());
  return Derivation(source, correlation)(with_brackets, further);
}

}  // namespace wienertree::text
