#include "wienertree/thinning/thinning.hpp"

#include "arrays.hpp"
#include "bindings.hpp"
#include "tree_choices.hpp"

namespace wienertree::python {
namespace {

using namespace py::literals;

template <class E>
E chosen(const char* option, const std::string& value, const app::Choices<E>& choices) {
  return choices[app::choose(option, value, app::names_of(choices))].value;
}

// States as (d, M), or (M) for d = 1.
ConstBatchView view_of(const Doubles& states) {
  if (states.ndim() != 1 && states.ndim() != 2)
    throw InputError("must be an array (d, M), or (M) for d = 1", "states",
                     std::to_string(states.ndim()) + " dimensions");
  const auto d = static_cast<std::size_t>(states.ndim() == 1 ? 1 : states.shape(0));
  const auto M = static_cast<std::size_t>(states.shape(states.ndim() - 1));
  return {states.data(), d, M, M};
}

py::object moved(const Batch& states) {
  if (states.nodes() == 0) return py::none();
  const ConstBatchView view = states;
  std::vector<double> values(view.data(), view.data() + view.components() * view.nodes());
  return hand_over(std::move(values),
                   {static_cast<py::ssize_t>(view.components()), static_cast<py::ssize_t>(view.nodes())});
}

py::object thin(const py::object& given_states, const py::object& given_log_weight, std::size_t nodes,
                const std::string& method, const std::string& order, int recombination_degree,
                std::size_t parents, std::uint64_t seed, std::uint32_t step, std::size_t threads) {
  const Doubles states = doubles_of(given_states, "states"),
                log_weight = doubles_of(given_log_weight, "log_weight");
  const ThinningOptions options{chosen("method", method, app::thinnings), chosen("order", order, app::orders),
                                recombination_degree};
  ThreadPool pool(threads);
  const Sites sites{view_of(states), values_of(log_weight), parents, &pool};
  if (sites.log_weight.size() != sites.x.nodes() || log_weight.ndim() != 1)
    throw InputError(
        "must be one for each site", "log_weight",
        std::to_string(sites.log_weight.size()) + " for " + std::to_string(sites.x.nodes()) + " sites");
  if (parents != 0 && sites.x.nodes() % parents != 0)
    throw InputError("must divide the number of sites", "parents", std::to_string(parents));
  if (nodes == 0) throw InputError("must be at least 1", "nodes", "0");
  Selection selection;
  {
    const py::gil_scoped_release unlocked;
    make_thinning(options)->thin(sites, nodes, {seed, 0, step, Purpose::thinning}, selection);
  }
  py::object count = py::none();
  if (!selection.count.empty()) count = hand_over(std::move(selection.count));
  return py::module_::import("wienertree.results")
      .attr("Selection")(hand_over(std::move(selection.site)), hand_over(std::move(selection.log_weight)),
                         count, moved(selection.moved_states), selection.discarded);
}

}  // namespace

void add_thinning(py::module_& module) {
  const std::string text =
      R"(A weighted measure on M sites in, a smaller one on some of them out: a Selection.

states: array (d, M), or (M) for d = 1; log_weight: (M). Arrays of doubles are read where they lie.
nodes: particles, or for the deterministic methods the nodes that are kept at most.
method: )" +
      CLI::detail::join(app::names_of(app::thinnings), ", ") +
      R"(.
order: in which random methods visit the sites, "tree" or "spatial".
recombination_degree: moments that the deterministic methods keep; 0: chosen from d and nodes.
parents: in tree order, site = branch * parents + parent is visited parent by parent; 0: in storage order.
seed, step: the draws are a function of these two. The result does not depend on threads.)";
  module.def("thin", &thin, "states"_a, "log_weight"_a, "nodes"_a, py::kw_only(),
             "method"_a = "recombination", "order"_a = "spatial", "recombination_degree"_a = 0,
             "parents"_a = 0, "seed"_a = 1, "step"_a = 0, "threads"_a = 1, text.c_str());
  module.def(
      "thinning_methods",
      [] {
        py::list names;
        for (const std::string& name : app::names_of(app::thinnings)) names.append(name);
        return names;
      },
      "Names of all thinning methods.");
}

}  // namespace wienertree::python
