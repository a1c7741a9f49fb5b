#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "canyon/simulation/scenario/scenario.hpp"
#include "python/src/binding.hpp"

namespace canyon::python {

/// A Python object held by the engine: always released under the GIL.
class Held {
 public:
  explicit Held(py::object object)
      : object_(new py::object(std::move(object)), [](const py::object* o) {
          const py::gil_scoped_acquire gil;
          delete o;
        }) {}
  [[nodiscard]] const py::object& get() const { return *object_; }

 private:
  std::shared_ptr<const py::object> object_;
};

/// Sets canyon.Models in a receiver: its disturbances, antenna, weighting and solver. Throws InputError for
/// other objects.
void put_models(const py::object& models, simulation::ReceiverConfig& receiver);
/// The same for several receivers: one for all, or a dict by name.
void put_models(const py::object& models, std::vector<simulation::ReceiverConfig>& receivers);

}  // namespace canyon::python
