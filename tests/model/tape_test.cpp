// The structure of tapes, and random expressions against plain evaluation.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "allocations.hpp"
#include "model/tape_evaluation.hpp"
#include "wienertree/model/dual.hpp"

using namespace wienertree;
using namespace wienertree::test;
using Value = TapeBuilder::Value;

namespace {

/// A builder with short names.
struct Builder : TapeBuilder {
  using TapeBuilder::TapeBuilder;
  Value operator()(double c) { return constant(c); }
  Value plus(Value a, Value b) { return binary(Op::add, a, b); }
  Value minus(Value a, Value b) { return binary(Op::subtract, a, b); }
  Value times(Value a, Value b) { return binary(Op::multiply, a, b); }
  Value over(Value a, Value b) { return binary(Op::divide, a, b); }
  Value pow(Value a, double n) { return binary(Op::power, a, constant(n)); }
  Tape tape(std::initializer_list<Value> outputs) const { return finish({outputs.begin(), outputs.size()}); }
};

}  // namespace

TEST_CASE("values that are equal in real arithmetic by an identity of the builder are the same value") {
  Builder t(2, 2);
  const Value x = t.input(0), y = t.input(1), u = t.uniform(0), w = t.uniform(1);
  CHECK(t.plus(x, t(0)) == x);
  CHECK(t.minus(x, t(0)) == x);
  CHECK(t.minus(x, x) == t(0));
  CHECK(t.times(x, t(1)) == x);
  CHECK(t.times(t(0), x) == t(0));
  CHECK(t.over(x, t(1)) == x);
  CHECK(t.over(x, t(4)) == t.times(t(0.25), x));
  CHECK(t.plus(x, y) == t.plus(y, x));
  CHECK(t.times(x, u) == t.times(u, x));
  CHECK(t.times(t(-1), x) == t.unary(Op::negate, x));
  CHECK(t.unary(Op::negate, t.unary(Op::negate, x)) == x);
  CHECK(t.plus(x, t.times(t(-1), y)) == t.minus(x, y));
  CHECK(t.unary(Op::negate, t.minus(x, y)) == t.minus(y, x));
  CHECK(t.times(t.times(x, u), t(2)) == t.times(x, t.times(u, t(2))));
  CHECK(t.times(t(3), t.times(t(2), x)) == t.times(t(6), x));
  CHECK(t.times(u, t.times(w, x)) == t.times(x, t.times(w, u)));
  CHECK(t.pow(x, 0) == t(1));
  CHECK(t.pow(x, 1) == x);
  CHECK(t.pow(x, 2) == t.times(x, x));
  CHECK(t.pow(x, 0.5) == t.unary(Op::square_root, x));
  CHECK(t.pow(x, -1) == t.over(t(1), x));
  CHECK(t.pow(x, -1.5) == t.over(t(1), t.times(x, t.unary(Op::square_root, x))));
  CHECK(t.binary(Op::power, t(1), x) == t(1));
  CHECK(t.binary(Op::minimum, x, y) == t.binary(Op::minimum, y, x));
  CHECK(t.unary(Op::exponential, t(0)) == t(1));
  CHECK(t.plus(t(2), t(3)) == t(5));
  // 0 and -0 are different constants, and a product that would overflow is not collected.
  CHECK(t(0.0) != t(-0.0));
  CHECK(t.times(t(1e200), t.times(t(1e200), x)) != t.times(t(std::numeric_limits<double>::infinity()), x));
}

TEST_CASE("a tape holds no more instructions and registers than its expressions need") {
  Builder t(2, 2);
  const Value x = t.input(0), y = t.input(1), u = t.uniform(0), w = t.uniform(1);

  SECTION("subexpressions are shared over outputs") {
    const Value h = t.unary(Op::hyperbolic_tangent, t.times(t(0.5), x));
    const Tape tape = t.tape({h, t.times(t(0.5), t.minus(t(1), t.pow(h, 2)))});
    CHECK(tape.instructions() == 4);  // x/2, tanh, 1 - h h, times 1/2
    CHECK(tape.registers() == 1);     // the first output holds h
  }
  SECTION("what depends on uniforms alone runs once a call") {
    const Value c = t.unary(Op::exponential, t.plus(u, w));
    const Tape tape = t.tape({t.times(c, x), t.plus(c, y), t.unary(Op::sine, c)});
    CHECK(tape.uniform_instructions() == 3);
    CHECK(tape.instructions() == 3);
  }
  SECTION("a product that serves one sum is fused with it, x (1/y) is a division") {
    CHECK(t.tape({t.plus(t.times(x, y), x)}).instructions() == 1);
    CHECK(t.tape({t.minus(t.times(x, y), x)}).instructions() == 1);
    CHECK(t.tape({t.minus(x, t.times(x, y))}).instructions() == 1);
    CHECK(t.tape({t.times(x, t.pow(y, -1))}).instructions() == 1);
    CHECK(t.tape({t.plus(t.times(x, y), x), t.times(x, y)}).instructions() == 2);
  }
  SECTION("powers cost multiplications") {
    CHECK(t.tape({t.pow(x, 8)}).instructions() == 3);
    CHECK(t.tape({t.pow(x, 15)}).instructions() == 6);
    CHECK(t.tape({t.pow(x, -2)}).instructions() == 2);
    CHECK(t.tape({t.pow(x, 2.7)}).instructions() == 1);
  }
  SECTION("dead values cost nothing") {
    t.unary(Op::sine, t.plus(x, y));
    CHECK(t.tape({x}).instructions() == 1);
  }
  SECTION("registers of a sum of a thousand terms, of a tall and of a balanced expression") {
    Value sum = t(0), chain = x;
    for (int i = 1; i <= 1000; ++i) sum = t.plus(sum, t.unary(Op::sine, t.times(t(i), x)));
    CHECK(t.tape({sum}).registers() <= 3);
    for (int i = 0; i < 100000; ++i) chain = t.unary(Op::sine, chain);
    CHECK(t.tape({chain}).registers() <= 1);
    std::vector<Value> level;
    for (int i = 1; i <= 1024; ++i) level.push_back(t.unary(Op::cosine, t.times(t(i), x)));
    while (level.size() > 1) {
      for (std::size_t i = 0; i < level.size() / 2; ++i) level[i] = t.plus(level[2 * i], level[2 * i + 1]);
      level.resize(level.size() / 2);
    }
    CHECK(t.tape({level[0]}).registers() <= 11);  // log2(1024) + 1 (Sethi, Ullman)
  }
}

TEST_CASE("outputs may be inputs, uniforms, constants and repeated") {
  Builder t(1, 2);
  const Value x = t.input(0), s = t.unary(Op::sine, x), u = t.uniform(1);
  const Tape tape = t.tape({x, s, u, t(7), s, t.plus(u, u), x, t.unary(Op::cosine, s)});
  for (const TapeKernel& kernel : kernels()) {
    for (const std::size_t nodes : {std::size_t{0}, std::size_t{1}, std::size_t{67}, std::size_t{128}}) {
      const auto out =
          evaluate(kernel, tape, {std::vector<double>(nodes, 0.3)}, std::vector{0.0, 2.5}, nodes);
      for (std::size_t n = 0; n < nodes; ++n) {
        CHECK(out[0][n] == 0.3);
        CHECK(out[1][n] == Approx(std::sin(0.3)));
        CHECK(out[2][n] == 2.5);
        CHECK(out[3][n] == 7);
        CHECK(out[4][n] == out[1][n]);
        CHECK(out[5][n] == 5);
        CHECK(out[6][n] == 0.3);
        CHECK(out[7][n] == Approx(std::cos(std::sin(0.3))));
      }
    }
  }
  Tape().evaluate({}, {}, {}, 5);
}

TEST_CASE("a tape does not write beyond its outputs") {
  Builder t(1, 0);
  const Tape tape = t.tape({t.unary(Op::exponential, t.input(0))});
  for (const TapeKernel& kernel : kernels())
    for (std::size_t nodes = 0; nodes <= 70; ++nodes) {
      const std::vector<double> x(nodes, 1.0);
      std::vector<double> y(nodes + 8, -1.0);
      const double* in = x.data();
      double* out = y.data();
      tape.evaluate(kernel, {&in, 1}, {}, {&out, 1}, nodes);
      for (std::size_t n = nodes; n < y.size(); ++n) REQUIRE(y[n] == -1.0);
    }
}

TEST_CASE("no allocation after the first call on a thread") {
  Builder t(2, 1);
  const Value x = t.input(0), y = t.input(1), u = t.uniform(0);
  const Tape tape =
      t.tape({t.plus(t.unary(Op::sine, x), t.times(t.unary(Op::exponential, u), y)), t.pow(x, 0.3)});
  const std::vector<double> a(1000, 0.5), b(1000, 0.25), uniforms = {2.0};
  std::vector<double> c(1000), d(1000);
  const double* const in[] = {a.data(), b.data()};
  double* const out[] = {c.data(), d.data()};
  for (const TapeKernel& kernel : kernels()) {
    tape.evaluate(kernel, in, uniforms, out, 1);
    const std::size_t before = allocations();
    for (std::size_t nodes = 1; nodes <= 1000; ++nodes) tape.evaluate(kernel, in, uniforms, out, nodes);
    CHECK(allocations() == before);
  }
  tape.evaluate(in, uniforms, out, 1);
  const std::size_t before = allocations();
  tape.evaluate(in, uniforms, out, 1000);
  CHECK(allocations() == before);
}

namespace {

constexpr std::size_t I = 3, U = 3, nodes = 70;
constexpr double inf = std::numeric_limits<double>::infinity();

/// A value of a random expression at every node, evaluated plainly, with a bound of the error of any
/// evaluation.
///
/// Running error analysis (Higham 2002, Accuracy and Stability of Numerical Algorithms, section 3.3): if
/// z = f(a, b) is computed from operands in error by at most e_a, e_b with relative rounding error k u,
/// u = 2^-53, then to first order
///
///     e_z = |df/da| e_a + |df/db| e_b + k u |z|
///
/// k = 8 for every function, since 4 ulp <= 8u relative; k = 2(|n| + 3) for x^n, which the tape may form by
/// at most |n| multiplications, a square root, a reciprocal. The tape's other identities (signs, order of
/// factors, fused sums) add no rounding. Both the plain value and the tape's lie within e_z of the exact one,
/// so they differ by at most 2 e_z; e_z becomes infinite, and the node is not compared, where an argument is
/// within 1000 e_a of a pole, a jump, a kink or the end of the domain, or the relative error above 1e-3, so
/// that the neglected second order is below 1 % of the bound.
struct Random {
  Value value;
  std::vector<double> z, e;
};

/// Partial derivatives at (a, b), the distance of a (and b) to the nearest singularity of f, and k.
struct Local {
  double da = 0, db = 0, distance = inf, k = 8;
};

double slope(Op op, double a) {
  const Dual<double, 1> x(a, {1});
  switch (op) {
#define X(operation, name, ...) \
  case Op::operation:           \
    if constexpr (Op::operation != Op::trigamma) return name(x).slopes[0];
    WIENERTREE_ELEMENTARY_FUNCTIONS(X)
#undef X
    default:
      return op == Op::trigamma ? 1 : 0;  // above 2.5 it is less steep than that
  }
}

Local local(Op op, double a, double b) {
  const double z = apply(op, a, b);
  switch (op) {
    case Op::add:
      return {1, 1};
    case Op::subtract:
      return {1, -1};
    case Op::multiply:
      return {b, a};
    case Op::divide:
      return {1 / b, -z / b, std::abs(b)};
    case Op::power:
      return {b * z / a, a > 0 ? z * std::log(a) : 0, std::abs(a), 2 * (std::abs(b) + 3)};
    case Op::minimum:
    case Op::maximum:
      return {1, 1};
    case Op::negate:
      return {-1};
    case Op::absolute:
      return {1};
    case Op::sign:
    case Op::step:
      return {0, 0, std::abs(a)};
    case Op::square_root:
      return {0.5 / z, 0, a};
    case Op::exponential:
      return {z};
    case Op::logarithm:
      return {1 / a, 0, a};
    case Op::sine:
      return {1};
    case Op::cosine:
      return {1};
    case Op::tangent:
      return {1 + z * z, 0, 1 / (1 + std::abs(z))};
    case Op::hyperbolic_sine:
      return {std::cosh(a)};
    case Op::hyperbolic_cosine:
      return {std::sinh(a)};
    case Op::hyperbolic_tangent:
      return {1};
    case Op::arctangent:
      return {1};
    case Op::error_function:
      return {1.13};
    case Op::error_function_complement:
      return {1.13 * std::exp(-a * a) * (1 + 1e-2)};
    case Op::where:
    case Op::unless:
      return {0, 1, std::abs(a)};
    case Op::arcsine:
    case Op::arccosine:
    case Op::inverse_hyperbolic_tangent:
      return {slope(op, a), 0, 1 - std::abs(a)};
    case Op::inverse_hyperbolic_cosine:
      return {slope(op, a), 0, a - 1};
    case Op::logarithm_of_one_plus:
      return {slope(op, a), 0, a + 1};
    case Op::inverse_hyperbolic_sine:
    case Op::exponential_minus_one:
    case Op::normal_distribution:
      return {slope(op, a)};
    case Op::logarithm_of_gamma:  // singular at 0, -1, ..; in units in the last place poor at its zeros
    case Op::digamma:
    case Op::trigamma:
      return {slope(op, a), 0, a - 2.5};
  }
  return {};
}

/// All in [1e-100, 1e100] or zero, so that nothing overflows or is subnormal on the way.
bool ordinary(double z) { return z == 0 || (std::abs(z) > 1e-100 && std::abs(z) < 1e100); }

Random combine(TapeBuilder& t, Op op, const Random& a, const Random& b) {
  constexpr double u = std::numeric_limits<double>::epsilon() / 2;
  Random result{is_binary(op) ? t.binary(op, a.value, b.value) : t.unary(op, a.value),
                std::vector<double>(nodes), std::vector<double>(nodes, inf)};
  for (std::size_t n = 0; n < nodes; ++n) {
    const double z = result.z[n] = apply(op, a.z[n], b.z[n]);
    const Local f = local(op, a.z[n], b.z[n]);
    const double ea = a.e[n], eb = is_binary(op) ? b.e[n] : 0;
    if (!ordinary(z) || !(f.distance >= 1000 * std::max(ea, eb)) || ea == inf || eb == inf) continue;
    const double e = std::abs(f.da) * ea + std::abs(f.db) * eb + f.k * u * std::abs(z);
    if (e <= 1e-3 * std::max(1.0, std::abs(z))) result.e[n] = e;
  }
  return result;
}

}  // namespace

TEST_CASE("random expressions agree with plain evaluation within the bound of running error analysis") {
  std::mt19937_64 generator(11);
  const auto pick = [&](std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(generator);
  };
  const auto number = [&] { return std::normal_distribution<double>(0, 1.5)(generator); };
  constexpr double numbers[] = {0, 1, -1, 2, -2, 0.5, -0.5, 3, 1.5, -1.5, 0.25, 7};
  std::size_t compared = 0, offered = 0;
  for (int trial = 0; trial < 1500; ++trial) {
    TapeBuilder t(I, U);
    Columns inputs(I, std::vector<double>(nodes));
    std::vector<double> uniforms(U);
    std::vector<Random> values;
    for (std::size_t i = 0; i < I; ++i) {
      for (double& x : inputs[i]) x = number();
      values.push_back({t.input(i), inputs[i], std::vector<double>(nodes, 0.0)});
    }
    for (std::size_t i = 0; i < U; ++i) {
      uniforms[i] = number();
      values.push_back(
          {t.uniform(i), std::vector<double>(nodes, uniforms[i]), std::vector<double>(nodes, 0.0)});
    }
    for (int i = 0; i < 4; ++i) {
      const double c = pick(3) == 0 ? number() : numbers[pick(std::size(numbers))];
      values.push_back({t.constant(c), std::vector<double>(nodes, c), std::vector<double>(nodes, 0.0)});
    }
    for (int i = 0; i < 30; ++i) {
      // Arithmetic two times in three; the latest values more often, so that expressions grow deep.
      const auto operand = [&] { return pick(2) ? pick(values.size()) : values.size() - 1 - pick(6); };
      const Op op = pick(3)   ? binary_operations[pick(4)]
                    : pick(2) ? binary_operations[4 + pick(3)]
                              : unary_operations[pick(std::size(unary_operations))];
      values.push_back(combine(t, op, values[operand()], values[operand()]));
    }
    std::vector<Value> outputs;
    std::vector<std::size_t> chosen;  // a few only: a value that is no output may be fused into another
    for (std::size_t i = 10; i < values.size(); ++i)
      if (pick(6) == 0 || i + 1 == values.size()) {
        outputs.push_back(values[i].value);
        chosen.push_back(i);
      }
    const Tape tape = t.finish(outputs);
    for (const TapeKernel& kernel : kernels()) {
      const auto out = evaluate(kernel, tape, inputs, uniforms, nodes);
      for (std::size_t o = 0; o < outputs.size(); ++o)
        for (std::size_t n = 0; n < nodes; ++n) {
          const Random& plain = values[chosen[o]];
          ++offered;
          if (plain.e[n] == inf) continue;
          ++compared;
          if (std::abs(out[o][n] - plain.z[n]) <= 2 * plain.e[n]) continue;
          INFO(kernel.name << ", trial " << trial << ", output " << o << ", node " << n << ": " << out[o][n]
                           << " instead of " << plain.z[n] << " +- " << plain.e[n]);
          REQUIRE(false);
        }
    }
  }
  CHECK(compared > offered / 2);
}
