#include "wienertree/tree/thinning.hpp"

#include "wienertree/model/error.hpp"
#include "wienertree/tree/counting.hpp"

namespace wienertree {

std::unique_ptr<Thinning> make_thinning(const ThinningOptions& options) {
  switch (options.method) {
    case ThinningMethod::none:
      return std::make_unique<KeepAll>(options.order);
    case ThinningMethod::recombination:
      throw InputError("this build has no patched recombination", "thinning", "recombination");
    default:
      return std::make_unique<CountingThinning>(options.method, options.order);
  }
}

}  // namespace wienertree
