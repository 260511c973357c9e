// Models written in C++: derivatives, both ways of evaluation, facts, and what make_model refuses.
#include "model/cpp_models.hpp"

#include "allocations.hpp"

using namespace wienertree;
using namespace wienertree::test;

TEST_CASE("fields, Jacobians, drifts and sensor derivatives are right, recorded and node by node") {
  check_both_ways(Benes{}, states(1, 37, -4, 4));
  check_both_ways(Heston<Convention::ito>{}, states(2, 37, 0.1, 3));
  check_both_ways(Heston<Convention::stratonovich>{}, states(2, 37, 0.1, 3));
  check_both_ways(Linear{}, states(2, 37, -4, 4));
  check_both_ways(Geometric{}, states(1, 37, 0.1, 4));
  check_both_ways(Everything<Convention::ito>{}, states(3, 37, 0.1, 1.5));
  check_both_ways(Everything<Convention::stratonovich>{}, states(3, 37, -1.5, -0.1));
}

TEST_CASE("a model may branch on its state when it says so") {
  const auto fields = make_vector_fields(Branching{});
  CHECK(derivative_faults(*fields, states(1, 20, 0.1, 0.9)) == Faults{});
  CHECK(derivative_faults(*fields, states(1, 20, -3, -0.1)) == Faults{});
  CHECK(position_faults(*fields, states(1, 37, -3, 3)) == Faults{});
}

TEST_CASE("recorded Heston: the Stratonovich drift is the one derived by hand") {
  // V_0 = (r s - v s/2 - rho xi s/4, kappa (theta - v) - xi^2/4)
  const Heston<Convention::ito> m;
  const auto fields = make_vector_fields(m);
  const Batch x = states(2, 11, 0.2, 2);
  Batch V(2, 11);
  fields->direct(x, std::vector{1.0, 0.0, 0.0}, V);
  for (std::size_t n = 0; n < 11; ++n) {
    const double s = x(0, n), v = x(1, n);
    CHECK(V(0, n) == Approx(m.r * s - v * s / 2 - m.rho * m.xi * s / 4).epsilon(1e-13));
    CHECK(V(1, n) == Approx(m.kappa * (m.theta - v) - m.xi * m.xi / 4).epsilon(1e-13));
  }
}

TEST_CASE("a slope stays zero beside an infinite one") {
  // At v = 0: d sqrt(v)/dv is infinite, d sqrt(v)/ds is 0.
  const auto check = [](const VectorFields& fields) {
    Batch x(2, 1), J(4, 1);
    x(0, 0) = 1.0;
    x(1, 0) = 0.0;
    fields.jacobian(x, std::vector{0.0, 0.0, 1.0}, J);
    CHECK(J(2, 0) == 0.0);
    CHECK(std::isinf(J(3, 0)));
  };
  check(*make_vector_fields(Heston<Convention::ito>{}));
  check(*make_vector_fields(NodeByNode<Heston<Convention::ito>>{}));
}

TEST_CASE("affine fields and sensors are found, with their flow") {
  const auto fields = make_vector_fields(Linear{});
  REQUIRE(fields->affine_fields());
  REQUIRE(fields->affine_sensor());
  CHECK(fields->affine_fields()->linear[0] == (Eigen::Matrix2d() << -1, 0.5, 0.25, -2).finished());
  CHECK(fields->affine_fields()->constant[0] == Eigen::Vector2d(1, 0));
  CHECK(fields->affine_fields()->linear[1] == (Eigen::Matrix2d() << 0, 0.5, 0, 0).finished());
  CHECK(fields->affine_fields()->constant[1] == Eigen::Vector2d(1, -0.7));
  CHECK(fields->affine_sensor()->linear == Eigen::RowVector2d(2, -1));
  CHECK(fields->affine_sensor()->constant(0) == 3);
  CHECK(fields->has_exact_flow());
  CHECK(make_vector_fields(Benes{})->affine_sensor());
  CHECK_FALSE(make_vector_fields(Benes{})->affine_fields());
  CHECK_FALSE(make_vector_fields(Benes{})->has_exact_flow());
  CHECK_FALSE(make_vector_fields(Everything<Convention::ito>{})->affine_sensor());
  CHECK_FALSE(make_vector_fields(Jump{})->affine_fields());
}

TEST_CASE("a model's own exact flow is used, and is the solution that its fields have") {
  Geometric model;
  model.mu = 0.2, model.sigma = 0.4;
  const auto fields = make_vector_fields(model);
  REQUIRE(fields->has_exact_flow());
  Batch x = states(1, 9, 0.5, 2);
  const Batch start = x;
  const std::vector<double> D = {0.5, -0.25};
  fields->exact_flow(D, x);
  for (std::size_t n = 0; n < 9; ++n) CHECK(x(0, n) == start(0, n) * std::exp(0.2 * 0.5 + 0.4 * -0.25));
  Batch y = start;  // the affine flow of the same model without its own
  PlainGeometric plain;
  plain.mu = 0.2, plain.sigma = 0.4;
  make_vector_fields(plain)->exact_flow(D, y);
  for (std::size_t n = 0; n < 9; ++n) CHECK(y(0, n) == Approx(x(0, n)).epsilon(1e-14));
  CHECK_THROWS_AS(make_vector_fields(Benes{})->exact_flow(D, x), InputError);
}

TEST_CASE("the helper for derivatives notices a wrong derivative") {
  const Faults faults = derivative_faults(*make_vector_fields(Wrong{}), states(1, 9, 0.1, 0.9));
  REQUIRE(faults.size() == 3);
  CHECK(faults[0].substr(0, 8) == "jacobian");
  CHECK(faults[1].substr(0, 9) == "ito_drift");
  CHECK(faults[2].substr(0, 17) == "sensor_derivative");
}

TEST_CASE("no allocation after the first call") {
  for (const auto& fields : {make_vector_fields(Heston<Convention::ito>{}),
                             make_vector_fields(NodeByNode<Heston<Convention::ito>>{})}) {
    const Batch x = states(2, 200, 0.1, 2);
    Batch out(4, 200);
    const std::vector<double> D = {1.0, 0.5, -0.5};
    const auto run = [&] {
      fields->direct(x, D, out.view().components(0, 2));
      fields->jacobian(x, D, out);
      fields->euler_step(x, 0.1, x, out.view().components(0, 2));
      fields->ito_drift(x, out.view().components(0, 2));
      fields->diffusion(x, out);
      fields->sensor(x, out.view().components(0, 2));
      fields->sensor_derivative(x, out);
    };
    run();
    const std::size_t before = allocations();
    run();
    CHECK(allocations() == before);
  }
}

TEST_CASE("make_model completes and verifies a model") {
  SECTION("names, bounds and the kind of observation") {
    const Model model = make_model(Benes{}, {.name = "benes", .initial = {0.5}});
    CHECK(model.state_names == std::vector<std::string>{"x"});
    CHECK(model.observation == ObservationKind::continuous);
    CHECK(model.exact_filter == ExactFilter::none);
    CHECK(make_model(Geometric{}, {.initial = {1.0}}).observation == ObservationKind::none);
    CHECK(make_model(Linear{}, {.initial = {1, 2}}).state_names == std::vector<std::string>{"x1", "x2"});
  }
  SECTION("a claimed Benes filter is verified") {
    const BenesParameters right{.mu = 0.6, .sigma = 1.2, .h1 = 0.8, .h2 = 0.1, .x0 = 0.5};
    ModelDescription rest{.name = "benes", .initial = {0.5}};
    rest.exact_filter = ExactFilter::benes;
    CHECK_THROWS_AS(make_model(Benes{}, rest), InputError);
    rest.benes = right;
    CHECK(make_model(Benes{}, rest).exact_filter == ExactFilter::benes);
    for (double BenesParameters::*parameter :
         {&BenesParameters::mu, &BenesParameters::sigma, &BenesParameters::h1, &BenesParameters::h2,
          &BenesParameters::x0}) {
      rest.benes = right;
      *rest.benes.*parameter += 1e-9;
      CHECK_THROWS_AS(make_model(Benes{}, rest), InputError);
    }
  }
  SECTION("Kalman-Bucy is found, and refused where it does not apply") {
    Linear additive;
    additive.noise_slope = 0;
    ModelDescription rest{.initial = {0, 0}};
    CHECK(make_model(additive, rest).exact_filter == ExactFilter::kalman_bucy);
    CHECK(make_model(Linear{}, rest).exact_filter == ExactFilter::none);
    rest.exact_filter = ExactFilter::kalman_bucy;
    CHECK(make_model(additive, rest).exact_filter == ExactFilter::kalman_bucy);
    CHECK_THROWS_AS(make_model(Linear{}, rest), InputError);
    rest.bounds.resize(2);
    rest.bounds[0].lower = -1;
    CHECK_THROWS_AS(make_model(additive, rest), InputError);
  }
  SECTION("missing and misshapen parts") {
    CHECK_THROWS_AS(make_model(Benes{}, {}), InputError);
    CHECK_THROWS_AS(make_model(Benes{}, {.initial = {1, 2}}), InputError);
    CHECK_THROWS_AS(make_model(Heston<Convention::ito>{}, {.initial = {1, -1}}), InputError);  // sqrt(-1)
    ModelDescription rest{.initial = {0.5}};
    rest.observation = ObservationKind::discrete;
    CHECK_THROWS_AS(make_model(Benes{}, rest), InputError);
    rest.observation = ObservationKind::continuous;
    CHECK_THROWS_AS(make_model(Geometric{}, rest), InputError);
    rest.observation = ObservationKind::none;
    rest.initial_law = InitialLaw{Eigen::VectorXd::Zero(2), Eigen::MatrixXd::Identity(2, 2)};
    CHECK_THROWS_AS(make_model(Geometric{}, rest), InputError);
  }
  SECTION("a random start gives its mean as the initial state") {
    ModelDescription rest;
    rest.initial_law = InitialLaw{Eigen::VectorXd::Constant(1, 0.3), Eigen::MatrixXd::Identity(1, 1)};
    CHECK(make_model(Benes{}, rest).initial == std::vector{0.3});
  }
  SECTION("an absorbing bound needs coefficients that vanish there") {
    ModelDescription rest{.initial = {1.0}, .bounds = {StateBound{.lower = 0, .boundary = Boundary::absorb}}};
    CHECK_NOTHROW(make_model(Geometric{}, rest));
    CHECK_THROWS_AS(make_model(Benes{}, rest), InputError);
  }
  SECTION("a type that implements VectorFields itself") {
    const Model model = make_model(record(Linear{}), {.initial = {0, 0}});
    CHECK(model.fields->noise_dimension() == 1);
  }
}
