#pragma once
/// What a signal and its observation are: a value that holds the vector fields and everything known about
/// them.
#include <Eigen/Core>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "wienertree/model/input_functions.hpp"
#include "wienertree/model/vector_fields.hpp"
#include "wienertree/numeric/error.hpp"

namespace wienertree {

/// What happens where a state would leave [lower, upper].
enum class Boundary {
  error,   ///< the run stops and names state, time and node
  clamp,   ///< fields are evaluated at, and nodes moved to, the nearest point inside
  absorb,  ///< a node that reaches the bound stays there
};

struct StateBound {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  Boundary boundary = Boundary::error;
  bool bounded() const {
    return lower > -std::numeric_limits<double>::infinity() ||
           upper < std::numeric_limits<double>::infinity();
  }
};

/// Density of a discrete observation given the state: y_k = h(X) + noise, or any expression.
class ObservationDensity {
 public:
  virtual ~ObservationDensity() = default;
  virtual std::size_t observation_dimension() const = 0;  ///< k
  /// out(n) = log density of y given state x_n. A NaN in y is a missing value: components missing contribute
  /// nothing. y: k values;  x: d x N;  out: N.   Thread-safe.
  /// @throws InputError if some but not all of y is missing and the density cannot be split by component
  virtual void log_density(std::span<const double> y, ConstBatchView x, std::span<double> out) const = 0;
  /// One draw of Y given one state, for `simulate`: y(k) from `uniforms` in (0,1) and standard `normals`, k
  /// of each.
  /// @throws InputError when the law cannot be sampled (a `log_likelihood` expression)
  virtual void sample(std::span<const double> x, std::span<const double> uniforms,
                      std::span<const double> normals, std::span<double> y) const = 0;
  /// Log density of y if it were noise alone, y = v. Missing components contribute nothing.
  /// @throws InputError when the density is not that of h(x) + noise
  virtual double log_noise_density(std::span<const double> y) const = 0;
  /// Variance of additive Gaussian noise per component (k values) when y = h(x) + N(0, sd^2); empty
  /// otherwise.
  virtual std::vector<double> gaussian_variances() const { return {}; }
};

enum class ObservationKind { none, continuous, discrete };
/// Discrete observations: h of the state at the observation time, or of the state one observation earlier.
enum class ObservationTiming { current, previous };

/// Parameters of the Benes filter: dX = mu sigma tanh(mu X/sigma) dt + sigma dB, dY = (h1 X + h2) dt + dW,
/// X_0 = x0.
struct BenesParameters {
  double mu = 0, sigma = 1, h1 = 0, h2 = 0, x0 = 0;
};

enum class ExactFilter { none, benes, kalman_bucy, kalman };

/// Random start N(mean, covariance).
struct InitialLaw {
  Eigen::VectorXd mean;        ///< d
  Eigen::MatrixXd covariance;  ///< d x d, positive semidefinite
};

struct Model {
  std::string name;
  std::vector<std::string> state_names;                    ///< d names
  std::vector<double> initial;                             ///< d values (the mean when `initial_law` is set)
  std::vector<StateBound> bounds;                          ///< d
  std::vector<std::pair<std::string, double>> parameters;  ///< as declared, after overrides
  std::shared_ptr<const VectorFields> fields;              ///< never null
  /// A model that depends on t explicitly carries a last component with V_0 = 1: it is a state to the
  /// mathematics, and reports leave it out.
  bool has_clock = false;
  /// Known functions of time in the coefficients; then there is a clock, which is theirs. Null: none.
  std::shared_ptr<const InputFunctions> inputs;
  ObservationKind observation = ObservationKind::none;
  ObservationTiming timing = ObservationTiming::current;
  std::shared_ptr<const ObservationDensity> density;  ///< discrete observations only
  std::optional<InitialLaw> initial_law;
  ExactFilter exact_filter = ExactFilter::none;
  std::optional<BenesParameters> benes;  ///< set when the coefficients were verified to be Benes'

  std::size_t state_dimension() const { return fields->state_dimension(); }
  std::size_t noise_dimension() const { return fields->noise_dimension(); }
  /// k: components of h for continuous observations, of y for discrete ones.
  std::size_t observation_dimension() const;
  /// The clock at a time of the observations.
  double clock(double time) const { return inputs ? inputs->clock(time) : time; }
  /// Where steps end: times at which an input jumps.
  std::span<const double> jumps() const { return inputs ? inputs->jumps() : std::span<const double>(); }
  /// States a user sees: all but the clock.
  std::size_t reported_dimension() const { return state_dimension() - (has_clock ? 1 : 0); }
};

/// Verifies the shape of the model's parts and the finiteness of its fields at the start.
/// @throws InputError naming the part and the value
void check(const Model& model);

}  // namespace wienertree
