/// A model in C++, filtered: a particle in the double well dX = (X - X^3) dt + s dB, observed through
/// dY = X dt + dW.
///
///     model_in_cpp            the posterior at ten times, beside the signal
#include <cmath>
#include <cstdio>

#include "wienertree/cubature/construct.hpp"
#include "wienertree/filter/filter.hpp"
#include "wienertree/filter/simulate.hpp"
#include "wienertree/model/cpp_model.hpp"

using namespace wienertree;

struct DoubleWell : CppModel<1, 1, 1> {  // states, Brownian motions, components of the observation
  static constexpr auto convention = Convention::ito;
  double s = 0.7;
  template <class T>
  State<T> drift(const State<T>& x) const {
    return {x[0] - x[0] * x[0] * x[0]};
  }
  template <class T>
  Diffusion<T> diffusion(const State<T>&) const {
    return {{{T(s)}}};
  }
  template <class T>
  Sensor<T> sensor(const State<T>& x) const {
    return {x[0]};
  }
};

int main() {
  const Model model = make_model(DoubleWell{}, {.name = "double-well", .initial = {-1.0}});
  const Simulation truth = simulate(model, 10.0, 20000, 2000, 3);

  FilterOptions options;
  options.formula = construct(5, 1);  // degree 5, one Brownian motion
  options.thinning.method = ThinningMethod::recombination;
  options.nodes = 60;
  const auto filter = make_filter(model, options);
  const ObservationWindows windows(truth.observations, model.observation, model.timing, 200);

  std::printf("%6s %10s %10s %10s\n", "t", "signal", "mean", "sd");
  std::size_t step = 0;
  run(*filter, windows, [&](const Posterior& p) {
    if (++step % 20 == 0)
      std::printf("%6.2f %10.4f %10.4f %10.4f\n", p.time, truth.signal.row(step * 10)[0], mean(p, 0),
                  std::sqrt(covariance(p, 0, 0)));
  });
  std::printf("log evidence %.6f\n", filter->posterior().log_evidence);
}
