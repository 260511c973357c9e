/// Linear programming as the oracle: min c.w subject to A w = b, w >= 0, with A the moments of the points and
/// b those of the measure. GLPK finds a basic solution, on at most q points; so must recombination, on the
/// same polytope.
#include <glpk.h>

#include <catch2/catch.hpp>

#include "thinning/recombination_clouds.hpp"

using namespace wienertree;
using namespace wienertree::recombination_test;

namespace {

class LinearProgram {
 public:
  LinearProgram(const std::vector<std::vector<double>>& A, const std::vector<double>& b)
      : problem_(glp_create_prob()) {
    glp_term_out(GLP_OFF);
    const int rows = static_cast<int>(b.size()), columns = static_cast<int>(A.size());
    glp_add_rows(problem_, rows);
    for (int r = 1; r <= rows; ++r) {
      const double value = b[static_cast<std::size_t>(r - 1)];
      glp_set_row_bnds(problem_, r, GLP_FX, value, value);
    }
    glp_add_cols(problem_, columns);
    std::vector<int> index(b.size() + 1);
    std::iota(index.begin(), index.end(), 0);
    for (int j = 1; j <= columns; ++j) {
      glp_set_col_bnds(problem_, j, GLP_LO, 0, 0);
      glp_set_mat_col(problem_, j, rows, index.data(), A[static_cast<std::size_t>(j - 1)].data() - 1);
    }
  }
  ~LinearProgram() { glp_delete_prob(problem_); }
  LinearProgram(const LinearProgram&) = delete;
  LinearProgram& operator=(const LinearProgram&) = delete;

  // Extreme value of c.w; the number of positive weights goes to `support`.
  double extreme(const std::vector<double>& c, int direction, std::size_t& support) {
    glp_set_obj_dir(problem_, direction);
    for (std::size_t j = 0; j < c.size(); ++j) glp_set_obj_coef(problem_, static_cast<int>(j + 1), c[j]);
    glp_smcp parameters;
    glp_init_smcp(&parameters);
    parameters.msg_lev = GLP_MSG_OFF;
    glp_adv_basis(problem_, 0);
    REQUIRE(glp_simplex(problem_, &parameters) == 0);
    REQUIRE(glp_get_status(problem_) == GLP_OPT);
    support = 0;
    for (std::size_t j = 0; j < c.size(); ++j)
      support += glp_get_col_prim(problem_, static_cast<int>(j + 1)) > 1e-12;
    return glp_get_obj_val(problem_);
  }

 private:
  glp_prob* problem_;
};

}  // namespace

TEST_CASE(
    "Recombination solves the linear program's constraints on no more points than a basic solution may "
    "have") {
  for (const auto& [d, degree] : {std::pair<std::size_t, int>{2, 5}, {3, 3}, {4, 2}, {5, 1}}) {
    const std::size_t q = moment_number(d, degree, 1000);
    const Cloud c = normal_cloud(d, 400, 50 + d);
    const Box box(c);
    const double mass = log_mass(c);
    std::vector<std::vector<double>> A;
    for (std::size_t j = 0; j < c.size(); ++j) {
      Cloud point{Batch(d, 1), {0}};
      for (std::size_t i = 0; i < d; ++i) point.x(i, 0) = c.x(i, j);
      A.push_back(moments(point, box, degree, 0));
    }
    LinearProgram program(A, moments(c, box, degree, mass));

    const Selection s = recombine(c, degree, q);
    REQUIRE(s.site.size() <= q);
    std::vector<double> cost(c.size());
    RandomStream{91}.uniforms(0, cost);
    double ours = 0;
    for (std::size_t k = 0; k < s.site.size(); ++k)
      ours += std::exp(s.log_weight[k] - mass) * cost[s.site[k]];
    std::size_t support = 0;
    const double least = program.extreme(cost, GLP_MIN, support);
    REQUIRE(support <= q);
    const double most = program.extreme(cost, GLP_MAX, support);
    REQUIRE(support <= q);
    // GLPK's constraints hold to 1e-9 or so.
    CAPTURE(d, degree, least, ours, most);
    REQUIRE(least - 1e-7 <= ours);
    REQUIRE(ours <= most + 1e-7);
    REQUIRE(moment_difference(c, selected(c, s), degree) < 1e-12);
  }
}
