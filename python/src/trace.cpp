#include <fmt/format.h>

#include "canyon/base/input_error.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/trace_points.hpp"
#include "python/src/binding.hpp"
#include "python/src/settings.hpp"

namespace canyon::python {
namespace {

using simulation::TracedSatellite;

/// A path in NumPy's layout.
struct PathRow {
  std::uint32_t point_index, satellite;
  std::uint8_t kind, order;
  double excess_m;
  std::array<double, 3> arrival, point, far_point;
  double incidence_rad, foliage_depth_m;
};

/// A city with a propagator: objects of trace() that are made once. The scene outlives its users.
class Tracer {
 public:
  Tracer(std::shared_ptr<simulation::CityScene> scene, const py::kwargs& settings)
      : scene_(std::move(scene)),
        propagator_(scene_->city.mesh, scene_->scene,
                    read_tree<propagation::PropagationOptions>(tree_of(settings), "propagation"),
                    scene_->city.seed) {}

  /// Satellites of a sky at times, or satellites in the given directions.
  py::object at(const py::object& where, const SkyPtr& sky, const py::object& when, const py::object& whom,
                const py::object& directions, int threads, bool with_paths) const {
    if ((sky == nullptr) == directions.is_none() || (sky != nullptr && when.is_none()))
      throw py::type_error("give a sky with times, or directions");
    if (sky == nullptr) return towards(where, directions, threads, with_paths);
    const Points points(where, "places");
    const std::vector<geodesy::GpsTime> times = times_of(when);
    std::vector<gnss::SatelliteId> satellites = sky->satellites;
    if (!whom.is_none()) {
      satellites.clear();
      for (const py::handle name : whom) {
        const std::string text = py::str(name).cast<std::string>();
        const auto id = gnss::parse_satellite(text);
        if (!id)
          throw InputError(fmt::format("'{}' is not a satellite", text), "use a name such as G05, E11, C23");
        satellites.push_back(*id);
      }
    }
    const simulation::Environment environment(scene_, sky->built.sky, sky->built.navigation.klobuchar);
    return run(points, satellites.size(), threads, with_paths, [&](auto& rows, const auto& options) {
      simulation::trace_points(environment, propagator_, times, points.span(), satellites, rows, options);
    });
  }

 private:
  py::object towards(const py::object& where, const py::object& whither, int threads, bool with_paths) const {
    const Points points(where, "places"), directions(whither, "directions");
    const simulation::Environment environment(scene_, std::make_shared<NoSky>());
    return run(points, directions.size(), threads, with_paths, [&](auto& rows, const auto& options) {
      simulation::trace_points(environment, propagator_, points.span(), directions.span(), rows, options);
    });
  }

  class NoSky final : public orbit::Sky {
   public:
    [[nodiscard]] std::vector<gnss::SatelliteId> satellites() const override { return {}; }
    [[nodiscard]] std::optional<orbit::SatelliteState> state(gnss::SatelliteId,
                                                             geodesy::GpsTime) const override {
      return std::nullopt;
    }
    [[nodiscard]] std::string source(gnss::SatelliteId, geodesy::GpsTime) const override { return "none"; }
  };

  template <typename Trace>
  static py::object run(const Points& points, std::size_t satellites, int threads, bool with_paths,
                        const Trace& trace) {
    std::vector<TracedSatellite> rows(points.size() * satellites);
    std::vector<simulation::TracedPath> paths;
    // Ctrl-C returns no partial table: callers can request parts.
    (void)interruptible([&](Signals& signals) {
      simulation::TracePointsOptions options;
      options.threads = threads;
      if (with_paths) options.paths = &paths;
      options.progress = [&](std::size_t, std::size_t) { signals.compute_look_angles(); };
      trace(rows, options);
      return true;
    });
    py::array table = owning_array(
        std::move(rows), {static_cast<py::ssize_t>(points.size()), static_cast<py::ssize_t>(satellites)});
    if (!with_paths) return table;
    std::vector<PathRow> path_rows;
    path_rows.reserve(paths.size());
    const auto three = [](const Eigen::Vector3d& v) { return std::array<double, 3>{v.x(), v.y(), v.z()}; };
    for (const simulation::TracedPath& each : paths) {
      const propagation::Path& path = each.path;
      path_rows.push_back({each.point_index, each.satellite, static_cast<std::uint8_t>(path.kind), path.order,
                           path.excess_m, three(path.arrival), three(path.point), three(path.far_point),
                           path.incidence_rad(), path.foliage_depth_m});
    }
    return py::make_tuple(table, owning_array(std::move(path_rows)));
  }

  std::shared_ptr<simulation::CityScene> scene_;
  propagation::Propagator propagator_;
};

}  // namespace

void bind_trace(py::module_& m) {
  // Names of fields are a contract; those of members need not be equal.
  PYBIND11_NUMPY_DTYPE_EX(TracedSatellite, azimuth_rad, "azimuth_rad", elevation_rad, "elevation_rad",
                          excess_m, "excess_m", visibility, "visibility", above_horizon, "above_horizon",
                          containment, "placement", paths, "paths");
  PYBIND11_NUMPY_DTYPE_EX(PathRow, point_index, "place", satellite, "satellite", kind, "kind", order, "order",
                          excess_m, "excess_m", arrival, "arrival", point, "point", far_point, "far_point",
                          incidence_rad, "incidence_rad", foliage_depth_m, "foliage_depth_m");
  py::class_<Tracer>(m, "Tracer", R"(Traces satellites in one city. Its facets are prepared once.

Parameters
----------
city : City
**propagation
    The keys below ``propagation:`` in a scenario: ``model``, ``reflection_order``, ...)")
      .def(py::init<std::shared_ptr<simulation::CityScene>, const py::kwargs&>(), "city"_a)
      .def("at", &Tracer::at, "places"_a, "sky"_a = nullptr, "times"_a = py::none(),
           "satellites"_a = py::none(), "directions"_a = py::none(), "threads"_a = 0, "paths"_a = false,
           "Traces at positions: see :func:`canyon.trace` for the arguments.");
}

}  // namespace canyon::python
