#pragma once
/// The exact law of TBBA by enumeration, from the algorithm as printed (Bain, Crisan 2009, section 9.2.1),
/// for weights that are integers: integer and fractional parts are then those of fractions, and exact.
#include <map>
#include <numeric>
#include <vector>

namespace wienertree_test {

using Counts = std::vector<unsigned>;
using CountLaw = std::map<Counts, double>;

/// Counts of H particles on sites owed owed_i / W particles each; sum owed_i / W = G is H or within 1 of it.
class TbbaLaw {
 public:
  TbbaLaw(const std::vector<unsigned>& owed, unsigned W, unsigned H) : owed_(owed), W_(W) {
    descend(std::accumulate(owed.begin(), owed.end(), 0U), H, 1.0);
  }
  const CountLaw& law() const { return law_; }

 private:
  void descend(unsigned G, unsigned H, double probability) {
    const std::size_t i = counts_.size();
    if (probability <= 0) return;
    if (i + 1 == owed_.size()) return take(H, 0, 0, probability);
    const unsigned whole = owed_[i] / W_, f = owed_[i] % W_, r = G % W_, extra = H - G / W_;
    const auto ratio = [](unsigned a, unsigned b) { return static_cast<double>(a) / static_cast<double>(b); };
    if (f + (G - owed_[i]) % W_ < W_) {
      const double p = r > 0 ? 1 - ratio(f, r) : 1;
      take(whole, G - owed_[i], H - whole, probability * p);
      take(whole + extra, G - owed_[i], H - whole - extra, probability * (1 - p));
    } else {
      const double p = 1 - ratio(W_ - f, W_ - r);
      take(whole + 1, G - owed_[i], H - whole - 1, probability * p);
      take(whole + extra, G - owed_[i], H - whole - extra, probability * (1 - p));
    }
  }
  void take(unsigned o, unsigned G, unsigned H, double probability) {
    if (probability <= 0) return;
    counts_.push_back(o);
    if (counts_.size() == owed_.size())
      law_[counts_] += probability;
    else
      descend(G, H, probability);
    counts_.pop_back();
  }

  std::vector<unsigned> owed_;
  unsigned W_;
  Counts counts_;
  CountLaw law_;
};

/// Law of N particles on sites of the given weights.
inline CountLaw flat_law(const std::vector<unsigned>& weights, unsigned N) {
  std::vector<unsigned> owed;
  for (const unsigned w : weights) owed.push_back(N * w);
  return TbbaLaw(owed, std::accumulate(weights.begin(), weights.end(), 0U), N).law();
}

/// Law of the leaves, family by family, of two levels of the iterated form: children of weights a, each with
/// children of weights b.
inline CountLaw iterated_law(const std::vector<unsigned>& a, const std::vector<unsigned>& b, unsigned N) {
  const unsigned A = std::accumulate(a.begin(), a.end(), 0U), B = std::accumulate(b.begin(), b.end(), 0U);
  CountLaw law;
  for (const auto& [families, p] : flat_law(a, N)) {
    CountLaw outcomes = {{Counts{}, p}};
    for (std::size_t i = 0; i < a.size(); ++i) {
      std::vector<unsigned> owed;
      for (const unsigned w : b) owed.push_back(N * a[i] * w);
      CountLaw longer;
      const CountLaw family = TbbaLaw(owed, A * B, families[i]).law();
      for (const auto& [leaves, q] : family)
        for (const auto& [before, r] : outcomes) {
          Counts joint = before;
          joint.insert(joint.end(), leaves.begin(), leaves.end());
          longer[joint] += r * q;
        }
      outcomes = longer;
    }
    for (const auto& [counts, q] : outcomes) law[counts] += q;
  }
  return law;
}

}  // namespace wienertree_test
