#include <algorithm>
#include <catch2/catch.hpp>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>

#include "wienertree/cubature/catalogue.hpp"
#include "wienertree/cubature/construct.hpp"
#include "wienertree/cubature/formula_file.hpp"
#include "wienertree/numeric/error.hpp"

using namespace wienertree;
namespace fs = std::filesystem;

namespace {

const fs::path shipped = fs::path(WIENERTREE_SOURCE_DIR) / "data" / "cubature_formulas";

std::string text_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

std::vector<fs::path> shipped_files() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(shipped)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

// An empty directory of this test's own, removed at its end.
struct TemporaryDirectory {
  fs::path path;
  explicit TemporaryDirectory(const std::string& name)
      : path(fs::temp_directory_path() /
             ("wienertree-formula-test-" + name + std::to_string(std::random_device{}()))) {
    fs::remove_all(path);
    fs::create_directories(path);
  }
  ~TemporaryDirectory() { fs::remove_all(path); }
  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(path / name, std::ios::binary) << text;
    return path / name;
  }
};

std::string message_of(const std::string& json) {
  try {
    const CubatureFormula formula = parse_formula(json, "f.json");
    require_holds(verify(formula), "f.json");
    return "accepted";
  } catch (const InputError& error) {
    return error.what();
  }
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

// The digits of the file from "paths" on that are the k-th significant digit of their number. A zero has its
// first decimal as its only one.
std::vector<std::size_t> significant_digits(const std::string& text, int k) {
  std::vector<std::size_t> positions;
  const auto is_part = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) || c == '.'; };
  for (std::size_t i = text.find("\"paths\""); i < text.size();) {
    if (!is_part(text[i])) {
      ++i;
      continue;
    }
    std::size_t end = i, seen = 0, position = 0;
    for (; end < text.size() && is_part(text[end]); ++end) {
      if (text[end] == '.' || (seen == 0 && text[end] == '0')) continue;
      if (++seen == static_cast<std::size_t>(k)) position = end;
    }
    if (text.substr(i, end - i) == "0.0") position = i + 2;
    if (position != 0) positions.push_back(position);
    i = end;
  }
  return positions;
}

const char* const valid =
    R"({"name": "n", "degree": 3, "dimension": 1, "source": "s", "paths": [
  {"weight": 0.5, "segments": [[1, 1]]},
  {"weight": 0.5, "segments": [[1, -1]]}
]})";

}  // namespace

TEST_CASE("Every shipped formula has exactly its stated degree") {
  const std::vector<fs::path> files = shipped_files();
  REQUIRE(files.size() >= 14);
  for (const fs::path& file : files) {
    const CubatureFormula formula = load_formula(file);
    const FormulaVerification verification = verify(formula);
    INFO(formula.name << " " << verification.brief());
    CHECK(verification.holds());
    CHECK(verification.degree == formula.degree);
    // The files' own rounding, 1.1e-16 a digit, amplified by coefficients of at most about 10.
    CHECK(verification.max_error < 1e-14);
    REQUIRE(verification.next_residual);
    CHECK(*verification.next_residual > 1e-5);
    CHECK(file.stem() == formula.name);
  }
}

TEST_CASE("A shipped file with one digit changed is refused") {
  for (const fs::path& file : shipped_files()) {
    const std::string text = text_of(file);
    for (const int k : {1, 3, 6}) {
      const std::vector<std::size_t> digits = significant_digits(text, k);
      const std::size_t stride = 1 + digits.size() / 12;
      for (std::size_t i = 0; i < digits.size(); i += stride) {
        std::string changed = text;
        char& digit = changed[digits[i]];
        digit = digit == '9' ? '8' : static_cast<char>(digit + 1);
        INFO(file.filename() << " byte " << digits[i]);
        const FormulaVerification verification =
            verify(parse_formula(changed, "changed"), moment_tolerance, false);
        REQUIRE_FALSE(verification.holds());
        const MomentComparison& moment = *verification.first_failure;
        CHECK(std::abs(moment.value - moment.expected) > moment_tolerance);
        CHECK(verification.degree == degree_of(moment.word) - 1);
      }
    }
  }
}

TEST_CASE("Loading names the first failing word and both values") {
  TemporaryDirectory directory("refused");
  const std::string text = text_of(shipped / "lyons-victoir-5-1.json");
  // The last segment of the first path is 0.01 too long: E B is off by 0.01/6.
  const fs::path file =
      directory.write("f.json", replaced(text, "[0.3333333333333333, -0.19930586239340856]]",
                                         "[0.3333333333333333, -0.18930586239340856]]"));
  CHECK_THROWS_WITH(load_formula(file), Catch::Matchers::StartsWith(file.string()) &&
                                            Catch::Matchers::Contains("stated degree 5") &&
                                            Catch::Matchers::Contains("word \"1\" is 0.00166666666666") &&
                                            Catch::Matchers::Contains("expected 0"));
  // A degree stated too high fails at a word of that degree.
  const fs::path high = directory.write("g.json", replaced(text, "\"degree\": 5", "\"degree\": 6"));
  const FormulaVerification verification = verify(read_formula(high));
  REQUIRE(verification.first_failure);
  CHECK(degree_of(verification.first_failure->word) == 6);
  CHECK(verification.degree == 5);
  CHECK_THROWS_AS(load_formula(high), InputError);
}

TEST_CASE("A formula better than stated is found to be") {
  CubatureFormula formula = load_formula(shipped / "moment-equations-9-1.json");
  formula.degree = 5;
  const FormulaVerification verification = verify(formula);
  CHECK(verification.holds());
  CHECK(verification.degree == 9);
  CHECK(*verification.next_residual < moment_tolerance);
}

TEST_CASE("Moments that are not finite fail") {
  CubatureFormula formula = construct_degree_3(1);
  formula.paths[0].increments(1, 0) = 1e300;
  const FormulaVerification verification = verify(formula);
  CHECK_FALSE(verification.holds());
  CHECK(verification.max_error == std::numeric_limits<double>::infinity());
}

TEST_CASE("Structure is checked before moments") {
  const auto refused = [](auto&& change) {
    CubatureFormula formula = construct_degree_3(2);
    change(formula);
    CHECK_THROWS_AS(verify(formula), InputError);
  };
  refused([](auto& f) { f.degree = 0; });
  refused([](auto& f) { f.dimension = 0; });
  refused([](auto& f) { f.dimension = 3; });
  refused([](auto& f) { f.paths.clear(); });
  refused([](auto& f) { f.paths[1].weight = 0; });
  refused([](auto& f) { f.paths[1].weight = -0.25; });
  refused([](auto& f) { f.paths[1].weight = std::nan(""); });
  refused([](auto& f) { f.paths[1].increments.resize(3, 0); });
  refused([](auto& f) { f.paths[1].increments(2, 0) = std::numeric_limits<double>::infinity(); });
  refused([](auto& f) { f.degree = 40; });
}

TEST_CASE("A formula survives writing and reading bit for bit") {
  TemporaryDirectory directory("round-trip");
  CubatureFormula formula = construct_ninomiya_victoir(3);
  formula.name = "quotes \" and \\ and \xc3\xa9";
  save_formula(formula, directory.path / "f.json");
  const CubatureFormula again = load_formula(directory.path / "f.json");
  CHECK(again.name == formula.name);
  CHECK(again.source == formula.source);
  CHECK(again.degree == formula.degree);
  CHECK(again.dimension == formula.dimension);
  REQUIRE(again.paths.size() == formula.paths.size());
  for (std::size_t j = 0; j < formula.paths.size(); ++j) {
    CHECK(again.paths[j].weight == formula.paths[j].weight);
    CHECK(again.paths[j].increments == formula.paths[j].increments);
  }
}

TEST_CASE("What cannot be written leaves what was there") {
  TemporaryDirectory directory("write");
  const CubatureFormula formula = construct_degree_3(1);
  CHECK_THROWS_AS(save_formula(formula, directory.path / "absent" / "f.json"), RunError);
  fs::create_directory(directory.path / "taken");
  directory.write("taken/inside", "kept");
  CHECK_THROWS_AS(save_formula(formula, directory.path / "taken"), RunError);
  CHECK(text_of(directory.path / "taken" / "inside") == "kept");
  CHECK(std::distance(fs::directory_iterator(directory.path), fs::directory_iterator()) == 1);
  CubatureFormula bad = formula;
  bad.name = "\xff";
  CHECK_THROWS_AS(format_formula(bad), InputError);
  bad = formula;
  bad.paths[0].weight = std::nan("");
  CHECK_THROWS_AS(format_formula(bad), InputError);
}

TEST_CASE("Malformed files are refused with file, place and key") {
  REQUIRE(message_of(valid) == "accepted");
  struct Malformed {
    std::string from, to, message;
  };
  const std::vector<Malformed> table = {
      {"\"source\": \"s\", ", "", "f.json: the key \"source\" is missing"},
      {"\"name\": \"n\"", "\"name\": 3", "f.json: \"name\" must be a string (3)"},
      {"\"source\"", "\"sauce\"",
       "f.json: unknown key; the keys are name, degree, dimension, source, paths (sauce)"},
      {"\"degree\": 3", "\"degree\": 3.5", "f.json: \"degree\" must be a positive integer (3.5)"},
      {"\"degree\": 3", "\"degree\": 0", "f.json: \"degree\" must be a positive integer (0)"},
      {"\"degree\": 3", "\"degree\": -3", "f.json: \"degree\" must be a positive integer (-3)"},
      {"\"degree\": 3", "\"degree\": \"3\"", "f.json: \"degree\" must be a positive integer (\"3\")"},
      {"\"degree\": 3", "\"degree\": 99999999999999999999",
       "f.json: \"degree\" must be a positive integer (1e+20)"},
      {"\"degree\": 3", "\"degree\": 3, \"degree\": 3", "f.json: a key appears twice in an object (degree)"},
      {"\"dimension\": 1", "\"dimension\": 2",
       "f.json: path 1, segment 1: a segment of dimension 2 is an array of 3 numbers ([1,1])"},
      {"\"dimension\": 1", "\"dimension\": null", "f.json: \"dimension\" must be a positive integer (null)"},
      {"\"weight\": 0.5", "\"weight\": 0", "f.json: path 1: a weight must be positive and finite (0)"},
      {"\"weight\": 0.5", "\"weight\": -0.5", "f.json: path 1: a weight must be positive and finite (-0.5)"},
      {"\"weight\": 0.5", "\"weight\": \"half\"", "f.json: path 1: \"weight\" must be a number (\"half\")"},
      {"\"weight\": 0.5", "\"weight\": 1e999", "f.json: a number is too large"},
      {"\"weight\": 0.5", "\"weight\": 0.6",
       "f.json: the formula does not have its stated degree 3: the weights sum to 1.1000000000000001, not to "
       "1"},
      {"\"weight\"", "\"mass\"", "f.json: path 1: unknown key; the keys are weight, segments (mass)"},
      {"\"weight\": 0.5, ", "", "f.json: path 1: the key \"weight\" is missing"},
      {"[[1, -1]]", "[[1, true]]", "f.json: path 2, segment 1: an increment must be a number (true)"},
      {"[[1, -1]]", "[[1, -1], 3]",
       "f.json: path 2, segment 2: a segment of dimension 1 is an array of 2 numbers (3)"},
      {"[[1, -1]]", "[]", "f.json: path 2: \"segments\" must be a non-empty array ([])"},
      {"[[1, -1]]", "{}", "f.json: path 2: \"segments\" must be a non-empty array ({})"},
      {"[[1, -1]]", "[[1, -2]]",
       "f.json: the formula does not have its stated degree 3: the moment of the word \"1\" is -0.5, "
       "expected 0"},
      {"[[1, 1]]", "[[1, 1]", "f.json: line 2, column 38: this is not JSON"},
  };
  for (const Malformed& malformed : table) {
    CHECK(message_of(replaced(valid, malformed.from, malformed.to)) == malformed.message);
  }
  CHECK(message_of("") == "f.json: line 1, column 1: this is not JSON");
  CHECK(message_of("[]") == "f.json: an object was expected ([])");
  CHECK(message_of("{\"paths\": []}") == "f.json: the key \"name\" is missing");
  CHECK(message_of(std::string("\xff\xfe")) == "f.json: line 1, column 1: this is not JSON");
  CHECK(message_of(std::string(100000, '[')) == "f.json: the JSON is nested too deeply");
  CHECK(message_of("{\"kind\": \"lie\"}") == "f.json: this is a formula of Lie polynomials, not of paths");
  CHECK_THROWS_AS(read_formula("/no/such/file.json"), InputError);
  CHECK_THROWS_AS(read_formula(shipped), InputError);  // a directory
}

TEST_CASE("The catalogue lists every file, ordered and verified") {
  const std::vector<CatalogueEntry> entries = bundled_formulas(shipped);
  CHECK(entries.size() == shipped_files().size());
  for (std::size_t i = 0; i < entries.size(); ++i) {
    CHECK(entries[i].verification.degree == entries[i].formula.degree);
    if (i > 0) CHECK(entries[i - 1].formula.degree <= entries[i].formula.degree);
  }
}

TEST_CASE("A directory with a formula that fails, or two of one name, is refused") {
  TemporaryDirectory directory("catalogue");
  CHECK(bundled_formulas(directory.path).empty());
  directory.write("a.json", valid);
  directory.write("notes.txt", "not a formula");
  CHECK(bundled_formulas(directory.path).size() == 1);
  directory.write("b.json", valid);
  CHECK_THROWS_WITH(bundled_formulas(directory.path), Catch::Matchers::Contains("a.json"));
  directory.write("b.json", replaced(valid, "[[1, 1]]", "[[1, 1.5]]"));
  CHECK_THROWS_AS(bundled_formulas(directory.path), InputError);
  CHECK_THROWS_AS(bundled_formulas(directory.path / "absent"), InputError);
}

TEST_CASE("The formula found for a degree has the least error at equal work") {
  const auto name = [](int degree, int p) { return find_formula(degree, p, shipped).name; };
  CHECK(name(5, 1) == "lyons-victoir-5-1");
  CHECK(name(5, 2) == "moment-equations-5-2");
  CHECK(name(5, 3) == "moment-equations-5-3");
  CHECK(name(5, 4) == "ninomiya-victoir-5-4");
  CHECK(name(7, 2) == "moment-equations-7-2-smooth");
  CHECK(name(9, 2) == "moment-equations-9-2");
  CHECK(name(11, 1) == "moment-equations-11-1");
  CHECK(name(3, 7) == "lyons-victoir-3-7");     // constructed
  CHECK(name(5, 6) == "ninomiya-victoir-5-6");  // constructed
  for (const CatalogueEntry& entry : bundled_formulas(shipped)) {
    const CubatureFormula best = find_formula(entry.formula.degree, entry.formula.dimension, shipped);
    CHECK(error_at_equal_work(best, verify(best)) <= error_at_equal_work(entry.formula, entry.verification));
  }
}

TEST_CASE("What is not in the catalogue is answered with what is") {
  CHECK_THROWS_WITH(find_formula(7, 4, shipped), Catch::Matchers::Contains("degree 7: p = 1, 2, 3;") &&
                                                     Catch::Matchers::Contains("degree 3: any p") &&
                                                     Catch::Matchers::Contains("degree 7, p = 4"));
  CHECK_THROWS_AS(find_formula(5, 99, shipped), InputError);
  CHECK_THROWS_AS(find_formula(3, 0, shipped), InputError);
  CHECK_THROWS_WITH(find_formula("lyons-victoir", shipped), Catch::Matchers::Contains("lyons-victoir-5-1, "));
  CHECK(find_formula("moment-equations-7-1", shipped).degree == 7);
}

TEST_CASE("A minus before a zero is not kept in a file: what is written reads back as the same text") {
  const std::string text =
      R"({"name": "n", "degree": 3, "dimension": 1, "source": "s", "paths": [{"weight": 0.5, "segments": [[1, -0.0]]}]})";
  const std::string written = format_formula(parse_formula(text, "f.json"));
  CHECK(written.find("-0") == std::string::npos);
  CHECK(format_formula(parse_formula(written, "g.json")) == written);
}
