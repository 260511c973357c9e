#include "wienertree/model/text/printable.hpp"

#include <catch2/catch.hpp>

using namespace wienertree::text;

TEST_CASE("what is printable stays as it is") {
  for (const std::string text : {"", "a b~!", "\u00e9\u03b2\u65e5", "\U0001F600"}) {
    CHECK(printable(text) == text);
    CHECK(unprintable_character(text).empty());
  }
}

TEST_CASE("control characters, turns of direction and what XML forbids are replaced and named") {
  CHECK(printable("a\x1b[2Jb") == "a\uFFFD[2Jb");
  CHECK(printable(std::string("a\0b", 3)) == "a\uFFFDb");
  CHECK(printable("\x7f\u0080\u009b\u009f") == "\uFFFD\uFFFD\uFFFD\uFFFD");
  CHECK(printable("\u202e\u2066\uFFFE\uFFFF") == "\uFFFD\uFFFD\uFFFD\uFFFD");
  CHECK(unprintable_character("ab\a") == "U+0007");
  CHECK(unprintable_character("\u202e") == "U+202E");
}

TEST_CASE("line ends and tabs become spaces, or are kept") {
  CHECK(printable("a\r\nb\tc") == "a  b c");
  CHECK(printable("a\r\nb\tc", LineEnds::kept) == "a\r\nb\tc");
  CHECK(unprintable_character("a\r\nb\tc").empty());
}

TEST_CASE("bytes that are not UTF-8 are replaced one by one") {
  CHECK(printable("a\xff"
                  "b") == "a\uFFFDb");
  CHECK(printable("\xc3") == "\uFFFD");                                // cut
  CHECK(printable("\xc0\xaf") == "\uFFFD\uFFFD");                      // overlong
  CHECK(printable("\xe0\x80\xaf") == "\uFFFD\uFFFD\uFFFD");            // overlong
  CHECK(printable("\xed\xa0\x80") == "\uFFFD\uFFFD\uFFFD");            // a surrogate
  CHECK(printable("\xf4\x90\x80\x80") == "\uFFFD\uFFFD\uFFFD\uFFFD");  // beyond U+10FFFF
  CHECK(unprintable_character("a\xff") == "a byte that is not UTF-8");
}
