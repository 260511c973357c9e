#pragma once
/// NumPy arrays in and out without copies.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace wienertree::python {

namespace py = pybind11;

/// An array read where it lies if it is a C-contiguous one of doubles, else NumPy's conversion of it to one.
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

inline std::span<const double> values_of(const Doubles& array) {
  return {array.data(), static_cast<std::size_t>(array.size())};
}

/// An array that owns the vector's memory. @pre the product of `shape` is the vector's size
template <class T>
py::array_t<T> hand_over(std::vector<T> values, std::vector<py::ssize_t> shape) {
  auto owner = std::make_unique<std::vector<T>>(std::move(values));
  T* data = owner->data();
  const py::capsule keeper(owner.release(), [](void* p) { delete static_cast<std::vector<T>*>(p); });
  return py::array_t<T>(std::move(shape), data, keeper);
}

template <class T>
py::array_t<T> hand_over(std::vector<T> values) {
  const auto n = static_cast<py::ssize_t>(values.size());
  return hand_over(std::move(values), {n});
}

/// Rows of `columns` values each.
inline py::array_t<double> hand_over_rows(std::vector<double> values, std::size_t columns) {
  const auto k = static_cast<py::ssize_t>(columns);
  const py::ssize_t rows = k == 0 ? 0 : static_cast<py::ssize_t>(values.size()) / k;
  return hand_over(std::move(values), {rows, k});
}

}  // namespace wienertree::python
