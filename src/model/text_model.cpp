#include "wienertree/model/text_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "wienertree/model/text/assembly.hpp"
#include "wienertree/model/text/bounded_states.hpp"
#include "wienertree/model/text/branches.hpp"
#include "wienertree/model/text/exact_filter.hpp"
#include "wienertree/model/text/smoothing.hpp"
#include "wienertree/model/text/square_root_form.hpp"
#include "wienertree/numeric/read_all.hpp"

namespace wienertree {

struct TextModel::Contents {
  text::ModelSource source;
  std::vector<double> parameters;
  std::shared_ptr<const InputFunctions> inputs = nullptr;  ///< null: as yet without values, or none
  Model model;
  std::string exact_filter_reason;
  text::SquareRootAnswer square_roots;
};

namespace {

std::string read_file(const std::string& path) {
  std::error_code status;
  if (std::filesystem::is_directory(path, status))
    throw InputError("this is a folder, not a model file", path);
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError("cannot read the model file", path, std::strerror(errno));
  std::string contents = read_all(file, largest_text_file, path);
  if (file.bad()) throw InputError("cannot read the model file", path, std::strerror(errno));
  return contents;
}

std::vector<std::string> printed(const std::vector<text::Expression>& list) {
  std::vector<std::string> result;
  for (text::Expression e : list) result.push_back(print(e));
  return result;
}

// As yet without values.
std::shared_ptr<const InputFunctions> unknown_inputs(const text::ModelSource& source) {
  if (source.inputs.empty()) return nullptr;
  std::vector<InputFunction> functions;
  for (const text::InputSource& input : source.inputs)
    functions.push_back({input.name, input.between, {}, {}});
  return std::make_shared<InputFunctions>(std::move(functions), "model " + source.name);
}

std::vector<std::vector<std::string>> printed(const std::vector<std::vector<text::Expression>>& lists) {
  std::vector<std::vector<std::string>> result;
  for (const auto& list : lists) result.push_back(printed(list));
  return result;
}

}  // namespace

TextModel TextModel::load(const std::string& path, const ParameterOverrides& overrides) {
  return parse(read_file(path), path, overrides);
}

TextModel TextModel::parse(std::string_view toml, const std::string& origin,
                           const ParameterOverrides& overrides) {
  Contents contents;
  contents.source = text::read_model(toml, origin);
  contents.parameters = text::parameter_values(contents.source, overrides);
  return TextModel(build(std::move(contents)));
}

// The model from source and parameters.
std::shared_ptr<TextModel::Contents> TextModel::build(Contents contents) {
  const text::ModelSource& source = contents.source;
  const text::SymbolicModel symbolic = text::derive(source, contents.parameters, false);
  text::Arena arena;
  const text::FieldExpressions bound =
      text::substitute(symbolic.coefficients, source, contents.parameters, arena);
  if (!contents.inputs) contents.inputs = unknown_inputs(source);
  contents.model = text::assemble(source, bound, contents.parameters, contents.inputs);
  const text::ExactFilterAnswer exact = text::exact_filter({bound, source, contents.model});
  contents.model.exact_filter = exact.filter;
  contents.model.benes = exact.benes;
  contents.exact_filter_reason = exact.reason;
  contents.square_roots = text::square_root_structure(bound, contents.model);
  check(contents.model);
  return std::make_shared<Contents>(std::move(contents));
}

TextModel TextModel::with_inputs(std::vector<InputFunction> functions, const std::string& origin) const {
  Contents known;
  known.source = contents_->source;
  known.parameters = contents_->parameters;
  std::vector<std::string> names;
  std::vector<InputFunction> in_order;
  for (const text::InputSource& input : known.source.inputs) {
    names.push_back(input.name);
    const auto given = std::find_if(functions.begin(), functions.end(),
                                    [&](const InputFunction& f) { return f.name == input.name; });
    if (given == functions.end()) throw InputError("lacks an input of the model", origin, input.name);
    in_order.push_back(std::move(*given));
    in_order.back().between = input.between;
    functions.erase(given);
  }
  if (!functions.empty())
    throw InputError("the model has no such input" + text::suggestion(functions.front().name, names), origin,
                     functions.front().name);
  if (!in_order.empty()) known.inputs = std::make_shared<InputFunctions>(std::move(in_order), origin);
  return TextModel(build(std::move(known)));
}

TextModel TextModel::with_integrals(const std::vector<RunningIntegral>& integrals) const {
  Contents extended;
  extended.source = contents_->source;
  extended.parameters = contents_->parameters;
  extended.inputs = contents_->inputs;
  extended.source.observation = {};
  extended.source.exact.reset();
  for (const RunningIntegral& integral : integrals)
    text::add_integral(extended.source, integral.name, integral.integrand, integral.where);
  return TextModel(build(std::move(extended)));
}

const std::optional<SquareRootStructure>& TextModel::square_roots() const {
  return contents_->square_roots.structure;
}

TextModel TextModel::without_price() const {
  const SquareRootStructure& structure = *contents_->square_roots.structure;
  const auto price = static_cast<std::ptrdiff_t>(structure.price->state);
  Contents reduced;
  reduced.source = contents_->source;
  reduced.parameters = contents_->parameters;
  reduced.inputs = contents_->inputs;
  reduced.source.observation = {};
  reduced.source.exact.reset();
  for (const SquareRootStructure::Component& component : structure.components) {
    const std::string& name = reduced.source.states[component.state].name;
    std::string integral = "integral_" + name;
    const auto is_taken = [&](const auto& named) { return named.name == integral; };
    while (std::any_of(reduced.source.states.begin(), reduced.source.states.end(), is_taken) ||
           std::any_of(reduced.source.parameters.begin(), reduced.source.parameters.end(), is_taken))
      integral += "_";
    text::add_integral(reduced.source, integral, fmt::format("{} + ({:.17g})", name, component.shift),
                       "the integral of a variance");
  }
  reduced.source.states.erase(reduced.source.states.begin() + price);
  reduced.source.drift.erase(reduced.source.drift.begin() + price);
  reduced.source.diffusion.erase(reduced.source.diffusion.begin() + price);
  return TextModel(build(std::move(reduced)));
}

Model TextModel::with_brackets(const std::vector<std::pair<std::size_t, std::size_t>>& brackets) const {
  text::ModelSource source = contents_->source;
  source.observation = {};
  source.exact.reset();
  const text::SymbolicModel symbolic = text::derive(source, contents_->parameters, false, brackets);
  text::Arena arena;
  const text::FieldExpressions bound =
      text::substitute(symbolic.coefficients, source, contents_->parameters, arena);
  Model model = text::assemble(source, bound, contents_->parameters, contents_->inputs);
  check(model);
  return model;
}

const Model& TextModel::model() const { return contents_->model; }

ModelAnalysis TextModel::analysis() const {
  const Model& model = contents_->model;
  const text::SymbolicModel symbolic = text::derive(contents_->source, contents_->parameters, true);
  const text::FieldExpressions& c = symbolic.coefficients;
  ModelAnalysis result;
  result.name = model.name;
  result.convention = contents_->source.convention == text::Convention::ito ? "ito" : "stratonovich";
  result.states = model.state_names;
  for (const text::InputSource& input : contents_->source.inputs)
    result.inputs.emplace_back(input.name, input.between);
  result.has_clock = model.has_clock;
  result.parameters = model.parameters;
  result.correlation = printed(c.correlation);
  result.ito_drift = printed(c.ito_drift);
  result.fields = printed(c.fields);
  result.jacobians = printed(c.jacobians);
  for (const text::Bracket& bracket : symbolic.brackets)
    result.brackets.push_back({bracket.i, bracket.j, printed(bracket.components)});
  result.sensor = printed(c.sensor);
  result.sensor_derivative = printed(c.sensor_derivative);
  if (c.log_likelihood) result.log_likelihood = print(*c.log_likelihood);
  result.affine_fields = model.fields->affine_fields() != nullptr;
  result.affine_sensor = model.fields->affine_sensor() != nullptr;
  result.has_exact_flow = model.fields->has_exact_flow();
  result.exact_filter = model.exact_filter;
  result.exact_filter_name = text::name(model.exact_filter);
  result.exact_filter_reason = contents_->exact_filter_reason;
  if (contents_->square_roots.structure)
    result.square_roots = text::described(*contents_->square_roots.structure, model);
  result.square_roots_reason = contents_->square_roots.reason;
  return result;
}

namespace {

// Observations are `uniforms`, or with `further` components of x after the d states, those.
BatchFunction batch_function(text::Expression e, const Model& model, std::vector<double> uniforms,
                             std::size_t further = 0) {
  const std::size_t d = model.state_dimension(), columns = model.inputs ? model.inputs->columns() : 0;
  TapeBuilder builder(d + further + columns, uniforms.size());
  text::TapeSymbols symbols;
  for (std::size_t i = 0; i < d; ++i) symbols.states.push_back(builder.input(i));
  for (std::size_t i = 0; i < uniforms.size(); ++i) symbols.observations.push_back(builder.uniform(i));
  for (std::size_t i = 0; i < further; ++i) symbols.observations.push_back(builder.input(d + i));
  if (model.inputs) text::take_columns(symbols, builder, *model.inputs, d + further);
  const TapeBuilder::Value output = text::emit(e, symbols, builder);
  return [tape = builder.finish(std::span(&output, 1)), uniforms = std::move(uniforms), known = model.inputs,
          clock = d - 1](ConstBatchView x, std::span<double> out) {
    thread_local std::vector<const double*> inputs;
    inputs.clear();
    for (std::size_t i = 0; i < x.components(); ++i) inputs.push_back(x.component(i).data());
    if (known) known->append(x.component(clock), inputs);
    double* const outputs = out.data();
    tape.evaluate(inputs, uniforms, std::span(&outputs, 1), x.nodes());
  };
}

}  // namespace

text::Expression TextModel::bound_expression(std::string_view expression, const std::string& where,
                                             text::Arena& arena) const {
  const text::SourceExpression source{std::string(expression), {where, 1, 1, ""}, true};
  return text::state_expression(source, contents_->source, contents_->model.has_clock, contents_->parameters,
                                arena);
}

BatchFunction TextModel::compile(std::string_view expression, const std::string& where) const {
  text::Arena arena;
  return batch_function(bound_expression(expression, where, arena), contents_->model, {});
}

KinkedFunction TextModel::compile_kinked(std::string_view expression, const std::string& where) const {
  const auto arena = std::make_shared<text::Arena>();
  const text::Expression e = bound_expression(expression, where, *arena);
  const std::shared_ptr<const Contents> contents = contents_;
  const text::SmoothedKinks smoothed = text::smooth_kinks(e, *arena);
  const text::Branches branches = text::branches_of(e, *arena);
  KinkedFunction function;
  function.exact = batch_function(e, contents->model, {});
  for (const text::Expression argument : branches.exact)
    function.kinks.push_back(batch_function(argument, contents->model, {}));
  const auto bound_to = [arena, contents](text::Expression value, std::span<const double> numbers) {
    return batch_function(value, contents->model, std::vector<double>(numbers.begin(), numbers.end()));
  };
  function.smoothed = [bound_to, value = smoothed.value](std::span<const double> widths) {
    std::vector<double> inverse;
    for (const double width : widths) inverse.push_back(1 / width);
    return bound_to(value, inverse);
  };
  function.branch = [bound_to, value = branches.value](std::span<const double> above) {
    return bound_to(value, above);
  };
  function.argument_branch = [bound_to, arguments = branches.arguments](std::size_t k,
                                                                        std::span<const double> above) {
    return bound_to(arguments[k], above);
  };
  if (branches.exact == branches.arguments)
    function.with_argument = [arena, e, exact = branches.exact, contents](std::size_t k) {
      return batch_function(text::with_argument(e, exact[k], *arena), contents->model, {}, 1);
    };
  return function;
}

std::optional<double> TextModel::constant(std::string_view expression, const std::string& where) const {
  text::Arena arena;
  const text::Expression e = bound_expression(expression, where, arena);
  if (!e->is_number()) return {};
  return e->number;
}

Model load_model(const std::string& path, const ParameterOverrides& overrides) {
  return TextModel::load(path, overrides).model();
}

Model parse_model(std::string_view toml, const std::string& origin, const ParameterOverrides& overrides) {
  return TextModel::parse(toml, origin, overrides).model();
}

}  // namespace wienertree
