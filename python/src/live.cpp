
#include <Eigen/Geometry>
#include <sstream>

#include "canyon/base/input_error.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/receiver_group.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "python/src/binding.hpp"
#include "python/src/epochs.hpp"
#include "python/src/models.hpp"
#include "python/src/settings.hpp"

namespace canyon::python {
namespace {

using simulation::ReceiverRunner;

/// A receiver for a simulator in Python.
class Live {
 public:
  Live(std::shared_ptr<simulation::CityScene> city, const py::object& start, const py::object& faults,
       const py::object& models, const py::kwargs& settings)
      : scene_(std::move(city)) {
    auto config = read_tree<simulation::RunnerConfig>(tree_of(settings), "receiver");
    put_models(models, config.receiver());
    const std::optional<geodesy::GpsTime> begin = start.is_none() ? config.start : time_of(start);
    if (!begin) throw InputError("'start' is missing", "give the instant of the host's time 0");
    {
      const py::gil_scoped_release release;
      run_ = std::make_shared<simulation::ReceiverGroup>(std::move(config), scene_, *begin);
    }
    if (faults.is_none()) return;
    for (const py::handle fault : faults) (void)add_fault(py::reinterpret_borrow<py::object>(fault));
  }

  EpochPtr observe(double seconds, py::handle position, py::handle velocity, double yaw, double yaw_rate,
                   bool paths) {
    simulation::RigidPose body{vector3(position, "the position"),
                               Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()))};
    if (!velocity.is_none()) body.linear_velocity = vector3(velocity, "the velocity");
    body.angular_velocity.z() = yaw_rate;
    const py::gil_scoped_release release;
    return make(simulation::pose_of(body, {scene_->city.frame}, receiver().at(seconds)), seconds, paths);
  }
  EpochPtr observe_without_pose(double seconds) {
    const py::gil_scoped_release release;
    return make(std::nullopt, seconds, false);
  }
  std::string add_fault(const py::object& fault) {
    // An item of `faults:` as JSON: the engine accepts text while a receiver runs.
    const std::string text = py::isinstance<py::str>(fault)
                                 ? fault.cast<std::string>()
                                 : py::module_::import("json").attr("dumps")(fault).cast<std::string>();
    return run_->add_fault(text);
  }
  void change(const py::object& changes, const py::kwargs& keys) {
    py::dict all = changes.is_none() ? py::dict() : py::dict(changes);
    all.attr("update")(keys);
    const std::string text =
        py::module_::import("json").attr("dumps")(object_of(tree_of(all))).cast<std::string>();
    receiver().set_config(simulation::changed_live_config(receiver().config(), text, {}));
    signal_.reset();
  }
  [[nodiscard]] std::unique_ptr<EpochEncoder> encoder(const std::string& format, double interval_s,
                                                      const std::string& generation) const {
    encoding::ReceiverDescription description = encoding::describe_receivers(receiver(), interval_s).front();
    description.ubx_generation =
        read_tree<simulation::StreamOptions>(tree_of(py::dict("generation"_a = generation)), "encoder")
            .generation;
    return std::make_unique<EpochEncoder>(format, description);
  }
  [[nodiscard]] py::dict options() const {
    py::dict values;
    std::istringstream lines(simulation::running_options(receiver().config()));
    for (std::string line; std::getline(lines, line);) {
      const std::size_t colon = line.find(": ");
      values[py::str(line.substr(0, colon))] = line.substr(colon + 2);
    }
    return values;
  }
  [[nodiscard]] ReceiverRunner& receiver() const { return (*run_)[0]; }

 private:
  EpochPtr make(const std::optional<simulation::Pose>& antenna, double seconds, bool paths) {
    const geodesy::GpsTime now = receiver().at(seconds);
    std::vector<simulation::ReceiverGroup::Due> due;
    for (const std::size_t r : run_->order())
      due.push_back({r, now, r == 0 ? antenna : run_->fixed_pose(r, now)});
    return kept(std::move(run_->make(due, false).back()), paths);
  }
  EpochPtr kept(ReceiverRunner::Step step, bool paths) {
    auto messages = step.arrival.messages;  // of the sky of this day
    step.epoch.arrival = nullptr;
    if (!signal_)
      signal_ =
          std::make_shared<const tracking::SignalOptions>(receiver().config().receiver().options.signal);
    return std::make_shared<KeptEpoch>(
        std::move(step.epoch), std::move(messages),
        paths ? std::make_shared<const propagation::Arrival>(std::move(step.arrival)) : nullptr, signal_,
        receiver().shared_sky());
  }

  std::shared_ptr<simulation::CityScene> scene_;
  std::shared_ptr<simulation::ReceiverGroup> run_;         // of the receiver, 0, and its base, 1
  std::shared_ptr<const tracking::SignalOptions> signal_;  ///< the receiver's; null: must be copied again
};

}  // namespace

void bind_live(py::module_& m) {
  py::class_<Live>(m, "ReceiverRunner",
                   R"(A receiver in a world whose time and motion are the caller's. Same steps, same numbers.

Parameters
----------
city : City
start : time, optional
    Instant of the caller's time 0; else the key ``start`` of `settings`.
faults : list of dict, optional
    Items of a scenario's ``faults:``.
models : Models, optional
    Own models.
**settings
    Keys of one receiver of a scenario (``profile``, ``clock``, ...) and ``sky``, ``seed``, ``start``.

Examples
--------
>>> import canyon
>>> city = canyon.City(open=True, origin={"latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520})
>>> receiver = canyon.ReceiverRunner(city, "2026-06-01T08:00:00Z", profile="survey")
>>> epoch = receiver.observe(0.0, (0, 0, 1.5))
>>> epoch.solved, epoch.placement
(True, 'free'))")
      .def(py::init<std::shared_ptr<simulation::CityScene>, const py::object&, const py::object&,
                    const py::object&, const py::kwargs&>(),
           "city"_a, "start"_a = py::none(), py::kw_only(), "faults"_a = py::none(), "models"_a = py::none())
      .def("observe", &Live::observe, "seconds"_a, "position"_a, "velocity"_a = py::none(), "yaw"_a = 0.0,
           "yaw_rate"_a = 0.0, "paths"_a = false, R"(One epoch `seconds` of the caller's time after the start.

`position` is the antenna's, east, north, up [m] of the city, `velocity` likewise [m/s], `yaw` [rad] from
east counter-clockwise, `yaw_rate` [rad/s]. A time before the last one begins anew; a place that no vehicle
gets to in one step restarts the receiver hot, with a warning.)")
      .def("observe_without_pose", &Live::observe_without_pose, "seconds"_a,
           "One epoch of an antenna without a known position: no signal, no fix.")
      .def("lose", &Live::observe_without_pose, "seconds"_a,
           "The former name of :meth:`observe_without_pose`.")
      .def(
          "restart", [](Live& self) { self.receiver().restart(); }, "As constructed.")
      .def("change", &Live::change, "changes"_a = py::none(), py::pos_only(),
           "Other options from the next step on (any key except ``sky``, ``start``, ``name``); restarts the "
           "receiver.")
      .def("add_fault", &Live::add_fault, "fault"_a,
           "Begins a fault now: an item of a scenario's ``faults:``. Returns its name.")
      .def(
          "end_fault", [](Live& self, const std::string& name) { self.receiver().end_fault(name); }, "name"_a,
          "Ends a fault before the next step.")
      .def_property_readonly(
          "options", &Live::options,
          "dict: Options that :meth:`change` takes, with dots in their names, and their values as text.")
      .def(
          "take_warnings", [](Live& self) { return self.receiver().take_warnings(); },
          "Warnings since the last call.")
      .def(
          "encoder", &Live::encoder, "format"_a, "interval_s"_a = 1.0, "generation"_a = "f9",
          "Encodes epochs to bytes: `begin()`, `encode(epoch)` of each, `end()`. See :func:`canyon.formats`. "
          "`generation` is of \"ubx\": m8, f9, m10 or x20.");
}

}  // namespace canyon::python
