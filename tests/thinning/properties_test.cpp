/// Properties of thinning and of formulas for inputs that RapidCheck makes up and, where one fails, makes
/// smaller. Seed and number of inputs: RC_PARAMS, set by ctest.
#include <rapidcheck.h>
#include <rapidcheck/catch.h>
#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>
#include <set>

#include "thinning/recombination_clouds.hpp"
#include "wienertree/cubature/construct.hpp"
#include "wienertree/cubature/formula_file.hpp"
#include "wienertree/cubature/verification.hpp"
#include "wienertree/thinning/masses.hpp"
#include "wienertree/thinning/thinning.hpp"

using namespace wienertree;
using recombination_test::Cloud;

namespace {

// Log-weights of every kind: over many orders of magnitude, equal ones, zeros (but not only zeros).
std::vector<double> some_log_weights(std::size_t n) {
  std::vector<double> w;
  for (std::size_t i = 0; i < n; ++i)
    w.push_back(*rc::gen::weightedOneOf<double>(
        {{6, rc::gen::map(rc::gen::inRange(-100000, 100000), [](int k) { return k * 1e-3; })},
         {2, rc::gen::just(0.25)},
         {1, rc::gen::just(-std::numeric_limits<double>::infinity())}}));
  w[*rc::gen::inRange<std::size_t>(0, n)] = 1.5;
  return w;
}

// States on a lattice, so that some coincide, with an offset and a scale per component.
Cloud some_cloud(std::size_t d, std::size_t n) {
  Cloud cloud{Batch(d, n), some_log_weights(n)};
  for (std::size_t i = 0; i < d; ++i) {
    const double scale = std::ldexp(1.0, *rc::gen::inRange(-20, 20)),
                 offset = *rc::gen::inRange(-9, 9) * scale;
    for (std::size_t k = 0; k < n; ++k) cloud.x(i, k) = offset + scale * *rc::gen::inRange(-500, 500) / 100.0;
  }
  return cloud;
}

RandomStream some_stream() { return {*rc::gen::arbitrary<std::uint64_t>(), 0, 1, Purpose::thinning}; }

}  // namespace

TEST_CASE("a thinning that counts gives [N g] or [N g] + 1 particles where it promises so, N in all") {
  for (const ThinningMethod method :
       {ThinningMethod::tbba, ThinningMethod::multinomial, ThinningMethod::residual,
        ThinningMethod::stratified, ThinningMethod::systematic})
    rc::prop("method " + std::to_string(static_cast<int>(method)), [method] {
      const auto n = *rc::gen::inRange<std::size_t>(1, 400);
      const auto N = *rc::gen::inRange<std::size_t>(1, 1000);
      const Cloud cloud = some_cloud(*rc::gen::inRange<std::size_t>(1, 4), n);
      ThinningOptions options;
      options.method = method;
      options.order = *rc::gen::element(SiteOrder::tree, SiteOrder::spatial);
      Selection kept;
      make_thinning(options)->thin(cloud.sites(), N, some_stream(), kept);
      RC_ASSERT(kept.site.size() <= N);
      RC_ASSERT(std::set<std::uint32_t>(kept.site.begin(), kept.site.end()).size() == kept.site.size());
      // Sums of at most 400 exponentials of relative error 2^-50.
      RC_ASSERT(std::fabs(recombination_test::log_mass(recombination_test::selected(cloud, kept)) -
                          recombination_test::log_mass(cloud)) < 1e-12);
      RC_ASSERT(std::accumulate(kept.count.begin(), kept.count.end(), std::size_t{0}) == N);
      if (method == ThinningMethod::multinomial || method == ThinningMethod::stratified) return;
      ParticleMasses masses;
      assign_masses(cloud.log_weight, N, masses);
      std::vector<std::uint32_t> count(n, 0);
      for (std::size_t k = 0; k < kept.site.size(); ++k) count[kept.site[k]] = kept.count[k];
      for (std::size_t i = 0; i < n; ++i) {
        const std::uint64_t whole = masses.mass[i] >> masses.fraction_bits;
        RC_ASSERT(count[i] >= whole);
        if (method != ThinningMethod::residual) RC_ASSERT(count[i] <= whole + 1);
      }
    });
}

TEST_CASE("recombination keeps all moments up to degree 2, and no more nodes than asked") {
  for (const ThinningMethod method :
       {ThinningMethod::recombination, ThinningMethod::levelwise, ThinningMethod::heavy_first})
    rc::prop("method " + std::to_string(static_cast<int>(method)), [method] {
      const auto d = *rc::gen::inRange<std::size_t>(1, 4);
      const auto n = *rc::gen::inRange<std::size_t>(1, 400);
      const Cloud cloud = some_cloud(d, n);
      // Room for all moments of degree 2: (d+1)(d+2)/2 numbers.
      const std::size_t moments = (d + 1) * (d + 2) / 2;
      const auto budget = *rc::gen::inRange<std::size_t>(2 * moments, 200);
      ThinningOptions options;
      options.method = method;
      options.recombination_degree = 2;
      Selection kept;
      make_thinning(options)->thin(cloud.sites(), budget, some_stream(), kept);
      RC_ASSERT(recombination_test::defect(cloud, kept, budget) == "");
      // Rounding of some hundred reductions, relative to the size of the box.
      const Cloud after = recombination_test::selected(cloud, kept);
      RC_ASSERT(recombination_test::moment_difference(cloud, after, 2) < 1e-10);
    });
}

TEST_CASE("a formula in closed form holds, and survives being written and read") {
  rc::prop("construct", [] {
    const int degree = *rc::gen::element(3, 5);
    const int p = *rc::gen::inRange(1, degree == 3 ? 12 : 7);
    const CubatureFormula formula = construct(degree, p);
    const FormulaVerification verification = verify(formula, moment_tolerance, false);
    RC_ASSERT(verification.holds());
    const std::string text = format_formula(formula);
    RC_ASSERT(format_formula(parse_formula(text, "f.json")) == text);
    // One increment shifted by a part in a thousand, and it no longer holds.
    CubatureFormula wrong = formula;
    auto& path = wrong.paths[*rc::gen::inRange<std::size_t>(0, wrong.paths.size())].increments;
    const auto column = *rc::gen::inRange<Eigen::Index>(0, path.cols());
    const auto row = *rc::gen::inRange<Eigen::Index>(0, path.rows());
    path(row, column) += 1e-3;
    RC_ASSERT(!verify(wrong, moment_tolerance, false).holds());
  });
}
