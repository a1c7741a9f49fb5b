#include <fmt/format.h>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/city_file.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/simulation/city_scene.hpp"
#include "canyon/simulation/load_city.hpp"
#include "python/src/arrays.hpp"
#include "python/src/settings.hpp"

namespace canyon::python {
namespace {

using simulation::CityScene;
using CityPtr = std::shared_ptr<CityScene>;

CityPtr scene_of(city::City city) {
  return std::make_shared<CityScene>(std::move(city));
}

/// Places and what lies there: cast rays, ask for terrain and rooms. The engine's arrays in, arrays out.
py::array placements(const CityScene& self, const py::object& places) {
  const Points points(places, "places");
  std::vector<std::uint8_t> result(points.size());
  {
    const py::gil_scoped_release release;
    for (std::size_t i = 0; i < points.size(); ++i) {
      result[i] = static_cast<std::uint8_t>(self.scene.placement(points.span()[i]));
    }
  }
  return owning_array(std::move(result));
}

py::dict cast(const CityScene& self, const py::object& from, const py::object& to) {
  const Points origins(from, "origins"), directions(to, "directions");
  const std::size_t n = std::max(origins.size(), directions.size());
  const auto fits = [n](const Points& points) { return points.size() == n || points.size() == 1; };
  if (!fits(origins) || !fits(directions)) {
    throw InputError(fmt::format("{} origins and {} directions", origins.size(), directions.size()),
                     "give as many of both, or one of either");
  }
  std::vector<double> range(n, kNan), normal(3 * n, kNan);
  std::vector<std::int64_t> triangle(n, -1);
  {
    const py::gil_scoped_release release;
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector3d& direction = directions.span()[directions.size() == 1 ? 0 : i];
      if (!(direction.norm() > 0)) throw InputError(fmt::format("direction {} has no length", i));
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

py::array terrain(const CityScene& self, const py::object& places) {
  const Points points(places, "places");
  std::vector<double> result;
  for (const Eigen::Vector3d& p : points.span()) {
    result.push_back(self.scene.terrain_height(p.x(), p.y()).value_or(kNan));
  }
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

py::dict summary(const CityScene& self) {
  const city::CitySummary s = city::summarize(self.city);
  return py::dict("buildings"_a = s.buildings, "triangles"_a = s.triangles,
                  "terrain_triangles"_a = s.terrain_triangles, "highest_roof_m"_a = s.highest_roof_m,
                  "built_area_fraction"_a = s.built_area_fraction, "min_enu_m"_a = array_of(s.bounds.min),
                  "max_enu_m"_a = array_of(s.bounds.max));
}

py::list objects(const CityScene& self) {
  static constexpr std::array<const char*, 4> kSurfaces{"building", "terrain", "foliage", "vehicle"};
  py::list list;
  for (const city::Object& object : self.city.mesh.objects) {
    list.append(py::make_tuple(object.name, kSurfaces.at(static_cast<std::size_t>(object.surface)),
                               object.first_triangle, object.triangle_count));
  }
  return list;
}

}  // namespace

void bind_city(py::module_& m) {
  py::class_<CityScene, CityPtr>(m, "City")
      .def_static(
          "from_settings",
          [](const py::object& settings, std::uint64_t seed) {
            const auto config = read_tree<simulation::CityConfig>(tree_of(settings), "city");
            const py::gil_scoped_release release;
            return scene_of(simulation::load_city(config, seed));
          },
          "settings"_a, "seed"_a = 1)
      .def_static(
          "load",
          [](const std::string& path, const py::object& origin) {
            std::optional<geodesy::Geodetic> place;
            if (!origin.is_none()) place = place_of(origin, "origin");
            const py::gil_scoped_release release;
            return scene_of(simulation::load_city(simulation::city_config(path, place)));
          },
          "path"_a, "origin"_a = py::none())
      .def_static(
          "of_scenario",
          [](const ScenarioTree& scenario) {
            std::vector<std::string> warnings;
            const py::gil_scoped_release release;
            return scene_of(simulation::load_city(scenario.scenario, warnings));
          },
          "scenario"_a)
      .def(
          "save",
          [](const CityScene& self, const std::string& path) { city::write_city_file(path, self.city); },
          "path"_a)
      .def_property_readonly("name", [](const CityScene& self) { return self.city.name; })
      .def_property_readonly("notes", [](const CityScene& self) { return self.city.notes; })
      .def_property_readonly("origin",
                             [](const CityScene& self) { return degrees_of(self.city.frame.origin()); })
      .def_property_readonly("summary", &summary)
      .def_property_readonly("objects", &objects)
      .def_property_readonly("vertices",
                             [](const py::object& self) {
                               const auto& vertices = self.cast<const CityScene&>().city.mesh.vertices;
                               static const double kNone = 0;
                               return view_of(vertices.empty() ? &kNone : vertices.front().data(),
                                              {static_cast<py::ssize_t>(vertices.size()), 3}, self);
                             })
      .def_property_readonly("triangles",
                             [](const py::object& self) {
                               const auto& triangles = self.cast<const CityScene&>().city.mesh.triangles;
                               static const std::uint32_t kNone = 0;
                               return view_of(triangles.empty() ? &kNone : triangles.front().data(),
                                              {static_cast<py::ssize_t>(triangles.size()), 3}, self);
                             })
      .def_property_readonly("materials",
                             [](const py::object& self) {
                               const auto& materials = self.cast<const CityScene&>().city.mesh.materials;
                               static_assert(sizeof(city::Material) == 1);
                               return view_of(reinterpret_cast<const std::uint8_t*>(materials.data()),
                                              {static_cast<py::ssize_t>(materials.size())}, self);
                             })
      .def("placement", &placements, "places"_a)
      .def("terrain", &terrain, "places"_a)
      .def("cast", &cast, "origins"_a, "directions"_a)
      .def(
          "enu_of",
          [](const CityScene& self, const py::object& places) {
            return converted(places, "places", [&](const Eigen::Vector3d& p) {
              const auto place = geodesy::Geodetic::from_degrees(p.x(), p.y(), p.z());
              geodesy::check_geodetic(place, "a place");
              return self.city.frame.local_from_geodetic(place);
            });
          },
          "places"_a)
      .def(
          "geodetic_of",
          [](const CityScene& self, const py::object& enu) {
            return converted(enu, "places", [&](const Eigen::Vector3d& p) {
              const geodesy::Geodetic place = self.city.frame.geodetic_from_local(p);
              return Eigen::Vector3d(geodesy::degrees(place.latitude_rad),
                                     geodesy::degrees(place.longitude_rad), place.height_m);
            });
          },
          "enu"_a);
  m.def("material_names", [] {
    std::vector<std::string> names;
    for (int i = 0; i <= static_cast<int>(city::Material::Foliage); ++i) {
      names.emplace_back(city::material_name(static_cast<city::Material>(i)));
    }
    return names;
  });
}

}  // namespace canyon::python
