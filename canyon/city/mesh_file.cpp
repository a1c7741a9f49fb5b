#include "canyon/city/mesh_file.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/city/mesh_topology.hpp"
#include "canyon/city/meshes/mesh_scene.hpp"

namespace canyon::city {
namespace {

constexpr double kMaxCity_m = 200e3;
constexpr double kSmallestCity_m = 1;
/// A sheet has no face steeper than this: |n_z| at least cos(80 deg).
constexpr double kSheetNormalZ = 0.17364817766693041;
/// A connected sheet inside a node of other type is terrain if it is under this fraction of the city.
constexpr double kTerrainFraction = 0.5;

/// Rotation that makes z the up axis. Right stays right, the direction to the viewer becomes south (COLLADA
/// 1.4.1, "up_axis"; glTF 2.0, 3.4).
Eigen::Matrix3d z_up_from(char up) {
  Eigen::Matrix3d r = Eigen::Matrix3d::Identity();
  if (up == 'Y') r << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  if (up == 'X') r << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  return r;
}

/// The triangles of one node, in ENU, welded, without degenerate ones.
struct Node {
  std::string name;
  bool named_terrain = false;
  Surface surface = Surface::Building;  ///< if it is not terrain
  std::vector<Eigen::Vector3d> vertices;
  TriangleIndices triangles;
  std::vector<Material> materials;
};

/// Whether there is a face and no face looks sideways.
bool is_sheet(const Node& node, const std::vector<std::uint32_t>& triangles) {
  return std::all_of(triangles.begin(), triangles.end(), [&node](std::uint32_t t) {
    const Eigen::Vector3d normal = normal_of(node.vertices, node.triangles[t]);
    return std::abs(normal.z()) >= kSheetNormalZ * normal.norm();
  });
}

Box bounds_of(const Node& node, const std::vector<std::uint32_t>& triangles) {
  Box box;
  for (const std::uint32_t t : triangles)
    for (const std::uint32_t v : node.triangles[t]) extend(box, node.vertices[v]);
  return box;
}

class MeshImport {
 public:
  MeshImport(const std::filesystem::path& path, const MeshImportOptions& options, bool whole_city)
      : path_(path), options_(options), whole_city_(whole_city) {}

  City read() {
    options_.validate();
    check_bytes();
    marked_ = has_mesh_mark(path_);
    meshes::MeshScene scene = meshes::read_mesh_scene(path_, marked_);
    if (options_.up_axis) scene.up = *options_.up_axis;

    Eigen::Affine3d enu_from_file = Eigen::Affine3d::Identity();
    enu_from_file.translate(options_.offset_m);
    enu_from_file.rotate(Eigen::AngleAxisd(options_.heading_rad, Eigen::Vector3d::UnitZ()));
    enu_from_file.scale(options_.scale * scene.metres_per_unit);
    enu_from_file.rotate(z_up_from(scene.up));
    for (meshes::SceneNode& node : scene.nodes) take(node, enu_from_file);
    check_size(scene.notes);

    City city;
    city.name = path_.filename().string();
    city.frame = geodesy::LocalFrame(options_.origin);
    note(fmt::format("{} triangles in {} nodes; 1 unit is {} m, {} up", read_, nodes_.size(),
                     scene.metres_per_unit * options_.scale, scene.up));
    note_degenerate(scene.notes, degenerate_);
    notes_.append(scene.notes, path_);
    if (marked_)
      build_as_written(city.mesh);
    else
      build(city.mesh);
    check_mesh(city.mesh, city.name);
    if (whole_city_ && !options_.up_axis && !marked_) check_up_axis(city.mesh, scene.up);
    city.notes = std::move(notes_);
    return city;
  }

 private:
  void note(std::string_view line) { notes_.add_line(ReadReport::Level::Remark, line); }

  void check_bytes() const {
    check_input_file(path_, meshes::kMaxMesh);
    const std::string head = read_head(path_, 512);
    if (is_gzip(head) || is_unpacked_whole(head))
      throw InputError(path_, 0, "is a packed file, not a mesh", "unpack it first");
    refuse_foreign_bytes(path_, head);
  }

  [[nodiscard]] bool names_terrain(const std::string& name) const {
    return std::any_of(options_.terrain_names.begin(), options_.terrain_names.end(),
                       [&name](const std::string& word) { return has_word(name, word); });
  }

  /// Guesses that a city lies on its side: its terrain is upright, no roof is above the ground, or its
  /// buildings are on one plane that is not level.
  void check_up_axis(const Mesh& mesh, char up) {
    constexpr double kUpright = 0.3, kPlane_m = 1, kApart_m = 10;
    const char other = up == 'Z' ? 'Y' : 'Z';
    const double towards_y = up == 'Z' ? 1 : -1;  // the other axis' up in ENU
    double area = 0, level = 0;
    Box ground, roofs;
    std::vector<double> feet_z, feet_y;
    for (const Object& object : mesh.objects) {
      Box box;
      extend(box, mesh, object);
      for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
        if (object.surface != Surface::Terrain) continue;
        const Eigen::Vector3d normal = normal_of(mesh.vertices, mesh.triangles[t]);
        area += normal.norm();
        level += std::abs(normal.z());
      }
      for (const Eigen::Vector3d& corner : {box.min, box.max}) {
        if (object.surface == Surface::Terrain) extend(ground, corner);
        if (object.surface == Surface::Building) extend(roofs, corner);
      }
      if (object.surface != Surface::Building) continue;
      feet_z.push_back(box.min.z());
      feet_y.push_back(towards_y > 0 ? box.min.y() : -box.max.y());
    }
    const auto spread = [](std::vector<double>& values) {
      const std::vector<double> ends = quantiles(values, std::array{0.05, 0.95});
      return ends[1] - ends[0];
    };
    std::string why;
    if (level < kUpright * area)
      why = "its terrain is upright";
    else if (!feet_z.empty() && roofs.max.z() <= (area > 0 ? ground.min.z() : 0))
      why = fmt::format("no building has a roof above the {}", area > 0 ? "terrain" : "origin");
    else if (feet_z.size() > 2 && spread(feet_y) < kPlane_m && spread(feet_z) > kApart_m)
      why = "its buildings are on an upright plane";
    if (why.empty()) return;
    notes_.add_line(ReadReport::Level::Guess,
                    fmt::format("{}: {}; if {} is the file's up axis, set up_axis: {}",
                                path_.filename().string(), why, static_cast<char>(other - 'A' + 'a'), other));
  }

  void take(meshes::SceneNode& from, const Eigen::Affine3d& enu_from_file) {
    Node node;
    node.name = from.name.empty() ? path_.stem().string() : from.name;
    bool reported = false;
    NodeName named = marked_ ? read_node_name(node.name) : split_surface(node.name, &reported);
    reported = reported || marked_;
    node.named_terrain =
        reported ? named.surface == Surface::Terrain : names_terrain(node.name) || names_terrain(from.above);
    if (reported) {
      node.name = std::move(named.name);
      node.surface = named.surface;
    }
    node.vertices = std::move(from.vertices);
    for (Eigen::Vector3d& vertex : node.vertices) {
      vertex = enu_from_file * vertex;
      if (!vertex.allFinite()) {
        throw InputError(path_, 0,
                         fmt::format("node '{}' has a vertex that is not a finite number", node.name),
                         "export it again");
      }
    }
    for (const meshes::SceneFaces& faces : from.faces) {
      const Material material =
          marked_ ? material_by_name(faces.material) : material_from_name(faces.material);
      for (const auto& t : faces.triangles) {
        ++read_;
        if (is_degenerate(node.vertices[t[0]], node.vertices[t[1]], node.vertices[t[2]])) {
          ++degenerate_;
          continue;
        }
        node.triangles.push_back(t);
        node.materials.push_back(material);
      }
    }
    if (!node.triangles.empty()) nodes_.push_back(std::move(node));
  }

  void check_size(const ReadReport& notes) {
    for (Node& node : nodes_) {
      for (const auto& triangle : node.triangles)
        for (const std::uint32_t v : triangle) extend(bounds_, node.vertices[v]);
    }
    if (nodes_.empty()) {
      if (degenerate_ == 0) {
        const std::string why = fmt::format("{}", fmt::join(notes.lines(), ", "));
        throw InputError(path_, 0,
                         why.empty() ? "has no triangle, only points or lines"
                                     : fmt::format("has no triangle that is read; {}", why),
                         "export the buildings as meshes of faces");
      }
      throw InputError(path_, 0,
                       fmt::format("has no triangle of 1e-8 m^2 or more, only {} smaller ones", read_),
                       "set the city's scale if its unit is wrong");
    }
    const double size = (bounds_.max - bounds_.min).maxCoeff();
    if (size > kMaxCity_m || (size < kSmallestCity_m && whole_city_ && !marked_)) {
      throw InputError(path_, 0, fmt::format("the city would be {:.4g} m large, outside 1 m to 200 km", size),
                       "set the city's scale: the unit declared in the file seems wrong");
    }
    const double distance = (0.5 * (bounds_.min + bounds_.max)).norm();
    if (distance > kMaxCity_m && whole_city_) {
      throw InputError(path_, 0, fmt::format("the city would be {:.0f} km from its origin", distance / 1e3),
                       "export it about a local origin, or move it there with the city's offset");
    }
  }

  /// Canyon's own files: nodes unchanged.
  void build_as_written(Mesh& mesh) {
    for (Node& node : nodes_) {
      weld(node.vertices, node.triangles);
      std::vector<std::uint32_t> all(node.triangles.size());
      std::iota(all.begin(), all.end(), 0U);
      append(mesh, node.name, node.surface, node, all, node.triangles);
    }
  }

  void build(Mesh& mesh) {
    const bool any_named =
        std::any_of(nodes_.begin(), nodes_.end(), [](const Node& node) { return node.named_terrain; });
    std::size_t flipped = 0;
    std::size_t flipped_objects = 0;
    std::size_t inside_out = 0;
    std::size_t open = 0;
    std::size_t tangled = 0;
    for (Node& node : nodes_) {
      weld(node.vertices, node.triangles);
      const auto components = connected_components(node.triangles, node.vertices.size());
      const std::vector<bool> terrain = terrain_components(node, components, any_named);
      std::size_t number = 0;
      const bool several = components.size() > 1;
      for (std::size_t c = 0; c < components.size(); ++c) {
        TriangleIndices triangles;
        for (const std::uint32_t t : components[c]) triangles.push_back(node.triangles[t]);
        const OrientedSolids orientation = orient_outwards(node.vertices, triangles);
        const bool all_flipped = orientation.flipped_count == triangles.size();
        if (orientation.flipped_count > 0 && !all_flipped) {
          flipped += orientation.flipped_count;
          ++flipped_objects;
        }
        tangled += orientation.orientable ? 0U : 1U;
        if (terrain[c]) {
          inside_out += face_up(node.vertices, triangles) ? 1U : 0U;
        } else {
          inside_out += all_flipped ? 1U : 0U;
          open += orientation.closed ? 0U : 1U;
        }
        std::string name = several ? fmt::format("{}_{}", node.name, ++number) : node.name;
        append(mesh, std::move(name), terrain[c] ? Surface::Terrain : node.surface, node, components[c],
               triangles);
      }
    }
    if (flipped > 0)
      note(fmt::format("{} triangles of {} objects flipped to agree with their neighbours", flipped,
                       flipped_objects));
    if (inside_out > 0) note(fmt::format("{} objects were inside out and have been flipped", inside_out));
    if (tangled > 0) note(fmt::format("{} objects have no consistent outside and are unchanged", tangled));
    if (open > 0) note(fmt::format("{} buildings are not closed (a missing floor aside)", open));
  }

  /// Chooses terrain by name if any node of the file has such a name. Otherwise terrain is a node that is a
  /// sheet, or a connected sheet under most of the city.
  std::vector<bool> terrain_components(const Node& node,
                                       const std::vector<std::vector<std::uint32_t>>& components,
                                       bool any_named) {
    std::vector<bool> terrain(components.size(), false);
    if (any_named) {
      if (node.named_terrain) {
        terrain.assign(components.size(), true);
        note(fmt::format("node '{}' is terrain by its name", node.name));
      }
      return terrain;
    }
    std::size_t sheets = 0;
    for (const auto& component : components) sheets += is_sheet(node, component) ? 1U : 0U;
    if (sheets == components.size()) {
      terrain.assign(components.size(), true);
      note(fmt::format("node '{}' is read as terrain: no face looks sideways", node.name));
      return terrain;
    }
    for (std::size_t c = 0; c < components.size(); ++c) {
      if (is_sheet(node, components[c]) &&
          plan_area(bounds_of(node, components[c])) >= kTerrainFraction * plan_area(bounds_)) {
        terrain[c] = true;
        note(fmt::format("part {} of node '{}' is read as terrain: a sheet under most of the city", c + 1,
                         node.name));
      }
    }
    return terrain;
  }

  void append(Mesh& mesh, std::string name, Surface surface, const Node& node,
              const std::vector<std::uint32_t>& component, const TriangleIndices& triangles) const {
    const bool terrain = surface == Surface::Terrain;
    std::vector<Material> materials(component.size(), Material::Ground);
    for (std::size_t t = 0; t < component.size() && (marked_ || !terrain); ++t)
      materials[t] = node.materials[component[t]];
    append_object(mesh, std::move(name), surface, materials, node.vertices, triangles);
  }

  std::filesystem::path path_;
  MeshImportOptions options_;
  bool whole_city_ = true;
  bool marked_ = false;  ///< written by Canyon, see mesh_marks.hpp
  std::vector<Node> nodes_;
  ReadReport notes_;
  Box bounds_;
  std::size_t read_ = 0;
  std::size_t degenerate_ = 0;
};

}  // namespace

City read_mesh_city(const std::filesystem::path& path, const MeshImportOptions& options) {
  return MeshImport(path, options, true).read();
}

City read_mesh_part(const std::filesystem::path& path, const MeshImportOptions& options) {
  return MeshImport(path, options, false).read();
}

}  // namespace canyon::city
