#include "study_identity.hpp"

#include <fstream>
#include <sstream>

#include "../data_directory.hpp"
#include "wienertree/cubature/formula_file.hpp"
#include "wienertree/run/checksum.hpp"
#include "wienertree/version.hpp"

namespace wienertree::app {
namespace {

std::string checksum_of_file(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError("cannot be read", "study", file);
  std::ostringstream all;
  all << in.rdbuf();
  return checksum_text(all.str());
}

std::string checksum_of_formula(const CubatureFormula& formula) {
  return formula.paths.empty() ? "" : checksum_text(format_formula(formula));
}

Json identity_of(const FilterCell& cell) {
  Json json;
  json["options"] = options_in_force(cell.setup, *cell.model);
  json["steps"] = cell.steps.value_or(0);
  json["formula"] = checksum_of_formula(cell.setup.options.formula);
  json["model"] = checksum_of_file(cell.model_file);
  return json;
}

Json identity_of(const WeakCell& cell) {
  Json json;
  json["model"] = checksum_of_file(model_file(cell.arguments.model).string());
  const std::vector<CubatureFormula> formulas =
      cell.driven ? std::vector{cell.driven->formula} : weak_formulas(cell.arguments, cell.problem);
  for (const CubatureFormula& formula : formulas) json["formulas"].push_back(checksum_of_formula(formula));
  return json;
}

Json identity_of_record(const Study& study, const ModelShelf& models) {
  const StudyObservations& o = study.observations;
  if (o.file) return checksum_of_file(observation_file(study));
  Json json = {{"horizon", o.horizon}, {"steps", o.steps}, {"keep", o.keep}, {"seed", o.seed}};
  if (o.model) json["model"] = checksum_of_file(model_file(models.file_of(*o.model)).string());
  return json;
}

Json identity_of_reference(const Study& study, const StudyCell& cell, const StudyData& data) {
  Json json;
  json["kind"] = static_cast<int>(study.reference.kind);
  const StudyData::Reference reference = data.reference(cell);
  if (reference.value) json["value"] = *reference.value;
  if (reference.filter != nullptr) json["run"] = identity_of(*reference.filter);
  if (reference.weak == nullptr) return json;
  json["run"] = identity_of(*reference.weak);
  for (const StudyOption& option : study.reference.options) json["options"][option.name] = option.values;
  return json;
}

}  // namespace

std::string identity_of_runs(const Study& study, const StudyCell& cell, const StudyData& data,
                             const ModelShelf& models) {
  Json json;
  json["version"] = WIENERTREE_VERSION;
  json["command"] = study.weak ? "weak" : "filter";
  json["options"] = cell.options;
  json["cell"] = cell.filter ? identity_of(*cell.filter) : identity_of(*cell.weak);
  if (!study.weak) json["record"] = identity_of_record(study, models);
  json["reference"] = identity_of_reference(study, cell, data);
  return checksum_text(json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

}  // namespace wienertree::app
