#pragma once
/// Models as text: a TOML file with the coefficients as expressions.
///
/// An expression is made of + - * / ^, parentheses, numbers, pi, parameters, state names, the time t and the
/// functions of elementary_functions.hpp, abs sign min max; of comparisons, which are 1 or 0, and, or, not, and
/// if(condition, a, b). ^ is right associative and binds tighter than a sign: -x^2 = -(x^2). The drift is given in the Ito or the Stratonovich sense, and the other
/// one derived.
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "wienertree/model/batch_function.hpp"
#include "wienertree/model/model.hpp"
#include "wienertree/model/square_root.hpp"

namespace wienertree {

namespace text {
class Arena;
struct Node;
}  // namespace text

/// Values that replace parameters of a file: (name, value).
using ParameterOverrides = std::vector<std::pair<std::string, double>>;

/// What can be said about a model from its coefficients. Expressions are in the syntax of the file (with sign
/// and step where abs, min and max were differentiated), parameters as symbols; components in the order of
/// `states`.
struct ModelAnalysis {
  struct Bracket {
    std::size_t i, j;                     ///< of [V_i, V_j], i < j
    std::vector<std::string> components;  ///< d
  };
  std::string name;
  std::string convention;           ///< in which the drift was given: "ito", "stratonovich"
  std::vector<std::string> states;  ///< d names, the last one "t" when `has_clock`
  /// Known functions of time, in which u' stands for the slope of u.
  std::vector<std::pair<std::string, Between>> inputs;
  bool has_clock = false;
  std::vector<std::pair<std::string, double>> parameters;  ///< after overrides
  /// Of the Brownian motions of the file, p x p; V_1 .. V_p are along independent ones. Empty: they are these.
  std::vector<std::vector<std::string>> correlation;
  std::vector<std::string> ito_drift;               ///< V~_0, d
  std::vector<std::vector<std::string>> fields;     ///< V_0 (Stratonovich), V_1 .. V_p, d each
  std::vector<std::vector<std::string>> jacobians;  ///< of V_0 .. V_p; entry i*d + l is dV^i/dx_l
  std::vector<Bracket> brackets;                    ///< [V_i, V_j] = (DV_j) V_i - (DV_i) V_j
  std::vector<std::string> sensor;                  ///< h, k
  std::vector<std::string> sensor_derivative;       ///< entry i*p + r-1 is V_r h_i
  std::string log_likelihood;                       ///< empty when the model has none
  bool affine_fields = false, affine_sensor = false, has_exact_flow = false;
  ExactFilter exact_filter = ExactFilter::none;
  std::string exact_filter_name;    ///< "benes", "kalman-bucy", "kalman", "none"
  std::string exact_filter_reason;  ///< why it applies, or why none does
  /// What is known of the transition: one line for each square-root process, and for a price that is lognormal
  /// given these; empty where there is none, or other states stand in the way.
  std::vector<std::string> square_roots;
  std::string square_roots_reason;  ///< why there is none
};

/// int_0^t of an expression of states, parameters and time along the path, under a name of its own.
struct RunningIntegral {
  std::string name, integrand;
  std::string where;  ///< how errors call it, e.g. "--average"
};

/// A model together with the text it was made from.
class TextModel {
 public:
  /// @throws InputError naming file, line, column and key
  static TextModel load(const std::string& path, const ParameterOverrides& overrides = {});
  /// origin: the name that errors give to the text
  static TextModel parse(std::string_view toml, const std::string& origin,
                         const ParameterOverrides& overrides = {});

  const Model& model() const;
  ModelAnalysis analysis() const;
  /// An expression of parameters and states (and t, when the model depends on it) as a function over batches
  /// of states.   where: how errors call it, e.g. "--payoff".
  /// @throws InputError with the column of the offending symbol
  BatchFunction compile(std::string_view expression, const std::string& where) const;

  /// The same with its kinks and jumps, where max, min, abs, sign, a comparison or `if` are not smooth: the
  /// smooth branches on either side (text/branches.hpp), and a smoothed function, whose average over a smooth
  /// law differs by O(h^12), h the width of smoothing (text/smoothing.hpp has the kernel).
  KinkedFunction compile_kinked(std::string_view expression, const std::string& where) const;
  /// The value of an expression in which no state occurs, nor t; nothing if one does. Otherwise as `compile`.
  std::optional<double> constant(std::string_view expression, const std::string& where) const;

  /// The same model with its inputs known. functions: one for each name of [inputs], in any order; how they are between
  /// their times is as in the file. origin: how errors call them.
  /// @throws InputError for a name that is missing or unknown, or as InputFunctions
  TextModel with_inputs(std::vector<InputFunction> functions, const std::string& origin) const;

  /// The signal of this model with the integrals as further states after its own: d name = integrand dt,
  /// starting from 0. An integrand may use the integrals before it. What is observed is left out.
  /// @throws InputError if a name is no identifier or taken, or an integrand is not an expression
  TextModel with_integrals(const std::vector<RunningIntegral>& integrals) const;
  /// The square-root processes that the signal is made of, if it is made of nothing else.
  const std::optional<SquareRootStructure>& square_roots() const;
  /// The signal without its price (`square_roots()->price`), and with int_0^t w_k dt of every square-root
  /// process as further states, in order.   @pre there is a price
  TextModel without_price() const;
  /// The signal with Lie brackets as further driving fields V_{p+1}, V_{p+2}, ..: bracket (i, j) is
  /// [V_i, V_j] = (DV_j) V_i - (DV_i) V_j, of V_0 .. V_p or of brackets before it. Only its flows mean
  /// anything (`direct`, `jacobian`, `exact_flow`): a bracket drives no Brownian motion.
  Model with_brackets(const std::vector<std::pair<std::size_t, std::size_t>>& brackets) const;

 private:
  struct Contents;
  explicit TextModel(std::shared_ptr<const Contents> contents) : contents_(std::move(contents)) {}
  static std::shared_ptr<Contents> build(Contents contents);
  const text::Node* bound_expression(std::string_view expression, const std::string& where,
                                     text::Arena& arena) const;
  std::shared_ptr<const Contents> contents_;
};

/// The model of a file. @throws InputError naming file, line, column and key
Model load_model(const std::string& path, const ParameterOverrides& overrides = {});
/// The model of a text; `origin` is the name that errors give to it.
Model parse_model(std::string_view toml, const std::string& origin, const ParameterOverrides& overrides = {});

}  // namespace wienertree
