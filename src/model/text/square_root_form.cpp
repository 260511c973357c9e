#include "wienertree/model/text/square_root_form.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "wienertree/model/text/affine_form.hpp"

namespace wienertree::text {

namespace {

using Eigen::Index;
using Component = SquareRootStructure::Component;
using Price = SquareRootStructure::Price;

// Two numbers that are equal but for rounding.
bool same(double a, double b) { return std::abs(a - b) <= 1e-12 * (std::abs(a) + std::abs(b)); }

// coefficient * sqrt(constant + linear x_state), times x_price where `priced`; state = d: the root is of 1.
struct RootTerm {
  double coefficient = 1, constant = 1, linear = 0;
  std::size_t state;
  bool priced = false;
};

// Whether the argument of a root is affine in one state.
bool take_root(Expression argument, std::size_t d, RootTerm& term) {
  const auto form = affine_form(argument, d);
  if (!form || term.state != d) return false;
  for (std::size_t i = 0; i < d; ++i) {
    if (form->linear(static_cast<Index>(i)) == 0) continue;
    if (term.state != d) return false;
    term.state = i;
    term.linear = form->linear(static_cast<Index>(i));
  }
  term.constant = form->constant;
  return term.state != d;
}

bool take_factor(Expression e, std::size_t d, std::size_t price, RootTerm& term) {
  switch (e->kind) {
    case Node::Kind::number:
      term.coefficient *= e->number;
      return true;
    case Node::Kind::symbol:
      if (e->role != Role::state || e->index != price || term.priced) return false;
      return term.priced = true;
    case Node::Kind::power:
      return e->operands[1]->is_number(0.5) && take_root(e->operands[0], d, term);
    case Node::Kind::product:
      return std::all_of(e->operands.begin(), e->operands.end(),
                         [&](Expression factor) { return take_factor(factor, d, price, term); });
    default:
      return false;
  }
}

// The terms of a sum as roots; nothing where one is no such term. `price` = d: no factor x_price.
std::optional<std::vector<RootTerm>> root_terms(Expression e, std::size_t d, std::size_t price) {
  std::vector<RootTerm> terms;
  if (e->is_number(0)) return terms;
  const std::vector<Expression> parts = e->kind == Node::Kind::sum ? e->operands : std::vector<Expression>{e};
  for (Expression part : parts) {
    RootTerm term{1, 1, 0, d, false};
    if (!take_factor(part, d, price, term)) return std::nullopt;
    terms.push_back(term);
  }
  return terms;
}

class Search {
 public:
  Search(const FieldExpressions& bound, const Model& model) : bound_(bound), model_(model) {}

  SquareRootAnswer operator()() {
    if (bound_.has_clock) return {{}, "a coefficient depends on the time t"};
    if (model_.initial_law) return {{}, "the start is random"};
    for (std::size_t i = 0; i < bound_.d; ++i)
      if (is_noisy(i)) add_component(i);
    if (result_.components.empty()) return {{}, "no state is a square-root process"};
    for (std::size_t k = 0; k < directions_.size(); ++k)
      for (std::size_t m = 0; m < k; ++m)
        if (std::abs(directions_[k].dot(directions_[m])) > 1e-12)
          return {{}, "square-root processes are driven by correlated Brownian motions"};
    for (std::size_t i = 0; i < bound_.d; ++i) {
      if (is_component(i)) continue;
      const std::string reason = is_noisy(i) ? add_price(i) : add_integral(i);
      if (!reason.empty()) return {{}, reason};
    }
    return {std::move(result_), {}};
  }

 private:
  const std::string& name(std::size_t i) const { return model_.state_names[i]; }
  bool is_noisy(std::size_t i) const {
    for (std::size_t j = 1; j <= bound_.p; ++j)
      if (!bound_.fields[j][i]->is_number(0)) return true;
    return false;
  }
  bool is_component(std::size_t i) const {
    return std::any_of(result_.components.begin(), result_.components.end(),
                       [i](const Component& c) { return c.state == i; });
  }

  void add_component(std::size_t i) {
    Eigen::VectorXd u = Eigen::VectorXd::Zero(static_cast<Index>(bound_.p));
    std::optional<double> shift;
    for (std::size_t j = 1; j <= bound_.p; ++j) {
      const auto terms = root_terms(bound_.fields[j][i], bound_.d, bound_.d);
      if (!terms) return;
      for (const RootTerm& term : *terms) {
        if (term.state != i || !(term.linear > 0)) return;
        const double here = term.constant / term.linear;
        if (shift && !same(*shift, here)) return;
        shift = here;
        u(static_cast<Index>(j) - 1) += term.coefficient * std::sqrt(term.linear);
      }
    }
    const double c = u.squaredNorm();
    const auto drift = affine_form(bound_.ito_drift[i], bound_.d);
    if (!shift || !(c > 0) || !drift) return;
    for (std::size_t l = 0; l < bound_.d; ++l)
      if (l != i && drift->linear(static_cast<Index>(l)) != 0) return;
    // w = v + shift:  dw = (constant + b (w - shift)) dt
    const double b = drift->linear(static_cast<Index>(i)), a = drift->constant - b * *shift;
    if (!(a >= 0) || !(model_.initial[i] + *shift >= 0)) return;
    result_.components.push_back({i, {a, b, c}, *shift});
    directions_.push_back(u / std::sqrt(c));
  }

  // The component whose root a term is, in units of w; the number of components if none.
  std::size_t component_of(const RootTerm& term) const {
    std::size_t k = 0;
    for (; k < result_.components.size(); ++k) {
      const Component& c = result_.components[k];
      if (c.state == term.state && term.linear > 0 &&
          (term.constant == c.shift * term.linear || same(term.constant, c.shift * term.linear)))
        break;
    }
    return k;
  }

  // constant + sum_k coefficient_k w_k of an affine form, which is to hold no other state.
  bool in_components(const AffineForm& form, double& constant, std::vector<double>& of) const {
    constant = form.constant;
    of.assign(result_.components.size(), 0.0);
    Eigen::VectorXd rest = form.linear;
    for (std::size_t k = 0; k < of.size(); ++k) {
      const auto state = static_cast<Index>(result_.components[k].state);
      of[k] = rest(state);
      constant -= of[k] * result_.components[k].shift;
      rest(state) = 0;
    }
    return rest.isZero(0);
  }

  std::string add_integral(std::size_t i) {
    SquareRootStructure::Integral integral{i, 0, {}};
    const auto drift = affine_form(bound_.ito_drift[i], bound_.d);
    if (!drift || !in_components(*drift, integral.constant, integral.of_component))
      return fmt::format("the drift of {} is not affine in the square-root processes", name(i));
    result_.integrals.push_back(std::move(integral));
    return {};
  }

  std::string add_price(std::size_t i) {
    const std::size_t K = result_.components.size();
    const std::string no_price = fmt::format(
        "{} is neither a square-root process nor a price whose volatility is one's root", name(i));
    if (result_.price)
      return fmt::format("there are two prices, {} and {}", name(result_.price->state), name(i));
    std::vector<Eigen::VectorXd> loading(K, Eigen::VectorXd::Zero(static_cast<Index>(bound_.p)));
    std::optional<bool> priced;
    for (std::size_t j = 1; j <= bound_.p; ++j) {
      const auto terms = root_terms(bound_.fields[j][i], bound_.d, i);
      if (!terms) return no_price;
      for (const RootTerm& term : *terms) {
        const std::size_t k = component_of(term);
        if (k == K || (priced && *priced != term.priced)) return no_price;
        priced = term.priced;
        loading[k](static_cast<Index>(j) - 1) += term.coefficient * std::sqrt(term.linear);
      }
    }
    if (*priced && !(model_.initial[i] > 0))
      return fmt::format("the price {} does not start above 0", name(i));
    Price price{i, !*priced, 0, {}, {}, {}};
    if (std::string reason = set_drift(i, *priced, price); !reason.empty()) return reason;
    std::vector<Eigen::VectorXd> residual;
    for (std::size_t k = 0; k < K; ++k) {
      price.correlated.push_back(loading[k].dot(directions_[k]));
      residual.push_back(loading[k] - price.correlated[k] * directions_[k]);
      // What rounding leaves of a residual is none.
      if (residual[k].norm() < 1e-12 * loading[k].norm()) residual[k].setZero();
      price.independent.push_back(residual[k].squaredNorm());
      if (*priced) price.drift[k] -= loading[k].squaredNorm() / 2;
      for (std::size_t m = 0; m < K; ++m) {
        const double size = loading[k].norm() * (1 + loading[m].norm());
        if (m != k && std::abs(loading[k].dot(directions_[m])) > 1e-12 * size)
          return "the price is correlated with one variance through the volatility of another";
        if (m < k && std::abs(residual[k].dot(residual[m])) > 1e-12 * size) return no_price;
      }
    }
    result_.price = std::move(price);
    return {};
  }

  // Of x = s:  s (rate + sum_k m_k w_k);  of x = log s: the sum alone.
  std::string set_drift(std::size_t i, bool priced, Price& price) const {
    const std::string reason =
        fmt::format("the drift of {} is not {} times an affine function of the variances", name(i),
                    priced ? "the price" : "1");
    if (!priced) {
      const auto form = affine_form(bound_.ito_drift[i], bound_.d);
      return form && in_components(*form, price.rate, price.drift) ? "" : reason;
    }
    price.drift.assign(result_.components.size(), 0.0);
    const Expression e = bound_.ito_drift[i];
    const std::vector<Expression> parts =
        e->kind == Node::Kind::sum ? e->operands : std::vector<Expression>{e};
    for (Expression part : parts) {
      if (part->is_number(0)) continue;
      // Each term is s times an affine rest.
      std::vector<Expression> rest;
      bool has_price = false;
      const std::vector<Expression> factors =
          part->kind == Node::Kind::product ? part->operands : std::vector<Expression>{part};
      for (Expression factor : factors) {
        const bool is_price =
            factor->kind == Node::Kind::symbol && factor->role == Role::state && factor->index == i;
        if (is_price && !has_price)
          has_price = true;
        else
          rest.push_back(factor);
      }
      Arena arena;
      const auto form = affine_form(arena.product(rest), bound_.d);
      double constant = 0;
      std::vector<double> of;
      if (!has_price || !form || !in_components(*form, constant, of)) return reason;
      price.rate += constant;
      for (std::size_t k = 0; k < of.size(); ++k) price.drift[k] += of[k];
    }
    return {};
  }

  const FieldExpressions& bound_;
  const Model& model_;
  SquareRootStructure result_;
  std::vector<Eigen::VectorXd> directions_;  ///< of the components' Brownian motions, unit vectors
};

}  // namespace

std::vector<std::string> described(const SquareRootStructure& structure, const Model& model) {
  std::vector<std::string> lines;
  for (const Component& component : structure.components) {
    const auto& [a, b, c] = component.process;
    std::string w = model.state_names[component.state];
    if (component.shift != 0)
      w = fmt::format("w = {} {} {:g}", w, component.shift < 0 ? "-" : "+", std::abs(component.shift));
    const std::string variable = component.shift != 0 ? "w" : w;
    lines.push_back(fmt::format("{}: d{} = ({:g} {} {:g} {}) dt + sqrt({:g} {}) dB, {} degrees of freedom{}",
                                w, variable, a, b < 0 ? "-" : "+", std::abs(b), variable, c, variable,
                                fmt::format("{:.3g}", 4 * a / c), 2 * a < c ? ", reaches 0" : ""));
  }
  if (structure.price)
    lines.push_back(fmt::format("{} is {} given these", model.state_names[structure.price->state],
                                structure.price->logarithmic ? "normal" : "lognormal"));
  return lines;
}

SquareRootAnswer square_root_structure(const FieldExpressions& bound, const Model& model) {
  return Search(bound, model)();
}

}  // namespace wienertree::text
