/// The C++ side of bench/python-overhead: filters a record REPEATS times by the library's own calls, and
/// prints the seconds of each.
///
///     bench_python_overhead MODEL.toml OBSERVATIONS.csv STEPS REPEATS
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "wienertree/cubature/catalogue.hpp"
#include "wienertree/filter/filter.hpp"
#include "wienertree/model/text_model.hpp"

int main(int argc, char** argv) {
  using namespace wienertree;
  if (argc != 5) return 2;
  const Model model = load_model(argv[1]);
  const ObservationPath path = read_observations(argv[2], model.observation_dimension(), model.observation);
  const auto steps = static_cast<std::size_t>(std::atoi(argv[3]));
  for (int i = 0; i < std::atoi(argv[4]); ++i) {
    const auto began = std::chrono::steady_clock::now();
    // A call of Python's chooses its formula among the files, too.
    FilterOptions options;
    const int degree = model.observation == ObservationKind::discrete ? 7 : 5;
    options.formula = find_formula(degree, static_cast<int>(model.noise_dimension()),
                                   std::string(WIENERTREE_SOURCE_DIR) + "/data/cubature_formulas");
    options.thinning.method = ThinningMethod::recombination;
    options.nodes = 60;
    const auto filter = make_filter(model, options);
    const ObservationWindows windows(path, model.observation, model.timing, steps);
    ObservationWindow window;
    PosteriorSummary summary;
    std::vector<double> mean;
    for (std::size_t j = 0; j < windows.size(); ++j) {
      windows.get(j, window);
      filter->advance(window);
      summarise(filter->posterior(), model.reported_dimension(), 0, summary);
      mean.push_back(summary.mean[0]);
    }
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
    std::printf("%.9f %.17g %.17g\n", took.count(), summary.log_evidence, mean.back());
  }
}
