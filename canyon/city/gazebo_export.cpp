#include "canyon/city/gazebo_export.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/mesh_export.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/city/mesh_parts.hpp"
#include "canyon/city/mesh_topology.hpp"

namespace canyon::city {
namespace {

constexpr std::string_view kModelMark = "A city written by Canyon.";
constexpr std::size_t kMaxTriangles = 100'000'000;

/// Objects that form one link.
struct Link {
  std::string name;
  std::vector<Object> objects;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< whole metres
};

/// Halves the objects across their longer side until each group is small enough.
void split_by_location(const Mesh& mesh, std::vector<Object> objects, std::size_t maximum,
                       std::vector<std::vector<Object>>& groups) {
  std::size_t triangles = 0;
  for (const Object& object : objects) triangles += object.triangle_count;
  if (objects.size() < 2 || triangles <= maximum) {
    if (!objects.empty()) groups.push_back(std::move(objects));
    return;
  }
  std::vector<std::pair<Eigen::Vector3d, Object>> posed;
  Box box;
  for (Object& object : objects) {
    Box object_value;
    extend(object_value, mesh, object);
    const Eigen::Vector3d middle = middle_of(object_value);
    extend(box, middle);
    posed.emplace_back(middle, std::move(object));
  }
  const Eigen::Vector3d size = box.max - box.min;
  const int axis = size.x() >= size.y() ? 0 : 1;
  const auto half = posed.begin() + static_cast<std::ptrdiff_t>(posed.size() / 2);
  std::stable_sort(posed.begin(), posed.end(),
                   [axis](const auto& a, const auto& b) { return a.first[axis] < b.first[axis]; });
  std::vector<Object> low;
  std::vector<Object> high;
  for (auto it = posed.begin(); it != posed.end(); ++it)
    (it < half ? low : high).push_back(std::move(it->second));
  split_by_location(mesh, std::move(low), maximum, groups);
  split_by_location(mesh, std::move(high), maximum, groups);
}

std::vector<Link> links_of(const Mesh& mesh, std::size_t triangles_per_mesh) {
  std::vector<Object> terrain;
  std::vector<Object> others;
  for (Object& object : objects_with_triangles(mesh))
    (object.surface == Surface::Terrain ? terrain : others).push_back(std::move(object));
  std::vector<std::vector<Object>> groups;
  split_by_location(mesh, std::move(others), triangles_per_mesh, groups);
  std::vector<Link> links;
  links.reserve(groups.size() + 1);
  for (auto& group : groups)
    links.push_back({fmt::format("buildings_{:03}", links.size() + 1), std::move(group), {}});
  if (!terrain.empty()) links.push_back({"terrain", std::move(terrain), {}});
  for (Link& link : links) {
    Box box;
    for (const Object& object : link.objects) extend(box, mesh, object);
    link.middle = middle_of(box).array().round();
  }
  return links;
}

/// A folder for a model that is written completely or not at all; it replaces one written by Canyon.
Temporary model_folder(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::exists(path, error) && !std::filesystem::is_directory(path, error))
    throw InputError(path, 0, "is a file", "name a folder for the model");
  if (std::filesystem::exists(path, error) && !std::filesystem::is_empty(path, error)) {
    std::ifstream in(path / "model.config");
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    if (text.find(kModelMark) == std::string::npos) {
      throw InputError(path, 0, "has other contents than a city written by Canyon",
                       "choose another folder, or remove it first");
    }
  }
  Temporary folder(path, Temporary::Kind::Folder);
  std::filesystem::create_directory(folder.temporary_path() / "meshes");
  return folder;
}

void write_meshes(const std::filesystem::path& folder, const City& city, const std::vector<Link>& links) {
  for (const Link& link : links) {
    const std::vector<std::string> names = node_names(link.objects, NameCharacters::XmlName);
    std::vector<ColladaNode> nodes;
    nodes.reserve(names.size());
    for (std::size_t i = 0; i < names.size(); ++i) nodes.push_back({names[i], {link.objects[i]}});
    OutputFile collision(folder / (link.name + ".dae"));
    write_collada(collision, city.mesh, nodes, city.name, "collision mesh", true, link.middle);
    collision.commit();
    OutputFile visual(folder / (link.name + "_visual.dae"));
    write_collada(visual, city.mesh, {{link.name, link.objects}}, city.name,
                  "visual mesh, merged by material", false, link.middle);
    visual.commit();
  }
}

/// The <model> element; mesh files are in the folder `meshes`.
std::string model_element(const std::string& name, const std::vector<Link>& links, const std::string& meshes,
                          std::string_view indent) {
  std::string text = fmt::format("{0}<model name=\"{1}\">\n{0}  <static>true</static>\n", indent, name);
  const std::string folder = xml_escaped(meshes);
  for (const Link& link : links) {
    const auto geometry = [&](const char* element, const char* suffix) {
      return fmt::format(
          "{0}    <{1} name=\"{1}\">\n{0}      <geometry><mesh><uri>{2}/{3}{4}.dae</uri></mesh></geometry>\n"
          "{0}    </{1}>\n",
          indent, element, folder, link.name, suffix);
    };
    text += fmt::format("{0}  <link name=\"{1}\">\n{0}    <pose>{2} {3} {4} 0 0 0</pose>\n", indent,
                        link.name, link.middle.x(), link.middle.y(), link.middle.z());
    text += geometry("collision", "");
    text += geometry("visual", "_visual");
    text += fmt::format("{}  </link>\n", indent);
  }
  return text + fmt::format("{}</model>\n", indent);
}

std::string time_comment(const GazeboOptions& options) {
  return options.gps_time.empty() ? "" : fmt::format("<!-- GPS time: {} -->\n", options.gps_time);
}

/// Fills a model folder at its temporary location; `folder_name` is its final name.
void fill_model(const std::filesystem::path& temporary, const std::string& folder_name, const City& city,
                const std::vector<Link>& links, const GazeboOptions& options) {
  write_file(temporary / "model.config",
             fmt::format("<?xml version=\"1.0\"?>\n<model>\n  <name>{}</name>\n  <version>1.0</version>\n"
                         "  <sdf version=\"1.6\">model.sdf</sdf>\n"
                         "  <author><name>Canyon</name></author>\n"
                         "  <description>{} {}: {} triangles, east-north-up about latitude {} deg, longitude "
                         "{} deg, height {} m.</description>\n</model>\n",
                         options.name, kModelMark, xml_escaped(city.name), city.mesh.triangles.size(),
                         geodesy::degrees(city.frame.origin().latitude_rad),
                         geodesy::degrees(city.frame.origin().longitude_rad), city.frame.origin().height_m));
  write_file(temporary / "model.sdf",
             "<?xml version=\"1.0\"?>\n"
             "<!-- Gazebo finds the meshes if the parent of this model's folder is in\n"
             "     GAZEBO_MODEL_PATH (Classic) or GZ_SIM_RESOURCE_PATH (Sim). -->\n" +
                 time_comment(options) + "<sdf version=\"1.6\">\n" +
                 model_element(options.name, links, "model://" + folder_name + "/meshes", "  ") + "</sdf>\n");
  write_meshes(temporary / "meshes", city, links);
}

void check_city(const std::filesystem::path& path, const City& city) {
  check_mesh(city.mesh, city.name);
  if (city.mesh.triangles.empty()) throw InputError(path, 0, "the city has no triangle to write");
}

/// Errors inside the temporary folder name the requested folder.
template <typename Call>
void in_name_of(const std::filesystem::path& folder, const Call& call) {
  try {
    call();
  } catch (const InputError& error) {
    throw InputError(folder, 0, error.problem(), error.hint());
  } catch (const OutputError& error) {
    throw OutputError(folder, 0, error.problem(), error.hint());
  }
}

std::string ground_plane(const Box& bounds) {
  const Eigen::Vector3d middle = middle_of(bounds);
  const Eigen::Vector3d size = (bounds.max - bounds.min).cwiseMax(50.0) * 2;
  const std::string plane =
      fmt::format("<geometry><plane><normal>0 0 1</normal><size>{:.0f} {:.0f}</size></plane></geometry>",
                  size.x(), size.y());
  const auto [r, g, b] = material_colour(Material::Ground);
  return fmt::format(
      "    <!-- The city has no terrain. -->\n"
      "    <model name=\"{0}\">\n      <static>true</static>\n      <pose>{1:.0f} {2:.0f} {3:.6f} 0 0 "
      "0</pose>\n"
      "      <link name=\"link\">\n        <collision name=\"collision\">{4}</collision>\n"
      "        <visual name=\"visual\">\n          {4}\n"
      "          <material><ambient>{5} {6} {7} 1</ambient><diffuse>{5} {6} {7} 1</diffuse></material>\n"
      "        </visual>\n      </link>\n    </model>\n",
      kGroundPlaneModel, middle.x(), middle.y(), bounds.min.z(), plane, r, g, b);
}

std::string world_text(const City& city, const std::vector<Link>& links, const std::string& meshes,
                       const GazeboOptions& options) {
  const geodesy::Geodetic& origin = city.frame.origin();
  std::string text = "<?xml version=\"1.0\"?>\n" + time_comment(options);
  text += fmt::format(
      "<sdf version=\"1.6\">\n  <world name=\"{}\">\n"
      "    <physics name=\"default\" default=\"true\" type=\"ode\">\n"
      "      <max_step_size>0.001</max_step_size>\n      <real_time_factor>1</real_time_factor>\n"
      "      <real_time_update_rate>1000</real_time_update_rate>\n    </physics>\n"
      "    <gravity>0 0 -9.8</gravity>\n"
      "    <spherical_coordinates>\n      <surface_model>EARTH_WGS84</surface_model>\n"
      "      <world_frame_orientation>ENU</world_frame_orientation>\n"
      "      <latitude_deg>{}</latitude_deg>\n      <longitude_deg>{}</longitude_deg>\n"
      "      <elevation>{}</elevation>\n      <heading_deg>{}</heading_deg>\n    </spherical_coordinates>\n"
      "    <scene>\n      <ambient>0.4 0.4 0.4 1</ambient>\n      <background>0.7 0.8 0.9 1</background>\n"
      "      <shadows>true</shadows>\n    </scene>\n"
      "    <light name=\"sun\" type=\"directional\">\n      <cast_shadows>true</cast_shadows>\n"
      "      <pose>0 0 1000 0 0 0</pose>\n      <diffuse>0.8 0.8 0.8 1</diffuse>\n"
      "      <specular>0.2 0.2 0.2 1</specular>\n      <direction>-0.5 0.3 -0.8</direction>\n    </light>\n",
      options.name, geodesy::degrees(origin.latitude_rad), geodesy::degrees(origin.longitude_rad),
      origin.height_m, geodesy::degrees(city.frame.heading_rad()));
  const bool has_terrain = !links.empty() && links.back().name == "terrain";
  if (!has_terrain) text += ground_plane(city.bounds());
  text +=
      "    <!-- Mesh files are next to this file, named relative to it. Gazebo Classic before 11.2: start it "
      "in\n"
      "         this folder, or put this folder in GAZEBO_RESOURCE_PATH. -->\n";
  text += model_element(options.name, links, meshes, "    ");
  return text + "  </world>\n</sdf>\n";
}

}  // namespace

void GazeboOptions::validate() const {
  const bool plain = std::all_of(name.begin(), name.end(), is_gazebo_name_character);
  if (name.empty() || name.size() > 100 || !plain || name.substr(0, 2) == "__") {
    throw InputError(fmt::format("Gazebo name '{}'", name),
                     "use 1 to 100 letters, digits, '_', '-' and '.', not beginning with '__'");
  }
  options::check(*this);
  const bool time = gps_time.find_first_not_of("0123456789T:.Z+- ") == std::string::npos;
  if (!time || gps_time.find("--") != std::string::npos || gps_time.size() > 40)
    throw InputError(fmt::format("GPS time '{}'", gps_time), "give ISO 8601, like 2019-04-28T12:45:00");
}

void visit(options::Visitor& v, GazeboOptions& o) {
  v.text({"name", "", "name of the model and the world"}, o.name);
  v.integer({"triangles_per_mesh", "", "maximum in one collision mesh"}, o.triangles_per_mesh, 1,
            kMaxTriangles);
  v.text({"gps_time", "", "ISO 8601, written as a comment"}, o.gps_time);
}

void write_gazebo_model(const std::filesystem::path& folder, const City& city, const GazeboOptions& options) {
  options.validate();
  check_city(folder, city);
  std::filesystem::path path = std::filesystem::absolute(folder).lexically_normal();
  if (path.filename().empty()) path = path.parent_path();
  const std::vector<Link> links = links_of(city.mesh, options.triangles_per_mesh);
  Temporary output = model_folder(path);
  in_name_of(folder,
             [&] { fill_model(output.temporary_path(), path.filename().string(), city, links, options); });
  output.rename_to_target();
}

void write_gazebo_world(const std::filesystem::path& path, const City& city, const GazeboOptions& options) {
  options.validate();
  const std::string extension = lower_case(path.extension().string());
  if (extension != ".world" && extension != ".sdf") {
    throw InputError(path, 0, fmt::format("unknown ending '{}' of a Gazebo world", extension),
                     "use .world or .sdf");
  }
  check_city(path, city);
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) throw InputError(path, 0, "is a folder");
  std::string name = path.stem().string() + "_model";
  for (char& c : name)
    if (!is_gazebo_name_character(c)) c = '_';
  const std::filesystem::path folder = path.parent_path() / name;
  const std::vector<Link> links = links_of(city.mesh, options.triangles_per_mesh);
  OutputFile world(path);
  world.write(world_text(city, links, name + "/meshes", options));
  Temporary output = model_folder(folder);
  in_name_of(folder, [&] { fill_model(output.temporary_path(), name, city, links, options); });
  // Renames the folder first: a world without meshes would be worse than meshes without a world.
  output.rename_to_target();
  world.commit();
}

}  // namespace canyon::city
