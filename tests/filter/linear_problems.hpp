#pragma once
/// Random linear models, as text.
#include <fmt/format.h>

#include <Eigen/Core>
#include <random>
#include <string>

#include "wienertree/filter/filter.hpp"
#include "wienertree/model/text_model.hpp"

namespace wienertree {

/// dX = (A X + a) dt + B dV,   observed through H X + c.
struct LinearProblem {
  Eigen::MatrixXd A, B, H;
  Eigen::VectorXd a, c, start;
  Eigen::MatrixXd start_covariance;

  /// Entries uniform in [-1, 1], the diagonal of A lowered by 1/2; start_covariance of full rank.
  LinearProblem(Eigen::Index d, Eigen::Index p, Eigen::Index k, unsigned seed) {
    std::mt19937_64 engine(seed);
    const auto draw = [&](Eigen::Index rows, Eigen::Index cols) {
      return Eigen::MatrixXd(Eigen::MatrixXd::NullaryExpr(
          rows, cols, [&] { return std::ldexp(static_cast<double>(engine() >> 11), -52) - 1; }));
    };
    A = draw(d, d) - 0.5 * Eigen::MatrixXd::Identity(d, d);
    B = draw(d, p);
    H = draw(k, d);
    a = draw(d, 1);
    c = draw(k, 1);
    start = draw(d, 1);
    const Eigen::MatrixXd L = draw(d, d);
    start_covariance = L * L.transpose() + 0.1 * Eigen::MatrixXd::Identity(d, d);
  }

  /// observation: the TOML lines of [observation] other than h, or empty for none.
  Model model(const std::string& observation, bool random_start) const {
    std::string state = "[state]\n", drift = "[drift]\n", diffusion = "[diffusion]\n";
    for (Eigen::Index i = 0; i < A.rows(); ++i) {
      state += fmt::format("x{} = {{ initial = {} }}\n", i, start(i));
      drift += fmt::format("x{} = \"{}\"\n", i, affine(A.row(i), a(i)));
      diffusion += fmt::format("x{} = [", i);
      for (Eigen::Index j = 0; j < B.cols(); ++j) diffusion += fmt::format("{}{}", j ? ", " : "", B(i, j));
      diffusion += "]\n";
    }
    std::string text = "name = \"linear\"\nconvention = \"ito\"\n" + state + drift + diffusion;
    if (!observation.empty()) {
      text += "[observation]\n" + observation + "\nh = [";
      for (Eigen::Index i = 0; i < H.rows(); ++i)
        text += fmt::format("{}\"{}\"", i ? ", " : "", affine(H.row(i), c(i)));
      text += "]\n";
    }
    Model m = parse_model(text, "linear.toml", {});
    if (random_start) m.initial_law = InitialLaw{start, start_covariance};
    return m;
  }

 private:
  static std::string affine(const Eigen::RowVectorXd& row, double constant) {
    std::string s = fmt::format("({})", constant);
    for (Eigen::Index j = 0; j < row.size(); ++j) s += fmt::format(" + ({})*x{}", row(j), j);
    return s;
  }
};

inline Eigen::VectorXd mean_of(const Posterior& p) {
  Eigen::VectorXd m(static_cast<Eigen::Index>(p.points.components()));
  for (Eigen::Index i = 0; i < m.size(); ++i) m(i) = mean(p, static_cast<std::size_t>(i));
  return m;
}

inline Eigen::MatrixXd covariance_of(const Posterior& p) {
  const auto d = static_cast<Eigen::Index>(p.points.components());
  Eigen::MatrixXd P(d, d);
  for (Eigen::Index i = 0; i < d; ++i)
    for (Eigen::Index j = 0; j < d; ++j)
      P(i, j) = covariance(p, static_cast<std::size_t>(i), static_cast<std::size_t>(j));
  return P;
}

}  // namespace wienertree
