#include "wienertree/weak/families.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace wienertree {
namespace {

constexpr double reach = 8.5;  // standard deviations; the mass beyond is 2e-17
constexpr int cells = 34;      // of half a standard deviation, in which sign changes are looked for

// Gauss-Legendre, 16 points, positive half (Abramowitz, Stegun 1964, table 25.4).
constexpr std::array<double, 8> gauss_x = {0.0950125098376374, 0.2816035507792589, 0.4580167776572274,
                                           0.6178762444026438, 0.7554044083550030, 0.8656312023878318,
                                           0.9445750230732326, 0.9894009349916499};
constexpr std::array<double, 8> gauss_w = {0.1894506104550685, 0.1826034150449236, 0.1691565193950025,
                                           0.1495959888165767, 0.1246289712555339, 0.0951585116824928,
                                           0.0622535239386479, 0.0271524594117541};

double phi(double z) { return std::numbers::inv_sqrtpi / std::numbers::sqrt2 * std::exp(-0.5 * z * z); }

// Integral over [a, b] by panels of at most 3 standard deviations.
template <class F>
double integral(double a, double b, F&& f) {
  const auto panels = static_cast<int>(std::ceil((b - a) / 3));
  double sum = 0;
  for (int p = 0; p < panels; ++p) {
    const double half = (b - a) / (2 * panels), centre = a + (2 * p + 1) * half;
    for (std::size_t i = 0; i < gauss_x.size(); ++i)
      sum += half * gauss_w[i] * (f(centre - half * gauss_x[i]) + f(centre + half * gauss_x[i]));
  }
  return sum;
}

// Where a continuous function changes sign on [-reach, reach].
template <class F>
void add_sign_changes(F&& f, std::vector<double>& out) {
  double low = -reach, f_low = f(low);
  for (int i = 1; i <= cells; ++i) {
    const double high = -reach + 2 * reach * i / cells, f_high = f(high);
    if ((f_low < 0) != (f_high < 0)) {
      double a = low, b = high;
      for (int k = 0; k < 45; ++k) {
        const double middle = 0.5 * (a + b);
        ((f(middle) < 0) == (f_low < 0) ? a : b) = middle;
      }
      out.push_back(0.5 * (a + b));
    }
    low = high;
    f_low = f_high;
  }
}

// 1, x, x^2, x^3 and, with a second variable, e, x e, x^2 e, e^2, x e^2, e^3.
constexpr std::array<std::array<int, 2>, 10> monomials = {
    {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {0, 1}, {1, 1}, {0, 2}, {2, 1}, {1, 2}, {0, 3}}};

double power(double x, int n) { return n == 0 ? 1 : n == 1 ? x : n == 2 ? x * x : x * x * x; }

LeafAverage sum_of(std::vector<double>& terms) {
  LeafAverage result;
  double sum = 0, lost = 0, modulus = 0;
  for (const double term : terms) {
    const double next = sum + term;
    lost += std::abs(sum) >= std::abs(term) ? (sum - next) + term : (term - next) + sum;
    sum = next;
    modulus += std::abs(term);
  }
  result.value = sum + lost;
  for (double& term : terms) term = std::abs(term);
  // The fewest that carry 99 %: few are looked at, for many are many enough.
  const std::size_t most = std::min<std::size_t>(terms.size(), 64);
  std::partial_sort(terms.begin(), terms.begin() + static_cast<std::ptrdiff_t>(most), terms.end(),
                    std::greater<>());
  double carried = 0;
  while (result.carriers < most && carried < 0.99 * modulus) carried += terms[result.carriers++];
  if (!(modulus > 0)) result.carriers = std::isfinite(modulus) ? 0 : most;
  return result;
}

}  // namespace

LeafAverage average_over(const BatchFunction& payoff, const Generation& leaves) {
  std::vector<double> values(leaves.size());
  payoff(leaves.states, values);
  for (std::size_t n = 0; n < values.size(); ++n) values[n] *= std::exp(leaves.log_weight[n]);
  return sum_of(values);
}

FamilyAverage::FamilyAverage(const Generation& leaves, std::size_t families, bool four)
    : leaves_(leaves), families_(families), members_(leaves.size() / families), four_(four) {
  weight_.resize(leaves.size());
  for (std::size_t n = 0; n < weight_.size(); ++n) weight_[n] = std::exp(leaves.log_weight[n]);
  w_.resize(members_);
  values_.resize(members_);
  xi_.resize(members_);
  eta_.resize(members_);
  const std::size_t d = leaves.states.components();
  states_.reshape(d, members_);
  further_.reshape(d + 1, members_);
}

LeafAverage FamilyAverage::operator()(const KinkedFunction& payoff) {
  exact_.resize(leaves_.size());
  payoff.exact(leaves_.states, exact_);
  argument_.resize(payoff.kinks.size());
  for (std::size_t k = 0; k < payoff.kinks.size(); ++k) {
    argument_[k].resize(leaves_.size());
    payoff.kinks[k](leaves_.states, argument_[k]);
  }
  member_.assign(payoff.kinks.size(), {});
  for (std::size_t k = 0; k < payoff.kinks.size(); ++k) classify(k);
  law_.resize(payoff.kinks.size());
  crosses_.resize(payoff.kinks.size());
  branch_.clear();
  singular_.clear();
  argument_branch_.clear();
  direct_ = {};
  std::vector<double> terms(families_);
  for (std::size_t family = 0; family < families_; ++family) {
    take_family(family);
    if (cross_somewhere(payoff)) {
      terms[family] = with_kinks(payoff);
      continue;
    }
    double sum = 0;
    for (std::size_t j = 0; j < members_; ++j) sum += w_[j] * exact_[j * families_ + family];
    terms[family] = sum;
  }
  return sum_of(terms);
}

// Looks for an argument before it that differs by a constant alone; else it is the first of a class, of a few.
void FamilyAverage::classify(std::size_t k) {
  const std::vector<double>& u = argument_[k];
  for (ArgumentClass& known : classes_) {
    const double shift = u[0] - known.values[0];
    bool same = std::isfinite(shift);
    for (std::size_t n = 0; same && n < u.size(); ++n) {
      // Rounding of the arguments and of the difference, a few units of 2^-53.
      const double size = std::abs(u[n]) + std::abs(known.values[n]) + std::abs(shift);
      same = std::abs(u[n] - known.values[n] - shift) <= 1e-15 * size;
    }
    if (!same) continue;
    member_[k] = {&known, shift};
    return;
  }
  constexpr std::size_t most_classes = 8;
  if (classes_.size() == most_classes) return;
  classes_.push_back({u, std::vector<FamilyShape>(families_)});
  member_[k] = {&classes_.back(), 0};
}

FamilyAverage::FamilyShape& FamilyAverage::shape_of(ArgumentClass& of) {
  FamilyShape& shape = of.families[family_];
  if (shape.known) return shape;
  for (std::size_t j = 0; j < members_; ++j) values_[j] = of.values[j * families_ + family_];
  const auto [least, most] = std::minmax_element(values_.begin(), values_.end());
  shape.least = *least;
  shape.most = *most;
  if (std::isfinite(*most - *least)) shape.law = step_law(values_, w_, four_);
  shape.known = true;
  return shape;
}

void FamilyAverage::take_family(std::size_t family) {
  family_ = family;
  mass_ = 0;
  for (std::size_t j = 0; j < members_; ++j) mass_ += w_[j] = weight_[j * families_ + family];
}

// The values of argument k over the family: as it is, or where kinks inside may cross, the branch for `sides`.
void FamilyAverage::take_argument(const KinkedFunction& payoff, std::size_t k, Sides sides) {
  const bool nested = !payoff.with_argument && crossing_ != 0;
  const std::vector<double>& all =
      nested ? argument_values(payoff, k, sides & ((Sides{1} << k) - 1)) : argument_[k];
  for (std::size_t j = 0; j < members_; ++j) values_[j] = all[j * families_ + family_];
}

bool FamilyAverage::cross_somewhere(const KinkedFunction& payoff) {
  if (!(mass_ > 0)) return false;
  fixed_ = 0;
  crossing_ = 0;
  double narrowest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < payoff.kinks.size(); ++k) {
    crosses_[k] = 0;
    // With a kink inside that crosses, the argument is smooth on either side of it: both are looked at.
    const bool smooth = payoff.with_argument || crossing_ == 0;
    for (const Sides inside : {Sides{0}, crossing_}) {
      if (crosses_[k] != 0 || (smooth && inside != 0)) continue;
      double low = 0, high = 0;
      const bool shared = smooth && member_[k].of != nullptr;
      if (shared) {
        const FamilyShape& shape = shape_of(*member_[k].of);
        low = shape.least + member_[k].shift;
        high = shape.most + member_[k].shift;
      } else {
        take_argument(payoff, k, fixed_ | inside);
        const auto [least, most] = std::minmax_element(values_.begin(), values_.end());
        low = *least;
        high = *most;
      }
      if (!std::isfinite(high - low)) return false;  // the average tells
      const double nearest = low > 0 ? low : high < 0 ? -high : 0;
      const bool far = nearest > 30 * (high - low);  // no law of this spread comes near
      double centre = low;
      if (!far) {
        if (shared) {
          law_[k] = shape_of(*member_[k].of).law;
          law_[k].mean += member_[k].shift;
        } else {
          law_[k] = step_law(values_, w_, four_);
        }
        centre = law_[k].mean;
        const Crossings found = crossings(law_[k], 0, reach);
        if (found.count > 0) {
          crosses_[k] = 1;
          double closest = reach;
          for (std::size_t i = 0; i < found.count; ++i) closest = std::min(closest, std::abs(found.z[i]));
          if (smooth && closest < narrowest) narrowest = closest, main_ = k;
          continue;
        }
      }
      // An argument that does not vary and is 0 is on the side where the payoff has it: step(0) = 0.
      if (inside == 0 && centre > 0) fixed_ |= Sides{1} << k;
      // Without a root, yet on different sides of 0 on the two sides of a kink inside.
      if (inside != 0 && (centre > 0) != ((fixed_ >> k & 1U) != 0)) crosses_[k] = 1;
    }
    if (crosses_[k] == 0) continue;
    fixed_ &= ~(Sides{1} << k);
    crossing_ |= Sides{1} << k;
  }
  return crossing_ != 0;
}

void FamilyAverage::build_basis(Basis& basis) const {
  const std::size_t variables = plane_ ? monomials.size() : 4;
  auto& [functions, combination] = basis;
  functions.clear();
  combination.clear();
  for (std::size_t m = 0; m < variables; ++m) {
    std::vector<double> v(members_), c(monomials.size(), 0.0);
    c[m] = 1;
    double size = 0;
    for (std::size_t j = 0; j < members_; ++j) {
      v[j] = power(xi_[j], monomials[m][0]) * power(eta_[j], monomials[m][1]);
      size += w_[j] / mass_ * v[j] * v[j];
    }
    for (int pass = 0; pass < 2; ++pass)
      for (std::size_t b = 0; b < functions.size(); ++b) {
        double product = 0;
        for (std::size_t j = 0; j < members_; ++j) product += w_[j] / mass_ * v[j] * functions[b][j];
        for (std::size_t j = 0; j < members_; ++j) v[j] -= product * functions[b][j];
        for (std::size_t i = 0; i < c.size(); ++i) c[i] -= product * combination[b][i];
      }
    double norm = 0;
    for (std::size_t j = 0; j < members_; ++j) norm += w_[j] / mass_ * v[j] * v[j];
    // What the members cannot tell from the functions before it is left out.
    if (!(norm > 1e-6 * size) || size == 0) continue;
    for (double& value : v) value /= std::sqrt(norm);
    for (double& value : c) value /= std::sqrt(norm);
    functions.push_back(std::move(v));
    combination.push_back(std::move(c));
  }
}

// Coefficients of the monomials.
void FamilyAverage::project(std::span<const double> values, std::span<double> coefficients) const {
  std::fill(coefficients.begin(), coefficients.end(), 0.0);
  for (std::size_t b = 0; b < basis_->functions.size(); ++b) {
    double product = 0;
    for (std::size_t j = 0; j < members_; ++j) product += w_[j] / mass_ * values[j] * basis_->functions[b][j];
    for (std::size_t i = 0; i < coefficients.size(); ++i)
      coefficients[i] += product * basis_->combination[b][i];
  }
}

double FamilyAverage::at(std::span<const double> c, double x, double e) const {
  double value = c[0] + x * (c[1] + x * (c[2] + x * c[3]));
  if (plane_) value += e * (c[4] + x * c[5] + x * x * c[7] + e * (c[6] + x * c[8] + e * c[9]));
  return value;
}

const std::vector<double>& FamilyAverage::branch_values(const KinkedFunction& payoff, Sides sides) {
  const auto [found, fresh] = branch_.try_emplace(sides);
  if (fresh) {
    std::vector<double> above(payoff.kinks.size());
    for (std::size_t k = 0; k < above.size(); ++k) above[k] = (sides >> k & 1U) != 0 ? 1.0 : 0.0;
    found->second.resize(leaves_.size());
    payoff.branch(above)(leaves_.states, found->second);
  }
  return found->second;
}

const std::vector<double>& FamilyAverage::argument_values(const KinkedFunction& payoff, std::size_t k,
                                                          Sides sides) {
  const auto [found, fresh] = argument_branch_.try_emplace({k, sides});
  if (fresh) {
    std::vector<double> above(payoff.kinks.size());
    for (std::size_t i = 0; i < above.size(); ++i) above[i] = (sides >> i & 1U) != 0 ? 1.0 : 0.0;
    found->second.resize(leaves_.size());
    payoff.argument_branch(k, above)(leaves_.states, found->second);
  }
  return found->second;
}

// Whether the branch is not finite at some leaf.
bool FamilyAverage::singular(const KinkedFunction& payoff, Sides sides) {
  const auto [found, fresh] = singular_.try_emplace(sides, false);
  if (fresh) {
    const std::vector<double>& values = branch_values(payoff, sides);
    found->second = !std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  }
  return found->second;
}

// Empty where the branch is not finite on the whole family.
const std::vector<double>& FamilyAverage::branch_fit(const KinkedFunction& payoff, Sides sides) {
  const auto [found, fresh] = branch_fit_.try_emplace(sides);
  if (!fresh) return found->second;
  const std::vector<double>& all = branch_values(payoff, sides);
  bool finite = true;
  for (std::size_t j = 0; j < members_; ++j) {
    values_[j] = all[j * families_ + family_];
    finite = finite && std::isfinite(values_[j]);
  }
  if (!finite) return found->second;
  found->second.resize(monomials.size());
  project(values_, found->second);
  return found->second;
}

const std::vector<double>& FamilyAverage::argument_fit(const KinkedFunction& payoff, std::size_t k,
                                                       Sides sides) {
  sides = payoff.with_argument ? 0 : sides & ((Sides{1} << k) - 1);  // of the kinks that may be inside
  const auto [found, fresh] = argument_fit_.try_emplace({k, sides});
  if (!fresh) return found->second;
  const std::vector<double>& all = argument_values(payoff, k, sides);
  for (std::size_t j = 0; j < members_; ++j) values_[j] = all[j * families_ + family_];
  found->second.resize(monomials.size());
  project(values_, found->second);
  return found->second;
}

FamilyAverage::Sides FamilyAverage::sides_at(const KinkedFunction& payoff, double xi, double eta) {
  Sides sides = fixed_;
  for (std::size_t k = 0; k < payoff.kinks.size(); ++k)
    if (crosses_[k] != 0 && at(argument_fit(payoff, k, sides), xi, eta) > 0) sides |= Sides{1} << k;
  return sides;
}

double FamilyAverage::argument_at(const KinkedFunction& payoff, std::size_t k, double xi, double eta) {
  Sides sides = fixed_;
  for (std::size_t i = 0; i < k; ++i)
    if (crosses_[i] != 0 && at(argument_fit(payoff, i, sides), xi, eta) > 0) sides |= Sides{1} << i;
  return at(argument_fit(payoff, k, sides), xi, eta);
}

// The payoff given that the main argument is u, which is xi on the members' scale.
double FamilyAverage::direct_value(const KinkedFunction& payoff, double u, double xi) {
  if (!direct_ || direct_kink_ != main_) {
    direct_ = payoff.with_argument(main_);
    direct_kink_ = main_;
  }
  const std::size_t d = leaves_.states.components();
  for (std::size_t j = 0; j < members_; ++j) {
    for (std::size_t i = 0; i < d; ++i) further_(i, j) = leaves_.states(i, j * families_ + family_);
    further_(d, j) = u;
  }
  direct_(further_, values_);
  std::array<double, monomials.size()> c{};
  project(values_, c);
  return at(c, xi, 0);
}

double FamilyAverage::with_kinks(const KinkedFunction& payoff) {
  branch_fit_.clear();
  argument_fit_.clear();
  const StepLaw& law = law_[main_];
  for (std::size_t j = 0; j < members_; ++j) {
    xi_[j] = (argument_[main_][j * families_ + family_] - law.mean) / law.deviation;
    eta_[j] = 0;
  }
  plane_ = false;
  Basis* basis = &own_basis_;
  const bool shared = member_[main_].of != nullptr;
  if (shared) basis = &shape_of(*member_[main_].of).basis;
  if (!shared || basis->functions.empty()) build_basis(*basis);
  basis_ = basis;
  build_second(payoff);
  return plane_ ? plane_integral(payoff) : line_integral(payoff);
}

// The kink whose argument is farthest from a function of the main one, if any is.
void FamilyAverage::build_second(const KinkedFunction& payoff) {
  double largest = 1e-4;
  std::array<double, monomials.size()> c{};
  std::vector<double> rest(members_);
  bool plane = false;
  for (std::size_t k = 0; k < payoff.kinks.size(); ++k) {
    if (crosses_[k] == 0 || k == main_) continue;
    for (const Sides inside : {Sides{0}, crossing_}) {
      take_argument(payoff, k, fixed_ | inside);
      project(values_, c);
      double square = 0, mean = 0, second = 0;
      for (std::size_t j = 0; j < members_; ++j) {
        rest[j] = values_[j] - at(c, xi_[j], 0);
        square += w_[j] / mass_ * rest[j] * rest[j];
        mean += w_[j] / mass_ * (values_[j] - values_[0]);
        second += w_[j] / mass_ * (values_[j] - values_[0]) * (values_[j] - values_[0]);
      }
      const double variance = second - mean * mean;
      const double ratio = variance > 0 ? std::sqrt(square / variance) : 0;
      if (!(ratio > largest)) continue;
      largest = ratio;
      for (std::size_t j = 0; j < members_; ++j) eta_[j] = rest[j] / std::sqrt(square);
      plane = true;
    }
  }
  plane_ = plane;
  if (!plane_) return;
  build_basis(own_basis_);
  basis_ = &own_basis_;
}

double FamilyAverage::line_integral(const KinkedFunction& payoff) {
  const StepLaw& law = law_[main_];
  std::vector<double> ends = {-reach, reach};
  const Crossings main = crossings(law, 0, reach);
  ends.insert(ends.end(), main.z.begin(), main.z.begin() + static_cast<std::ptrdiff_t>(main.count));
  for (std::size_t k = 0; k < payoff.kinks.size(); ++k)
    if (crosses_[k] != 0 && k != main_)
      add_sign_changes([&](double z) { return argument_at(payoff, k, law.standard(z), 0); }, ends);
  std::sort(ends.begin(), ends.end());
  // The branch of the longest piece in probability is averaged by the cubature formula.
  Sides base = 0;
  double most = -1;
  std::vector<Sides> sides(ends.size() - 1);
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    if (!(ends[i + 1] > ends[i])) continue;
    sides[i] = sides_at(payoff, law.standard(0.5 * (ends[i] + ends[i + 1])), 0);
    const double mass = std::erf(ends[i + 1] / std::numbers::sqrt2) - std::erf(ends[i] / std::numbers::sqrt2);
    if (mass > most && !branch_fit(payoff, sides[i]).empty()) most = mass, base = sides[i];
  }
  // A branch with a singularity is no polynomial near it, even where the family sees it finite.
  bool direct = false;
  for (std::size_t i = 0; i + 1 < ends.size(); ++i)
    direct = direct || (payoff.with_argument && ends[i + 1] > ends[i] && singular(payoff, sides[i]));
  const bool control = most >= 0 && !direct;
  double sum = 0;
  if (control) {
    const std::vector<double>& values = branch_values(payoff, base);
    for (std::size_t j = 0; j < members_; ++j) sum += w_[j] / mass_ * values[j * families_ + family_];
  }
  const std::vector<double> none;
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    const double a = ends[i], b = ends[i + 1];
    if (!(b > a) || (control && sides[i] == base)) continue;
    const std::vector<double>& fit = direct ? none : branch_fit(payoff, sides[i]);
    const auto base_at = [&](double xi) { return control ? at(branch_fit(payoff, base), xi, 0) : 0.0; };
    if (!fit.empty()) {
      sum += integral(a, b, [&](double z) {
        const double xi = law.standard(z);
        return phi(z) * (at(fit, xi, 0) - base_at(xi));
      });
      continue;
    }
    if (!payoff.with_argument) return mass_ * std::numeric_limits<double>::quiet_NaN();
    // Singular at an end, perhaps: z = a + (b - a) (3 t^2 - 2 t^3) makes a root's derivative bounded.
    const double middle = std::clamp(0.0, a, b);
    for (const auto& [from, to] : {std::pair{a, middle}, std::pair{middle, b}}) {
      if (!(to > from)) continue;
      const double width = to - from;
      sum += integral(0, 9, [&](double nine_t) {
        const double t = nine_t / 9, z = from + width * t * t * (3 - 2 * t), xi = law.standard(z);
        return width / 9 * 6 * t * (1 - t) * phi(z) * (direct_value(payoff, law(z), xi) - base_at(xi));
      });
    }
  }
  return mass_ * sum;
}

double FamilyAverage::plane_integral(const KinkedFunction& payoff) {
  const StepLaw& law = law_[main_];
  std::vector<double> ends = {-reach, reach}, across;
  const Crossings main = crossings(law, 0, reach);
  ends.insert(ends.end(), main.z.begin(), main.z.begin() + static_cast<std::ptrdiff_t>(main.count));
  std::sort(ends.begin(), ends.end());
  const Sides base = sides_at(payoff, law.standard(0), 0);
  const bool control = !branch_fit(payoff, base).empty();
  double sum = 0;
  if (control) {
    const std::vector<double>& values = branch_values(payoff, base);
    for (std::size_t j = 0; j < members_; ++j) sum += w_[j] / mass_ * values[j * families_ + family_];
  }
  const auto line = [&](double z) {
    const double xi = law.standard(z);
    across.assign({-reach, reach});
    for (std::size_t k = 0; k < payoff.kinks.size(); ++k)
      if (crosses_[k] != 0) add_sign_changes([&](double e) { return argument_at(payoff, k, xi, e); }, across);
    std::sort(across.begin(), across.end());
    double part = 0;
    for (std::size_t i = 0; i + 1 < across.size(); ++i) {
      const double a = across[i], b = across[i + 1];
      if (!(b > a)) continue;
      const Sides sides = sides_at(payoff, xi, 0.5 * (a + b));
      if (control && sides == base) continue;
      const std::vector<double>& fit = branch_fit(payoff, sides);
      if (fit.empty()) return std::numeric_limits<double>::quiet_NaN();
      const std::vector<double>* const of_base = control ? &branch_fit(payoff, base) : nullptr;
      part += integral(a, b, [&](double e) {
        return phi(e) * (at(fit, xi, e) - (of_base != nullptr ? at(*of_base, xi, e) : 0.0));
      });
    }
    return part * phi(z);
  };
  for (std::size_t i = 0; i + 1 < ends.size(); ++i)
    if (ends[i + 1] > ends[i]) sum += integral(ends[i], ends[i + 1], line);
  if (std::isfinite(sum)) return mass_ * sum;
  // Several arguments and a branch that is not finite: the cubature of the payoff as it is.
  double plain = 0;
  for (std::size_t j = 0; j < members_; ++j) plain += w_[j] * exact_[j * families_ + family_];
  return plain;
}

}  // namespace wienertree
