#pragma once
/// The keys of a study file, section by section.
#include <array>

#include "wienertree/model/file_key.hpp"

namespace wienertree::app {

inline constexpr std::array<FileKey, 15> study_keys{{
    {"title", "text", "required", "heading of the page"},
    {"paper", "text", "none", "what was published"},
    {"finding", "text", "none", "what is found"},
    {"command", "\"filter\" or \"weak\"", "filter", "what is run"},
    {"quantity", "one or a list", "mean_x; value for weak",
     "mean_, sd_, m2_ .. m9_ or wasserstein_<state>, log_evidence, log_bayes_factor, variance; for weak: "
     "value, "
     "extrapolated"},
    {"measure", "one or a list", "rmse", "absolute, relative, rmse, relative-rmse, deviation or value"},
    {"launches", "whole number", "1", "how often a cell that draws random numbers is run"},
    {"reference", "see below", "none", "what runs are compared with"},
    {"observations", "table", "required for filter", "records that are filtered"},
    {"options", "table", "required", "options of every run"},
    {"pool", "list of options", "none", "whose values are taken together, as runs of one cell"},
    {"series", "list of tables", "one, of [options]", "lines with options of their own"},
    {"plot", "list of tables", "none", "pictures"},
    {"claim", "list of tables", "none", "sentences that the numbers decide"},
    {"full", "table", "none", "what takes the place of the same keys with --full"},
}};

inline constexpr std::array<FileKey, 2> reference_keys{{
    {"by_payoff", "PAYOFF = number or expression", "none", "of the model's parameters, for each payoff"},
    {"run", "table", "none", "options of a finer run, in addition to those that state the problem"},
}};

inline constexpr std::array<FileKey, 7> observations_keys{{
    {"file", "text", "simulated", "one record, alone among the keys here; from the study file's directory"},
    {"model", "text", "the cell's", "the model of the simulation"},
    {"horizon", "number", "required", "end of the records, which start at 0"},
    {"steps", "whole number", "required", "of Euler's method"},
    {"keep", "whole number", "steps", "how many rows are kept; divides steps"},
    {"paths", "whole number", "1", "independent records"},
    {"seed", "whole number", "1", "of the simulation"},
}};

inline constexpr std::array<FileKey, 2> series_keys{{
    {"label", "text", "required", "what its lines are called"},
    {"launches", "whole number", "that at the top", "of this series"},
}};

inline constexpr std::array<FileKey, 13> plot_keys{{
    {"title", "text", "none", "above the plot"},
    {"kind", "\"error\" or \"density\"", "error",
     "density: the law itself, a panel a cell, on the first path"},
    {"x", "text", "required", "an option with numbers, seconds (of the processor) or ode_solves"},
    {"along", "text", "x", "the option that runs along a line"},
    {"y", "text", "the first measure", "which measure"},
    {"quantity", "text", "the first quantity", "of which quantity"},
    {"series", "list of labels", "all", "which are drawn"},
    {"fit", "true, false or [low, high]", "true with two logarithmic axes",
     "whether slopes are fitted, and to which x"},
    {"unfitted", "list of labels", "none", "series whose lines have no slope: those that end on a floor"},
    {"log_x", "true or false", "true", "logarithmic axis"},
    {"log_y", "true or false", "true", "logarithmic axis"},
    {"x_label", "text", "by x", "name of the axis"},
    {"y_label", "text", "by measure and quantity", "name of the axis"},
}};

inline constexpr std::array<FileKey, 9> claim_keys{{
    {"text", "text", "required", "the sentence"},
    {"plot", "whole number", "1", "the plot whose lines are meant"},
    {"slope", "label of a line", "or ratio", "whose slope is decided on"},
    {"ratio", "label of a line", "or slope", "whose values are divided by those of `to`"},
    {"to", "label of a line", "required with ratio", "what is divided by"},
    {"at", "number", "geometric mean over common points", "value of `along` for ratio"},
    {"to_at", "number", "at", "value of `along` for `to`"},
    {"within", "[low, high]", "required", "where the number must lie for the claim to hold"},
    {"holds", "true or false", "true", "what is found to be so"},
}};

}  // namespace wienertree::app
