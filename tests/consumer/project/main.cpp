// A project outside the source tree: a model in C++ is simulated and filtered with the installed library.
#include <cmath>
#include <cstdio>
#include <cstring>
#include <wienertree/cubature/construct.hpp>
#include <wienertree/cubature/verification.hpp>
#include <wienertree/filter/filter.hpp>
#include <wienertree/filter/simulate.hpp>
#include <wienertree/model/cpp_model.hpp>
#include <wienertree/version.hpp>

using namespace wienertree;

struct OrnsteinUhlenbeck : CppModel<1, 1, 1> {
  static constexpr auto convention = Convention::ito;
  template <class T>
  State<T> drift(const State<T>& x) const {
    return {tanh(-x[0])};
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

// argv[1]: the version that was installed.
int main(int argc, char** argv) {
  if (argc != 2 || std::strcmp(version, argv[1]) != 0) return 2;
  if (!(verify(construct(5, 2)).max_error < 1e-12)) return 1;
  const Model model = make_model(OrnsteinUhlenbeck{}, {.initial = {0.0}});
  const ObservationPath y = simulate(model, 1.0, 1000, 100, 1).observations;
  FilterOptions options;
  options.formula = construct(5, 1);
  options.flow = FlowMethod::cvode;
  const auto filter = make_filter(model, options);
  run(*filter, ObservationWindows(y, model.observation, model.timing, 10), {});
  std::printf("%.6f\n", mean(filter->posterior(), 0));
  return std::isfinite(mean(filter->posterior(), 0)) ? 0 : 1;
}
