#pragma once
/// Expressions of a text model as immutable trees in a fixed order.
///
/// A computer algebra system may order the terms of a sum differently in every run; rounding would then
/// differ too. Here the operands of sums and products are sorted by a rule that depends on the expression
/// alone, so that the same model gives the same bytes.
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <unordered_set>
#include <vector>

#include "wienertree/model/tape.hpp"

namespace wienertree::text {

/// What a name stands for. The clock `t` is the state after the last declared one. Input k is a known function of
/// time, its value with the index 2k and its slope with 2k + 1.
enum class Role : std::uint8_t { parameter, state, observation, input };

struct Node;
/// Equal expressions of one arena are the same pointer. Valid as long as the arena.
using Expression = const Node*;

struct Node {
  enum class Kind : std::uint8_t { number, pi, symbol, power, function, product, sum };
  Kind kind = Kind::number;
  double number = 0;                 ///< of a number
  std::string name;                  ///< of a symbol; of a number how to print it
  Role role{};                       ///< of a symbol
  std::size_t index = 0;             ///< of a symbol: which parameter, state or component of y, from 0
  Op op{};                           ///< of a function
  std::vector<Expression> operands;  ///< power: base, exponent; function: arguments; sum, product: sorted

  bool is_number() const { return kind == Kind::number; }
  bool is_number(double value) const { return is_number() && number == value; }
};

/// A total order that depends on the expressions alone: numbers, pi, parameters, states, observations,
/// powers, functions, products, sums.
int compare(Expression a, Expression b);

/// Makes and owns expressions.
class Arena {
 public:
  Arena() = default;
  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;

  /// `printed` is how the number is to be printed; by default its shortest decimal form.
  Expression number(double value, std::string printed = {});
  Expression pi();
  Expression symbol(Role role, std::size_t index, const std::string& name);
  Expression power(Expression base, Expression exponent);
  Expression function(Op op, std::vector<Expression> arguments);
  /// Sorted, not simplified; of no operands it is 0, of one that one.
  Expression sum(std::vector<Expression> terms);
  /// Sorted, not simplified; of no operands it is 1, of one that one.
  Expression product(std::vector<Expression> factors);

 private:
  struct Hash {
    std::size_t operator()(Expression e) const;
  };
  struct Equal {
    bool operator()(Expression a, Expression b) const;
  };
  Expression intern(Node node);

  std::deque<Node> nodes_;
  std::unordered_set<Expression, Hash, Equal> known_;
};

/// A term as coefficient times rest; the rest of a number is null.
struct Term {
  double coefficient;
  Expression rest;
};
Term split(Expression term, Arena& arena);

/// In the syntax of the model file: parsing it again gives an equal expression.
std::string print(Expression e);

/// The parameters replaced by their values, numbers folded, equal terms and powers of equal bases collected.
/// @throws InputError at `where` when a part that is constant has no finite value, as log(0)
Expression substitute(Expression e, std::span<const double> parameters, Arena& arena,
                      const std::string& where);

/// Number of nodes as a tree, equal ones counted every time; infinity when astronomical.
double size(Expression e);
/// Whether a symbol of this role, or this symbol, occurs.
bool contains(Expression e, Role role);
bool contains(Expression e, Role role, std::size_t index);
/// Whether min, max, abs, sign, a comparison or `if` occur, so that the expression is not analytic.
bool is_piecewise(Expression e);

/// What the symbols of a bound expression are on a tape.
struct TapeSymbols {
  std::vector<TapeBuilder::Value> states, observations;
  std::vector<TapeBuilder::Value> inputs;  ///< value and slope of each
};
/// What 0 log(0) is. In log densities of counts, y log(m) - m and the like, it is the limit 0.
enum class ZeroLogZero { nan, zero };
/// @pre no parameter occurs in `e`
TapeBuilder::Value emit(Expression e, const TapeSymbols& symbols, TapeBuilder& builder,
                        ZeroLogZero zero_log_zero = ZeroLogZero::nan);

}  // namespace wienertree::text
