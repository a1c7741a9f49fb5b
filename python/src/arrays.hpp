#pragma once

#include <limits>
#include <span>

#include "canyon/geodesy/frames.hpp"
#include "python/src/binding.hpp"

namespace canyon::python {

/// Stands for a missing value in arrays of float64.
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// An array that owns a vector: nothing is copied. @param shape of which the product is the vector's length
template <typename T>
py::array_t<T> owning_array(std::vector<T>&& values, std::vector<py::ssize_t> shape) {
  auto* kept = new std::vector<T>(std::move(values));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<T>*>(p); });
  return py::array_t<T>(std::move(shape), kept->data(), owner);
}
template <typename T>
py::array_t<T> owning_array(std::vector<T>&& values) {
  const auto size = static_cast<py::ssize_t>(values.size());
  return owning_array(std::move(values), {size});
}

/// The array, which nobody can write into: what a property makes at each access would lose what is written.
template <typename T>
py::array_t<T> read_only(py::array_t<T> array) {
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

/// A read-only look at memory of `owner`, which it keeps alive.
template <typename T>
py::array_t<T> view_of(const T* data, std::vector<py::ssize_t> shape, py::handle owner) {
  return read_only(py::array_t<T>(std::move(shape), data, owner));
}

/// Rows of three finite numbers, without a copy where the array is float64 and contiguous.
class Points {
 public:
  /// One point of shape (3,) or n of shape (n, 3). Throws InputError, naming `what`, for anything else.
  Points(const py::object& from, const char* what);

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool single() const { return single_; }
  [[nodiscard]] std::span<const Eigen::Vector3d> span() const {
    static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double));
    return {reinterpret_cast<const Eigen::Vector3d*>(array_.data()), size_};
  }

 private:
  py::array_t<double, py::array::c_style> array_;
  std::size_t size_ = 0;
  bool single_ = false;
};

/// Three finite numbers. Quick for tuples and arrays alike.
[[nodiscard]] Eigen::Vector3d vector3(py::handle from, const char* what);
/// Read-only.
[[nodiscard]] py::array_t<double> array_of(const Eigen::Vector3d& v);
/// (latitude [deg], longitude [deg], height [m]).
[[nodiscard]] py::tuple degrees_of(const geodesy::Geodetic& place);

}  // namespace canyon::python
