#include "wienertree/model/text/smoothing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <unordered_map>

namespace wienertree::text {
namespace {

// P as a polynomial in z^2, lowest degree first.
std::array<double, smoothing_terms - 1> polynomial() {
  std::array<double, smoothing_terms - 1> P{};
  P[0] = 1;
  // He_{n+1} = x He_n - n He_{n-1}, coefficients by power of x.
  constexpr std::size_t size = 2 * smoothing_terms;
  std::array<double, size> before{}, hermite{};
  hermite[0] = 1;
  double scale = 1;
  for (std::size_t n = 0; n + 4 <= size; ++n) {
    if (n % 2 == 0) {
      const auto j = static_cast<double>(n / 2 + 1);
      scale /= -2 * j;
      for (std::size_t power = 0; power <= n; power += 2) P[power / 2] += scale * hermite[power];
    }
    std::array<double, size> next{};
    for (std::size_t power = 0; power + 1 < size; ++power) next[power + 1] = hermite[power];
    for (std::size_t power = 0; power < size; ++power) next[power] -= static_cast<double>(n) * before[power];
    before = hermite;
    hermite = next;
  }
  return P;
}

class Smoothing {
 public:
  explicit Smoothing(Arena& arena) : arena_(arena) {}

  Expression operator()(Expression e) {
    if (const auto found = done_.find(e); found != done_.end()) return found->second;
    const Expression result = rebuilt(e);
    done_.emplace(e, result);
    return result;
  }
  std::vector<Expression> arguments() const { return arguments_; }

 private:
  Expression rebuilt(Expression e) {
    if (e->operands.empty()) return e;
    std::vector<Expression> operands;
    for (Expression operand : e->operands) operands.push_back((*this)(operand));
    switch (e->kind) {
      case Node::Kind::power:
        return arena_.power(operands[0], operands[1]);
      case Node::Kind::product:
        return arena_.product(std::move(operands));
      case Node::Kind::sum:
        return arena_.sum(std::move(operands));
      default:
        break;
    }
    if (e->op == Op::absolute)
      return arena_.sum({times(2, ramp(e->operands[0], operands[0])), times(-1, operands[0])});
    if (e->op == Op::step) return jump(e->operands[0], operands[0]);
    if (e->op == Op::sign)
      return arena_.sum({times(2, jump(e->operands[0], operands[0])), arena_.number(-1)});
    if (e->op != Op::maximum && e->op != Op::minimum) return arena_.function(e->op, std::move(operands));
    const Expression exact = minus(e->operands[0], e->operands[1]), u = minus(operands[0], operands[1]);
    return e->op == Op::maximum ? arena_.sum({operands[1], ramp(exact, u)})
                                : arena_.sum({operands[0], times(-1, ramp(exact, u))});
  }

  Expression times(double c, Expression e) { return arena_.product({arena_.number(c), e}); }
  Expression minus(Expression a, Expression b) { return arena_.sum({a, times(-1, b)}); }

  struct Kernel {
    Expression inverse_width, z, square, Phi, phi;
  };
  // `exact` is u with its own kinks unsmoothed.
  Kernel kernel(Expression exact, Expression u) {
    const auto known = std::find(arguments_.begin(), arguments_.end(), exact);
    const auto k = static_cast<std::size_t>(known - arguments_.begin());
    if (known == arguments_.end()) arguments_.push_back(exact);
    const Expression inverse_width = arena_.symbol(Role::observation, k, "inverse_width");
    const Expression z = arena_.product({u, inverse_width}), square = arena_.power(z, arena_.number(2));
    return {inverse_width, z, square,
            times(0.5, arena_.function(Op::error_function_complement, {times(-1 / std::numbers::sqrt2, z)})),
            times(std::numbers::inv_sqrtpi / std::numbers::sqrt2,
                  arena_.function(Op::exponential, {times(-0.5, square)}))};
  }

  Expression polynomial_in(Expression square, std::span<const double> coefficients) {
    Expression P = arena_.number(coefficients.back());
    for (std::size_t i = coefficients.size() - 1; i-- > 0;)
      P = arena_.sum({arena_.number(coefficients[i]), arena_.product({square, P})});
    return P;
  }

  // f_h(u)
  Expression ramp(Expression exact, Expression u) {
    const Kernel K = kernel(exact, u);
    static const auto coefficients = polynomial();
    const Expression width = arena_.power(K.inverse_width, arena_.number(-1));
    return arena_.product(
        {width, arena_.sum({arena_.product({K.z, K.Phi}),
                            arena_.product({K.phi, polynomial_in(K.square, coefficients)})})});
  }

  // f_h'(u) = Phi + phi (z (1 - P) + P')
  Expression jump(Expression exact, Expression u) {
    const Kernel K = kernel(exact, u);
    static const auto coefficients = [] {
      const auto P = polynomial();
      auto Q = P;  // z Q(z^2) = z (1 - P) + P'
      for (std::size_t i = 0; i < P.size(); ++i)
        Q[i] = (i == 0 ? 1 : 0) - P[i] + (i + 1 < P.size() ? 2 * static_cast<double>(i + 1) * P[i + 1] : 0);
      return Q;
    }();
    return arena_.sum({K.Phi, arena_.product({K.phi, K.z, polynomial_in(K.square, coefficients)})});
  }

  Arena& arena_;
  std::unordered_map<Expression, Expression> done_;
  std::vector<Expression> arguments_;
};

}  // namespace

SmoothedKinks smooth_kinks(Expression e, Arena& arena) {
  Smoothing smoothing(arena);
  const Expression value = smoothing(e);
  return {value, smoothing.arguments()};
}

}  // namespace wienertree::text
