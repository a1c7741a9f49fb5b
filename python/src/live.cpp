#include <fmt/format.h>

#include "canyon/base/input_error.hpp"
#include "canyon/simulation/city_scene.hpp"
#include "canyon/simulation/live_receiver.hpp"
#include "canyon/simulation/load_city.hpp"
#include "python/src/arrays.hpp"
#include "python/src/epochs.hpp"
#include "python/src/models.hpp"
#include "python/src/settings.hpp"

namespace canyon::python {
namespace {

using simulation::LiveReceiver;

/// A receiver of Python's own simulator.
class Live {
 public:
  Live(const py::object& settings, std::shared_ptr<simulation::CityScene> city, const py::object& start,
       const std::vector<py::object>& faults, const py::object& models)
      : scene_(std::move(city)) {
    auto config = read_tree<simulation::LiveConfig>(tree_of(settings), "receiver");
    put_models(models, config.receiver());
    const std::optional<geodesy::GpsTime> begin = start.is_none() ? config.start : time_of(start);
    if (!begin) throw InputError("'start' is missing", "give the instant of the host's time 0");
    {
      const py::gil_scoped_release release;
      receiver_ = std::make_shared<LiveReceiver>(std::move(config), scene_, *begin);
    }
    for (const py::object& fault : faults) (void)add_fault(fault);
  }

  EpochPtr observe(double seconds, py::handle position, py::handle velocity, double yaw, double yaw_rate,
                   bool paths) {
    simulation::AntennaState antenna;
    antenna.position_enu_m = vector3(position, "the position");
    if (!velocity.is_none()) antenna.velocity_enu_mps = vector3(velocity, "the velocity");
    antenna.yaw_rad = yaw;
    antenna.yaw_rate_radps = yaw_rate;
    const py::gil_scoped_release release;
    return kept(receiver_->observe(seconds, antenna), paths);
  }
  EpochPtr lose(double seconds) {
    const py::gil_scoped_release release;
    return kept(receiver_->lose(seconds), false);
  }
  std::string add_fault(const py::object& fault) {
    // An item of `faults:` as JSON: text is what the engine takes while a receiver runs.
    const std::string text = py::isinstance<py::str>(fault)
                                 ? fault.cast<std::string>()
                                 : py::module_::import("json").attr("dumps")(fault).cast<std::string>();
    return receiver_->add_fault(text);
  }
  void change(const py::dict& changes) {
    const std::string text =
        py::module_::import("json").attr("dumps")(object_of(tree_of(changes))).cast<std::string>();
    receiver_->set_config(simulation::changed_live_config(receiver_->config(), text, {}));
    signal_.reset();
  }
  [[nodiscard]] std::unique_ptr<EpochEncoder> encoder(const std::string& format, double interval_s) const {
    return std::make_unique<EpochEncoder>(format, output::describe_receivers(*receiver_, interval_s).front());
  }
  LiveReceiver& receiver() { return *receiver_; }

 private:
  EpochPtr kept(LiveReceiver::Step step, bool paths) {
    auto messages = step.arrival.messages;  // those of the sky of this day
    if (!signal_)
      signal_ =
          std::make_shared<const tracking::SignalOptions>(receiver_->config().receiver().options.signal);
    return std::make_shared<KeptEpoch>(
        std::move(step.epoch), std::move(messages),
        paths ? std::make_shared<const propagation::Arrival>(std::move(step.arrival)) : nullptr, signal_,
        receiver_->shared_sky());
  }

  std::shared_ptr<simulation::CityScene> scene_;
  std::shared_ptr<LiveReceiver> receiver_;
  std::shared_ptr<const tracking::SignalOptions> signal_;  ///< the receiver's; null: to be copied anew
};

}  // namespace

void bind_live(py::module_& m) {
  py::class_<Live>(m, "LiveReceiver")
      .def(py::init<const py::object&, std::shared_ptr<simulation::CityScene>, const py::object&,
                    const std::vector<py::object>&, const py::object&>(),
           "settings"_a, "city"_a, "start"_a = py::none(), "faults"_a = std::vector<py::object>{},
           "models"_a = py::none())
      .def("observe", &Live::observe, "seconds"_a, "position"_a, "velocity"_a = py::none(), "yaw"_a = 0.0,
           "yaw_rate"_a = 0.0, "paths"_a = false)
      .def("lose", &Live::lose, "seconds"_a)
      .def("restart", [](Live& self) { self.receiver().restart(); })
      .def("change", &Live::change, "changes"_a)
      .def("add_fault", &Live::add_fault, "fault"_a)
      .def(
          "end_fault", [](Live& self, const std::string& name) { self.receiver().end_fault(name); }, "name"_a)
      .def("options", [](Live& self) { return simulation::running_options(self.receiver().config()); })
      .def("take_warnings", [](Live& self) { return self.receiver().take_warnings(); })
      .def("encoder", &Live::encoder, "format"_a, "interval_s"_a = 1.0);
}

}  // namespace canyon::python
