// Evaluations of a text model are free of allocation after the first call on a thread.
#include <catch2/catch.hpp>

#include "allocations.hpp"
#include "model/text_model_support.hpp"

using namespace wienertree;
using namespace wienertree::testing;

TEST_CASE("no evaluation allocates") {
  for (const char* name : {"heston", "linear-3d", "benes", "stochastic-volatility", "nile"}) {
    const TextModel model = TextModel::load(bundled(name));
    const Model& m = model.model();
    const std::size_t d = m.state_dimension(), p = m.noise_dimension(), k = m.fields->sensor_dimension(),
                      N = 100;
    Batch x(d, N), V(d, N), J(d * d, N), dB(p, N), S(d * p, N), h(k, N), Vh(k * p, N);
    for (std::size_t i = 0; i < d; ++i)
      for (std::size_t n = 0; n < N; ++n) x(i, n) = m.initial[i];
    for (std::size_t j = 0; j < p; ++j)
      for (std::size_t n = 0; n < N; ++n) dB(j, n) = 0.01;
    const Point D(1 + p, 0.1), y(1, 0.3);
    std::vector<double> out(N);
    const BatchFunction payoff = model.compile("max(" + m.state_names[0] + ", 0)", "payoff");
    std::size_t before = 0;
    for (int pass = 0; pass < 2; ++pass) {
      before = test::allocations();
      m.fields->direct(x, D, V);
      m.fields->jacobian(x, D, J);
      m.fields->ito_drift(x, V);
      m.fields->diffusion(x, S);
      m.fields->euler_step(x, 0.1, dB, V);
      m.fields->sensor(x, h);
      m.fields->sensor_derivative(x, Vh);
      if (m.fields->has_exact_flow()) m.fields->exact_flow(D, x);
      if (m.density) m.density->log_density(y, x, out);
      payoff(x, out);
    }
    const std::size_t after = test::allocations();
    INFO(name);
    CHECK(after == before);
  }
}
