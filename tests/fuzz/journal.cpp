/// The journal of a study, runs.csv: whatever the bytes, what is read of them is written as text which reads back as the
/// same runs, or it is an InputError.
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "../../apps/study/study_journal.hpp"
#include "wienertree/numeric/error.hpp"

namespace {

const std::filesystem::path& folder() {
  static const std::filesystem::path made = [] {
    std::string name = (std::filesystem::temp_directory_path() / "fuzzed-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) std::abort();
    return std::filesystem::path(name);
  }();
  return made;
}

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

bool same(const wienertree::app::RunRecord& a, const wienertree::app::RunRecord& b) {
  bool all = a.cell == b.cell && a.path == b.path && a.launch == b.launch && same(a.nodes, b.nodes) &&
             same(a.ode_solves, b.ode_solves) && same(a.seconds, b.seconds);
  for (std::size_t q = 0; q < a.value.size(); ++q)
    all = all && same(a.value[q], b.value[q]) && same(a.truth[q], b.truth[q]);
  return all;
}

}  // namespace

// A text without the header gets it, since few others would get past the first line.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using wienertree::app::StudyJournal;
  const std::string text(reinterpret_cast<const char*>(bytes), size);
  const std::vector<std::string> quantities = {"mean_x"};
  std::filesystem::remove_all(folder());
  std::filesystem::create_directory(folder());
  std::string header;
  { StudyJournal empty(folder().string(), quantities); }
  {
    std::ifstream in(folder() / "runs.csv");
    std::getline(in, header);
  }
  std::ofstream(folder() / "runs.csv", std::ios::binary)
      << (text.starts_with("cell") ? "" : header + "\n") << text;
  std::vector<wienertree::app::RunRecord> records;
  try {
    StudyJournal journal(folder().string(), quantities);
    records = journal.records();
    journal.rewrite(records);
  } catch (const wienertree::InputError&) {
    return 0;  // what bad input is to give
  }
  const StudyJournal again(folder().string(), quantities);
  if (again.records().size() != records.size()) std::abort();
  for (std::size_t i = 0; i < records.size(); ++i)
    if (!same(records[i], again.records()[i])) std::abort();
  return 0;
}
