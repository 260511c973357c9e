#include "wienertree/cubature/signature.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <random>

#include "cubature/random_path.hpp"
#include "wienertree/numeric/error.hpp"

using namespace wienertree;
using wienertree::testing::random_path;

namespace {

// Coefficients of the paths below are at most 3^k / k! < 5 and come from a few hundred roundings of 1.1e-16
// each.
constexpr double rounding = 1e-13;

// A tensor series without truncation by layout: the words one by one. Deliberately naive.
using Series = std::map<Word, double>;

Series naive_product(const Series& a, const Series& b, int degree) {
  Series c;
  for (const auto& [u, x] : a) {
    for (const auto& [v, y] : b) {
      Word uv = u;
      uv.insert(uv.end(), v.begin(), v.end());
      if (degree_of(uv) <= degree) c[uv] += x * y;
    }
  }
  return c;
}

Series naive_exponential(const Series& a, int degree) {
  Series result{{Word{}, 1.0}}, power = result;
  for (int k = 1; k <= degree; ++k) {
    power = naive_product(power, a, degree);
    for (auto& [word, value] : power) result[word] += value /= k;
  }
  return result;
}

double difference(const TensorSeries& series, const Series& naive) {
  double largest = 0;
  for (GradedWords::Index i = 0; i < series.words.size(); ++i) {
    const auto found = naive.find(series.words.word(i));
    largest =
        std::max(largest, std::abs(series.coefficients[i] - (found == naive.end() ? 0 : found->second)));
  }
  return largest;
}

double difference(const TensorSeries& a, const TensorSeries& b) {
  return (a.coefficients - b.coefficients).lpNorm<Eigen::Infinity>();
}

// int dw^{a_1} .. dw^{a_k} by definition: the integral over a_1..a_j is on each segment a polynomial in the
// local time u, and the next one is its antiderivative times the increment, continued from the segment
// before.
double iterated_integral(const CubaturePath& path, const Word& word) {
  const Eigen::Index segments = path.increments.cols();
  std::vector<std::vector<double>> integrand(static_cast<std::size_t>(segments), {1.0});
  double at_end = 1;
  for (const int letter : word) {
    double start = 0;
    for (Eigen::Index s = 0; s < segments; ++s) {
      std::vector<double>& polynomial = integrand[static_cast<std::size_t>(s)];
      std::vector<double> antiderivative{start};
      for (std::size_t k = 0; k < polynomial.size(); ++k)
        antiderivative.push_back(path.increments(letter, s) * polynomial[k] / static_cast<double>(k + 1));
      start = 0;
      for (const double coefficient : antiderivative) start += coefficient;
      polynomial = antiderivative;
    }
    at_end = start;
  }
  return at_end;
}

void shuffle(const Word& u, const Word& v, Word prefix, std::vector<Word>& out) {
  if (u.empty() || v.empty()) {
    prefix.insert(prefix.end(), u.begin(), u.end());
    prefix.insert(prefix.end(), v.begin(), v.end());
    out.push_back(prefix);
    return;
  }
  Word with_u = prefix, with_v = prefix;
  with_u.push_back(u.front());
  with_v.push_back(v.front());
  shuffle({u.begin() + 1, u.end()}, v, with_u, out);
  shuffle(u, {v.begin() + 1, v.end()}, with_v, out);
}

}  // namespace

TEST_CASE("Words are numbered by degree, then lexicographically, without gaps") {
  for (int p = 1; p <= 3; ++p) {
    const int m = 6;
    std::vector<Word> all{{}};
    for (std::size_t i = 0; i < all.size(); ++i) {
      for (int letter = 0; letter <= p; ++letter) {
        Word longer = all[i];
        longer.push_back(letter);
        if (degree_of(longer) <= m) all.push_back(longer);
      }
    }
    std::sort(all.begin(), all.end(), [](const Word& a, const Word& b) {
      return std::make_pair(degree_of(a), a) < std::make_pair(degree_of(b), b);
    });
    const GradedWords words(p, m);
    REQUIRE(words.size() == static_cast<GradedWords::Index>(all.size()));
    REQUIRE(GradedWords::count_up_to(p, m) == words.size());
    for (GradedWords::Index i = 0; i < words.size(); ++i) {
      CHECK(words.word(i) == all[static_cast<std::size_t>(i)]);
      CHECK(words.index(all[static_cast<std::size_t>(i)]) == i);
    }
  }
}

TEST_CASE("Words are printed with spaces") {
  CHECK(to_string(Word{0, 1, 1, 0}) == "0 1 1 0");
  CHECK(to_string(Word{}) == "(empty word)");
}

TEST_CASE("More words than fit are refused") {
  CHECK_THROWS_AS(GradedWords(1000, 1000), InputError);
  CHECK_THROWS_AS(GradedWords(2, 60), InputError);
  CHECK_THROWS_AS(GradedWords(0, 3), InputError);
  CHECK_THROWS_AS(GradedWords(1, -1), InputError);
  CHECK(GradedWords::count_up_to(1000000, 1000000) == GradedWords::limit + 1);
}

TEST_CASE("The expected signature is exp(e_0 + 1/2 sum e_i e_i)") {
  for (int p = 1; p <= 3; ++p) {
    const int m = p == 1 ? 9 : 6;
    Series generator{{Word{0}, 1.0}};
    TensorSeries exponent(p, m);
    exponent[Word{0}] = 1;
    for (int i = 1; i <= p; ++i) generator[Word{i, i}] = exponent[Word{i, i}] = 0.5;
    const TensorSeries expected = expected_signature(p, m);
    CHECK(difference(expected, naive_exponential(generator, m)) < 1e-15);
    CHECK(difference(expected, exponential(exponent)) < 1e-15);
  }
}

TEST_CASE("The expected signature has the values known in closed form") {
  const TensorSeries E = expected_signature(2, 8);
  CHECK(E[Word{}] == 1);
  CHECK(E[Word{1, 1, 1, 1}] == 0.125);  // E B^4 / 4! = 3/24
  CHECK(E[Word{0, 1, 1}] == 0.25);      // int t dt-ordered: 1/2 * 1/2!
  CHECK(E[Word{1, 0, 1}] == 0);         // int B dt o dB has mean 0
  CHECK(E[Word{1, 1, 2, 2, 0}] == Approx(1. / 24));
  CHECK(E[Word{0, 0, 0, 0}] == Approx(1. / 24));
}

TEST_CASE("Chen's identity gives the iterated integrals of a piecewise linear path") {
  std::mt19937_64 engine(20240101);
  for (int p = 1; p <= 3; ++p) {
    for (int segments : {1, 2, 5}) {
      const CubaturePath path = random_path(p, segments, engine);
      const TensorSeries S = signature(path, 7);
      double largest = 0;
      for (GradedWords::Index i = 0; i < S.words.size(); ++i)
        largest = std::max(largest, std::abs(S.coefficients[i] - iterated_integral(path, S.words.word(i))));
      CHECK(largest < rounding);
    }
  }
}

TEST_CASE("The signature of a concatenation is the product, of the reversed path the inverse") {
  std::mt19937_64 engine(7);
  for (int p = 1; p <= 3; ++p) {
    const CubaturePath path = random_path(p, 6, engine);
    const CubaturePath head{1, path.increments.leftCols(2)}, tail{1, path.increments.rightCols(4)};
    const TensorSeries S = signature(path, 6);
    CHECK(difference(S, product(signature(head, 6), signature(tail, 6))) < rounding);
    const TensorSeries one = product(S, signature(CubaturePath{1, -path.increments.rowwise().reverse()}, 6));
    TensorSeries identity(p, 6);
    identity[Word{}] = 1;
    CHECK(difference(one, identity) < rounding);
  }
}

TEST_CASE("Signatures satisfy the shuffle identity") {
  std::mt19937_64 engine(11);
  const int m = 8;
  for (int p = 1; p <= 3; ++p) {
    const TensorSeries S = signature(random_path(p, 5, engine), m);
    const GradedWords half(p, m / 2);
    std::uniform_int_distribution<GradedWords::Index> any(0, half.size() - 1);
    for (int trial = 0; trial < 200; ++trial) {
      const Word u = half.word(any(engine)), v = half.word(any(engine));
      std::vector<Word> shuffles;
      shuffle(u, v, {}, shuffles);
      double sum = 0;
      for (const Word& w : shuffles) sum += S[w];
      INFO(to_string(u) << " | " << to_string(v));
      CHECK(std::abs(S[u] * S[v] - sum) < rounding);
    }
  }
}

TEST_CASE("Scaling a path to a step of length s multiplies a word by s^(degree/2)") {
  std::mt19937_64 engine(13);
  const double s = 0.3;
  for (int p = 1; p <= 3; ++p) {
    const CubaturePath path = random_path(p, 4, engine);
    CubaturePath scaled = path;
    for (Eigen::Index k = 0; k < path.increments.cols(); ++k) {
      auto column = scaled.increments.col(k);
      scaled_increments(path, static_cast<std::size_t>(k), s,
                        {column.data(), static_cast<std::size_t>(column.size())});
    }
    const TensorSeries S = signature(path, 6), T = signature(scaled, 6);
    for (GradedWords::Index i = 0; i < S.words.size(); ++i) {
      const double factor = std::pow(s, degree_of(S.words.word(i)) / 2.0);
      CHECK(std::abs(T.coefficients[i] - factor * S.coefficients[i]) < rounding);
    }
  }
}

TEST_CASE("Compensated sums keep what plain sums lose") {
  CompensatedSum sum(1);
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(1);
  sum.add(1, one);
  for (int i = 0; i < 1000; ++i) sum.add(1e-17, one);  // each is lost on its own against 1
  sum.add(-1, one);
  CHECK(sum.value()[0] == Approx(1e-14).epsilon(1e-12));
}
