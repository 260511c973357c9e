/// No output takes the place of an input or of another output, and trouble with names is found before the run.
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>

#include "program.hpp"

using namespace cli;

namespace {

namespace fs = std::filesystem;

// Refused in one line, and every file is as it was.
void check_refused(const Workplace& place, const std::string& arguments,
                   const std::vector<std::string>& told) {
  const std::vector<std::string> before = place.files();
  std::vector<std::string> contents;
  const auto content_of = [&](const std::string& name) {
    std::error_code failure;
    return fs::is_regular_file(place.directory() / name, failure) ? place.read(name) : std::string();
  };
  for (const std::string& name : before) contents.push_back(content_of(name));
  const Outcome outcome = place.run(arguments);
  INFO(arguments << "\n" << outcome.err);
  CHECK(outcome.code == 2);
  CHECK(lines_of(outcome.err).size() == 1);
  for (const std::string& part : told) CHECK_THAT(outcome.err, Catch::Contains(part));
  CHECK(place.files() == before);
  for (std::size_t i = 0; i < before.size(); ++i) CHECK(content_of(before[i]) == contents[i]);
}

void write_model(const Workplace& place) {
  place.write("m.toml",
              "convention = \"ito\"\n[state]\nx = { initial = 1.0 }\n[drift]\nx = \"-x\"\n[diffusion]\nx = "
              "[\"1\"]\n[observation]\nkind = \"continuous\"\nh = [\"x\"]\n");
}

}  // namespace

TEST_CASE("an output that is an input is refused, whatever it is called") {
  const Workplace place;
  simulate_benes(place);
  write_model(place);
  place.write("empty.svg", "");
  REQUIRE(place.run("formulas construct --degree 5 --dimension 1 --output f.json").code == 0);
  REQUIRE(place.run("filter m.toml --observations Y.csv --checkpoint save --output out.csv --quiet").code ==
          0);
  fs::create_symlink("Y.csv", place.directory() / "link.csv");
  fs::create_hard_link(place.directory() / "Y.csv", place.directory() / "other.csv");
  fs::create_symlink("Y.csv", place.directory() / "picture.svg");
  const std::string filter = "filter m.toml --observations Y.csv ", overwritten = "it would be overwritten";
  for (const std::string name : {"Y.csv", "./Y.csv", "link.csv", "other.csv"}) {
    check_refused(place, filter + "--output " + name, {"--output", "--observations", overwritten});
    check_refused(place, filter + "--checkpoint " + name, {"--checkpoint", "--observations", overwritten});
    check_refused(place, "compare m.toml benes --observations Y.csv --output " + name,
                  {"--output", overwritten});
    check_refused(place, "tree m.toml --observations Y.csv --steps 5 --dot " + name, {"--dot", overwritten});
  }
  check_refused(place, filter + "--output m.toml", {"--output", "model", overwritten});
  check_refused(place, filter + "--output f.json --formula f.json", {"--output", "--formula", overwritten});
  check_refused(place, filter + "--plot picture.svg", {"--plot", "--observations", overwritten});
  check_refused(place, filter + "--output save --resume save", {"--output", "--resume", overwritten});
  check_refused(place, filter + "--plot p.svg --signal X.csv --output X.csv",
                {"--signal", "--output", overwritten});
  check_refused(place, "simulate m.toml --horizon 1 --steps 5 --observations m.toml",
                {"--observations", overwritten});
  check_refused(place, "weak m.toml --horizon 1 --steps 2 --payoff x --output m.toml",
                {"--output", overwritten});
  // A checkpoint goes on where it was resumed.
  CHECK(place.run(filter + "--checkpoint save --resume save --output out.csv --quiet").code == 0);
}

TEST_CASE("two outputs that are one file are refused, where it exists and where it does not") {
  const Workplace place;
  simulate_benes(place);
  write_model(place);
  place.write("there.csv", "");
  fs::create_directory(place.directory() / "sub");
  fs::create_symlink("there.csv", place.directory() / "link.csv");
  fs::create_symlink("sub/new.csv", place.directory() / "dangling.csv");
  const std::string simulate = "simulate m.toml --horizon 1 --steps 5 --observations ",
                    both = "writes as well";
  check_refused(place, simulate + "new.csv --signal new.csv", {"--signal", "--observations", both});
  check_refused(place, simulate + "new.csv --signal sub/../new.csv", {both});
  check_refused(place, simulate + "there.csv --signal link.csv", {both});
  check_refused(place, simulate + "sub/new.csv --signal dangling.csv", {both});
  check_refused(place, simulate + "- --signal -", {"--signal"});
  check_refused(place, "tree m.toml --horizon 1 --steps 3 --dot t --graphml t", {both});
  check_refused(place, "filter m.toml --observations Y.csv --output s --checkpoint s", {both});
  // A device takes any number.
  CHECK(place.run(simulate + "/dev/null --signal /dev/null").code == 0);
}

TEST_CASE("redirected standard streams are files like others") {
  Workplace place;
  simulate_benes(place);
  place.input_from = (place.directory() / "Y.csv").string();
  check_refused(place, "filter benes - --output Y.csv", {"--output", "it would be overwritten"});
}

TEST_CASE("a link to a file that does not exist yet is followed") {
  const Workplace place;
  write_model(place);
  fs::create_directory(place.directory() / "sub");
  fs::create_symlink("sub/new.csv", place.directory() / "link.csv");
  CHECK(place.run("simulate m.toml --horizon 1 --steps 5 --observations link.csv").code == 0);
  CHECK(fs::is_symlink(place.directory() / "link.csv"));
  CHECK_THAT(place.read("sub/new.csv"), Catch::StartsWith("t,y1"));
  fs::create_symlink("nowhere/new.csv", place.directory() / "lost.csv");
  check_refused(place, "simulate m.toml --horizon 1 --steps 5 --observations lost.csv",
                {"no such directory"});
  fs::create_symlink("loop.csv", place.directory() / "loop.csv");
  check_refused(place, "simulate m.toml --horizon 1 --steps 5 --observations loop.csv",
                {"loop.csv", "cannot be"});
}

TEST_CASE("a name is written or refused at the start, however long it is") {
  const Workplace place;
  write_model(place);
  const std::string simulate = "simulate m.toml --horizon 1 --steps 5 --observations ";
  const std::string longest(255,
                            'y');  // as long as a name may be: a temporary name made of it would be too long
  CHECK(place.run(simulate + longest).code == 0);
  CHECK_THAT(place.read(longest), Catch::StartsWith("t,y1"));
  CHECK(place.files().size() == 2);
  check_refused(place, simulate + longest + "y", {"--observations", "too long"});
}

TEST_CASE("temporary files that dead processes left are removed, also those of the number we have now") {
  const Workplace place;
  write_model(place);
  std::array<char, 256> host{};
  REQUIRE(::gethostname(host.data(), host.size() - 1) == 0);
  // The program's number will most likely be one of these.
  const pid_t now = ::getpid();
  for (pid_t number = now; number < now + 2000; ++number)
    place.write(".out.csv." + std::string(host.data()) + "." + std::to_string(number) + ".tmp", "left over");
  CHECK(place.run("simulate m.toml --horizon 1 --steps 5 --observations out.csv").code == 0);
  CHECK_THAT(place.read("out.csv"), Catch::StartsWith("t,y1"));
  CHECK(place.files().size() < 1000);  // those of living processes stay
}

TEST_CASE("an empty name is named") {
  const Workplace place;
  simulate_benes(place);
  for (const std::string option :
       {"--observations", "--signal", "--output", "--plot", "--checkpoint", "--resume", "--formula"}) {
    std::vector<std::string> words = {"filter", "benes"};
    if (option != "--observations") words.insert(words.end(), {"--observations", "Y.csv"});
    words.insert(words.end(), {option, ""});
    const Outcome outcome = place.run(words);
    INFO(option << "\n" << outcome.err);
    CHECK(outcome.code == 2);
    CHECK_THAT(outcome.err, Catch::Contains(option + ": a file name is needed, and this one is empty"));
  }
  const Outcome model = place.run(std::vector<std::string>{"filter", "", "--observations", "Y.csv"});
  CHECK(model.code == 2);
  CHECK_THAT(model.err, Catch::Contains("model: the name is empty"));
  const Outcome study = place.run(std::vector<std::string>{"study", "steps", "--output", ""});
  CHECK(study.code == 2);
  CHECK_THAT(study.err, Catch::Contains("--output: a file name is needed"));
}
