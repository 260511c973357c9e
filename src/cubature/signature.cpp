#include "wienertree/cubature/signature.hpp"

#include <cassert>
#include <cmath>

namespace wienertree {
namespace {

using Index = GradedWords::Index;

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
  set_to_one(E);
  // exp(G) = 1 + G (1 + G/2 (1 + G/3 (..))) for G = e_0 + 1/2 sum_i e_i (x) e_i, which raises degrees by two:
  // in place, degrees descending. The words iiv with ||v|| = g - 2 are those that begin with i among the v'
  // of the words iv', ||v'|| = g - 1.
  const GradedWords& words = E.words;
  for (int k = degree / 2; k >= 1; --k) {
    for (int g = degree - 2 * (k - 1); g >= 2; --g) {
      const Index rest = words.count(g - 2);
      const Eigen::VectorXd tail = E.coefficients.segment(words.first(g - 2), rest) / k;
      E.coefficients.segment(words.first_with(0, g), rest) = tail;
      for (int i = 1; i <= p; ++i) {
        const Index within = words.first_with(i, g - 1) - words.first(g - 1);
        E.coefficients.segment(words.first_with(i, g) + within, rest) = tail / 2;
      }
    }
  }
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
