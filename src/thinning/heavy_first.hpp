#pragma once
/// Heavy sites go on as they are, light ones are merged, as in the adaptive patched cubature filter of Lee
/// and Lyons (2016, "The adaptive patched cubature filter and its implementation", Commun. Math. Sci. 14,
/// 799-829).
#include "wienertree/thinning/thinning.hpp"

namespace wienertree {

/// Deterministic; keeps the total mass; at most `budget` nodes. The heaviest half of the budget, as far as a
/// site of it weighs more than 1/budget of the mass, is kept as it is; what is left of the budget goes to the
/// other sites by patched recombination. Equal weights are told apart by where they are stored.
class HeavyFirst final : public Thinning {
 public:
  /// @throws InputError if degree < 0
  explicit HeavyFirst(int degree);
  /// @throws as make_recombination's
  void thin(const Sites& sites, std::size_t budget, const RandomStream& random, Selection& out) override;
  std::string_view name() const override { return "heavy-first"; }
  bool deterministic() const override { return true; }

 private:
  void find_heavy(std::span<const double> log_weight, std::size_t budget);

  std::unique_ptr<Thinning> recombination_;
  Selection light_;
  std::vector<std::uint32_t> heavy_;
  std::vector<double> log_weight_;  ///< that of heavy sites is -infinity
};

}  // namespace wienertree
