#include <fmt/format.h>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/city_file.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "python/src/binding.hpp"
#include "python/src/settings.hpp"

namespace canyon::python {
namespace {

using simulation::CityScene;
using CityPtr = std::shared_ptr<CityScene>;

/// A city with queries: rays, terrain, containment. The engine's arrays in, arrays out.
py::array containments(const CityScene& self, const py::object& positions) {
  const Points points(positions, "places");
  std::vector<std::uint8_t> result(points.size());
  {
    const py::gil_scoped_release release;
    for (std::size_t i = 0; i < points.size(); ++i)
      result[i] = static_cast<std::uint8_t>(self.scene.containment(points.span()[i]));
  }
  return owning_array(std::move(result));
}

py::dict cast(const CityScene& self, const py::object& from, const py::object& to) {
  const Points origins(from, "origins"), directions(to, "directions");
  const std::size_t n = std::max(origins.size(), directions.size());
  const auto fits = [n](const Points& points) { return points.size() == n || points.size() == 1; };
  if (!fits(origins) || !fits(directions)) {
    throw InputError(fmt::format("{} origins and {} directions", origins.size(), directions.size()),
                     "give the same number of both, or one of either");
  }
  std::vector<double> range(n, kNan), normal(3 * n, kNan);
  std::vector<std::int64_t> triangle(n, -1);
  {
    const py::gil_scoped_release release;
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector3d& direction = directions.span()[directions.size() == 1 ? 0 : i];
      if (!(direction.norm() > 0)) throw InputError(fmt::format("direction {} has zero length", i));
      const auto hit = self.scene.cast({origins.span()[origins.size() == 1 ? 0 : i], direction.normalized()});
      if (!hit) continue;
      range[i] = hit->range_m;
      triangle[i] = hit->triangle;
      for (std::size_t k = 0; k < 3; ++k) normal[3 * i + k] = hit->normal[static_cast<Eigen::Index>(k)];
    }
  }
  const auto rows = static_cast<py::ssize_t>(n);
  return py::dict("range_m"_a = owning_array(std::move(range)),
                  "triangle"_a = owning_array(std::move(triangle)),
                  "normal"_a = owning_array(std::move(normal), {rows, 3}));
}

py::array terrain(const CityScene& self, const py::object& positions) {
  const Points points(positions, "places");
  std::vector<double> result;
  for (const Eigen::Vector3d& p : points.span())
    result.push_back(self.scene.terrain_height(p.x(), p.y()).value_or(kNan));
  return owning_array(std::move(result));
}

template <typename Convert>
py::array converted(const py::object& from, const char* what, const Convert& convert) {
  const Points points(from, what);
  std::vector<double> result;
  result.reserve(3 * points.size());
  for (const Eigen::Vector3d& p : points.span()) {
    const Eigen::Vector3d q = convert(p);
    result.insert(result.end(), {q.x(), q.y(), q.z()});
  }
  if (points.single()) return owning_array(std::move(result), {3});
  return owning_array(std::move(result), {static_cast<py::ssize_t>(points.size()), 3});
}

/// The result of make(city), made once for each city.
template <typename Make>
py::object once(const py::object& self, const char* name, const Make& make) {
  const py::dict kept = py::module_::import("canyon.city").attr("KEPT").attr("setdefault")(self, py::dict());
  if (!kept.contains(name)) kept[name] = make(self.cast<const CityScene&>());
  return kept[name];
}

py::dict summary(const CityScene& self) {
  const city::CitySummary s = city::summarize(self.city);
  return py::dict("buildings"_a = s.buildings, "triangles"_a = s.triangles,
                  "terrain_triangles"_a = s.terrain_triangles, "highest_roof_m"_a = s.highest_roof_m,
                  "built_area_fraction"_a = s.built_area_fraction, "min_enu_m"_a = array_of(s.bounds.min),
                  "max_enu_m"_a = array_of(s.bounds.max));
}

py::object named_object(const city::Object& object) {
  static constexpr std::array<const char*, 4> kSurfaces{"building", "terrain", "foliage", "vehicle"};
  return py::module_::import("canyon.city")
      .attr("CityObject")(object.name, kSurfaces.at(static_cast<std::size_t>(object.surface)),
                          object.first_triangle, object.triangle_count);
}

py::list objects(const CityScene& self) {
  py::list list;
  for (const city::Object& object : self.city.mesh.objects) list.append(named_object(object));
  return list;
}

py::object object_of_triangle(const CityScene& self, std::int64_t triangle) {
  for (const city::Object& object : self.city.mesh.objects) {
    const auto first = static_cast<std::int64_t>(object.first_triangle);
    if (triangle >= first && triangle < first + static_cast<std::int64_t>(object.triangle_count))
      return named_object(object);
  }
  throw py::index_error(fmt::format("triangle {} of {}", triangle, self.city.mesh.triangles.size()));
}

CityPtr city_of_settings(const py::dict& settings) {
  const auto config = read_tree<simulation::CityConfig>(tree_of(settings), "city");
  return scene_of([&] { return simulation::load_city(config); });
}

}  // namespace

void bind_city(py::module_& m) {
  py::class_<CityScene, CityPtr>(m, "City",
                                 R"(A city: static surfaces in the east-north-up frame about its origin [m].

Parameters
----------
**settings
    The keys below ``city:`` in a scenario (docs/scenario.md): ``mesh``, ``file``, ``osm``, ``synthetic``
    or ``open``, and those that belong to them.

Examples
--------
>>> import canyon
>>> city = canyon.City(
...     synthetic={"blocks_east": 2, "blocks_north": 2, "seed": 7},
...     origin={"latitude_deg": 22.3, "longitude_deg": 114.17, "height_m": 0},
... )
>>> city.triangles.shape[1], city.vertices.flags.writeable
(3, False)
>>> hit = city.cast([0, 0, 2], [1, 0.3, 0.05])
>>> bool(hit["range_m"][0] > 0)
True)")
      .def(py::init([](const py::kwargs& settings) { return city_of_settings(settings); }))
      .def_static(
          "load",
          [](const std::filesystem::path& path, const py::object& origin) {
            std::optional<geodesy::Geodetic> position;
            if (!origin.is_none()) position = position_of(origin, "origin");
            return scene_of(
                [&] { return simulation::load_city(simulation::city_config(path.string(), position)); });
          },
          "path"_a, "origin"_a = py::none(), R"(A city of any file that Canyon reads, by its name.

Parameters
----------
path : path
    OpenStreetMap, CityGML, CityJSON, mesh, Gazebo world, or Canyon's own file (docs/city.md).
origin : (latitude_deg, longitude_deg, height_m), optional
    The place of a mesh's zero, or the zero that a map shall get.)")
      .def_static(
          "from_osm",
          [](const py::object& files, const py::kwargs& settings) {
            const bool one = py::isinstance<py::str>(files) || py::hasattr(files, "__fspath__");
            py::dict all("osm"_a = one ? py::list(py::make_tuple(files)) : py::list(files));
            all.attr("update")(settings);
            return city_of_settings(all);
          },
          "files"_a, R"(A city of OpenStreetMap files.

Parameters
----------
files : path or list of paths
    OpenStreetMap (.osm, .osm.gz, .osm.bz2, .osm.pbf), CityGML or CityJSON.
**settings
    Further keys below ``city:``: ``origin``, ``bbox``, ``terrain``, ... (docs/city.md).)")
      .def_static(
          "of_scenario",
          [](const py::object& scenario) {
            const ScenarioPtr tree = scenario_of(scenario);
            return scene_of([&] { return simulation::load_city(tree->scenario); });
          },
          "scenario"_a, "The city of a scenario: random facades and position offset by its seed.")
      .def_static(
          "_read",
          [](const std::filesystem::path& path, std::uint64_t seed) -> std::shared_ptr<CityScene> {
            city::City city = city::read_city_file(path);
            city.seed = seed;
            return std::make_shared<WithInputs<CityScene>>(std::move(city));
          },
          "path"_a, "seed"_a)
      .def_property_readonly("_seed", [](const CityScene& self) { return self.city.seed; })
      .def(
          "save",
          [](CityScene& self, const std::filesystem::path& path) {
            const InputFiles::Scope scope(inputs_of(self));
            city::write_city_file(path, self.city);
          },
          "path"_a, "Writes Canyon's own city file (.canyon), which loads quickly.")
      .def_property_readonly(
          "name", [](const CityScene& self) { return self.city.name; }, "str: Its name in the source.")
      .def_property_readonly(
          "notes", [](const CityScene& self) { return self.city.notes.lines(); },
          "list of str: Data dropped, guessed or repaired by the import.")
      .def_property_readonly(
          "origin", [](const CityScene& self) { return degrees_of(self.city.frame.origin()); },
          "tuple: (latitude_deg, longitude_deg, height_m) of the frame's origin, WGS 84.")
      .def_property_readonly(
          "summary", [](const py::object& self) { return once(self, "summary", summary); },
          "dict: buildings, triangles, highest_roof_m, built_area_fraction [1], min_enu_m, max_enu_m, ...")
      .def_property_readonly(
          "objects", [](const py::object& self) { return once(self, "objects", objects); },
          "list of CityObject: All triangles, in order.")
      .def_property_readonly(
          "vertices",
          [](const py::object& self) {
            const auto& vertices = self.cast<const CityScene&>().city.mesh.vertices;
            static const double kNone = 0;
            return view_of(vertices.empty() ? &kNone : vertices.front().data(),
                           {static_cast<py::ssize_t>(vertices.size()), 3}, self);
          },
          "(n, 3) array [m]: East, north, up. The engine's own memory, read-only.")
      .def_property_readonly(
          "triangles",
          [](const py::object& self) {
            const auto& triangles = self.cast<const CityScene&>().city.mesh.triangles;
            static const std::uint32_t kNone = 0;
            return view_of(triangles.empty() ? &kNone : triangles.front().data(),
                           {static_cast<py::ssize_t>(triangles.size()), 3}, self);
          },
          "(m, 3) array: Indices into :attr:`vertices`, counter-clockwise from outside. Read-only, not "
          "copied.")
      .def_property_readonly(
          "materials",
          [](const py::object& self) {
            const auto& materials = self.cast<const CityScene&>().city.mesh.materials;
            static_assert(sizeof(city::Material) == 1);
            return view_of(reinterpret_cast<const std::uint8_t*>(materials.data()),
                           {static_cast<py::ssize_t>(materials.size())}, self);
          },
          "(m,) array: Index into :data:`canyon.MATERIALS` of each triangle. Read-only, not copied.")
      .def("object_of", &object_of_triangle, "triangle"_a,
           "The CityObject of a triangle, by its index into :attr:`triangles`.")
      .def("placement", &containments, "places"_a,
           "Containment of positions (n, 3), east, north, up [m]: free, inside a building or under the "
           "terrain: "
           "indices into :data:`canyon.PLACEMENTS`.")
      .def("terrain", &terrain, "places"_a,
           "Height of the terrain [m] at positions, NaN if there is none. Heights of the positions are "
           "ignored.")
      .def("cast", &cast, "origins"_a, "directions"_a, R"(First hits of rays.

Parameters
----------
origins, directions : (n, 3) array or (3,)
    As many of both, or one of either. Directions need no unit length.

Returns
-------
dict
    ``range_m`` (n,), NaN without a hit; ``triangle`` (n,), -1 without; ``normal`` (n, 3).)")
      .def(
          "enu_of",
          [](const CityScene& self, const py::object& points) {
            return converted(points, "places", [&](const Eigen::Vector3d& p) {
              const auto position = geodesy::Geodetic::from_degrees(p.x(), p.y(), p.z());
              geodesy::check_geodetic(position, "a place");
              return self.city.frame.local_from_geodetic(position);
            });
          },
          "places"_a, "East, north, up [m] of (latitude_deg, longitude_deg, height_m), (3,) or (n, 3).")
      .def(
          "geodetic_of",
          [](const CityScene& self, const py::object& enu) {
            return converted(enu, "places", [&](const Eigen::Vector3d& p) {
              const geodesy::Geodetic position = self.city.frame.geodetic_from_local(p);
              return Eigen::Vector3d(geodesy::degrees(position.latitude_rad),
                                     geodesy::degrees(position.longitude_rad), position.height_m);
            });
          },
          "enu"_a, "(latitude_deg, longitude_deg, height_m) of east, north, up [m], (3,) or (n, 3).")
      .def("__repr__", [](const CityScene& self) {
        return fmt::format("<canyon.City {}: {} triangles>",
                           py::repr(py::str(self.city.name)).cast<std::string>(),
                           self.city.mesh.triangles.size());
      });
  m.def("material_names", [] {
    std::vector<std::string> names;
    for (int i = 0; i <= static_cast<int>(city::Material::Foliage); ++i) {
      names.emplace_back(city::material_name(static_cast<city::Material>(i)));
    }
    return names;
  });
}

}  // namespace canyon::python
