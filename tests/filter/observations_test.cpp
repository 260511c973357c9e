#include "wienertree/filter/observations.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <sstream>

using namespace wienertree;

namespace {

ObservationPath parse(const std::string& text, std::size_t k, ObservationKind kind) {
  std::istringstream in(text);
  return read_observations(in, "y.csv", k, kind);
}

}  // namespace

TEST_CASE("a record is read back as it was written, missing values included") {
  ObservationPath path;
  path.dimension = 2;
  path.append(0.1, std::vector{1.0 / 3, std::nan("")});
  path.append(1e9, std::vector{-2e-300, 5.0});
  std::ostringstream out;
  write_observations(out, path);
  const ObservationPath back = parse(out.str(), 2, ObservationKind::discrete);
  CHECK(back.times == path.times);
  CHECK(back.values[0] == path.values[0]);
  CHECK(std::isnan(back.values[1]));
  CHECK(back.values[2] == path.values[2]);
}

TEST_CASE("white space, blank lines, a byte order mark and CRLF are accepted") {
  const auto path = parse("\xef\xbb\xbft, y1\r\n0, 1\r\n\r\n 1 ,2 \r\n", 1, ObservationKind::continuous);
  CHECK(path.times == std::vector{0.0, 1.0});
  CHECK(path.values == std::vector{1.0, 2.0});
}

TEST_CASE("malformed records are refused with line, column and value") {
  struct Case {
    std::string text, where, message;
    std::size_t k = 1;
    ObservationKind kind = ObservationKind::continuous;
  };
  const Case cases[] = {
      {"", "y.csv", "empty"},
      {"t,y1\n", "y.csv", "no rows"},
      {"t,y1\n0,0\n", "y.csv", "at least two rows"},
      {"time,y\n0,0\n1,1\n", "y.csv:1", "expected the header t,y1"},
      {"t,y1,y2\n0,0,0\n", "y.csv:1", "expected the header t,y1"},
      {"t,y1\n0,0\n", "y.csv:1", "expected the header t,y1,y2", 2},
      {"t,y1\n0,0\n1\n", "y.csv:3: column y1", "ends early"},
      {"t,y1\n0,0\n1,2,3\n", "y.csv:3", "too many fields"},
      {"t,y1\n0,0\n1,nan\n", "y.csv:3: column y1", "not a finite number (nan)"},
      {"t,y1\n0,0\n1,inf\n", "y.csv:3: column y1", "not a finite number (inf)"},
      {"t,y1\n0,0\n1,1e999\n", "y.csv:3: column y1", "(1e999)"},
      {"t,y1\n0,0\n1,1,5\n", "y.csv:3", "too many"},
      {"t,y1\n0,0\n1,abc\n", "y.csv:3: column y1", "not a number (abc)"},
      {"t,y1\n0,0\n1,0.", "y.csv:3", "cut off"},
      {"t,y1\n0,0\n1,2e-", "y.csv:3", "cut off"},
      {"t,y1\n0,0\n1,", "y.csv:3", "cut off", 1, ObservationKind::discrete},
      {"t,y1\n0,0\n1," + std::string(longest_line, '1') + "\n", "y.csv:3", "longer than"},
      {std::string(longest_line + 1, 't'), "y.csv:1", "longer than"},
      {"t,y1\n0,0\n1,\n", "y.csv:3: column y1", "missing"},
      {"t,y1\n,0\n1,1\n", "y.csv:2: column t", "missing", 1, ObservationKind::discrete},
      {"t,y1\n0,0\n0,1\n", "y.csv:3: column t", "times must increase (0 after 0)"},
      {"t,y1\n1,0\n0,1\n", "y.csv:3: column t", "times must increase (0 after 1)"},
  };
  for (const Case& c : cases) {
    INFO(c.text);
    try {
      parse(c.text, c.k, c.kind);
      FAIL("accepted");
    } catch (const InputError& e) {
      CHECK_THAT(e.where(), Catch::StartsWith(c.where));
      CHECK_THAT(e.what(), Catch::Contains(c.message));
      CHECK(std::string(e.what()).find('\n') == std::string::npos);
    }
  }
  CHECK_THROWS_AS(read_observations("/no/such/file.csv", 1, ObservationKind::continuous), InputError);
}
