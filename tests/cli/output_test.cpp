/// Results appear whole or not at all.
#include <sys/stat.h>
#include <catch2/catch.hpp>

#include "program.hpp"

using cli::Outcome;
using cli::Workplace;

TEST_CASE("a file that cannot be written whole leaves what was there") {
  Workplace place;
  cli::simulate_benes(place);
  const std::string filter = "filter benes --method klv --observations Y.csv --output out.csv";
  const std::vector<std::string> fresh = place.files();
  place.largest_file = 1000;  // the table has about 40 000 bytes
  for (const bool exists : {false, true}) {
    if (exists) place.write("out.csv", "precious\n");
    const Outcome outcome = place.run(filter);
    INFO(outcome.err);
    CHECK(outcome.code == 1);
    CHECK(outcome.signal == 0);
    CHECK(cli::lines_of(outcome.err).size() == 1);
    CHECK_THAT(outcome.err, Catch::Contains("--output") && Catch::Contains("out.csv"));
    if (!exists) CHECK(place.files() == fresh);
  }
  CHECK(place.read("out.csv") == "precious\n");
  CHECK(place.files().size() == fresh.size() + 1);  // no temporary file is left
}

TEST_CASE("simulate writes both files or neither") {
  Workplace place;
  place.write("Y.csv", "precious\n");
  place.largest_file = 6000;  // the observations fit, the three components of the signal do not
  const Outcome outcome =
      place.run("simulate lorenz63 --horizon 1 --steps 100 --observations Y.csv --signal X.csv");
  INFO(outcome.err);
  CHECK(outcome.code == 1);
  CHECK_THAT(outcome.err, Catch::Contains("--signal"));
  CHECK(place.read("Y.csv") == "precious\n");
  CHECK(place.files() == std::vector<std::string>{"Y.csv"});
}

TEST_CASE("a run that fails leaves existing results as they were") {
  const Workplace place;
  place.write("out.csv", "precious\n");
  place.write("out.svg", "precious\n");
  place.write("Y.csv", "t,y1\n0,0\n1,nan\n");
  CHECK(place.run("filter benes --method klv --observations Y.csv --output out.csv --plot out.svg").code ==
        2);
  CHECK(place.read("out.csv") == "precious\n");
  CHECK(place.read("out.svg") == "precious\n");
  CHECK(place.files().size() == 3);
}

TEST_CASE("a full device is an error") {
  Workplace place;
  cli::simulate_benes(place);
  Outcome outcome = place.run("filter benes --method klv --observations Y.csv --output /dev/full");
  CHECK(outcome.code == 1);
  CHECK(cli::lines_of(outcome.err).size() == 1);
  CHECK_THAT(outcome.err, Catch::Contains("--output") && Catch::Contains("/dev/full"));
  struct stat status {};
  REQUIRE(::stat("/dev/full", &status) == 0);
  CHECK(S_ISCHR(status.st_mode));  // the device itself is still there

  place.stdout_to = "/dev/full";
  for (const char* arguments : {"filter benes --observations Y.csv", "model list", "formulas list", "--help",
                                "--version", "simulate benes --horizon 1 --steps 10 --observations -"}) {
    outcome = place.run(arguments);
    INFO(arguments << "\n" << outcome.err);
    CHECK(outcome.code == 1);
    CHECK(cli::lines_of(outcome.err).size() == 1);
    CHECK_THAT(outcome.err, Catch::Contains("standard output"));
  }
}

TEST_CASE("a broken pipe ends the program quietly with 1") {
  Workplace place;
  cli::simulate_benes(place);
  place.stdout_to = "closed pipe";
  for (const char* arguments : {"filter benes --observations Y.csv", "model list", "--help"}) {
    const Outcome outcome = place.run(arguments);
    CHECK(outcome.code == 1);
    CHECK(outcome.signal == 0);
    CHECK(outcome.err.empty());
  }
}

TEST_CASE("a link to a file stays a link, and a file keeps its permissions") {
  const Workplace place;
  cli::simulate_benes(place);
  place.write("real.csv", "old\n");
  std::filesystem::permissions(place.directory() / "real.csv", std::filesystem::perms(0640));
  std::filesystem::create_symlink("real.csv", place.directory() / "link.csv");
  CHECK(place.run("filter benes --method klv --observations Y.csv --output link.csv").code == 0);
  CHECK(std::filesystem::is_symlink(place.directory() / "link.csv"));
  CHECK_THAT(place.read("real.csv"), Catch::StartsWith("t,mean_x,"));
  CHECK(std::filesystem::status(place.directory() / "real.csv").permissions() ==
        std::filesystem::perms(0640));
}
