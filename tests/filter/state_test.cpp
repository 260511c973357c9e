/// A filter put down in the middle and taken up by another one goes on with the same bytes.
#include <catch2/catch.hpp>
#include <cstring>

#include "filter/linear_problems.hpp"
#include "filter/text_problems.hpp"
#include "wienertree/cubature/construct.hpp"

using namespace wienertree;

namespace {

constexpr std::size_t steps = 24, put_down_after = 9;

std::vector<double> numbers(const Posterior& posterior, std::size_t dimension) {
  PosteriorSummary s;
  summarise(posterior, dimension, 3, s);
  std::vector<double> all = {posterior.time, s.log_evidence, s.ess, static_cast<double>(s.nodes)};
  for (const auto* part : {&s.mean, &s.sd, &s.q05, &s.q50, &s.q95})
    all.insert(all.end(), part->begin(), part->end());
  for (const auto& moments : s.moments) all.insert(all.end(), moments.begin(), moments.end());
  return all;
}

bool same_bytes(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

void check_resumed(const Model& model, FilterOptions options) {
  options.launch = 2;
  const Simulation drawn =
      simulate(model, 2.4, 480, model.observation == ObservationKind::continuous ? 240 : steps, 5);
  const ObservationWindows windows(drawn.observations, model.observation, model.timing, steps);
  INFO("method " << static_cast<int>(options.method) << ", thinning "
                 << static_cast<int>(options.thinning.method) << ", model " << model.name);
  const auto whole = make_filter(model, options);
  options.threads = 2;
  std::unique_ptr<Filter> resumed;
  ObservationWindow window;
  for (std::size_t j = 0; j < windows.size(); ++j) {
    windows.get(j, window);
    whole->advance(window);
    const std::vector<double> expected = numbers(whole->posterior(), model.reported_dimension());
    if (resumed) {
      resumed->advance(window);
      CHECK(same_bytes(numbers(resumed->posterior(), model.reported_dimension()), expected));
    }
    // Twice, so that what was taken up is put down once more.
    if (j + 1 == put_down_after || j + 1 == put_down_after + 5) {
      StateArchive state;
      (resumed ? *resumed : *whole).exchange(state);
      const std::string bytes = state.bytes();
      resumed = make_filter(model, options);
      StateArchive back(bytes);
      resumed->exchange(back);
      back.finish();
    }
  }
  CHECK(resumed->statistics().steps == whole->statistics().steps);
  CHECK(resumed->statistics().children == whole->statistics().children);
  CHECK(resumed->statistics().flow.node_segments == whole->statistics().flow.node_segments);
}

FilterOptions with(FilterMethod method, std::size_t nodes = 50) {
  FilterOptions options;
  options.method = method;
  options.formula = construct(5, 1);
  options.nodes = nodes;
  return options;
}

const char* const sv = R"(name = "sv"
convention = "ito"
[state]
x = { initial = 0.1 }
[drift]
x = "-x"
[diffusion]
x = ["0.8"]
[observation]
kind = "discrete"
h = ["x"]
noise = { law = "gaussian", sd = 0.5 }
[initial]
mean = [0.1]
covariance = [[0.3]]
)";

}  // namespace

TEST_CASE("a tree with every thinning goes on with the same bytes", "[threads]") {
  const Model model = benes_cases[2].model();
  for (const ThinningMethod thinning :
       {ThinningMethod::tbba, ThinningMethod::multinomial, ThinningMethod::residual,
        ThinningMethod::stratified, ThinningMethod::systematic, ThinningMethod::recombination,
        ThinningMethod::levelwise, ThinningMethod::heavy_first}) {
    FilterOptions options = with(FilterMethod::klv);
    options.thinning.method = thinning;
    check_resumed(model, options);
    options.flow = FlowMethod::cvode;
    check_resumed(model, options);
    options.flow = FlowMethod::automatic;
    if (recombines(thinning)) continue;
    options.ess_threshold = 0.5;
    check_resumed(model, options);
    options.ess_threshold = 1;
    options.prune_weights = PruneWeights::cubature;
    options.thinning.order = SiteOrder::tree;
    check_resumed(model, options);
  }
}

TEST_CASE("particles, Gaussians and weights that are never resampled go on with the same bytes",
          "[threads]") {
  const Model continuous = benes_cases[1].model(), discrete = parse_model(sv, "sv.toml");
  FilterOptions euler = with(FilterMethod::euler, 333);
  euler.thinning.method = ThinningMethod::systematic;
  FilterOptions mixture = with(FilterMethod::gaussian_mixture, 77);
  mixture.beta = 0.1;
  for (const Model& model : {continuous, discrete}) {
    euler.ess_threshold = 1;
    check_resumed(model, euler);
    euler.ess_threshold = 0.4;
    check_resumed(model, euler);
    check_resumed(model, mixture);
    check_resumed(model, with(FilterMethod::klv));
  }
  check_resumed(discrete, with(FilterMethod::weighted, 100));
}

TEST_CASE("exact filters go on with the same bytes", "[threads]") {
  check_resumed(benes_cases[0].model(), with(FilterMethod::benes));
  check_resumed(benes_cases[0].model(), with(FilterMethod::grid));
  check_resumed(parse_model(sv, "sv.toml"), with(FilterMethod::grid));
  check_resumed(parse_model(sv, "sv.toml"), with(FilterMethod::kalman));
  for (const bool random_start : {false, true}) {
    const Model linear = LinearProblem(3, 2, 2, 8).model("kind = \"continuous\"\n", random_start);
    check_resumed(linear, with(FilterMethod::kalman_bucy));
    FilterOptions klv = with(FilterMethod::klv);
    klv.formula = construct(5, 2);
    check_resumed(linear, klv);
  }
}

TEST_CASE("bytes that are not the state of such a filter are refused", "[threads]") {
  const Model model = benes_cases[2].model();
  const auto small = make_filter(model, with(FilterMethod::euler, 10)),
             large = make_filter(model, with(FilterMethod::euler, 11));
  StateArchive state;
  small->exchange(state);
  const std::string bytes = state.bytes();
  for (std::size_t cut = 0; cut < bytes.size(); cut += 7) {
    StateArchive back(std::string_view(bytes).substr(0, cut));
    CHECK_THROWS_AS(small->exchange(back), InputError);
  }
  StateArchive other(bytes);
  CHECK_THROWS_AS(large->exchange(other), InputError);
  const std::string longer = bytes + "x";
  StateArchive left_over(longer);
  small->exchange(left_over);
  CHECK_THROWS_AS(left_over.finish(), InputError);
}
