#pragma once

// Eigen and what nearly every file of the bindings uses. pybind11's Eigen casters copy, arrays.hpp does not.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <Eigen/Core>
#include <atomic>
#include <chrono>
#include <exception>
#include <vector>

namespace canyon::python {

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

/// Thrown by the engine's callbacks once a signal handler raised something.
struct Stopped {};

/// Ctrl-C while the engine works without the GIL: Python's handlers run in the main thread, every 50 ms.
/// Engine callbacks on the calling thread ask it; what a handler raises ends the work.
class Signals {
 public:
  /// True: a handler raised something, which throw_pending() raises. Takes the GIL where it must look.
  bool interrupted();
  /// Throws Stopped where interrupted().
  void look() {
    if (interrupted()) throw Stopped{};
  }
  /// True where KeyboardInterrupt (or a class derived from it) was raised; anything else is thrown.
  bool take_interrupt();
  [[nodiscard]] const std::atomic<bool>* stop() const { return &stop_; }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  std::atomic<bool> stop_{false};
  std::exception_ptr raised_;
};

/// Returns work(signals), which runs without the GIL. Raises what a handler raised meanwhile,
/// KeyboardInterrupt among it.
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

}  // namespace canyon::python
