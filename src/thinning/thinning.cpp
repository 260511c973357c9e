#include "wienertree/thinning/thinning.hpp"

#include "wienertree/thinning/counting.hpp"
#include "wienertree/thinning/heavy_first.hpp"
#include "wienertree/thinning/recombination/recombination.hpp"

namespace wienertree {

std::unique_ptr<Thinning> make_thinning(const ThinningOptions& options) {
  if (options.own) return options.own();
  switch (options.method) {
    case ThinningMethod::none:
      return std::make_unique<KeepAll>(options.order);
    case ThinningMethod::recombination:
      return make_recombination(options.recombination_degree);
    case ThinningMethod::levelwise:
      return make_levelwise_recombination(options.recombination_degree);
    case ThinningMethod::heavy_first:
      return std::make_unique<HeavyFirst>(options.recombination_degree);
    default:
      return std::make_unique<CountingThinning>(options.method, options.order);
  }
}

}  // namespace wienertree
