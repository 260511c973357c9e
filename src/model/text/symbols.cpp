#include <fmt/format.h>

#include "wienertree/model/text/symbolic.hpp"

namespace wienertree::text {

std::mutex& symbolic_mutex() {
  static std::mutex mutex;
  return mutex;
}

Symbols::Symbols(const std::vector<std::string>& parameters, const std::vector<std::string>& states,
                 const std::vector<std::string>& inputs)
    : parameters_(parameters.size()), first_input_(parameters.size() + states.size() + 1) {
  const auto add = [this](const std::string& name, Role role, std::size_t index) {
    entries_.push_back({name, role, index, GiNaC::realsymbol(name)});
    known_.emplace(entries_.back().symbol, &entries_.back());
  };
  for (std::size_t i = 0; i < parameters.size(); ++i) add(parameters[i], Role::parameter, i);
  for (std::size_t i = 0; i < states.size(); ++i) add(states[i], Role::state, i);
  add("t", Role::state, states.size());
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    add(inputs[k], Role::input, 2 * k);
    add(inputs[k] + "'", Role::input, 2 * k + 1);
  }
}

const GiNaC::realsymbol& Symbols::observation(std::size_t i) {
  while (observations_.size() <= i) {
    const std::string name = fmt::format("y{}", observations_.size() + 1);
    observations_.push_back({name, Role::observation, observations_.size(), GiNaC::realsymbol(name)});
    known_.emplace(observations_.back().symbol, &observations_.back());
  }
  return observations_[i].symbol;
}

const Symbols::Entry* Symbols::find(std::string_view name) const {
  for (const Entry& entry : entries_)
    if (entry.name == name) return &entry;
  return nullptr;
}

const Symbols::Entry& Symbols::entry(const GiNaC::symbol& symbol) const { return *known_.at(symbol); }

}  // namespace wienertree::text
