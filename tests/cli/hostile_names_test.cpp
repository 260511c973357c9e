/// Names, labels and titles of a file that somebody sent are text wherever they go: no picture and no page runs
/// them, and all of them stay well formed.
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <random>

#include "markup.hpp"
#include "program.hpp"

using namespace cli;

namespace {

const std::vector<std::string> hostile = {
    "a`touch PWNED`b",
    "$(touch PWNED)",
    "x\"; system(\"touch PWNED\") #",
    "'; system('touch PWNED') #",
    "''`touch PWNED`''",
    "\\140touch PWNED\\140 \\",
    "\\\"`touch PWNED`\\\"",
    "@ARG1 @GPVAL_TERM ${HOME} %s %n %1$s",
    "{/Symbol a}^{2}_b &{space} ~a{.8-}",
    "<script>system('touch PWNED')</script>",
    "</text></svg></title></pre><img src=x onerror=alert(1)>",
    "&amp; &lt &#0; ]]> --> <!-- <![CDATA[",
    "=cmd|'touch PWNED'!A1",
    "\u00e9\u00fc \u65e5\u672c \u03b1\u2264\u03b2",
};

// Strings of the characters that shells, gnuplot, XML and printf interpret; the seed is fixed.
std::vector<std::string> random_names(std::size_t count) {
  const std::vector<std::string> pieces = {"`",  "'", "\"", "\\", "$(", ")",  "@",  "{",      "}",
                                           "<",  ">", "&",  ";",  "#",  "%s", "!",  "touch",  " PWNED",
                                           "a1", "^", "_",  "|",  "*",  "~",  "]]", "system("};
  std::mt19937 engine(20261130);
  std::uniform_int_distribution<std::size_t> which(0, pieces.size() - 1), length(1, 24);
  std::vector<std::string> names;
  for (std::size_t n = 0; n < count; ++n) {
    std::string name = "n";
    for (std::size_t i = length(engine); i > 0; --i) name += pieces[which(engine)];
    names.push_back(name + "z");
  }
  return names;
}

// A TOML string.
std::string in_toml(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  return out + "\"";
}

std::string model_named(const std::string& name) {
  return "name = " + in_toml(name) +
         "\nconvention = \"ito\"\n[parameters]\nmu = 0.5\n[state]\nx = { initial = 1.0 }\n[drift]\nx = "
         "\"-mu*x\"\n[diffusion]\nx = [\"1\"]\n[observation]\nkind = \"continuous\"\nh = [\"x\"]\n";
}

constexpr const char* record = "t,y1\n0,0\n0.1,0.1\n0.2,0.15\n0.3,0.1\n0.4,0.2\n";

// Ends well, and leaves what was there and these files.
void check_leaves(const Workplace& place, const std::vector<std::string>& arguments,
                  const std::vector<std::string>& outputs) {
  std::vector<std::string> expected = place.files();
  expected.insert(expected.end(), outputs.begin(), outputs.end());
  std::sort(expected.begin(), expected.end());
  expected.erase(std::unique(expected.begin(), expected.end()), expected.end());
  const Outcome outcome = place.run(arguments);
  INFO(outcome.err);
  CHECK(outcome.code == 0);
  CHECK(place.files() == expected);
}

std::string text_of_picture(const Workplace& place, const std::string& file) {
  const Markup picture = parse_markup(place.read(file), MarkupKind::xml);
  CHECK(std::find(picture.elements.begin(), picture.elements.end(), "script") == picture.elements.end());
  return picture.text;
}

}  // namespace

TEST_CASE("a hostile name of a model is text in the picture of a posterior, a density and a tree") {
  std::vector<std::string> names = hostile;
  for (const std::string& name : random_names(10)) names.push_back(name);
  const Workplace place;
  place.write("Y.csv", record);
  for (const std::string& name : names) {
    INFO(name);
    place.write("m.toml", model_named(name));
    const std::vector<std::string> filter = {"filter",  "m.toml", "--observations", "Y.csv",
                                             "--nodes", "10",     "--output",       "out.csv",
                                             "--quiet", "--plot", "p.svg"};
    check_leaves(place, filter, {"out.csv", "p.svg"});
    CHECK_THAT(text_of_picture(place, "p.svg"), Catch::Contains(name));
    std::vector<std::string> density = filter;
    density.insert(density.end(), {"--density-at", "0.2"});
    check_leaves(place, density, {});
    CHECK_THAT(text_of_picture(place, "p.svg"), Catch::Contains(name));
    check_leaves(place,
                 {"tree", "m.toml", "--horizon", "1", "--steps", "3", "--plot", "p.svg", "--graphml", "t.xml",
                  "--dot", "t.dot", "--quiet"},
                 {"t.xml", "t.dot"});
    CHECK_THAT(text_of_picture(place, "p.svg"), Catch::Contains(name));
    CHECK_NOTHROW(parse_markup(place.read("t.xml"), MarkupKind::xml));
  }
}

TEST_CASE("a hostile name of a file is text in every picture, and in a bitmap") {
  const Workplace place;
  place.write("Y.csv", record);
  for (std::string name : hostile) {
    if (name.find('/') != std::string::npos) continue;
    INFO(name);
    // A model without a name is called like its file.
    std::string model = model_named("");
    model.erase(0, model.find('\n') + 1);
    place.write(name + ".toml", model);
    check_leaves(place,
                 {"filter", name + ".toml", "--observations", "Y.csv", "--nodes", "10", "--output", "out.csv",
                  "--plot", "p.svg"},
                 {"out.csv", "p.svg"});
    CHECK_THAT(text_of_picture(place, "p.svg"), Catch::Contains(name));
    check_leaves(place,
                 {"compare", name + ".toml", name + ".toml:mu=0.2", "--observations", "Y.csv", "--nodes",
                  "10", "--output", "out.csv", "--plot", "c.svg"},
                 {"c.svg"});
    CHECK_THAT(text_of_picture(place, "c.svg"), Catch::Contains(name.substr(0, 20)));
    check_leaves(place,
                 {"compare", name + ".toml", name + ".toml:mu=0.2", "--observations", "Y.csv", "--nodes",
                  "10", "--output", "out.csv", "--plot", "c.png"},
                 {"c.png"});
  }
}

TEST_CASE("hostile titles, labels and axes of a study are text in its pictures and on its page") {
  std::vector<std::string> names = hostile;
  for (const std::string& name : random_names(4)) names.push_back(name);
  const Workplace place;
  place.write("m.toml", model_named(names.front()));
  std::string series, plots, claims;
  for (std::size_t i = 0; i < names.size(); ++i)
    series += "[[series]]\nlabel = " + in_toml(names[i]) + "\nnodes = " + std::to_string(10 + i) + "\n";
  for (std::size_t i = 0; i + 2 < names.size(); i += 3)
    plots += "[[plot]]\nx = \"steps\"\nseries = [" + in_toml(names[i]) + "]\ntitle = " + in_toml(names[i]) +
             "\nx_label = " + in_toml(names[i + 1]) + "\ny_label = " + in_toml(names[i + 2]) + "\n";
  for (const std::string& name : names)
    claims += "[[claim]]\ntext = " + in_toml(name) + "\nratio = " + in_toml(names.front()) +
              "\nto = " + in_toml(names.front()) + "\nwithin = [0, 2]\n";
  place.write(
      "s`touch PWNED`.toml",
      "title = " + in_toml(names[0]) + "\npaper = " + in_toml(names[1]) + "\nfinding = " + in_toml(names[9]) +
          "\nreference = \"exact\"\n[observations]\nhorizon = 1\nsteps = 100\nkeep = 20\n[options]\nmodel "
          "= \"m.toml\"\nsteps = [5, 10]\n" +
          series + plots + claims + "[[plot]]\nkind = \"density\"\ntitle = " + in_toml(names[2]) +
          "\nseries = [" + in_toml(names[3]) + "]\n");
  // The exact filter knows the model as linear.
  place.write("m.toml", model_named(names.front()) + "[exact]\nfilter = \"kalman-bucy\"\n");
  check_leaves(place, {"study", "s`touch PWNED`.toml", "--output", "out"}, {"out"});
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(place.directory() / "out"))
    files.push_back(entry.path().filename().string());
  CHECK(std::find(files.begin(), files.end(), "PWNED") == files.end());
  const Markup page = parse_markup(place.read("out/index.html"), MarkupKind::html);
  for (const std::string& name : names) CHECK_THAT(page.text, Catch::Contains(name));
  for (const char* element : {"script", "img"})
    CHECK(std::find(page.elements.begin(), page.elements.end(), element) == page.elements.end());
  for (std::size_t i = 0; i + 2 < names.size(); i += 3) {
    const std::string text = text_of_picture(place, "out/plot-" + std::to_string(1 + i / 3) + ".svg");
    for (std::size_t k = 0; k < 3; ++k) CHECK_THAT(text, Catch::Contains(names[i + k]));
  }
}

TEST_CASE("control characters are refused in files, and replaced in file names and messages") {
  const Workplace place;
  place.write("Y.csv", record);
  for (const char* character : {"\\u0007", "\\u001b[2J", "\\u007f", "\\u009b", "\\u202e"}) {
    INFO(character);
    place.write("m.toml", "name = \"a" + std::string(character) + "b\"\n" +
                              model_named("").substr(model_named("").find('\n') + 1));
    const Outcome outcome = place.run("filter m.toml --observations Y.csv --plot p.svg");
    CHECK(outcome.code == 2);
    CHECK_THAT(outcome.err,
               Catch::Contains("m.toml:1:8") && Catch::Contains("must not hold the character U+"));
    CHECK(lines_of(outcome.err).size() == 1);
    for (const char c : outcome.err) CHECK((c == '\n' || (c >= 0x20 && c != 0x7f) || (c & 0x80) != 0));
    CHECK(outcome.err.find('\x9b') == std::string::npos);
  }
  place.write("m.toml", "name = \"two\\nlines\"\n" + model_named("").substr(model_named("").find('\n') + 1));
  CHECK_THAT(place.run("model show m.toml").err, Catch::Contains("must be one line of printable characters"));
  for (const std::string name : {"bell\a", "escape\x1b[2J", "not\xffutf8", "line\nend"}) {
    std::string model = model_named("");
    model.erase(0, model.find('\n') + 1);
    place.write(name + ".toml", model);
    const Outcome outcome =
        place.run(std::vector<std::string>{"filter", name + ".toml", "--observations", "Y.csv", "--nodes",
                                           "10", "--plot", "p.svg", "--format", "json"});
    CHECK(outcome.code == 0);
    CHECK(outcome.err.find_first_of("\a\x1b\xff") == std::string::npos);
    CHECK_NOTHROW(text_of_picture(place, "p.svg"));
  }
}

TEST_CASE("neither the environment nor a start-up file of the user reaches a picture") {
  Workplace place;
  place.write("Y.csv", record);
  place.write("m.toml", model_named("plain"));
  const std::string filter = "filter m.toml --observations Y.csv --nodes 10 --output out.csv --quiet --plot ";
  REQUIRE(place.run(filter + "usual.svg").code == 0);
  place.write(".gnuplot", "system(\"touch PWNED\")\nset terminal dumb\n");
  place.environment = {{"HOME", place.directory().string()},
                       {"GNUTERM", "dumb"},
                       {"GNUPLOT_LIB", place.directory().string()},
                       {"GNUPLOT_PS_DIR", place.directory().string()},
                       {"GNUHELP", "/dev/null"},
                       {"LC_ALL", "de_DE.UTF-8"}};
  REQUIRE(place.run(filter + "other.svg").code == 0);
  CHECK(place.read("other.svg") == place.read("usual.svg"));
  const std::vector<std::string> files = place.files();
  CHECK(std::find(files.begin(), files.end(), "PWNED") == files.end());
}
