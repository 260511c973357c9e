#pragma once
/// The symbols of a model's source, and its places in what algebra throws.
#include <exception>
#include <string>
#include <vector>

#include "wienertree/model/text/model_source.hpp"
#include "wienertree/model/text/symbolic.hpp"

namespace wienertree::text {

inline std::vector<std::string> names(const std::vector<NamedExpression>& list) {
  std::vector<std::string> result;
  for (const NamedExpression& entry : list) result.push_back(entry.name);
  return result;
}

inline std::vector<std::string> names(const std::vector<StateSource>& list) {
  std::vector<std::string> result;
  for (const StateSource& entry : list) result.push_back(entry.name);
  return result;
}

inline std::vector<std::string> names(const std::vector<InputSource>& list) {
  std::vector<std::string> result;
  for (const InputSource& entry : list) result.push_back(entry.name);
  return result;
}

inline Symbols symbols_of(const ModelSource& source) {
  return {names(source.parameters), names(source.states), names(source.inputs)};
}

// What the algebra makes of valid input may still have a pole or leave the real numbers.
template <class F>
auto at_place(const SourceExpression& source, F&& f) {
  try {
    return f();
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw InputError("this expression is not a finite real number everywhere it must be",
                     source.location.text(), error.what());
  }
}

}  // namespace wienertree::text
