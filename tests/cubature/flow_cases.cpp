#include "cubature/flow_cases.hpp"

#include <random>

#include "cubature/reference_flow.hpp"

namespace wienertree::test {
namespace {

template <class Equations>
FlowCase make_case(Model model, Equations equations, std::size_t nodes, double spread,
                   std::vector<std::vector<double>> segments) {
  FlowCase result{std::move(model), Batch(Equations::d, nodes), std::move(segments), {}};
  std::mt19937_64 random(7);
  for (std::size_t n = 0; n < nodes; ++n)
    for (std::size_t i = 0; i < Equations::d; ++i)
      result.nodes(i, n) =
          result.model.initial[i] + spread * (2 * std::generate_canonical<double, 53>(random) - 1);
  for (const std::vector<double>& D : result.segments) {
    const auto field = [&](const long double* x, long double* out) {
      equations.template field<long double>(x, D.data(), out);
    };
    Batch end(Equations::d, nodes);
    for (std::size_t n = 0; n < nodes; ++n) {
      std::vector<double> x;
      for (std::size_t i = 0; i < Equations::d; ++i) x.push_back(result.nodes(i, n));
      x = reference_flow(field, x);
      for (std::size_t i = 0; i < Equations::d; ++i) end(i, n) = x[i];
    }
    result.ends.push_back(end);
  }
  return result;
}

template <class Equations>
FlowCase make_case(const char* name, Equations equations, std::vector<double> initial, std::size_t nodes,
                   double spread, std::vector<std::vector<double>> segments) {
  return make_case(model_of(name, equations, std::move(initial)), equations, nodes, spread,
                   std::move(segments));
}

std::vector<FlowCase> make_cases() {
  std::vector<FlowCase> cases;
  cases.push_back(make_case("tanh", Tanh{}, {0.0}, 100, 3.0,
                            {{0.01, 0.17}, {0.1, -0.5}, {1.0, 1.7}, {0.0, 1.0}, {1.0, 0.0}, {-0.3, 0.4}}));
  cases.push_back(
      make_case(model_with("Ornstein-Uhlenbeck", std::make_shared<OrnsteinUhlenbeckFields>(), {0.0}),
                OrnsteinUhlenbeck{}, 100, 2.0, {{0.01, 0.17}, {1.0, -1.7}, {0.0, 1.0}, {-0.5, 0.2}}));
  cases.push_back(make_case("linear", Linear3{}, {0.0, 0.0, 0.0}, 70, 2.0,
                            {{0.01, 0.17, -0.1}, {0.3, 1.0, 0.9}, {1.0, -1.7, 1.7}}));
  cases.push_back(make_case("Heston", Heston{}, {1.0, 0.09}, 70, 0.05,
                            {{0.05, 0.3, -0.3}, {0.5, -1.2, 1.2}, {0.0, 1.0, 0.0}}));
  cases.push_back(
      make_case("Lorenz", Lorenz{}, {5.0, 5.0, 20.0}, 70, 5.0, {{0.01, 0.17}, {0.1, -0.5}, {0.2, 1.0}}));
  cases.push_back(make_case("stiff relaxation", Stiff{}, {0.5, 0.5}, 8, 0.5, {{0.1, 0.5}, {0.3, -0.5}}));
  cases.push_back(make_case("Van der Pol", VanDerPol{}, {2.0, 0.0}, 6, 0.3, {{0.2, 1.0}, {0.5, -1.0}}));
  return cases;
}

}  // namespace

const std::vector<FlowCase>& flow_cases() {
  static const std::vector<FlowCase> cases = make_cases();
  return cases;
}

}  // namespace wienertree::test
