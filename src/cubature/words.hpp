#pragma once
/// Words over the alphabet {0..p}, graded by ||alpha|| = length + number of zeros: the letter 0 stands for
/// time, which scales like the square of a Brownian motion.
#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

namespace wienertree {

/// Letters from left to right; the empty word is the empty vector.
using Word = std::vector<int>;

/// ||alpha|| = k + #{i : alpha_i = 0} for alpha = (alpha_1..alpha_k).
int degree_of(std::span<const int> word);

/// "0 1 1 0"; the empty word reads "(empty word)".
std::string to_string(std::span<const int> word);

/// All words over {0..p} of degree <= m, numbered by degree and lexicographically within a degree.
/// A word of degree g is 0v with ||v|| = g - 2 or iv with ||v|| = g - 1, so W_g = W_{g-2} + p W_{g-1} words
/// have degree g, and the words of degree g are laid out as
///     [0 W_{g-2}-block | 1 W_{g-1}-block | .. | p W_{g-1}-block]:
/// prefixing a letter to all words of a degree maps a contiguous block to a contiguous block.
class GradedWords {
 public:
  using Index = Eigen::Index;
  /// More words than this are refused rather than left to exhaust the memory.
  static constexpr Index limit = Index{1} << 22;

  /// @throws InputError if p < 1, degree < 0, or there are more than `limit` words
  GradedWords(int p, int degree);
  /// Number of words over {0..p} of degree <= m, or limit + 1 if there are more than `limit`.
  static Index count_up_to(int p, int degree);

  int dimension() const { return p_; }
  int degree() const { return static_cast<int>(first_.size()) - 2; }
  Index size() const { return first_.back(); }
  /// Words of degree g occupy [first(g), first(g) + count(g)); g <= degree().
  Index first(int g) const { return first_[static_cast<std::size_t>(g)]; }
  /// W_g; 0 for g < 0.
  Index count(int g) const { return g < 0 ? 0 : first(g + 1) - first(g); }
  /// Where the words of degree g that begin with `letter` start; there are count(g - weight(letter)) of them.
  Index first_with(int letter, int g) const {
    return first(g) + (letter == 0 ? 0 : count(g - 2) + (letter - 1) * count(g - 1));
  }
  /// Degree of a single letter: 2 for time, 1 otherwise.
  static constexpr int weight(int letter) { return letter == 0 ? 2 : 1; }

  /// @pre letters in {0..p}, degree_of(word) <= degree()
  Index index(std::span<const int> word) const;
  /// @pre 0 <= index < size()
  Word word(Index index) const;

  friend bool operator==(const GradedWords&, const GradedWords&) = default;

 private:
  int p_;
  std::vector<Index> first_;  // first_[g] for g = 0..degree + 1
};

}  // namespace wienertree
