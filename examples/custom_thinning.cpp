/// A thinning of one's own: the N heaviest nodes stay, and share the mass. It is biased, as its evidence
/// shows beside that of systematic sampling and of recombination with as many nodes.
///
///     custom_thinning
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "wienertree/cubature/construct.hpp"
#include "wienertree/filter/filter.hpp"
#include "wienertree/filter/simulate.hpp"
#include "wienertree/model/cpp_model.hpp"

using namespace wienertree;

class Heaviest final : public Thinning {
 public:
  void thin(const Sites& sites, std::size_t budget, const RandomStream&, Selection& out) override {
    const auto w = sites.log_weight;
    out = {};
    out.site.resize(w.size());
    std::iota(out.site.begin(), out.site.end(), 0U);
    std::sort(out.site.begin(), out.site.end(), [&](auto a, auto b) { return w[a] > w[b]; });
    out.site.resize(std::min(budget, w.size()));
    std::sort(out.site.begin(), out.site.end());
    double all = 0, kept = 0;
    for (const double l : w) all += std::exp(l);
    for (const auto site : out.site) kept += std::exp(w[site]);
    for (const auto site : out.site)
      out.log_weight.push_back(w[site] + std::log(all / kept));  // same total mass
  }
  std::string_view name() const override { return "heaviest"; }
  bool deterministic() const override { return true; }
};

struct OrnsteinUhlenbeck : CppModel<1, 1, 1> {
  static constexpr auto convention = Convention::ito;
  template <class T>
  State<T> drift(const State<T>& x) const {
    return {-x[0]};
  }
  template <class T>
  Diffusion<T> diffusion(const State<T>&) const {
    return {{{T(1.0)}}};
  }
  template <class T>
  Sensor<T> sensor(const State<T>& x) const {
    return {x[0]};
  }
};

double log_evidence(const Model& model, const ObservationPath& y, const FilterOptions& options) {
  const auto filter = make_filter(model, options);
  run(*filter, ObservationWindows(y, model.observation, model.timing, 100), {});
  return filter->posterior().log_evidence;
}

int main() {
  const Model model = make_model(OrnsteinUhlenbeck{}, {.name = "ou", .initial = {0.0}});
  const ObservationPath y = simulate(model, 5.0, 50000, 5000, 1).observations;
  FilterOptions options;
  options.formula = construct(5, 1);
  options.nodes = 30;
  options.thinning.method = ThinningMethod::systematic;
  std::printf("systematic     %.6f\n", log_evidence(model, y, options));
  options.thinning.own = [] { return std::make_unique<Heaviest>(); };
  std::printf("heaviest       %.6f\n", log_evidence(model, y, options));
  options.thinning = {ThinningMethod::recombination};
  std::printf("recombination  %.6f\n", log_evidence(model, y, options));
  options.method = FilterMethod::kalman_bucy;
  std::printf("exact          %.6f\n", log_evidence(model, y, options));
}
