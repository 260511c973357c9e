#pragma once
/// What a run of a study depends on: a run on disk stands for one that is asked for only where all of it is the same.
#include <string>

#include "study_data.hpp"

namespace wienertree::app {

/// A checksum of everything that decides the runs of a cell beside path and launch: version of the program, options,
/// contents of the model file, formula, the record that is filtered or how it is simulated, and the reference it is
/// compared with, with its own options and formula. Titles, plots, claims and other cells are not part of it.
/// @throws InputError for a file that cannot be read
std::string identity_of_runs(const Study& study, const StudyCell& cell, const StudyData& data,
                             const ModelShelf& models);

}  // namespace wienertree::app
