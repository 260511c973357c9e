#pragma once
/// NumPy arrays in and out without copies.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "wienertree/numeric/error.hpp"

namespace wienertree::python {

namespace py = pybind11;

/// An array read where it lies if it is a C-contiguous one of doubles, else NumPy's conversion of it to one.
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// Numbers that were handed in: arrays, masked ones (what is masked is NaN), lists.
/// @throws InputError naming `what` for dates and durations, which have no unit here, and for what is not real numbers
inline Doubles doubles_of(const py::handle& numbers, const std::string& what) {
  const py::module_ numpy = py::module_::import("numpy");
  const py::object masked = numpy.attr("ma").attr("MaskedArray");
  const py::object array = py::isinstance(numbers, masked) ? py::reinterpret_borrow<py::object>(numbers)
                                                           : py::object(numpy.attr("asarray")(numbers));
  const auto kind = array.attr("dtype").attr("kind").cast<std::string>();
  if (kind == "M" || kind == "m")
    throw InputError(
        "dates and durations have no unit here: give numbers, (t - t[0]) / numpy.timedelta64(1, \"D\") for "
        "days",
        what, py::str(array.attr("dtype")).cast<std::string>());
  if (std::string("biufO").find(kind) == std::string::npos)
    throw InputError("must be real numbers", what, py::str(array.attr("dtype")).cast<std::string>());
  if (py::isinstance(array, masked))
    return Doubles(array.attr("astype")("float64").attr("filled")(std::numeric_limits<double>::quiet_NaN()));
  return Doubles(array);
}

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
