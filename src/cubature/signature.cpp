#include "wienertree/cubature/signature.hpp"

#include <cassert>
#include <cmath>

namespace wienertree {
namespace {

using Index = GradedWords::Index;

// The only splitting into blocks "0" and "ii" is found from the left: a letter i > 0 must open an "ii".
double expected_coefficient(const Word& word) {
  double value = 1;
  int blocks = 0;
  for (std::size_t i = 0; i < word.size(); ++i) {
    if (word[i] != 0) {
      if (i + 1 == word.size() || word[i + 1] != word[i]) return 0;
      value /= 2;
      ++i;
    }
    value /= ++blocks;
  }
  return value;
}

void set_to_one(TensorSeries& S) {
  S.coefficients.setZero();
  S.coefficients[0] = 1;
}

void set_to_signature(const CubaturePath& path, TensorSeries& S, Eigen::VectorXd& scratch) {
  set_to_one(S);
  for (Eigen::Index s = path.increments.cols() - 1; s >= 0; --s) {
    const auto column = path.increments.col(s);
    multiply_by_exponential_from_left({column.data(), static_cast<std::size_t>(column.size())}, S, scratch);
  }
}

}  // namespace

TensorSeries expected_signature(int p, int degree) {
  TensorSeries E(p, degree);
  for (Index i = 0; i < E.words.size(); ++i) E.coefficients[i] = expected_coefficient(E.words.word(i));
  return E;
}

TensorSeries signature(const CubaturePath& path, int degree) {
  TensorSeries S(static_cast<int>(path.increments.rows()) - 1, degree);
  Eigen::VectorXd scratch;
  set_to_signature(path, S, scratch);
  return S;
}

TensorSeries mean_signature(const CubatureFormula& formula, int degree) {
  TensorSeries S(formula.dimension, degree);
  CompensatedSum mean(S.words.size());
  Eigen::VectorXd scratch;
  for (const CubaturePath& path : formula.paths) {
    assert(path.increments.rows() == formula.dimension + 1);
    set_to_signature(path, S, scratch);
    mean.add(path.weight, S.coefficients);
  }
  S.coefficients = mean.value();
  return S;
}

void multiply_by_exponential_from_left(std::span<const double> D, TensorSeries& S, Eigen::VectorXd& scratch) {
  const GradedWords& words = S.words;
  const int p = words.dimension(), m = words.degree();
  assert(static_cast<int>(D.size()) == p + 1);
  // T holds the levels of Horner's scheme in place of S, degrees descending so that a word is read before it
  // is replaced. Words that begin with a letter of zero increment never change, and the others' original
  // coefficients are kept in `scratch`.
  Eigen::VectorXd& T = S.coefficients;
  scratch.resize(words.size());
  const auto for_each_block = [&](int up_to, auto&& visit) {
    for (int g = up_to; g >= 1; --g) {
      for (int letter = 0; letter <= p; ++letter) {
        const double increment = D[static_cast<std::size_t>(letter)];
        const int rest = g - GradedWords::weight(letter);
        if (increment != 0 && rest >= 0)
          visit(words.first_with(letter, g), words.first(rest), words.count(rest), increment);
      }
    }
  };
  for_each_block(m,
                 [&](Index with, Index, Index n, double) { scratch.segment(with, n) = T.segment(with, n); });
  for (int k = m; k >= 1; --k) {
    for_each_block(m - k + 1, [&](Index with, Index without, Index n, double increment) {
      T.segment(with, n) = scratch.segment(with, n) + (increment / k) * T.segment(without, n);
    });
  }
}

TensorSeries product(const TensorSeries& a, const TensorSeries& b) {
  assert(a.words == b.words);
  const GradedWords& words = a.words;
  TensorSeries c(words.dimension(), words.degree());
  for (Index u = 0; u < words.size(); ++u) {
    const double factor = a.coefficients[u];
    if (factor == 0) continue;
    Word word = words.word(u);
    const int du = degree_of(word);
    // The words uv with ||v|| = g are contiguous, in the order of v; the first has the least v, which is
    // 00..0 or 00..01.
    for (int g = 0; du + g <= words.degree(); ++g) {
      Word least = word;
      least.insert(least.end(), static_cast<std::size_t>(g / 2), 0);
      if (g % 2 == 1) least.push_back(1);
      c.coefficients.segment(words.index(least), words.count(g)) +=
          factor * b.coefficients.segment(words.first(g), words.count(g));
    }
  }
  return c;
}

TensorSeries exponential(const TensorSeries& a) {
  assert(a.coefficients[0] == 0);
  TensorSeries result(a.words.dimension(), a.words.degree());
  set_to_one(result);
  for (int k = a.words.degree(); k >= 1; --k) {  // 1 + a (1 + a/2 (1 + a/3 (..)))
    result = product(a, result);
    result.coefficients /= k;
    result.coefficients[0] = 1;
  }
  return result;
}

void CompensatedSum::add(double factor, const Eigen::VectorXd& terms) {
  assert(terms.size() == sum_.size());
  for (Eigen::Index i = 0; i < terms.size(); ++i) {
    const double term = factor * terms[i], sum = sum_[i] + term;
    lost_[i] += std::abs(sum_[i]) >= std::abs(term) ? (sum_[i] - sum) + term : (term - sum) + sum_[i];
    sum_[i] = sum;
  }
}

}  // namespace wienertree
