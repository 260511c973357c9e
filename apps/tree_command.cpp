#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <sstream>

#include "command_line.hpp"
#include "commands.hpp"
#include "data_directory.hpp"
#include "filter_arguments.hpp"
#include "input_files.hpp"
#include "output.hpp"
#include "standard_input.hpp"
#include "tree_plot.hpp"
#include "wienertree/model/text_model.hpp"
#include "wienertree/run/window_source.hpp"
#include "wienertree/tree/genealogy.hpp"

namespace wienertree::app {
namespace {

struct TreeArguments {
  std::string model;
  Assignments parameters;
  FilterArguments filter;
  std::optional<std::uint64_t> steps;
  std::optional<double> horizon;
  std::optional<std::string> observations, dot, graphml, plot;
  bool quiet = false;
};

constexpr double most_nodes = 20000;  // more than any layout shows
constexpr std::size_t usual_nodes = 20;

// Equal steps of [0, T] without observations.
class BareWindows final {
 public:
  BareWindows(double horizon, std::size_t steps) : horizon_(horizon), steps_(steps) {}
  bool next(ObservationWindow& window) {
    if (done_ == steps_) return false;
    const auto at = [&](std::size_t j) {
      return horizon_ * static_cast<double>(j) / static_cast<double>(steps_);
    };
    window.step = done_ + 1;
    window.start = at(done_);
    window.end = at(++done_);
    return true;
  }
  std::size_t size() const { return steps_; }

 private:
  double horizon_;
  std::size_t steps_, done_ = 0;
};

void refuse_large_picture(const FilterSetup& setup, std::size_t steps) {
  const auto paths = static_cast<double>(setup.options.formula.paths.size());
  double level = 1, all = 1;
  for (std::size_t j = 0; j < steps && all <= most_nodes; ++j) {
    level *= paths;
    if (setup.options.method == FilterMethod::klv)
      level = std::min(level, static_cast<double>(setup.options.nodes));
    all += level;
  }
  if (all > most_nodes)
    throw InputError(
        fmt::format("the tree would have more than {} nodes: take fewer --steps or --nodes", most_nodes),
        "tree", fmt::format("{} steps", steps));
}

// log-likelihood of the last step per node kept: what its child's weight gained over that of its parent and
// its path.
std::vector<double> step_likelihoods(const Genealogy& genealogy, const Posterior& children,
                                     const Generation& kept, const CubatureFormula& formula) {
  const std::span<const double> before = genealogy.log_weights(genealogy.generations() - 1);
  std::vector<double> gained(kept.size());
  for (std::size_t n = 0; n < kept.size(); ++n) {
    const std::size_t parent = kept.parent[n], branch = kept.branch[n];
    gained[n] = std::log(children.weight[branch * before.size() + parent]) + children.log_evidence -
                before[parent] - std::log(formula.paths[branch].weight);
  }
  return gained;
}

template <class Windows>
Genealogy grow_tree(const Model& model, const FilterSetup& setup, Windows& windows) {
  refuse_large_picture(setup, windows.size());
  const auto filter = make_filter(model, setup.options);
  const bool counted = setup.random;
  const bool observed = model.observation != ObservationKind::none;
  Genealogy genealogy({.states = true, .weights = true, .counts = counted, .likelihoods = observed},
                      model.state_names);
  for (ObservationWindow window; windows.next(window);) {
    // An observation at the start weighs the root before it grows.
    if (window.length() > 0 && genealogy.generations() == 0) {
      Generation root = *filter->generation();
      root.time = window.start;
      genealogy.append(root);
    }
    filter->advance(window);
    if (window.length() == 0) continue;
    const Generation& kept = *filter->generation();
    genealogy.append(kept, observed
                               ? step_likelihoods(genealogy, filter->posterior(), kept, setup.options.formula)
                               : std::vector<double>());
  }
  return genealogy;
}

template <class Write>
void stage(OutputFile& file, const Genealogy& genealogy, Write write) {
  std::ostringstream text;
  write(text, genealogy);
  file.stage(text.str());
}

std::string title_of(const Model& model, const FilterSetup& setup, const TreeArguments& a) {
  return fmt::format("{} on {}, {}", describe(setup), model.name,
                     a.horizon ? "without observations" : *a.observations);
}

std::string summary(const Genealogy& genealogy) {
  const std::size_t last = genealogy.generations() - 1;
  std::string text =
      fmt::format("{} generations, {} nodes, {} at t = {:g}\nancestors of the last generation: {}\n",
                  genealogy.generations(), genealogy.nodes(), genealogy.size(last), genealogy.time(last),
                  fmt::join(distinct_ancestors(genealogy), " "));
  if (const auto ancestor = most_recent_common_ancestor(genealogy))
    text +=
        fmt::format("most recent common ancestor at t = {:g}\n", genealogy.time(generation_of(*ancestor)));
  return text;
}

void write_tree(const TreeArguments& a) {
  Model model = load_model(model_file(a.model).string(), a.parameters);
  refuse_inputs(model, "the tree that is drawn");
  if (!a.dot && !a.graphml && !a.plot)
    throw InputError("give one of --plot, --dot and --graphml, or several", "tree");
  if (a.horizon.has_value() == a.observations.has_value())
    throw InputError("give either --horizon (the signal alone) or --observations", "tree");
  if (a.horizon && !a.steps) throw InputError("is needed with --horizon", "--steps");
  if (a.dot == "-" && a.graphml == "-")
    throw InputError("standard output takes one file only", "--graphml", "-");
  FilterArguments arguments = a.filter;
  if (!arguments.thin) arguments.thin = ThinningMethod::tbba;
  if (!arguments.conditioning) arguments.conditioning = Conditioning::children;
  if (!arguments.nodes && arguments.thin != ThinningMethod::none) arguments.nodes = usual_nodes;
  if (a.horizon) model.observation = ObservationKind::none;
  const FilterSetup setup = filter_setup(arguments, model);
  std::optional<Picture> picture;
  std::optional<OutputFile> dot, graphml, plot;
  if (a.plot) {
    picture.emplace(*a.plot);
    plot.emplace("--plot", *a.plot);
  }
  if (a.dot) dot.emplace("--dot", *a.dot);
  if (a.graphml) graphml.emplace("--graphml", *a.graphml);

  const Genealogy genealogy = [&] {
    if (a.horizon) {
      BareWindows windows(*a.horizon, *a.steps);
      return grow_tree(model, setup, windows);
    }
    if (model.observation == ObservationKind::none)
      throw InputError("the model has no [observation]: give --horizon instead", "--observations",
                       *a.observations);
    const auto windows = windows_of(*a.observations, model, a.steps);
    return grow_tree(model, setup, *windows);
  }();
  if (dot) stage(*dot, genealogy, write_graphviz);
  if (graphml) stage(*graphml, genealogy, write_graphml);
  if (plot) plot->stage(draw_tree(*picture, title_of(model, setup, a), genealogy));
  if (dot) dot->publish();
  if (graphml) graphml->publish();
  if (plot) plot->publish();
  if (!a.quiet) tell(summary(genealogy));
}

}  // namespace

void add_tree_command(CLI::App& program) {
  CLI::App& app =
      *program.add_subcommand("tree", "The thinned tree as a graph, with states, weights and counts");
  const auto a = std::make_shared<TreeArguments>();
  app.add_option("MODEL", a->model, "A bundled model or a TOML file")->required();
  add_number(app, "--horizon", a->horizon, Sign::positive,
             "End of the time interval: the tree of the signal alone");
  add_text(app, "--observations", a->observations, "FILE", "CSV with header t,y1,..: the tree of the filter");
  add_count(app, "--steps", a->steps, 1, "Steps", 1'000'000);
  add_text(app, "--plot", a->plot, "FILE",
           "A picture, .svg or .png: nodes by time and state, sized by weight, coloured by likelihood");
  add_text(app, "--dot", a->dot, "FILE", "GraphViz; - is standard output");
  add_text(app, "--graphml", a->graphml, "FILE", "GraphML; - is standard output");
  add_tree_options(app, a->filter);
  add_assignments(app, a->parameters);
  app.add_flag("--quiet", a->quiet, "No summary");
  app.footer(
      "Thinning is tbba to 20 nodes if nothing else is asked for. Example:\n"
      "  wienertree tree benes --observations Y.csv --steps 20 --nodes 30 --plot tree.svg");
  app.callback([a] { write_tree(*a); });
}

}  // namespace wienertree::app
