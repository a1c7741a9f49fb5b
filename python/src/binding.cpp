#include "python/src/binding.hpp"

#include <fmt/format.h>

#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::python {

namespace {

std::string shape_text(const py::array& array) {
  std::string text;
  for (py::ssize_t i = 0; i < array.ndim(); ++i)
    text += fmt::format("{}{}", i > 0 ? ", " : "", array.shape(i));
  return "(" + text + (array.ndim() == 1 ? ",)" : ")");
}

}  // namespace

Points::Points(const py::object& from, const char* what) {
  const py::array any = py::array::ensure(from);
  if (!any) {
    PyErr_Clear();
    throw InputError(fmt::format("{}: cannot be converted to an array", what), "give rows of three numbers");
  }
  const char kind = any.dtype().kind();
  if (kind != 'f' && kind != 'i' && kind != 'u') {
    throw InputError(
        fmt::format("{}: the array is of type {}", what, py::str(any.dtype()).cast<std::string>()),
        "give numbers (float64)");
  }
  single_ = any.ndim() == 1;
  if ((any.ndim() != 1 && any.ndim() != 2) || any.shape(any.ndim() - 1) != 3) {
    throw InputError(fmt::format("{}: the array has the shape {}", what, shape_text(any)),
                     "give (3,) or (n, 3)");
  }
  array_ = py::array_t<double, py::array::c_style>::ensure(any);
  size_ = single_ ? 1 : static_cast<std::size_t>(array_.shape(0));
  const double* values = array_.data();
  for (std::size_t i = 0; i < 3 * size_; ++i) {
    if (std::isfinite(values[i])) continue;
    throw InputError(fmt::format("{}: row {} has a value that is not finite ({})", what, i / 3, values[i]),
                     "remove such rows, or correct their source");
  }
}

Eigen::Vector3d vector3(py::handle from, const char* what) {
  Eigen::Vector3d v;
  if (PyTuple_Check(from.ptr()) != 0 && PyTuple_GET_SIZE(from.ptr()) == 3) {
    for (int i = 0; i < 3; ++i) {
      v[i] = PyFloat_AsDouble(PyTuple_GET_ITEM(from.ptr(), i));
      if (v[i] == -1 && PyErr_Occurred() != nullptr) throw py::error_already_set();
    }
  } else {
    const py::array_t<double, py::array::c_style | py::array::forcecast> array =
        py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(from);
    if (!array || array.ndim() != 1 || array.shape(0) != 3) {
      PyErr_Clear();
      throw InputError(fmt::format("{} is not three numbers", what), "give a tuple or an array of three");
    }
    v = {array.data()[0], array.data()[1], array.data()[2]};
  }
  if (!v.allFinite())
    throw InputError(fmt::format("NaN: {} is not finite", what), "check the source of this value");
  return v;
}

py::array_t<double> array_of(const Eigen::Vector3d& v) {
  return read_only(py::array_t<double>({py::ssize_t{3}}, v.data()));
}

py::tuple degrees_of(const geodesy::Geodetic& position) {
  return py::make_tuple(geodesy::degrees(position.latitude_rad), geodesy::degrees(position.longitude_rad),
                        position.height_m);
}

}  // namespace canyon::python
