#include "python/src/models.hpp"

#include <fmt/format.h>

#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"
#include "canyon/receiver/positioning/pseudorange_model.hpp"
#include "python/src/settings.hpp"

namespace canyon::python {
namespace {

using propagation::Path;
using propagation::SatelliteView;

/// An arrival passed to Python for one call of apply(). Afterwards it is invalid, even if kept.
struct Borrowed {
  const propagation::Antenna* antenna;
  propagation::Arrival* arrival;
};
struct BorrowedArrival {
  std::shared_ptr<Borrowed> borrowed;

  [[nodiscard]] propagation::Arrival& arrival() const {
    if (borrowed->arrival == nullptr)
      throw InputError("an arrival is valid only during the call of apply()", "copy its numbers");
    return *borrowed->arrival;
  }
  [[nodiscard]] const propagation::Antenna& antenna() const {
    (void)arrival();
    return *borrowed->antenna;
  }
};
struct LentView {
  BorrowedArrival of;
  gnss::SatelliteId id;

  [[nodiscard]] SatelliteView& view() const {
    for (SatelliteView& each : of.arrival().views)
      if (each.line.id == id) return each;
    throw InputError(fmt::format("{} was removed from the arrival", gnss::to_string(id)));
  }
};
struct LentPath {
  LentView of;
  std::size_t index;

  [[nodiscard]] Path& path() const {
    std::vector<Path>& paths = of.view().paths.paths;
    if (index < paths.size()) return paths[index];
    throw InputError("the path was removed");
  }
};

double finite(double value, double least, const char* what) {
  if (std::isfinite(value) && value >= least) return value;
  throw InputError(fmt::format("{} of {} is out of range", what, value),
                   fmt::format("give at least {}", least));
}

/// Python's `apply(arrival)`.
class PythonDisturbance final : public disturbance::Disturbance {
 public:
  explicit PythonDisturbance(Held object) : object_(std::move(object)) {}
  void apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) override {
    const py::gil_scoped_acquire gil;
    const auto borrowed = std::make_shared<Borrowed>(Borrowed{&antenna, &arrival});
    struct Return {
      Borrowed& borrowed;
      ~Return() { borrowed.arrival = nullptr; }
    } const back{*borrowed};
    object_.get().attr("apply")(BorrowedArrival{borrowed});
  }

 private:
  Held object_;
};

/// The object of one receiver: made by a factory `make(seed, receiver)`, or the object itself, reset by its
/// method `begin(seed, receiver)`, if it exists.
py::object started(const py::object& object, const char* method, std::uint64_t seed,
                   const std::string& receiver) {
  if (py::hasattr(object, method) && !py::isinstance<py::type>(object)) {
    if (py::hasattr(object, "begin")) object.attr("begin")(seed, receiver);
    return object;
  }
  return object(seed, receiver);
}

disturbance::DisturbanceSource source_of(const Held& object) {
  const std::string name = py::repr(object.get()).cast<std::string>();
  return {name, [object](std::uint64_t seed, const std::string& receiver) {
            const py::gil_scoped_acquire gil;
            return std::make_unique<PythonDisturbance>(Held(started(object.get(), "apply", seed, receiver)));
          }};
}

/// gain(elevation_rad, carrier_hz) -> (rhcp_dbic, lhcp_dbic), sampled once at each degree.
signal::AntennaPattern pattern_of(const py::object& antenna) {
  const auto rows = [&](double carrier_hz) {
    std::vector<signal::PatternPoint> points;
    for (int deg = -90; deg <= 90; ++deg) {
      const py::tuple gain = py::tuple(antenna(geodesy::radians(deg), carrier_hz));
      if (gain.size() != 2)
        throw InputError("the antenna does not return a pair of gains", "return (rhcp_dbic, lhcp_dbic)");
      points.push_back({static_cast<double>(deg), gain[0].cast<double>(), gain[1].cast<double>()});
    }
    return points;
  };
  return {"Python's own", rows(1575.42e6), rows(1227.60e6)};
}

/// The input of a solver, as arrays; satellite positions are at transmission, in the axes of reception.
struct Problem {
  geodesy::GpsTime time;
  std::vector<std::string> satellites;
  py::object position_ecef_m, range_m, sigma_m, cn0_dbhz, doppler_hz, start_ecef_m;
};

template <typename Value>
py::object numbers(const std::vector<positioning::RangedSatellite>& satellites, const Value& value) {
  std::vector<double> all;
  all.reserve(satellites.size());
  for (const positioning::RangedSatellite& s : satellites) all.push_back(value(s));
  return owning_array(std::move(all));
}

positioning::Fix solve(const Held& solver, geodesy::GpsTime time,
                       const std::vector<positioning::Measurement>& measurements, const orbit::Sky& sky,
                       const positioning::FixOptions& options,
                       const std::map<gnss::System, gnss::Klobuchar>& klobuchar) {
  std::vector<positioning::RangedSatellite> satellites;
  positioning::range_satellites(time, measurements, sky, options, satellites);
  const auto own = positioning::solve_fix(time, satellites, options, klobuchar, Eigen::Vector3d::Zero());
  // Satellites are rotated by the Earth's rotation during the flight time, which needs a position: the
  // engine's own, or a point below all satellites.
  Eigen::Vector3d start = own.position_ecef;
  if (!own.solved()) {
    start.setZero();
    for (const auto& s : satellites) start += s.state.position_m.normalized();
    start = start.norm() > 0 ? start.normalized() * 6.371e6 : Eigen::Vector3d(6.371e6, 0, 0);
  }
  for (positioning::RangedSatellite& s : satellites)
    for (int i = 0; i < 3; ++i) positioning::update_satellite_geometry(s, start);
  if (own.solved()) positioning::look_up(satellites, start, time, options, klobuchar);
  std::erase_if(satellites, [](const auto& s) { return !s.above_mask; });

  const py::gil_scoped_acquire gil;
  Problem problem;
  problem.time = time;
  std::vector<double> points;
  for (const positioning::RangedSatellite& s : satellites) {
    problem.satellites.push_back(gnss::to_string(s.measured->id));
    points.insert(points.end(), {s.position.x(), s.position.y(), s.position.z()});
  }
  const auto n = static_cast<py::ssize_t>(satellites.size());
  problem.position_ecef_m = owning_array(std::move(points), {n, 3});
  problem.range_m = numbers(satellites, [](const auto& s) { return s.pseudorange_m - s.space_m; });
  problem.sigma_m = numbers(satellites, [](const auto& s) { return s.sigma_m; });
  problem.cn0_dbhz = numbers(satellites, [](const auto& s) { return s.measured->cn0_dbhz.value_or(kNan); });
  problem.doppler_hz =
      numbers(satellites, [](const auto& s) { return s.measured->doppler_hz.value_or(kNan); });
  problem.start_ecef_m = own.solved() ? py::object(array_of(own.position_ecef).attr("copy")()) : py::none();
  const py::object result = solver.get().attr("solve")(problem);
  if (result.is_none()) {
    positioning::Fix none;
    none.status = satellites.size() < 4 ? positioning::FixStatus::TooFewSatellites
                                        : positioning::FixStatus::NotConverged;
    none.available = own.available;
    return none;
  }
  return positioning::fix_at(vector3(result, "the solver's position"), time, measurements, sky, options,
                             klobuchar);
}

/// weighting(satellite, elevation_rad, cn0_dbhz, sigma_m) -> sigma_m
receiver::ModelSource models_of(const py::object& weighting, const py::object& solver) {
  const Held weigh(weighting), solves(solver);
  return [weigh, solves](std::uint64_t seed, const std::string& name) {
    const py::gil_scoped_acquire gil;
    receiver::UserModels models;
    if (!weigh.get().is_none())
      models.sigma_m = [weigh](const positioning::Measurement& m, double elevation_rad) {
        const py::gil_scoped_acquire lock;
        return weigh.get()(gnss::to_string(m.id), elevation_rad, m.cn0_dbhz.value_or(kNan), m.sigma_m)
            .cast<double>();
      };
    if (!solves.get().is_none()) {
      const Held solver_of_this(started(solves.get(), "solve", seed, name));
      models.solve = [solver_of_this](geodesy::GpsTime time, const auto& measurements, const orbit::Sky& sky,
                                      const auto& options, const auto& klobuchar) {
        return solve(solver_of_this, time, measurements, sky, options, klobuchar);
      };
    }
    return models;
  };
}

}  // namespace

void put_models(const py::object& models, simulation::ReceiverConfig& receiver) {
  if (models.is_none()) return;
  for (const char* part : {"disturbances", "antenna", "weighting", "solver"})
    if (!py::hasattr(models, part))
      throw InputError("the models are not a canyon.Models", "give a canyon.Models");
  for (const py::handle each : models.attr("disturbances")) {
    const py::object object = py::reinterpret_borrow<py::object>(each);
    if (!py::hasattr(object, "apply") && PyCallable_Check(object.ptr()) == 0) {
      throw InputError(fmt::format("{} is not a disturbance", py::repr(object).cast<std::string>()),
                       "give an object with apply(arrival), or a factory make(seed, receiver)");
    }
    receiver.disturbances.push_back(source_of(Held(object)));
  }
  const py::object antenna = models.attr("antenna"), weighting = models.attr("weighting"),
                   solver = models.attr("solver");
  for (const auto& [what, object] : {std::pair("antenna", antenna), std::pair("weighting", weighting)})
    if (!object.is_none() && PyCallable_Check(object.ptr()) == 0)
      throw InputError(fmt::format("the {} is not a function", what), "see docs/python.md for an example");
  if (!solver.is_none() && !py::hasattr(solver, "solve") && PyCallable_Check(solver.ptr()) == 0) {
    throw InputError("the solver has no method solve()",
                     "give an object with solve(problem), or a factory make(seed, receiver)");
  }
  if (!antenna.is_none()) receiver.options.signal.antenna = pattern_of(antenna);
  if (!weighting.is_none() || !solver.is_none()) receiver.models = models_of(weighting, solver);
}

void put_models(const py::object& models, std::vector<simulation::ReceiverConfig>& receivers) {
  if (!py::isinstance<py::dict>(models)) {
    for (simulation::ReceiverConfig& receiver : receivers) put_models(models, receiver);
    return;
  }
  for (const auto& [key, value] : py::reinterpret_borrow<py::dict>(models)) {
    const std::string name = py::str(key).cast<std::string>();
    const auto found = std::find_if(receivers.begin(), receivers.end(),
                                    [&](const auto& receiver) { return receiver.options.name == name; });
    if (found == receivers.end())
      throw InputError(fmt::format("models are given for '{}', but there is no such receiver", name));
    put_models(py::reinterpret_borrow<py::object>(value), *found);
  }
}

void bind_models(py::module_& m) {
  using P = LentPath;
  using V = LentView;
  using A = BorrowedArrival;
  py::class_<P>(m, "ArrivingPath", "An arriving path of a satellite.")
      .def_property_readonly("kind", [](const P& p) { return std::string(propagation::name(p.path().kind)); })
      .def_property_readonly("order", [](const P& p) { return p.path().order; })
      .def_property_readonly(
          "arrival", [](const P& p) { return array_of(p.path().arrival); },
          "Unit vector, east, north, up, towards the direction of arrival.")
      .def_property(
          "excess_m", [](const P& p) { return p.path().excess_m; },
          [](const P& p, double v) { p.path().excess_m = finite(v, 0, "an excess path"); },
          "Excess path [m], at least 0.")
      .def_property(
          "amplitude_factor", [](const P& p) { return p.path().amplitude_factor; },
          [](const P& p, double v) { p.path().amplitude_factor = finite(v, 0, "an amplitude factor"); },
          "Multiplies the path's amplitude, at least 0.");
  py::class_<V>(m, "ArrivingSatellite", "A satellite above the horizon of an antenna.")
      .def_property_readonly("name", [](const V& v) { return gnss::to_string(v.id); })
      .def_property_readonly("azimuth_rad", [](const V& v) { return v.view().line.azimuth_rad; })
      .def_property_readonly("elevation_rad", [](const V& v) { return v.view().line.elevation_rad; })
      .def_property_readonly(
          "visibility", [](const V& v) { return std::string(propagation::name(v.view().paths.visibility)); })
      .def_property_readonly("paths",
                             [](const V& v) {
                               std::vector<LentPath> paths;
                               for (std::size_t i = 0; i < v.view().paths.paths.size(); ++i)
                                 paths.push_back({v, i});
                               return paths;
                             })
      .def(
          "keep_paths",
          [](const V& v, const std::vector<std::size_t>& indices) {
            std::vector<Path> kept;
            kept.reserve(indices.size());
            for (const std::size_t i : indices) kept.push_back(v.view().paths.paths.at(i));
            v.view().paths.paths = std::move(kept);
          },
          "indices"_a, "Keeps these paths in this order; removes the others.");
  py::class_<A>(m, "Arrival", "The signals arriving at an antenna at one instant, valid during one call.")
      .def_property_readonly("time", [](const A& a) { return datetime(a.antenna().time); })
      .def_property_readonly("gps_ns", [](const A& a) { return a.antenna().time.nanoseconds(); })
      .def_property_readonly("antenna_enu_m", [](const A& a) { return array_of(a.arrival().antenna_enu); })
      .def_property_readonly("velocity_ecef_mps",
                             [](const A& a) { return array_of(a.antenna().velocity_ecef); })
      .def_property_readonly(
          "placement",
          [](const A& a) { return std::string(encoding::containment_word(a.arrival().containment)); })
      .def_property_readonly("satellites",
                             [](const A& a) {
                               std::vector<LentView> views;
                               for (const SatelliteView& view : a.arrival().views)
                                 views.push_back({a, view.line.id});
                               return views;
                             })
      .def(
          "remove",
          [](const A& a, const std::string& name) {
            const auto id = gnss::parse_satellite(name);
            if (id) std::erase_if(a.arrival().views, [&](const auto& view) { return view.line.id == *id; });
          },
          "satellite"_a)
      .def(
          "interfere",
          [](const A& a, double power_dbw, const py::object& towards, double width_hz) {
            propagation::Interference wave;
            wave.spectrum.shape = propagation::Spectrum::Shape::Band;
            wave.spectrum.width_hz = finite(width_hz, 1, "a width in Hz");
            wave.power_dbw = finite(power_dbw, -400, "a power in dBW");
            wave.arrival = vector3(towards, "the direction").normalized();
            a.arrival().interference.push_back(wave);
          },
          "power_dbw"_a, "towards"_a, "width_hz"_a = 20e6,
          "Adds noise around L1: its power at an isotropic antenna, and its direction of arrival (ENU).");
  py::class_<Problem>(m, "Problem", "Ranges of one epoch, for a solver.")
      .def_property_readonly("time", [](const Problem& p) { return datetime(p.time); })
      .def_property_readonly("gps_ns", [](const Problem& p) { return p.time.nanoseconds(); })
      .def_readonly("satellites", &Problem::satellites)
      .def_readonly("position_ecef_m", &Problem::position_ecef_m,
                    "(n, 3): satellites at transmission, in the Earth's axes of reception.")
      .def_readonly("range_m", &Problem::range_m,
                    "(n,): pseudoranges minus satellite clocks and atmosphere: distance and receiver clock, "
                    "one per system.")
      .def_readonly("sigma_m", &Problem::sigma_m)
      .def_readonly("cn0_dbhz", &Problem::cn0_dbhz)
      .def_readonly("doppler_hz", &Problem::doppler_hz)
      .def_readonly("start_ecef_m", &Problem::start_ecef_m,
                    "The engine's own least squares; None if that has no solution.");
}

}  // namespace canyon::python
