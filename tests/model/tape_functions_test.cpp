// The elementary functions of every machine code against the C library, and bytes that do not depend on
// position.
#include <boost/math/special_functions/digamma.hpp>
#include <boost/math/special_functions/trigamma.hpp>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <string>

#include "model/tape_evaluation.hpp"

using namespace wienertree;
using namespace wienertree::test;

namespace {

Tape tape_of(Op op) {
  TapeBuilder t(2, 0);
  const auto value = is_binary(op) ? t.binary(op, t.input(0), t.input(1)) : t.unary(op, t.input(0));
  return t.finish({&value, 1});
}

// The functions of the table in extended precision, independent of what is tested.
namespace extended {
using std::acosh, std::asinh, std::atanh, std::cosh, std::sinh, std::tanh;
using std::asin, std::acos, std::atan, std::cos, std::sin, std::tan;
using std::erf, std::erfc, std::exp, std::expm1, std::lgamma, std::log, std::log1p, std::sqrt;
long double normcdf(long double x) { return 0.5L * std::erfc(-x * std::sqrt(0.5L)); }
long double digamma(long double x) {
  return x <= 0 && std::floor(x) == x     ? std::numeric_limits<long double>::quiet_NaN()
         : std::isinf(x) || std::isnan(x) ? (x > 0 ? x : std::numeric_limits<long double>::quiet_NaN())
                                          : boost::math::digamma(x);
}
long double trigamma(long double x) {
  return x <= 0 && std::floor(x) == x     ? std::numeric_limits<long double>::quiet_NaN()
         : std::isinf(x) || std::isnan(x) ? (x > 0 ? 0 : std::numeric_limits<long double>::quiet_NaN())
                                          : boost::math::trigamma(x);
}
}  // namespace extended

long double exact(Op op, long double a, long double b) {
  switch (op) {
#define X(operation, name, ...) \
  case Op::operation:           \
    return extended::name(a);
    WIENERTREE_ELEMENTARY_FUNCTIONS(X)
#undef X
    case Op::power:
      return std::pow(a, b);
    default:
      return apply(op, static_cast<double>(a), static_cast<double>(b));
  }
}

/// Distance from the exact value in units of the last place of a double near it.
/// Where `least` > 0, near a number of at least this size.
double error_in_ulp(double computed, long double exact_value, double least) {
  const double nearest = static_cast<double>(exact_value);
  if (std::isnan(nearest) && std::isnan(computed)) return 0.0;
  if (std::isinf(nearest) || std::isinf(computed)) {
    if (computed == nearest) return 0.0;
    // Either side of the overflow threshold is a rounding away.
    return std::abs(std::isinf(nearest) ? computed : nearest) > 0.999999 * std::numeric_limits<double>::max()
               ? 1.0
               : std::numeric_limits<double>::infinity();
  }
  const double size = std::max({std::abs(nearest), std::numeric_limits<double>::min(), least});
  const double ulp = std::nextafter(size, std::numeric_limits<double>::infinity()) - size;
  const auto distance = static_cast<double>(std::abs(static_cast<long double>(computed) - exact_value)) / ulp;
  return std::isnan(distance) ? std::numeric_limits<double>::infinity() : distance;
}

/// libmvec claims at most 4 ulp, the C library's scalar functions less; arithmetic and sqrt are correctly
/// rounded. The exp and tanh of tape_exponential.inl, used where there is a fused multiply-add, claim 1
/// and 2.5.
double largest_error(const TapeKernel& kernel, Op op) {
  const std::string name = kernel.name;
  if (op < Op::power || (op > Op::power && op <= Op::square_root)) return 0.5;
  const bool own = name == "avx2" || name == "avx512";
  if (own && op == Op::exponential) return 1.0;
  if (own && op == Op::hyperbolic_tangent) return 2.5;
  return 4.0;
}

void check_accuracy(const TapeKernel& kernel, Op op, const std::vector<double>& a,
                    const std::vector<double>& b) {
  const auto values = evaluate(kernel, tape_of(op), {a, b}, {}, a.size())[0];
  double worst = 0;
  std::size_t where = 0;
  for (std::size_t n = 0; n < a.size(); ++n) {
    // log Gamma and its derivatives have zeros that are no doubles, where they are as accurate as near 1.
    const bool of_gamma = op == Op::logarithm_of_gamma || op == Op::digamma || op == Op::trigamma;
    const double error = error_in_ulp(values[n], exact(op, a[n], b[n]), of_gamma ? 1 : 0);
    if (error > worst) worst = error, where = n;
  }
  INFO(kernel.name << ", operation " << static_cast<int>(op) << " at " << a[where] << ", " << b[where]
                   << " is " << values[where]);
  CHECK(worst <= largest_error(kernel, op) + 0.01);  // the long double reference is good to 2^-11 ulp
}

void check_special(const TapeKernel& kernel, Op op, const std::vector<double>& a,
                   const std::vector<double>& b) {
  check_accuracy(kernel, op, a, b);
  if (op == Op::minimum || op == Op::maximum) return;  // of 0 and -0 either may be returned
  const auto computed = evaluate(kernel, tape_of(op), {a, b}, {}, a.size())[0];
  for (std::size_t n = 0; n < a.size(); ++n) {
    const double expected = apply(op, a[n], b[n]);
    INFO(kernel.name << ", operation " << static_cast<int>(op) << " at " << a[n] << ", " << b[n] << " is "
                     << computed[n]);
    if (!std::isnan(expected)) CHECK(std::signbit(computed[n]) == std::signbit(expected));
  }
}

}  // namespace

TEST_CASE("every operation is as accurate as claimed on ordinary arguments") {
  constexpr std::size_t draws = 20000;
  std::mt19937_64 generator(20240501);
  std::uniform_real_distribution<double> exponent(-12, 9.4), sign(-1, 1);
  std::vector<double> a(draws), b(draws), positive(draws), small(draws);
  for (std::size_t n = 0; n < draws; ++n) {
    a[n] = std::copysign(std::exp2(exponent(generator)), sign(generator));
    b[n] = std::copysign(std::exp2(exponent(generator)), sign(generator));
    positive[n] = std::abs(a[n]);
    small[n] = 30 * sign(generator);
  }
  for (const TapeKernel& kernel : kernels()) {
    for (const Op op : unary_operations)
      check_accuracy(kernel, op,
                     op == Op::logarithm || op == Op::digamma || op == Op::trigamma ? positive : a, b);
    for (const Op op : binary_operations)
      check_accuracy(kernel, op, op == Op::power ? positive : a, op == Op::power ? small : b);
  }
}

TEST_CASE("tanh and exp keep their accuracy where their reduction changes") {
  // Multiples of ln(2)/2 separate the integers n of the reduction, for tanh those of ln(2)/4.
  std::vector<double> a;
  for (int k = -4300; k <= 4100; ++k)
    for (const double offset : {-1e-12, 0.0, 1e-12}) a.push_back(k * 0.17328679513998632 + offset);
  for (int k = -1074; k <= 2; k += 3) a.push_back(std::ldexp(1.37, k));
  for (const TapeKernel& kernel : kernels())
    for (const Op op : {Op::exponential, Op::hyperbolic_tangent}) check_accuracy(kernel, op, a, a);
}

TEST_CASE("special arguments give the C library's infinities, zeros and NaN") {
  const auto& values = special_values();
  std::vector<double> a, b;
  for (const double x : values)
    for (const double y : values) a.push_back(x), b.push_back(y);
  for (const double x : {-2.0, -1.0, -3.5, 2.0, 0.0, -0.0})  // integer and other exponents
    for (const double y : {-3.0, -2.0, 2.0, 3.0, 1001.0, 1002.0, -1001.0, 2.5, -2.5})
      a.push_back(x), b.push_back(y);
  for (const TapeKernel& kernel : kernels()) {
    for (const Op op : unary_operations) check_special(kernel, op, values, values);
    for (const Op op : binary_operations) check_special(kernel, op, a, b);
  }
}

TEST_CASE("a value out of the domain is NaN, and NaN goes through every operation") {
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               infinity = std::numeric_limits<double>::infinity();
  for (const TapeKernel& kernel : kernels()) {
    CAPTURE(kernel.name);
    const auto value = [&](Op op, double a, double b) {
      return evaluate(kernel, tape_of(op), {{a}, {b}}, {}, 1)[0][0];
    };
    for (const Op op : unary_operations) CHECK(std::isnan(value(op, nan, 0)));
    for (const Op op : binary_operations) {
      CHECK(std::isnan(value(op, nan, 1)));
      // What is not chosen does not matter.
      if (op == Op::where || op == Op::unless)
        CHECK(value(op, op == Op::where ? 0 : 2, nan) == 0);
      else
        CHECK(std::isnan(value(op, 2, nan)));
    }
    CHECK(std::isnan(value(Op::square_root, -1, 0)));
    CHECK(std::isnan(value(Op::logarithm, -1, 0)));
    CHECK(std::isnan(value(Op::sine, infinity, 0)));
    CHECK(std::isnan(value(Op::power, -1.5, 0.5)));
    CHECK(std::isnan(value(Op::divide, 0, 0)));
  }
}

TEST_CASE("a node's value depends bit for bit on its inputs alone, at every position and length") {
  // Each value alone is the reference; then batches of 1..130 nodes, each node in changing company and place,
  // from an address that no vector is aligned to.
  std::vector<double> pool = special_values();
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal(0, 3);
  while (pool.size() < 257) pool.push_back(normal(generator));
  TapeBuilder t(2, 1);
  std::vector<TapeBuilder::Value> outputs;
  for (const Op op : unary_operations) outputs.push_back(t.unary(op, t.input(0)));
  for (const Op op : binary_operations) {
    outputs.push_back(t.binary(op, t.input(0), t.input(1)));
    outputs.push_back(t.binary(op, t.input(0), t.uniform(0)));
    outputs.push_back(t.binary(op, t.uniform(0), t.input(1)));
    outputs.push_back(t.binary(Op::add, t.binary(Op::multiply, t.input(0), outputs.back()), t.input(1)));
  }
  const Tape tape = t.finish(outputs);
  const std::vector<double> uniforms = {1.7};
  const std::size_t P = pool.size(), O = outputs.size();
  for (const TapeKernel& kernel : kernels()) {
    CAPTURE(kernel.name);
    Columns alone(P);
    for (std::size_t v = 0; v < P; ++v)
      for (const auto& column : evaluate(kernel, tape, {{pool[v]}, {pool[P - 1 - v]}}, uniforms, 1))
        alone[v].push_back(column[0]);
    std::size_t different = 0;
    for (std::size_t length = 1; length <= 130; ++length) {
      std::vector<double> x(length + 1), y(length + 1), out(O * (length + 1));
      const auto place = [&](std::size_t n) { return (n * (length % 7 + 1) + 31 * length) % P; };
      for (std::size_t n = 0; n < length; ++n) x[n + 1] = pool[place(n)], y[n + 1] = pool[P - 1 - place(n)];
      const std::vector<const double*> in = {x.data() + 1, y.data() + 1};
      std::vector<double*> to;
      for (std::size_t o = 0; o < O; ++o) to.push_back(out.data() + o * (length + 1) + 1);
      tape.evaluate(kernel, in, uniforms, to, length);
      for (std::size_t o = 0; o < O; ++o)
        for (std::size_t n = 0; n < length; ++n) different += !same_bytes(to[o][n], alone[place(n)][o]);
    }
    CHECK(different == 0);
  }
}
