/// Checkpoints: what they are refused for, and streams that are put down and taken up.
#include <catch2/catch.hpp>
#include <csignal>

#include "program.hpp"

using namespace cli;

namespace {

const std::string filter = "filter benes --observations Y.csv --nodes 40 --steps 50 --quiet ";

void check_refused(const Workplace& place, const std::string& arguments, const std::string& told) {
  const Outcome outcome = place.run(arguments);
  INFO(arguments << "\n" << outcome.err);
  CHECK(outcome.code == 2);
  CHECK(outcome.out.empty());
  CHECK(lines_of(outcome.err).size() == 1);
  CHECK_THAT(outcome.err, Catch::Contains("--resume") && Catch::Contains(told));
}

}  // namespace

TEST_CASE("a finished run is a checkpoint whose resumption gives the same bytes") {
  const Workplace place;
  simulate_benes(place);
  for (const std::string options : {"", "--moments 3", "--format json", "--thin tbba --launches 2"}) {
    const std::string whole = output_of(place, filter + options);
    CHECK(output_of(place, filter + options + " --checkpoint save --checkpoint-every 0.001") == whole);
    CHECK(output_of(place, filter + options + " --resume save") == whole);
    CHECK(output_of(place, filter + options + " --resume save --checkpoint save --threads 2") == whole);
  }
  // Pictures too, the law at one time among them.
  const std::string picture = filter + "--density-at 2 --output o.csv --plot ";
  output_of(place, picture + "a.svg --checkpoint save");
  output_of(place, picture + "b.svg --resume save");
  CHECK(place.read("a.svg") == place.read("b.svg"));
}

TEST_CASE("a checkpoint of another run is refused, naming what differs and both values") {
  const Workplace place;
  simulate_benes(place);
  output_of(place, filter + "--checkpoint save");
  check_refused(place, filter + "--resume save --set mu=0.5", "parameters mu was 0.05, and is 0.5");
  check_refused(place, "filter benes --observations Y.csv --nodes 41 --steps 50 --resume save",
                "options nodes was 40, and is 41");
  check_refused(place, "filter benes --observations Y.csv --nodes 40 --steps 100 --resume save",
                "in 100 steps");
  check_refused(place, filter + "--resume save --thin tbba", "recombination");
  check_refused(place, filter + "--resume save --functional picard", "functional");
  check_refused(place, filter + "--resume save --moments 2", "moments was 0, and is 2");
  check_refused(place, "filter benes --observations Y.csv --steps 50 --method euler --resume save", "method");
  std::string rows = place.read("Y.csv");
  rows[rows.size() - 2] = rows[rows.size() - 2] == '1' ? '2' : '1';
  place.write("other.csv", rows);
  check_refused(place, "filter benes --observations other.csv --nodes 40 --steps 50 --resume save",
                "checksum");
}

TEST_CASE("what is no whole checkpoint is refused") {
  const Workplace place;
  simulate_benes(place);
  output_of(place, filter + "--checkpoint save");
  const std::string save = place.read("save");
  check_refused(place, filter + "--resume absent", "cannot be opened");
  check_refused(place, filter + "--resume Y.csv", "is not a checkpoint");
  check_refused(place, filter + "--resume .", "cannot be read");
  place.write("bad", "");
  check_refused(place, filter + "--resume bad", "empty");
  for (const std::size_t size : {std::size_t{25}, save.size() / 2, save.size() - 1}) {
    place.write("bad", save.substr(0, size));
    check_refused(place, filter + "--resume bad", "is damaged");
  }
  for (const std::size_t at : {std::size_t{30}, save.size() / 2, save.size() - 1}) {
    std::string flipped = save;
    flipped[at] = static_cast<char>(flipped[at] ^ 1);
    place.write("bad", flipped);
    check_refused(place, filter + "--resume bad", "is damaged: its checksum");
  }
  std::string later = save;
  later[22] = '2';
  place.write("bad", later);
  check_refused(place, filter + "--resume bad", "format 2, and this program reads 1");
}

TEST_CASE("checkpoints of compare and weak: finished ones give the same bytes, others are refused") {
  const Workplace place;
  simulate_benes(place);
  const std::string compare =
      "compare benes benes:h1=0.6 --observations Y.csv --nodes 30 --steps 40 --quiet ";
  const std::string whole = output_of(place, compare);
  CHECK(output_of(place, compare + "--checkpoint save --checkpoint-every 0.001") == whole);
  CHECK(output_of(place, compare + "--resume save") == whole);
  check_refused(place, compare + "--resume save --set mu=0.5", "models 0 parameters mu was 0.05, and is 0.5");
  check_refused(place, compare + "--resume save --seed 3 --thin tbba", "models 0 options");
  check_refused(place, filter + "--resume save", "command was \"compare\", and is \"filter\"");

  const std::string weak =
      "weak heston --horizon 1 --payoff max(s-1,0) --square-roots off --nodes 200 --quiet ";
  for (const std::string options : {"--steps 6 ", "--steps 6 --richardson ", "--tolerance 1e-3 "}) {
    const auto values = [&](const std::string& more) {
      const std::string table = output_of(place, weak + options + more);
      return table.substr(0, table.rfind(','));  // without the seconds it took
    };
    const std::string value = values("");
    CHECK(values("--checkpoint save --checkpoint-every 0.001") == value);
    CHECK(values("--resume save") == value);
    check_refused(place, weak + options + "--resume save --payoff s", "payoffs 1 was none, and is \"s\"");
    check_refused(place, weak + options + "--resume save --set xi=0.2", "parameters xi");
    check_refused(place, weak + options + "--resume save --rtol 1e-5", "rtol");
  }
}

TEST_CASE("a checkpoint that cannot be written is an error, and the one before stays") {
  Workplace place;
  simulate_benes(place);
  CHECK(place.run(filter + "--checkpoint -").code == 2);
  CHECK(place.run(filter + "--checkpoint absent/save").code == 2);
  CHECK(place.run(filter + "--checkpoint-every 3").code == 2);
  place.write("save", "precious\n");
  place.largest_file = 500;
  const Outcome outcome = place.run(filter + "--output out.csv --checkpoint save");
  CHECK(outcome.code == 1);
  CHECK_THAT(outcome.err, Catch::Contains("--checkpoint") && Catch::Contains("save"));
  CHECK(place.read("save") == "precious\n");
}

TEST_CASE("a stream that was ended by SIGTERM is taken up with the rows that follow") {
  const Workplace place;
  simulate_benes(place);
  const std::vector<std::string> rows = lines_of(place.read("Y.csv"));
  for (const std::string options : {"", "--method euler --nodes 500"}) {
    Workplace whole;
    whole.input = place.read("Y.csv");
    const std::vector<std::string> expected = lines_of(output_of(whole, "filter benes - --quiet " + options));
    const std::string command = "filter benes - --quiet --checkpoint save " + options;
    std::vector<std::string> got;
    Running first = place.start(command, true);
    first.tell(rows[0] + "\n" + rows[1] + "\n");
    for (int i = 0; i < 2; ++i) got.push_back(first.read_line());
    for (std::size_t r = 2; r < 150; ++r) {
      first.tell(rows[r] + "\n");
      got.push_back(first.read_line());
    }
    first.tell("1.49,0.");  // in the middle of a row
    first.signal(SIGTERM);
    const Outcome stopped = first.finish();
    CHECK(stopped.signal == SIGTERM);
    CHECK(stopped.out.empty());
    CHECK_THAT(stopped.err, Catch::Contains("--resume ") && Catch::Contains("save goes on"));
    // Rows that it has had already are passed over.
    Running second = place.start(command + " --resume save", true);
    second.tell(rows[0] + "\n");
    for (std::size_t r = 100; r < rows.size(); ++r) second.tell(rows[r] + "\n");
    second.end_input();
    const Outcome rest = second.finish();
    CHECK(rest.code == 0);
    for (const std::string& line : lines_of(rest.out)) got.push_back(line);
    CHECK(got == expected);
  }
}

TEST_CASE("a run without a checkpoint is ended by SIGTERM at once and leaves nothing") {
  const Workplace place;
  Running run = place.start("filter benes -", true);
  run.tell("t,y1\n0,0\n1,0\n");
  for (int i = 0; i < 3; ++i) run.read_line();
  run.signal(SIGTERM);
  const Outcome outcome = run.finish();
  CHECK(outcome.signal == SIGTERM);
  CHECK(outcome.err.empty());
  CHECK(place.files().empty());
}
