#include "markup.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace cli {
namespace {

constexpr std::array<std::pair<std::string_view, std::string_view>, 6> entities{
    {{"&amp;", "&"}, {"&lt;", "<"}, {"&gt;", ">"}, {"&quot;", "\""}, {"&#39;", "'"}, {"&nbsp;", " "}}};
constexpr std::array<std::string_view, 4> void_elements{"meta", "br", "link", "img"};

bool name_character(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == ':' || c == '_' || c == '.';
}

class Parser {
 public:
  Parser(std::string_view rest, MarkupKind kind) : rest_(rest), kind_(kind) {}

  Markup parse() {
    while (!rest_.empty()) {
      if (skip("<!--", "-->") || skip("<?", "?>") || skip("<!DOCTYPE", ">")) continue;
      if (rest_.starts_with("</"))
        close();
      else if (rest_.starts_with('<'))
        open();
      else
        character();
    }
    require(open_.empty(), "an element is not closed");
    return std::move(markup_);
  }

 private:
  void require(bool holds, const std::string& message) const {
    if (!holds) throw std::runtime_error(message + ": " + std::string(rest_.substr(0, 80)));
  }
  bool skip(std::string_view begin, std::string_view end) {
    if (!rest_.starts_with(begin)) return false;
    const std::size_t at = rest_.find(end, begin.size());
    require(at != std::string_view::npos, "no end");
    rest_.remove_prefix(at + end.size());
    return true;
  }
  std::string name() {
    std::size_t length = 0;
    while (length < rest_.size() && name_character(rest_[length])) ++length;
    require(length > 0, "a name is needed");
    const std::string name(rest_.substr(0, length));
    rest_.remove_prefix(length);
    return name;
  }
  void blanks() {
    while (!rest_.empty() && std::isspace(static_cast<unsigned char>(rest_.front())) != 0)
      rest_.remove_prefix(1);
  }
  bool take(std::string_view text) {
    if (!rest_.starts_with(text)) return false;
    rest_.remove_prefix(text.size());
    return true;
  }

  void close() {
    take("</");
    const std::string closed = name();
    require(!open_.empty() && open_.back() == closed, "not the element that is open");
    open_.pop_back();
    blanks();
    require(take(">"), "no end of a tag");
  }
  void open() {
    take("<");
    const std::string opened = name();
    markup_.elements.push_back(opened);
    for (blanks(); !rest_.starts_with('>') && !rest_.starts_with("/>"); blanks()) attribute();
    const bool ends = take("/>");
    if (!ends) take(">");
    const bool is_void = kind_ == MarkupKind::html &&
                         std::find(void_elements.begin(), void_elements.end(), opened) != void_elements.end();
    if (!ends && !is_void) open_.push_back(opened);
    if (opened == "style" && kind_ == MarkupKind::html) rest_.remove_prefix(rest_.find("</style>"));
  }
  void attribute() {
    name();
    blanks();
    if (!take("=")) {
      require(kind_ == MarkupKind::html, "an attribute without a value");
      return;
    }
    blanks();
    require(!rest_.empty() && (rest_.front() == '"' || rest_.front() == '\''), "a value without quotes");
    const char quote = rest_.front();
    rest_.remove_prefix(1);
    while (!rest_.starts_with(quote)) {
      require(!rest_.empty() && rest_.front() != '<', "no end of a value");
      character();
    }
    rest_.remove_prefix(1);
  }
  void character() {
    if (rest_.front() == '&') {
      for (const auto& [entity, meaning] : entities)
        if (take(entity)) {
          markup_.text += meaning;
          return;
        }
      require(false, "an ampersand that begins no entity");
    }
    const auto c = static_cast<unsigned char>(rest_.front());
    require(c >= 0x20 || c == '\n' || c == '\t' || c == '\r', "a control character");
    const std::size_t bytes = c < 0x80 ? 1 : c >= 0xF0 ? 4 : c >= 0xE0 ? 3 : 2;
    require(c < 0x80 || (c >= 0xC2 && c <= 0xF4 && rest_.size() >= bytes), "not UTF-8");
    for (std::size_t i = 1; i < bytes; ++i)
      require((static_cast<unsigned char>(rest_[i]) & 0xC0U) == 0x80U, "not UTF-8");
    markup_.text += rest_.substr(0, bytes);
    rest_.remove_prefix(bytes);
  }

  std::string_view rest_;
  MarkupKind kind_;
  Markup markup_;
  std::vector<std::string> open_;
};

}  // namespace

Markup parse_markup(const std::string& document, MarkupKind kind) { return Parser(document, kind).parse(); }

}  // namespace cli
