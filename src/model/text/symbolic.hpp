#pragma once
/// The only header that shows GiNaC: parsing into its expressions and conversion into ours.
///
/// GiNaC counts its references and numbers its symbols without locks: whoever uses this header holds
/// `symbolic_mutex()` from the first expression made to the last one destroyed.
#include <ginac/ginac.h>

#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "wienertree/model/text/expression.hpp"
#include "wienertree/model/text/location.hpp"

namespace wienertree::text {

std::mutex& symbolic_mutex();

/// The names of a model. Their GiNaC symbols stand for real numbers.
class Symbols {
 public:
  struct Entry {
    std::string name;
    Role role;
    std::size_t index;
    GiNaC::realsymbol symbol;
  };
  /// The clock `t` is added as the state after the declared ones. The slope of an input u is called u'.
  Symbols(const std::vector<std::string>& parameters, const std::vector<std::string>& states,
          const std::vector<std::string>& inputs = {});

  const GiNaC::realsymbol& parameter(std::size_t i) const { return entries_[i].symbol; }
  /// i = number of declared states: the clock.
  const GiNaC::realsymbol& state(std::size_t i) const { return entries_[parameters_ + i].symbol; }
  /// Value of input k for i = 2k, its slope for i = 2k + 1.
  const GiNaC::realsymbol& input(std::size_t i) const { return entries_[first_input_ + i].symbol; }
  std::size_t inputs() const { return (entries_.size() - first_input_) / 2; }
  /// Component i of y, from 0; it is written y1 for i = 0.
  const GiNaC::realsymbol& observation(std::size_t i);
  /// How many components of y were asked for: the largest plus one.
  std::size_t observations() const { return observations_.size(); }

  const Entry* find(std::string_view name) const;
  const std::deque<Entry>& entries() const { return entries_; }
  /// @throws std::out_of_range for a symbol that is not of this table
  const Entry& entry(const GiNaC::symbol& symbol) const;

 private:
  std::size_t parameters_, first_input_;
  std::deque<Entry> entries_, observations_;
  std::map<GiNaC::ex, const Entry*, GiNaC::ex_is_less> known_;
};

/// What an expression may refer to besides numbers, pi and functions.
struct Scope {
  Symbols& symbols;
  std::size_t parameters;     ///< the first so many
  bool states = false;        ///< states, inputs and t
  bool observations = false;  ///< y1, y2, ..
};

/// Right-associative ^ binds tighter than the signs, which bind tighter than * and /.
/// @throws InputError with the place of the offending symbol
GiNaC::ex parse(const SourceExpression& source, const Scope& scope);

/// Applies a function of the language. @throws std::exception as GiNaC does (a pole)
GiNaC::ex apply_symbolically(Op op, const std::vector<GiNaC::ex>& arguments);
/// The Op of a GiNaC function.
Op operation(const GiNaC::function& function);

/// Converts GiNaC's expressions to sorted ones. Contents of sums inside products are normalised (coprime
/// integer coefficients, the first one positive), since which form GiNaC chooses differs from run to run.
class Conversion {
 public:
  Conversion(const Symbols& symbols, Arena& arena) : symbols_(symbols), arena_(arena) {}
  /// @throws std::domain_error when a number in it is not real
  Expression operator()(const GiNaC::ex& e);

 private:
  struct Scaled {
    GiNaC::numeric coefficient;
    Expression rest;  // null stands for 1
  };
  Scaled scaled(const GiNaC::ex& e);
  Scaled make_scaled(const GiNaC::ex& e);
  Scaled scaled_power(const GiNaC::ex& base, const GiNaC::ex& exponent);
  Scaled scaled_product(const GiNaC::ex& e);
  std::vector<Scaled> terms(const GiNaC::ex& sum);
  Scaled primitive_part(const GiNaC::ex& sum);
  Expression joined(const Scaled& s);
  Expression number(const GiNaC::numeric& value);

  const Symbols& symbols_;
  Arena& arena_;
  std::map<GiNaC::ex, Scaled, GiNaC::ex_is_less> done_;
};

}  // namespace wienertree::text
