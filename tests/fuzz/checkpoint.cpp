/// A checkpoint and the state in it: whatever the bytes, and with a checksum that somebody made to match, it is a filter
/// that goes on or an InputError, and going on gives a law or an error.
#include <cmath>
#include <string_view>

#include "../../apps/checkpoint.hpp"
#include "file.hpp"
#include "wienertree/cubature/construct.hpp"
#include "wienertree/filter/filter.hpp"
#include "wienertree/model/text_model.hpp"

namespace {

using namespace wienertree;

Model model_of(const char* observation) {
  return TextModel::parse(
             std::string(
                 "name = \"m\"\nconvention = \"ito\"\n[state]\nx = { initial = 1.0 }\n[drift]\nx = \"-x\"\n"
                 "[diffusion]\nx = [\"1\"]\n[observation]\n") +
                 observation,
             "model.toml")
      .model();
}

FilterOptions options_of(FilterMethod method) {
  FilterOptions options;
  options.method = method;
  options.nodes = 8;
  options.grid_points = 40;
  options.formula = construct_degree_3(1);
  if (method == FilterMethod::klv) options.thinning.method = ThinningMethod::recombination;
  if (method == FilterMethod::euler || method == FilterMethod::gaussian_mixture)
    options.thinning.method = ThinningMethod::systematic;
  return options;
}

// The bytes as the state of a filter that was resumed.
void go_on(std::string_view state, FilterMethod method, const Model& model) {
  const auto filter = make_filter(model, options_of(method));
  try {
    StateArchive archive(state);
    filter->exchange(archive);
    archive.finish();
  } catch (const InputError&) {
    return;
  }
  ObservationPath path;
  path.dimension = 1;
  for (int r = 0; r < 3; ++r) path.append(r, std::vector{0.1 * r});
  try {
    run(*filter, ObservationWindows(path, model.observation, ObservationTiming::current, 0),
        [](const Posterior& law) {
          PosteriorSummary summary;
          summarise(law, 1, 0, summary);
        });
  } catch (const Error&) {  // a law of weights that are no numbers, say
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const Model continuous = model_of("kind = \"continuous\"\nh = [\"x\"]\n"),
                     discrete = model_of(
                         "kind = \"discrete\"\nh = [\"x\"]\nnoise = { law = \"gaussian\", sd = 1.0 }\n");
  const app::Json run = {{"command", "filter"}};
  const std::string_view all(reinterpret_cast<const char*>(bytes), size);
  try {
    const FuzzedFile file(bytes, size);
    app::read_checkpoint(file.path(), run);
  } catch (const InputError&) {  // what bad input is to give
  }
  if (size == 0) return 0;
  const std::string_view state = all.substr(1);
  switch (bytes[0] % 6) {
    case 0:
      return go_on(state, FilterMethod::klv, continuous), 0;
    case 1:
      return go_on(state, FilterMethod::euler, continuous), 0;
    case 2:
      return go_on(state, FilterMethod::gaussian_mixture, discrete), 0;
    case 3:
      return go_on(state, FilterMethod::kalman, discrete), 0;
    case 4:
      return go_on(state, FilterMethod::kalman_bucy, continuous), 0;
    default:
      return go_on(state, FilterMethod::grid, discrete), 0;
  }
}
