#pragma once
/// Runs what a study still lacks, on all threads.
#include <string>
#include <vector>

#include "study_data.hpp"
#include "study_journal.hpp"

namespace wienertree::app {

/// Every run of the cells that the journal does not have is computed and appended to it as it is finished;
/// then the journal is put in the order of the cells, paths and launches, runs of other cells after them.
/// @returns the runs of these cells in that order
/// @throws InputError, RunError as filters and trees do, naming cell, path and launch
std::vector<RunRecord> run_study(const Study& study, const std::vector<StudyCell>& cells, StudyData& data,
                                 StudyJournal& journal, std::size_t threads, bool show_progress);

}  // namespace wienertree::app
