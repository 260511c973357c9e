/// A functional of one's own: the likelihood of a step by the midpoint of its ends,
///     log w = h_m.D - (s/2) |h_m|^2,     h_m = (h_0 + h_1)/2.
/// Its error in the number of steps is printed beside that of the functionals that come with the library.
///
///     custom_functional
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "wienertree/cubature/construct.hpp"
#include "wienertree/filter/filter.hpp"
#include "wienertree/filter/simulate.hpp"
#include "wienertree/model/cpp_model.hpp"

using namespace wienertree;

class Midpoint final : public Functional {
 public:
  std::string_view name() const override { return "midpoint"; }
  bool uses_end() const override { return true; }
  bool uses_derivative() const override { return false; }
  void at_start(const ObservationWindow&, ConstBatchView, ConstBatchView,
                std::span<double> out) const override {
    std::fill(out.begin(), out.end(), 0.0);
  }
  void at_end(const ObservationWindow& w, ConstBatchView h0, ConstBatchView, ConstBatchView h1,
              std::span<double> log_weight) const override {
    for (std::size_t i = 0; i < h0.components(); ++i)
      for (std::size_t n = 0; n < log_weight.size(); ++n) {
        const double h = (h0(i, n) + h1(i, n)) / 2;
        log_weight[n] += h * w.increment[i] - w.length() * h * h / 2;
      }
  }
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

double final_mean(const Model& model, const ObservationPath& y, const FilterOptions& options,
                  std::size_t steps) {
  const auto filter = make_filter(model, options);
  run(*filter, ObservationWindows(y, model.observation, model.timing, steps), {});
  return mean(filter->posterior(), 0);
}

int main() {
  const Model model = make_model(OrnsteinUhlenbeck{}, {.name = "ou", .initial = {0.0}});
  const ObservationPath y = simulate(model, 5.0, 100000, 100000, 1).observations;
  FilterOptions options;
  options.method = FilterMethod::kalman_bucy;
  const double exact = final_mean(model, y, options, 100000);

  options.method = FilterMethod::klv;
  options.formula = construct(5, 1);
  options.nodes = 100;
  options.thinning.method = ThinningMethod::recombination;
  std::printf("%8s %12s %12s %12s\n", "steps", "midpoint", "trapezoid", "second order");
  for (const std::size_t steps : {25, 50, 100, 200}) {
    const auto error = [&](FunctionalMethod method, bool own) {
      options.functional = method;
      options.own_functional = {};
      if (own) options.own_functional = [] { return std::make_unique<Midpoint>(); };
      return std::fabs(final_mean(model, y, options, steps) - exact);
    };
    std::printf("%8zu %12.2e %12.2e %12.2e\n", steps, error(FunctionalMethod::picard, true),
                error(FunctionalMethod::trapezoid, false), error(FunctionalMethod::second_order, false));
  }
}
