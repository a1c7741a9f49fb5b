#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <Eigen/Core>
#include <atomic>
#include <chrono>
#include <exception>
#include <limits>
#include <span>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"

namespace canyon::python {

// Common parts of the bindings. pybind11's Eigen casters copy, the arrays below do not.
namespace py = pybind11;
using namespace pybind11::literals;

// One function for each file that adds to the module; module.cpp calls them in this order.
void bind_settings(py::module_& m);
void bind_city(py::module_& m);
void bind_sky(py::module_& m);
void bind_trace(py::module_& m);
void bind_models(py::module_& m);
void bind_epochs(py::module_& m);
void bind_simulation(py::module_& m);
void bind_samples(py::module_& m);
void bind_live(py::module_& m);
void bind_heatmap(py::module_& m);
void bind_validation(py::module_& m);

/// Thrown by the engine's callbacks after a signal handler raised an exception.
struct Stopped {};

/// Ctrl-C while the engine works without the GIL: Python's handlers run in the main thread, every 50 ms.
/// Engine callbacks on the calling thread check it; an exception of a handler ends the work.
class Signals {
 public:
  /// True: a handler raised an exception, which throw_pending() raises. Takes the GIL if it must check.
  bool interrupted();
  /// Throws Stopped if interrupted().
  void compute_look_angles() {
    if (interrupted()) throw Stopped{};
  }
  /// True if KeyboardInterrupt (or a class derived from it) was raised; anything else is thrown.
  bool take_interrupt();
  [[nodiscard]] const std::atomic<bool>* stop() const { return &stop_; }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  std::atomic<bool> stop_{false};
  std::exception_ptr raised_;
};

/// Returns work(signals), which runs without the GIL. Raises exceptions of handlers during the work,
/// including KeyboardInterrupt.
template <typename Work>
auto interruptible(const Work& work) {
  Signals signals;
  try {
    auto result = [&] {
      const py::gil_scoped_release release;
      return work(signals);
    }();
    if (!signals.take_interrupt()) return result;
  } catch (const Stopped&) {
    (void)signals.take_interrupt();
  }
  PyErr_SetNone(PyExc_KeyboardInterrupt);
  throw py::error_already_set();
}

/// The missing value in arrays of float64.
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// An array that owns a vector: nothing is copied. @param shape its product is the vector's length
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

/// A read-only array: writes to an array that a property makes at each access would be lost.
template <typename T>
py::array_t<T> read_only(py::array_t<T> array) {
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

/// A read-only view of memory of `owner`, which it keeps alive.
template <typename T>
py::array_t<T> view_of(const T* data, std::vector<py::ssize_t> shape, py::handle owner) {
  return read_only(py::array_t<T>(std::move(shape), data, owner));
}

/// Rows of three finite numbers, without a copy if the array is float64 and contiguous.
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

/// Three finite numbers. Fast for tuples and arrays.
[[nodiscard]] Eigen::Vector3d vector3(py::handle from, const char* what);
/// Read-only.
[[nodiscard]] py::array_t<double> array_of(const Eigen::Vector3d& v);
/// (latitude [deg], longitude [deg], height [m]).
[[nodiscard]] py::tuple degrees_of(const geodesy::Geodetic& position);

}  // namespace canyon::python
