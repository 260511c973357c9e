#include "wienertree/weak/conditional_price.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "wienertree/weak/affine_pieces.hpp"
#include "wienertree/weak/given_variances.hpp"

namespace wienertree {

namespace {

constexpr double reach = 8.5;  // standard deviations; 2e-17 of the mass lie beyond
constexpr int cells = 34;      // between -reach and reach, in which kinks are looked for
// 12 nodes on a panel of width 2 integrate phi(z) exp(S z), S up to 3, to rounding; on one of 3.4, S up to 1, to 1e-13.
constexpr double narrow_panel = 2, wide_panel = 3.4;
constexpr std::size_t leaves_at_once = 64;

// Gauss-Legendre, 12 nodes, the positive half (Abramowitz, Stegun 1964, table 25.4).
constexpr std::array<double, 6> legendre_node{0.125233408511468915, 0.367831498998180194,
                                              0.587317954286617447, 0.769902674194304687,
                                              0.904117256370474857, 0.981560634246719251};
constexpr std::array<double, 6> legendre_weight{0.249147045813402785, 0.233492536538354809,
                                                0.203167426723065922, 0.160078328543346226,
                                                0.106939325995318431, 0.047175336386511827};

// The integral over z, for the leaves of a batch a few at a time.
class Average {
 public:
  Average(const SquareRootStructure& structure, const std::vector<double>& start, const BatchFunction& f,
          const std::vector<BatchFunction>& kinks, double T)
      : structure_(structure), f_(f), kinks_(kinks), d_(start.size()), law_of_(structure, start, T) {}

  void operator()(ConstBatchView leaves, std::span<double> out) {
    for (std::size_t first = 0; first < leaves.nodes(); first += leaves_at_once)
      some(leaves.nodes(first, std::min(leaves_at_once, leaves.nodes() - first)), out.subspan(first));
  }

 private:
  // A point z of leaf n.
  struct Point {
    std::size_t leaf;
    double z, weight;
  };

  void some(ConstBatchView leaves, std::span<double> out) {
    const std::size_t N = leaves.nodes();
    law_.resize(N);
    for (std::size_t n = 0; n < N; ++n) law_[n] = law_of_(leaves, n);
    find_breaks(leaves);
    points_.clear();
    for (std::size_t n = 0; n < N; ++n) add_panels(n);
    evaluate(f_, leaves, points_);
    std::fill_n(out.begin(), N, 0.0);
    for (std::size_t i = 0; i < points_.size(); ++i) out[points_[i].leaf] += points_[i].weight * values_[i];
  }

  // values_[i] = function at points[i].
  void evaluate(const BatchFunction& function, ConstBatchView leaves, const std::vector<Point>& points) {
    const SquareRootStructure::Price& price = *structure_.price;
    states_.reshape(d_, points.size());
    values_.resize(points.size());
    for (std::size_t i = 0; i < d_; ++i) {
      const auto to = states_.component(i);
      for (std::size_t p = 0; p < points.size(); ++p) {
        const auto [leaf, z, weight] = points[p];
        if (i != price.state) {
          to[p] = leaves(i < price.state ? i : i - 1, leaf);
        } else {
          const double u = law_[leaf].mean + law_[leaf].deviation * z;
          to[p] = price.logarithmic ? u : std::exp(u);
        }
      }
    }
    function(states_, values_);
  }

  // Zeros of the kinks' arguments in z: sign changes between the ends of cells, then regula falsi with
  // Illinois' modification (Dowell, Jarratt 1971).
  void find_breaks(ConstBatchView leaves) {
    struct Bracket {
      double a, b, fa, fb;
    };
    breaks_.assign(leaves.nodes(), {});
    for (const BatchFunction& kink : kinks_) {
      points_.clear();
      for (std::size_t n = 0; n < leaves.nodes(); ++n)
        for (int cell = 0; cell <= cells; ++cell) points_.push_back({n, reach * (2.0 * cell / cells - 1), 0});
      evaluate(kink, leaves, points_);
      std::vector<Bracket> brackets;
      std::vector<std::size_t> leaf;
      for (std::size_t i = 0; i + 1 < points_.size(); ++i) {
        if (points_[i].leaf != points_[i + 1].leaf || !((values_[i] > 0) != (values_[i + 1] > 0))) continue;
        if (law_[points_[i].leaf].deviation == 0) continue;
        brackets.push_back({points_[i].z, points_[i + 1].z, values_[i], values_[i + 1]});
        leaf.push_back(points_[i].leaf);
      }
      constexpr int most_iterations = 60;
      std::vector<Point> trial(brackets.size());  // at the end the zeros
      bool open = !brackets.empty();
      for (int iteration = 0; open && iteration < most_iterations; ++iteration) {
        open = false;
        for (std::size_t i = 0; i < brackets.size(); ++i) {
          const auto [a, b, fa, fb] = brackets[i];
          double z = a - fa * (b - a) / (fb - fa);
          if (!(z >= a && z <= b)) z = (a + b) / 2;
          trial[i] = {leaf[i], z, 0};
        }
        evaluate(kink, leaves, trial);
        for (std::size_t i = 0; i < brackets.size(); ++i) {
          auto& [a, b, fa, fb] = brackets[i];
          const double z = trial[i].z, fz = values_[i];
          if (fz == 0 || b - a < 1e-14 * reach) {
            a = b = z;
            fa = fb = 1;
            continue;
          }
          // An end that stays halves its value.
          if ((fz > 0) == (fa > 0)) {
            open = open || std::abs(z - a) > 1e-15 * reach;
            a = z;
            fa = fz;
            fb /= 2;
          } else {
            open = open || std::abs(z - b) > 1e-15 * reach;
            b = z;
            fb = fz;
            fa /= 2;
          }
        }
      }
      for (const Point& zero : trial) breaks_[zero.leaf].push_back(zero.z);
    }
    for (std::vector<double>& of_leaf : breaks_) std::sort(of_leaf.begin(), of_leaf.end());
  }

  void add_panels(std::size_t n) {
    if (law_[n].deviation == 0) {
      points_.push_back({n, 0.0, 1.0});
      return;
    }
    const double widest = law_[n].deviation <= 1 ? wide_panel : narrow_panel;
    double left = -reach;
    for (std::size_t i = 0; i <= breaks_[n].size(); ++i) {
      const double right = i < breaks_[n].size() ? breaks_[n][i] : reach;
      const double panels = std::ceil((right - left) / widest), half = (right - left) / panels / 2;
      for (double panel = 0; panel < panels; ++panel)
        for (std::size_t k = 0; k < legendre_node.size(); ++k)
          for (const double side : {-1.0, 1.0}) {
            const double z = left + (2 * panel + 1 + side * legendre_node[k]) * half;
            constexpr double inverse_root = 0.3989422804014326779;  // of 2 pi
            points_.push_back({n, z, half * legendre_weight[k] * inverse_root * std::exp(-z * z / 2)});
          }
      left = right;
    }
  }

  const SquareRootStructure& structure_;
  const BatchFunction& f_;
  const std::vector<BatchFunction>& kinks_;
  std::size_t d_;
  GivenVariances law_of_;
  std::vector<NormalLaw> law_;
  std::vector<std::vector<double>> breaks_;
  std::vector<Point> points_;
  std::vector<double> values_;
  Batch states_;
};

}  // namespace

ConditionalPrice::ConditionalPrice(SquareRootStructure structure, std::vector<double> start)
    : structure_(std::move(structure)), start_(std::move(start)) {}

std::optional<double> ConditionalPrice::forward(double T) const {
  const SquareRootStructure::Price& price = *structure_.price;
  for (std::size_t k = 0; k < structure_.components.size(); ++k) {
    const double half = (price.correlated[k] * price.correlated[k] + price.independent[k]) / 2;
    if (std::abs(price.drift[k] + half) > 1e-12 * half) return std::nullopt;
  }
  const double u = start_[price.state];
  return price.logarithmic ? std::exp(u + price.rate * T) : u * std::exp(price.rate * T);
}

double ConditionalPrice::slope(const BatchFunction& f, double T) const {
  const std::optional<double> mean = forward(T);
  if (!mean) return 0;
  const SquareRootStructure::Price& price = *structure_.price;
  Batch far(start_.size(), 2);
  std::array<double, 2> at{1e8 * *mean, 1e9 * *mean}, value{};
  for (std::size_t n = 0; n < 2; ++n)
    for (std::size_t i = 0; i < start_.size(); ++i)
      far(i, n) = i != price.state ? start_[i] : price.logarithmic ? std::log(at[n]) : at[n];
  f(far, value);
  const double near = value[0] / at[0], further = value[1] / at[1];
  return std::isfinite(further) && std::abs(near - further) <= 1e-3 * std::abs(further) ? further : 0;
}

BatchFunction ConditionalPrice::average_of_rest(const BatchFunction& f,
                                                const std::vector<BatchFunction>& kinks, double T) const {
  const double growth = slope(f, T);
  if (growth == 0) return average(f, kinks, T);
  const SquareRootStructure::Price& price = *structure_.price;
  const BatchFunction rest = [f, growth, state = price.state, logarithmic = price.logarithmic](
                                 ConstBatchView x, std::span<double> out) {
    f(x, out);
    for (std::size_t n = 0; n < out.size(); ++n)
      out[n] -= growth * (logarithmic ? std::exp(x(state, n)) : x(state, n));
  };
  return [averaged = average(rest, kinks, T), mean = growth * *forward(T)](ConstBatchView x,
                                                                           std::span<double> out) {
    averaged(x, out);
    for (double& value : out) value += mean;
  };
}

BatchFunction ConditionalPrice::average_of_rest(const KinkedFunction& f, double T) const {
  const SquareRootStructure::Price& price = *structure_.price;
  std::optional<AffinePieces> pieces = affine_pieces(f, start_, price.state, price.logarithmic);
  if (!pieces) return average_of_rest(f.exact, f.kinks, T);
  const std::optional<double> expected = forward(T);
  const double known = expected ? pieces->pieces.back().slope : 0;
  for (AffinePieces::Piece& piece : pieces->pieces) piece.slope -= known;
  return [pieces = *std::move(pieces), law_of = GivenVariances(structure_, start_, T),
          constant = known * expected.value_or(0)](ConstBatchView x, std::span<double> out) {
    for (std::size_t n = 0; n < out.size(); ++n) {
      const NormalLaw law = law_of(x, n);
      out[n] = constant + pieces.average(law.mean, law.deviation);
    }
  };
}

BatchFunction ConditionalPrice::average(const BatchFunction& f, const std::vector<BatchFunction>& kinks,
                                        double T) const {
  return [structure = structure_, start = start_, f, kinks, T](ConstBatchView x, std::span<double> out) {
    Average(structure, start, f, kinks, T)(x, out);
  };
}

}  // namespace wienertree
