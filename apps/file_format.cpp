#include "file_format.hpp"

#include <fmt/format.h>

#include "study/study_keys.hpp"
#include "wienertree/cubature/formula_keys.hpp"
#include "wienertree/model/text/function_names.hpp"
#include "wienertree/model/text/model_keys.hpp"

namespace wienertree::app {
namespace {

std::string function_list() {
  std::string names;
  for (const text::FunctionName& function : text::function_names)
    names += (names.empty() ? "" : " ") + std::string(function.name);
  return names;
}

FileFormat model_format() {
  return {"model",
          "A model is a TOML file. Expressions are text or numbers, of the states, the parameters, the time "
          "t and pi, with\n"
          "+ - * / ^, parentheses, comparisons (x > 1: 1 or 0), and, or, not, if(condition, a, b),\n" +
              function_list() + ".\n",
          {{"At the top", "", text::model_keys},
           {"[state] NAME = { .. }", "", text::state_keys},
           {"[inputs] NAME = { .. }", "", text::input_keys},
           {"[noise]", "", text::brownian_keys},
           {"[observation]", "", text::observation_keys},
           {"[observation] noise = { .. }", "", text::noise_keys},
           {"[initial]", "", text::initial_keys},
           {"[exact]", "", text::exact_keys}},
          R"toml(name = "pendulum"
convention = "ito"

[parameters]
damping = 0.2
s = 0.3

[state]
angle = { initial = 1.0 }
speed = { initial = 0.0, lower = -20, upper = 20, boundary = "clamp" }

[drift]
angle = "speed"
speed = "-sin(angle) - damping*speed"

[diffusion]
angle = [0]
speed = ["s"]

[observation]
kind = "discrete"
h = ["sin(angle)"]
noise = { law = "gaussian", sd = 0.1 }
)toml"};
}

FileFormat formula_format() {
  return {
      "formula",
      "A cubature formula is a JSON file. No key is optional, and no other is allowed. Every moment up to "
      "the degree is\n"
      "checked when it is read, to 1e-12: numbers need 17 digits. A formula of Lie polynomials is read by "
      "weak only.\n",
      {{"At the top", "", formula_keys},
       {"In paths", "", path_keys},
       {"At the top of a formula of Lie polynomials", "", lie_formula_keys},
       {"In elements", "", lie_element_keys},
       {"In terms", "", lie_term_keys}},
      R"json({"name": "two-lines", "degree": 3, "dimension": 1, "source": "Lyons, Victoir (2004)", "paths": [
  {"weight": 0.5, "segments": [[1, 1]]},
  {"weight": 0.5, "segments": [[1, -1]]}
]}
)json"};
}

FileFormat observations_format() {
  return {"observations",
          "Observations are a CSV file with the header t,y1[,y2..], a column a component of h, and "
          "increasing t. The law at\n"
          "the start is that of the state at the first row. Continuous observations: rows are the path of "
          "Y, the first one\n"
          "its start, and no value is missing. Discrete ones: every row is an observation, an empty field "
          "a missing value. Beside them may stand the inputs of a model, in any order; --inputs takes them "
          "from a file\n"
          "of their own, with the header t,NAME[,NAME..].\n"
          "Files of signals have the header t,<state>[,<state>..] instead.\n",
          {},
          "t,y1\n0,0\n0.25,0.1043\n0.5,-0.2218\n0.75,-0.1509\n1,0.0381\n"};
}

FileFormat study_format() {
  return {
      "study",
      "A study is a TOML file. A list among its options is swept; several lists give every combination.\n",
      {{"At the top", "", study_keys},
       {"reference",
        "\"exact\", \"none\", a number, an expression of the model's parameters, or a table with one of",
        reference_keys},
       {"[observations]", "", observations_keys},
       {"[options]",
        "The options of filter or weak, without dashes, each a value or a list; model; set.NAME for a "
        "parameter; until,\n"
        "the time at which a filter is asked, the end of the record if not given. threads has no place "
        "here.",
        {}},
       {"[[series]]", "Options that take the place of those of [options], and", series_keys},
       {"[[plot]]", "", plot_keys},
       {"[[claim]]", "A slope, or a ratio of two lines, and where it must lie", claim_keys},
       {"[full]", "The same keys, and tables key by key.", {}}},
      R"toml(title = "Error against the number of steps"
quantity = "mean_x"
measure = "rmse"
reference = "exact"

[observations]
horizon = 4.0
steps = 4000
keep = 400
paths = 3

[options]
model = "benes"
steps = [10, 20, 40]
functional = ["picard", "second-order"]

[[plot]]
x = "steps"

[[claim]]
text = "The second-order functional is of order 1.5 or better"
slope = "functional second-order"
within = [-4, -1.5]
)toml"};
}

FileFormat checkpoint_format() {
  return {"checkpoint",
          "A checkpoint is written by --checkpoint and read by --resume of filter, compare and weak:\n"
          "  the line \"wienertree checkpoint 1\", in which 1 is the version of the format,\n"
          "  a line of JSON: command, version of the program, checksums of model, formula and "
          "observations, every option,\n"
          "  the state of the run as bytes, in the machine's byte order, which the JSON names,\n"
          "  the CRC-64 of all before it in eight bytes, the lowest first.\n"
          "What differs from the run that is to be resumed is refused, with both values.\n",
          {},
          ""};
}

std::string note_of(const FileKey& key) {
  if (key.otherwise.starts_with("required")) return fmt::format(" ({})", key.otherwise);
  return fmt::format(" [{}]", key.otherwise);
}

}  // namespace

const std::vector<FileFormat>& file_formats() {
  static const std::vector<FileFormat> formats = {model_format(), formula_format(), observations_format(),
                                                  study_format(), checkpoint_format()};
  return formats;
}

std::string format_text(const FileFormat& format) {
  std::string text = format.introduction;
  for (const FormatSection& section : format.sections) {
    text += fmt::format("\n{}\n", section.name);
    if (!section.says.empty()) text += section.says + '\n';
    for (const FileKey& key : section.keys)
      text +=
          fmt::format("  {:<15} {}\n  {:<15}   {}{}\n", key.name, key.value, "", key.meaning, note_of(key));
  }
  if (!format.example.empty()) text += "\nExample\n\n" + format.example;
  return text;
}

}  // namespace wienertree::app
