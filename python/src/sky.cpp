#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"
#include "python/src/binding.hpp"
#include "python/src/settings.hpp"

namespace canyon::python {
namespace {

std::vector<std::string> names_of(const std::vector<gnss::SatelliteId>& ids) {
  std::vector<std::string> names;
  for (const gnss::SatelliteId id : ids) names.push_back(gnss::to_string(id));
  return names;
}

/// Azimuth, elevation, range and position of every satellite at every time, from one position.
py::dict compute_look_angles(const SkyHandle& self, const py::object& when, const py::object& where) {
  const std::vector<geodesy::GpsTime> times = times_of(when);
  const orbit::Observer observer(geodesy::ecef_from_geodetic(position_of(where, "the place")));
  const std::size_t n = times.size() * self.satellites.size();
  std::vector<double> azimuth(n, kNan), elevation(n, kNan), range(n, kNan), position(3 * n, kNan);
  {
    const py::gil_scoped_release release;
    std::size_t i = 0;
    for (const geodesy::GpsTime t : times) {
      for (const gnss::SatelliteId id : self.satellites) {
        if (const auto line = orbit::line_of_sight(*self.built.sky, id, t, observer)) {
          azimuth[i] = line->azimuth_rad;
          elevation[i] = line->elevation_rad;
          range[i] = line->range_m;
          for (std::size_t k = 0; k < 3; ++k)
            position[3 * i + k] = line->position_at_reception_m[static_cast<Eigen::Index>(k)];
        }
        ++i;
      }
    }
  }
  const std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(times.size()),
                                       static_cast<py::ssize_t>(self.satellites.size())};
  return py::dict("azimuth_rad"_a = owning_array(std::move(azimuth), shape),
                  "elevation_rad"_a = owning_array(std::move(elevation), shape),
                  "range_m"_a = owning_array(std::move(range), shape),
                  "position_ecef_m"_a = owning_array(std::move(position), {shape[0], shape[1], 3}));
}

SkyPtr sky_of(options::Node settings, const std::filesystem::path& folder, geodesy::GpsTime begin,
              geodesy::GpsTime end, const geodesy::Geodetic& seen_from) {
  const bool here = folder == std::filesystem::current_path();
  const auto config = read_tree<simulation::SkyConfig>(settings, "sky", here ? "" : folder / "");
  const py::gil_scoped_release release;
  simulation::BuiltSky built = simulation::build_sky(config, begin, end, seen_from);
  auto satellites = built.sky->satellites();
  return std::make_shared<SkyHandle>(
      SkyHandle{std::move(built), std::move(satellites), std::move(settings), folder, begin, end, seen_from});
}

}  // namespace

void bind_sky(py::module_& m) {
  py::class_<SkyHandle, SkyPtr>(m, "Sky", R"(Satellites over a span of time.

Parameters
----------
begin, end : time
    Between which it is asked; `end` is `begin` where left out. Text such as ``"2026-06-01T08:00:00Z"``,
    ``datetime`` or ``numpy.datetime64`` (UTC).
place : (latitude_deg, longitude_deg, height_m), optional
    From where frozen satellites are seen.
**settings
    The keys below ``sky:`` in a scenario: ``navigation``, ``sp3``, ``nominal``, ``frozen``, ``systems``.

Examples
--------
>>> import canyon
>>> sky = canyon.Sky("2026-06-01T08:00:00Z", systems=["GPS"])
>>> look = sky.look("2026-06-01T08:00:00Z", (48.1, 11.6, 520))
>>> look["elevation_rad"].shape == (1, len(sky.satellites))
True)")
      .def(py::init([](const py::object& begin, const py::object& end, const py::object& position,
                       const py::kwargs& settings) {
             const geodesy::GpsTime from = time_of(begin);
             SkyPtr sky =
                 sky_of(tree_of(settings.empty() ? py::dict("nominal"_a = true) : py::dict(settings)),
                        std::filesystem::current_path(), from, end.is_none() ? from : time_of(end),
                        position.is_none() ? geodesy::Geodetic{} : position_of(position, "place"));
             warn_of(sky->built.report);
             return sky;
           }),
           "begin"_a, "end"_a = py::none(), "place"_a = py::none())
      .def(py::pickle(
          [](const SkyHandle& self) {
            return py::make_tuple(object_of(self.settings, true), self.folder, self.begin.nanoseconds(),
                                  self.end.nanoseconds(), self.seen_from.latitude_rad,
                                  self.seen_from.longitude_rad, self.seen_from.height_m);
          },
          [](const py::tuple& state) {
            return sky_of(tree_of(state[0]), state[1].cast<std::filesystem::path>(), time_of(state[2]),
                          time_of(state[3]),
                          {state[4].cast<double>(), state[5].cast<double>(), state[6].cast<double>()});
          }))
      .def_property_readonly(
          "satellites", [](const SkyHandle& self) { return names_of(self.satellites); },
          "list of str: \"G01\", \"E05\", ..., satellites that it may have.")
      .def_property_readonly(
          "warnings", [](const SkyHandle& self) { return self.built.report.warnings(); },
          "list of str: Stale ephemerides and similar warnings.")
      .def("look", &compute_look_angles, "times"_a, "place"_a,
           R"(Where all satellites stand, above the horizon or not.

Parameters
----------
times : time or sequence of times
place : (latitude_deg, longitude_deg, height_m)

Returns
-------
dict
    ``azimuth_rad`` (from north, clockwise), ``elevation_rad`` and ``range_m`` of shape
    (times, satellites), ``position_ecef_m`` with a further axis of 3; NaN without an ephemeris.)");
}

}  // namespace canyon::python
