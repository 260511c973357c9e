#include "wienertree/cubature/words.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

#include "wienertree/numeric/error.hpp"

namespace wienertree {

int degree_of(std::span<const int> word) {
  return static_cast<int>(word.size()) + static_cast<int>(std::count(word.begin(), word.end(), 0));
}

std::string to_string(std::span<const int> word) {
  return word.empty() ? "(empty word)" : fmt::format("{}", fmt::join(word, " "));
}

GradedWords::Index GradedWords::count_up_to(int p, int degree) {
  Index before = 0, current = 1, total = 1;  // W_{g-1}, W_g, W_0 + .. + W_g
  for (int g = 1; g <= degree; ++g) {
    // current <= limit < 2^23 and p < 2^31, so that neither product nor sum overflows.
    const Index next = before + p * current;
    before = current;
    current = next;
    total += next;
    if (total > limit) return limit + 1;
  }
  return total;
}

GradedWords::GradedWords(int p, int degree) : p_(p) {
  if (p < 1) throw InputError("the dimension must be at least 1", "words", fmt::format("{}", p));
  if (degree < 0) throw InputError("the degree must not be negative", "words", fmt::format("{}", degree));
  if (count_up_to(p, degree) > limit)
    throw InputError(fmt::format("there are more than {} words of this degree and dimension", limit), "words",
                     fmt::format("degree {}, dimension {}", degree, p));
  first_ = {0, 1};
  for (int g = 1; g <= degree; ++g) {
    first_.push_back(first_.back() + count(g - 2) + p * count(g - 1));
  }
}

GradedWords::Index GradedWords::index(std::span<const int> word) const {
  int g = degree_of(word);
  assert(g <= degree());
  Index offset = 0;  // within the words of the degree of what is left
  for (const int letter : word) {
    assert(0 <= letter && letter <= p_);
    offset += first_with(letter, g) - first(g);
    g -= weight(letter);
  }
  return first(degree_of(word)) + offset;
}

Word GradedWords::word(Index index) const {
  assert(0 <= index && index < size());
  int g = degree();
  while (first(g) > index) --g;
  Index offset = index - first(g);
  Word letters;
  while (g > 0) {
    const int letter =
        offset < count(g - 2) ? 0 : 1 + static_cast<int>((offset - count(g - 2)) / count(g - 1));
    offset -= first_with(letter, g) - first(g);
    g -= weight(letter);
    letters.push_back(letter);
  }
  return letters;
}

}  // namespace wienertree
