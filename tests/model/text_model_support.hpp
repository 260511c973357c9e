#pragma once
/// Evaluation of models at single points, for tests.
#include <random>
#include <string>
#include <vector>

#include "wienertree/model/text_model.hpp"

namespace wienertree::testing {

using Point = std::vector<double>;

inline std::string bundled(const std::string& name) {
  return std::string(WIENERTREE_SOURCE_DIR) + "/data/models/" + name + ".toml";
}

inline Batch one_node(const Point& x) {
  Batch batch(x.size(), 1);
  for (std::size_t i = 0; i < x.size(); ++i) batch(i, 0) = x[i];
  return batch;
}

inline Point values(const Batch& batch) {
  Point result;
  for (std::size_t i = 0; i < batch.components(); ++i) result.push_back(batch(i, 0));
  return result;
}

/// V_k(x), Stratonovich.
inline Point field(const VectorFields& fields, std::size_t k, const Point& x) {
  Point D(1 + fields.noise_dimension(), 0.0);
  D[k] = 1;
  Batch out(x.size(), 1);
  fields.direct(one_node(x), D, out);
  return values(out);
}

inline Point direct(const VectorFields& fields, const Point& x, const Point& D) {
  Batch out(x.size(), 1);
  fields.direct(one_node(x), D, out);
  return values(out);
}

inline Point jacobian(const VectorFields& fields, const Point& x, const Point& D) {
  Batch out(x.size() * x.size(), 1);
  fields.jacobian(one_node(x), D, out);
  return values(out);
}

inline Point ito_drift(const VectorFields& fields, const Point& x) {
  Batch out(x.size(), 1);
  fields.ito_drift(one_node(x), out);
  return values(out);
}

inline Point sensor(const VectorFields& fields, const Point& x) {
  Batch out(fields.sensor_dimension(), 1);
  fields.sensor(one_node(x), out);
  return values(out);
}

inline double log_density(const ObservationDensity& density, const Point& y, const Point& x) {
  double result = 0;
  density.log_density(y, one_node(x), {&result, 1});
  return result;
}

/// The value of an expression over the states of a model.
inline double value_of(const TextModel& model, const std::string& expression, const Point& x) {
  double result = 0;
  model.compile(expression, "test")(one_node(x), {&result, 1});
  return result;
}

}  // namespace wienertree::testing
