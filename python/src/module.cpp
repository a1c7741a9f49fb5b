#include "python/src/binding.hpp"

#include "canyon/base/input_error.hpp"

namespace canyon::python {

bool Signals::interrupted() {
  if (stop_) return true;
  const auto now = std::chrono::steady_clock::now();
  if (now - last_ < std::chrono::milliseconds(50)) return false;
  last_ = now;
  const py::gil_scoped_acquire gil;
  if (PyErr_CheckSignals() == 0) return false;
  raised_ = std::make_exception_ptr(py::error_already_set());
  stop_ = true;
  return true;
}

bool Signals::take_interrupt() {
  if (!raised_) return false;
  try {
    std::rethrow_exception(raised_);
  } catch (py::error_already_set& error) {
    if (!error.matches(PyExc_KeyboardInterrupt)) throw;
  }
  return true;
}

namespace {

/// The classes are in canyon.errors, so that they are documented and typed like other Python classes.
void raise_as(const char* name, const Error& error) {
  const py::object cls = py::module_::import("canyon.errors").attr(name);
  const py::object file = error.file().empty() ? py::object(py::none()) : py::str(error.file());
  const py::object line = error.line() > 0 ? py::object(py::int_(error.line())) : py::none();
  const py::object value = cls(error.problem(), error.hint(), file, line, std::string(error.what()));
  PyErr_SetObject(cls.ptr(), value.ptr());
}

}  // namespace
}  // namespace canyon::python

PYBIND11_MODULE(_canyon, m) {
  using namespace canyon::python;
  m.doc() = "Canyon's engine. Import these from the package canyon.";
  m.attr("__version__") = CANYON_VERSION;
  py::register_exception_translator([](std::exception_ptr failure) {
    try {
      if (failure) std::rethrow_exception(failure);
    } catch (const canyon::OutputError& error) {
      raise_as("OutputError", error);
    } catch (const canyon::InputError& error) {
      raise_as("InputError", error);
    }
  });
  bind_settings(m);
  bind_city(m);
  bind_sky(m);
  bind_trace(m);
  bind_models(m);
  bind_epochs(m);
  bind_simulation(m);
  bind_samples(m);
  bind_live(m);
  bind_heatmap(m);
  bind_validation(m);
}
