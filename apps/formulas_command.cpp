#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "command_line.hpp"
#include "commands.hpp"
#include "data_directory.hpp"
#include "output.hpp"
#include "wienertree/cubature/catalogue.hpp"
#include "wienertree/cubature/construct.hpp"
#include "wienertree/cubature/formula_file.hpp"
#include "wienertree/cubature/lie_formula_file.hpp"

namespace wienertree::app {
namespace {

std::string list_formulas() {
  std::string text = fmt::format("{:<28} {:>6} {:>9} {:>5} {:>8} {:>9} {:>13}  {}\n", "name", "degree",
                                 "dimension", "paths", "segments", "error", "next residual", "source");
  for (const CatalogueEntry& entry : bundled_formulas(formulas_directory()))
    text += fmt::format("{:<28} {:>6} {:>9} {:>5} {:>8} {:>9.1e} {:>13.3g}  {}\n", entry.formula.name,
                        entry.formula.degree, entry.formula.dimension, entry.formula.paths.size(),
                        total_segments(entry.formula), entry.verification.max_error,
                        entry.verification.next_residual.value_or(NAN), entry.formula.source);
  return text;
}

std::string show_lie_formula(const std::filesystem::path& file) {
  const LieFormula formula = read_lie_formula(file);
  const FormulaVerification verification = verify(formula);
  require_holds(verification, file.string());
  std::string text =
      fmt::format("{}: degree {}, {} Brownian motion{}, {} Lie polynomials\nsource: {}\n{}\n", formula.name,
                  formula.degree, formula.dimension, formula.dimension == 1 ? "" : "s",
                  formula.elements.size(), formula.source, verification.brief());
  for (std::size_t j = 0; j < formula.elements.size(); ++j) {
    text += fmt::format("\nelement {}, weight {:.17g}\n", j + 1, formula.elements[j].weight);
    for (const LieTerm& term : formula.elements[j].terms)
      text += fmt::format(" {:>25.17g} {}\n", term.coefficient, term.bracket.to_string());
  }
  return text;
}

std::string show_formula(const std::string& name) {
  const std::filesystem::path file = formula_path(name, "formulas show");
  if (is_lie_formula(file)) return show_lie_formula(file);
  const CubatureFormula formula = read_formula(file);
  const FormulaVerification verification = verify(formula);
  require_holds(verification, name);
  std::string text =
      fmt::format("{}: degree {}, {} Brownian motion{}, {} paths, {} segments\nsource: {}\n{}\n",
                  formula.name, formula.degree, formula.dimension, formula.dimension == 1 ? "" : "s",
                  formula.paths.size(), total_segments(formula), formula.source, verification.brief());
  for (std::size_t j = 0; j < formula.paths.size(); ++j) {
    const CubaturePath& path = formula.paths[j];
    text += fmt::format("\npath {}, weight {:.17g}\n", j + 1, path.weight);
    for (Eigen::Index s = 0; s < path.increments.cols(); ++s) {
      for (Eigen::Index i = 0; i < path.increments.rows(); ++i)
        text += fmt::format(" {:>25.17g}", path.increments(i, s));
      text += '\n';
    }
  }
  return text;
}

std::string verify_formula(const std::string& name) {
  const std::filesystem::path file = formula_path(name, "formulas verify");
  const FormulaVerification verification =
      is_lie_formula(file) ? verify(read_lie_formula(file)) : verify(read_formula(file));
  require_holds(verification, file.string());
  return fmt::format("{}: {}\n", file.string(), verification.brief());
}

struct ConstructArguments {
  std::optional<std::uint64_t> degree, dimension;
  std::optional<std::string> output;
  bool lie = false;
};

void construct_formula(const ConstructArguments& a) {
  OutputFile output("--output", a.output.value_or("-"));
  if (a.lie && *a.degree != 5)
    throw InputError("formulas of Lie polynomials are constructed for degree 5 only", "--degree",
                     std::to_string(*a.degree));
  const int degree = static_cast<int>(*a.degree), p = static_cast<int>(*a.dimension);
  output.stage(a.lie ? format_formula(construct_lie_5(p)) : format_formula(construct(degree, p)));
  output.publish();
}

}  // namespace

void add_formulas_command(CLI::App& program) {
  CLI::App& app = *program.add_subcommand("formulas", "Cubature formulas on Wiener space");
  app.require_subcommand(1);
  app.footer("Example:\n  wienertree formulas list");

  CLI::App& list = *app.add_subcommand("list", "The bundled formulas");
  list.footer("Example:\n  wienertree formulas list");
  list.callback([] { write_to_stdout(list_formulas()); });

  const auto shown = std::make_shared<std::string>();
  CLI::App& show = *app.add_subcommand("show", "Paths and weights of a formula, and how exact it is");
  show.add_option("NAME", *shown, "A bundled formula or a JSON file")->required();
  show.footer("Example:\n  wienertree formulas show lyons-victoir-5-1");
  show.callback([shown] { write_to_stdout(show_formula(*shown)); });

  const auto verified = std::make_shared<std::string>();
  CLI::App& check =
      *app.add_subcommand("verify", "Compute all moments of a formula; fails with the first wrong one");
  check.add_option("FILE", *verified, "A JSON file or a bundled formula")->required();
  check.footer("Example:\n  wienertree formulas verify my-formula.json");
  check.callback([verified] { write_to_stdout(verify_formula(*verified)); });

  const auto a = std::make_shared<ConstructArguments>();
  CLI::App& build = *app.add_subcommand(
      "construct", "A formula in closed form: degree 3 or 5, any number of Brownian motions");
  add_count(build, "--degree", a->degree, 1, "Degree", 99)->required();
  add_count(build, "--dimension", a->dimension, 1, "Number of Brownian motions", 1000)->required();
  build.add_flag("--lie", a->lie, "Lie polynomials, for `weak`: fewer ODEs, of fields with Lie brackets");
  add_text(build, "--output", a->output, "FILE", "Where it goes [standard output]");
  build.footer("Example:\n  wienertree formulas construct --degree 5 --dimension 6 --output nv-5-6.json");
  build.callback([a] { construct_formula(*a); });
}

}  // namespace wienertree::app
