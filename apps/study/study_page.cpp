#include "study_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <regex>

#include "study_plot.hpp"
#include "wienertree/model/text/printable.hpp"
#include "wienertree/version.hpp"

namespace wienertree::app {
namespace {

constexpr const char* style = R"(
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 60rem; padding: 1rem; font: 16px/1.5 system-ui, "Helvetica Neue", Arial, sans-serif; color: #222;
  background: #fff; overflow-wrap: anywhere; }
h1 { font-size: 1.6rem; line-height: 1.2; margin: .5rem 0 1rem; }
h2 { font-size: 1.15rem; margin: 2rem 0 .5rem; }
p { margin: .5rem 0; max-width: 46rem; }
.who { color: #555; font-weight: 600; }
figure { margin: 1.2rem 0; }
figure svg { width: 100%; height: auto; display: block; }
figcaption { font-size: .85rem; color: #555; }
.narrow { display: none; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .85rem; font-variant-numeric: tabular-nums; overflow-wrap: normal; }
th, td { padding: .25rem .6rem; text-align: right; border-bottom: 1px solid #ddd; white-space: nowrap; }
th { border-bottom: 2px solid #888; font-weight: 600; vertical-align: bottom; }
th.text, td.text { text-align: left; }
td.wrap { white-space: normal; min-width: 14rem; overflow-wrap: normal; }
td.yes { color: #00634A; } td.no { color: #A34700; }
pre { overflow-x: auto; font-size: .8rem; background: #f6f6f6; padding: .8rem; }
a { color: #0060A0; }
@media (max-width: 640px) {
  .wide { display: none; } .narrow { display: block; } .scroll { margin: 0 -1rem; padding: 0 1rem; }
  th, td { padding: .25rem .35rem; } td.wrap { min-width: 7rem; }
  .claims tr { display: block; padding: .4rem 0; border-bottom: 1px solid #ddd; } .claims tr:first-child { display: none; }
  .claims td { display: inline; border: 0; padding: 0 .3rem 0 0; white-space: normal; } .claims td.wrap { display: block; }
  .claims td[data-name]:not(:empty)::before { content: attr(data-name) " "; color: #666; }
}
footer { margin-top: 3rem; font-size: .8rem; color: #666; }
)";

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text::printable(text, text::LineEnds::kept)) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

// Numbers like 10 000 are not broken between lines.
std::string prose(const std::string& text) {
  static const std::regex thousands("([0-9]) (?=[0-9]{3}($|[^0-9]))");
  return std::regex_replace(escaped(text), thousands, "$1&nbsp;");
}

std::string base64(const std::string& bytes) {
  constexpr const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k <= bytes.size() ? digits[group >> (18 - 6 * k) & 63U] : '=';
  }
  return out;
}

// Names inside one picture must not meet those of another on the same page.
std::string inlined(const std::string& svg, const std::string& prefix, const std::string& what) {
  std::string body = svg.substr(svg.find("<svg"));
  body = std::regex_replace(body, std::regex("(\\bid=['\"])"), "$1" + prefix);
  body = std::regex_replace(body, std::regex("(href=['\"]#)"), "$1" + prefix);
  body = std::regex_replace(body, std::regex("(url\\(#)"), "$1" + prefix);
  // The size is that of the page; the view box keeps the proportions.
  body = std::regex_replace(body, std::regex("<svg([^>]*?)\\s+width=\"[0-9]+\" height=\"[0-9]+\""), "<svg$1",
                            std::regex_constants::format_first_only);
  const std::size_t title = body.find("<title>"), end = body.find("</title>");
  if (title != std::string::npos && end != std::string::npos)
    body.replace(title, end - title, "<title>" + escaped(what));
  return body;
}

std::string number(double x, int digits = 3) {
  return std::isnan(x) ? "" : fmt::format("{:.{}g}", x, digits);
}

std::string interval(double low, double high, int digits = 3) {
  return std::isnan(low) || std::isnan(high)
             ? ""
             : fmt::format("{} … {}", number(low, digits), number(high, digits));
}

std::string figure(const StudyPlot& plot, const std::vector<PlotLine>& lines, const StudyPicture& picture,
                   std::size_t n) {
  const std::string what = plot.title.empty() ? fmt::format("plot {}", n) : plot.title;
  std::string html =
      fmt::format("<figure>\n<div class=\"{}\">{}</div>\n", picture.narrow.empty() ? "both" : "wide",
                  inlined(picture.wide, fmt::format("w{}-", n), what));
  if (!picture.narrow.empty())
    html += fmt::format("<div class=\"narrow\">{}</div>\n",
                        inlined(picture.narrow, fmt::format("n{}-", n), what));
  const auto has_fit = [](const PlotLine& line) { return line.fit.has_value(); };
  std::string explained = plot.density ? "" : "Shaded: 95 % confidence. ";
  if (std::any_of(lines.begin(), lines.end(), has_fit))
    explained += "Dashed: fitted line; its slope stands beside the name. ";
  return html + fmt::format(
                    "<figcaption>{}<a href=\"{}\">PNG</a>, <a "
                    "href=\"plot-{}.svg\">SVG</a></figcaption>\n</figure>\n",
                    explained, picture.png, n);
}

std::string claims_section(const Study& study, const StudyResults& results) {
  if (study.claims.empty()) return {};
  std::string html =
      "<h2>What is claimed, and what these numbers say</h2>\n<div class=\"scroll\"><table "
      "class=\"claims\">\n<tr><th "
      "class=\"text\">claim</th><th>found</th><th>95 "
      "%</th><th>claimed</th><th class=\"text\"></th></tr>\n";
  for (std::size_t c = 0; c < study.claims.size(); ++c) {
    const ClaimOutcome& o = results.claims[c];
    html += fmt::format(
        "<tr><td class=\"text wrap\">{}</td><td data-name=\"found\">{}</td><td data-name=\"95 %\">{}</td><td "
        "data-name=\"claimed\">{} … {}</td><td class=\"text "
        "{}\">{}</td></tr>\n",
        prose(study.claims[c].text), number(o.value), interval(o.low, o.high), number(study.claims[c].low),
        number(study.claims[c].high), o.inside ? "yes" : "no", o.inside ? "holds" : "does not hold");
  }
  return html + "</table></div>\n";
}

std::string notes_section(const StudyResults& results) {
  if (results.notes.empty()) return {};
  std::string html = "<h2>Left out</h2>\n<ul>\n";
  for (const std::string& note : results.notes) html += fmt::format("<li>{}</li>\n", escaped(note));
  return html + "</ul>\n";
}

std::string slopes_section(const Study& study, const StudyResults& results) {
  std::string rows;
  for (std::size_t p = 0; p < study.plots.size(); ++p)
    for (const PlotLine& line : results.lines[p])
      if (line.fit)
        rows += fmt::format(
            "<tr><td class=\"text\">{}</td><td class=\"text "
            "wrap\">{}</td><td>{:.3f}</td><td>{}</td><td>{}</td></tr>\n",
            p + 1, escaped(line.label), line.fit->slope, interval(line.fit->slope_low, line.fit->slope_high),
            line.fit->points);
  if (rows.empty()) return {};
  return "<h2>Slopes</h2>\n<div class=\"scroll\"><table>\n<tr><th class=\"text\">plot</th><th "
         "class=\"text\">line</th><th>slope</th><th>95 "
         "%</th><th>points</th></tr>\n" +
         rows + "</table></div>\n";
}

std::string table_section(const Study& study, const StudyResults& results) {
  std::string html = "<h2>All points</h2>\n<details><summary>";
  html += fmt::format(
      "{} points</summary>\n<div class=\"scroll\"><table>\n<tr><th class=\"text\">options</th><th>runs</th>",
      results.points.size());
  for (const std::string& q : study.quantities)
    for (const auto& [name, measure] : study.measures)
      html += fmt::format("<th>{} of {}</th><th>95 %</th>", escaped(name), escaped(q));
  html += "<th>ODE solves</th><th>CPU s</th></tr>\n";
  for (const StudyPoint& point : results.points) {
    html += fmt::format("<tr><td class=\"text\">{}</td><td>{}</td>", escaped(words_of(point.options)),
                        point.runs);
    for (const MeasuredError& e : point.errors)
      html += fmt::format("<td>{}</td><td>{}</td>", number(e.value, 4), interval(e.low, e.high));
    html += fmt::format("<td>{}</td><td>{}</td></tr>\n", number(point.ode_solves, 5), number(point.seconds));
  }
  return html + "</table></div></details>\n";
}

std::string downloads_section(const std::vector<StudyDownload>& downloads) {
  std::string html = "<h2>Data</h2>\n<ul>\n";
  for (const StudyDownload& d : downloads) {
    html += fmt::format("<li><a href=\"{0}\">{0}</a> beside this page", escaped(d.name));
    if (d.embedded)
      html += fmt::format(
          ", or <a download=\"{}\" href=\"data:text/plain;charset=utf-8;base64,{}\">from inside it</a>",
          escaped(d.name), base64(d.content));
    html += "</li>\n";
  }
  return html + "</ul>\n";
}

}  // namespace

std::string study_page(const Study& study, const StudyResults& results,
                       const std::vector<StudyPicture>& pictures,
                       const std::vector<StudyDownload>& downloads) {
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{0}</title>\n"
      "<style>{1}</style>\n</head>\n<body>\n<h1>{0}</h1>\n",
      prose(study.title), style);
  if (!study.paper.empty())
    html += fmt::format("<p><span class=\"who\">Published:</span> {}</p>\n", prose(study.paper));
  if (!study.finding.empty())
    html += fmt::format("<p><span class=\"who\">Found:</span> {}</p>\n", prose(study.finding));
  for (std::size_t p = 0; p < pictures.size(); ++p)
    html += figure(study.plots[p], results.lines[p], pictures[p], p + 1);
  html += claims_section(study, results) + notes_section(results) + slopes_section(study, results) +
          table_section(study, results) + downloads_section(downloads);
  html += fmt::format("<h2>Study file</h2>\n<details><summary>{}.toml</summary>\n<pre>{}</pre></details>\n",
                      escaped(study.name), escaped(study.source));
  return html +
         fmt::format("<footer>wienertree {}: wienertree study {}{} --output DIR</footer>\n</body>\n</html>\n",
                     WIENERTREE_VERSION, escaped(study.name), study.full ? " --full" : "");
}

}  // namespace wienertree::app
