#include "canyon/city/mesh_file.hpp"

#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <fstream>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/archives.hpp"
#include "canyon/base/foreign_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/input_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/utf16.hpp"
#include "canyon/city/boxes.hpp"
#include "canyon/city/mesh_doubts.hpp"
#include "canyon/city/mesh_file_format.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/city/mesh_names.hpp"
#include "canyon/city/mesh_topology.hpp"

namespace canyon::city {
namespace {

constexpr std::array<std::string_view, 6> kExtensions{".dae", ".obj", ".stl", ".gltf", ".glb", ".ply"};
constexpr double kLargestCity_m = 200e3;
constexpr double kSmallestCity_m = 1;
/// Assimp keeps coordinates as floats: beyond this one they come in steps of 2^-10 units and more.
constexpr double kFinestCoordinate = 8192;
/// A sheet has no face steeper than this: |n_z| at least cos(80 deg).
constexpr double kSheetNormalZ = 0.17364817766693041;
/// A connected sheet inside a node of something else is terrain when it lies under this share of the city.
constexpr double kTerrainShare = 0.5;

Eigen::Affine3d affine_from(const aiMatrix4x4& m) {
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  result.matrix().topRows<3>() << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4;
  return result;
}

/// The triangles of one node, in ENU, degenerate ones gone, welded.
struct Node {
  std::string name;
  bool named_terrain = false;
  Surface surface = Surface::Building;  ///< where it is not terrain
  std::vector<Eigen::Vector3d> vertices;
  TriangleIndices triangles;
  std::vector<Material> materials;
};

/// Whether no face looks sideways, and there is one.
bool is_sheet(const Node& node, const std::vector<std::uint32_t>& triangles) {
  return std::all_of(triangles.begin(), triangles.end(), [&node](std::uint32_t t) {
    const auto& [a, b, c] = node.triangles[t];
    const Eigen::Vector3d normal =
        (node.vertices[b] - node.vertices[a]).cross(node.vertices[c] - node.vertices[a]);
    return std::abs(normal.z()) >= kSheetNormalZ * normal.norm();
  });
}

Box bounds_of(const Node& node, const std::vector<std::uint32_t>& triangles) {
  Box box;
  for (const std::uint32_t t : triangles) {
    for (const std::uint32_t v : node.triangles[t]) extend(box, node.vertices[v]);
  }
  return box;
}

class MeshImport {
 public:
  MeshImport(const std::filesystem::path& path, const MeshImportOptions& options, bool whole_city)
      : path_(path), options_(options), whole_city_(whole_city) {}

  City read(std::string* caution = nullptr) {
    options_.validate();
    const std::string extension = check_path();
    FileFrame frame;
    check_format(extension, frame);
    marked_ = has_mesh_mark(path_);
    const aiScene& scene = load();
    if (options_.up_axis) frame.up = *options_.up_axis == 'Y' ? UpAxis::Y : UpAxis::Z;

    Eigen::Affine3d enu_from_file = Eigen::Affine3d::Identity();
    enu_from_file.translate(options_.offset_m);
    enu_from_file.rotate(Eigen::AngleAxisd(options_.heading_rad, Eigen::Vector3d::UnitZ()));
    enu_from_file.scale(options_.scale * frame.metres_per_unit);
    enu_from_file.rotate(z_up_from(frame.up));
    for (unsigned m = 0; m < scene.mNumMaterials; ++m) {
      const std::string name = scene.mMaterials[m]->GetName().C_Str();
      materials_.push_back(marked_ ? material_by_name(name) : material_from_name(name));
    }
    // Assimp makes COLLADA's root transform by itself, see check_collada().
    const Eigen::Affine3d root =
        extension == ".dae" ? Eigen::Affine3d::Identity() : affine_from(scene.mRootNode->mTransformation);
    collect(scene, *scene.mRootNode, enu_from_file * root, false);
    check_size();

    City city;
    city.name = path_.filename().string();
    city.frame = geodesy::LocalFrame(options_.origin);
    note(fmt::format("{} triangles in {} nodes; 1 unit is {} m, {} up", read_, nodes_.size(),
                     frame.metres_per_unit * options_.scale, "XYZ"[static_cast<int>(frame.up)]));
    std::for_each(doubts_.begin(), doubts_.end(), [this](const std::string& doubt) { note(doubt); });
    if (degenerate_ > 0)
      note(fmt::format("{} degenerate triangles (area below 1e-8 m^2) dropped", degenerate_));
    if (largest_coordinate_ > kFinestCoordinate) {
      note(fmt::format(
          "file coordinates reach {:.0f} units; mesh files are read in single precision, here to {:.3f} m: "
          "export "
          "the mesh about its own origin",
          largest_coordinate_,
          std::ldexp(1.0, std::ilogb(largest_coordinate_) - 23) * frame.metres_per_unit * options_.scale));
    }
    if (marked_) {
      build_as_written(city.mesh);
    } else {
      build(city.mesh);
    }
    check_mesh(city.mesh, city.name);
    city.notes = std::move(notes_);
    if (caution != nullptr && !options_.up_axis && !marked_)
      *caution = up_axis_caution(city, frame.up, path_, options_.heading_rad);
    return city;
  }

 private:
  void note(std::string line) { notes_.push_back(std::move(line)); }

  [[nodiscard]] std::string check_path() const {
    std::string extension = lower_case(path_.extension().string());
    if (std::find(kExtensions.begin(), kExtensions.end(), extension) == kExtensions.end()) {
      throw InputError(path_, 0, fmt::format("unknown mesh format '{}'", extension),
                       "use .dae, .obj, .stl, .gltf, .glb or .ply");
    }
    check_input_file(path_, kLargestMesh);
    if (!std::ifstream(path_)) throw InputError(path_, 0, "cannot be read");
    const std::string head = read_head(path_, 512);
    if (is_gzip(head) || is_unpacked_whole(head))
      throw InputError(path_, 0, "is a packed file, not a mesh", "unpack it first");
    refuse_foreign_bytes(path_, head);
    if (Utf16Decoder::is_marked(head)) throw InputError(path_, 0, "is text in UTF-16", "save it as UTF-8");
    return extension;
  }

  /// Checks for faults that Assimp does not notice or survive.
  void check_format(const std::string& extension, FileFrame& frame) {
    if (extension == ".ply") doubts_ = check_ply(path_);
    if (extension == ".stl") doubts_ = check_stl(path_);
    if (extension == ".obj") doubts_ = check_obj(path_);
    if (extension == ".dae") doubts_ = check_collada(path_, frame);
    if (extension != ".gltf" && extension != ".glb") return;
    frame.up = UpAxis::Y;
    doubts_ = check_gltf(path_);
  }

  const aiScene& load() {
    importer_.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    importer_.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS,
                                 aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS |
                                     aiComponent_COLORS | aiComponent_TEXCOORDS | aiComponent_BONEWEIGHTS |
                                     aiComponent_ANIMATIONS | aiComponent_TEXTURES | aiComponent_LIGHTS |
                                     aiComponent_CAMERAS);
    // Uses Canyon's own names only: other programs' names may be empty or repeat where their ids do not.
    if (marked_) importer_.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_USE_COLLADA_NAMES, true);
    const aiScene* scene = importer_.ReadFile(path_.string(), 0);
    if (scene != nullptr) {
      if (!marked_) add_face_doubts(*scene, doubts_);
      scene = importer_.ApplyPostProcessing(aiProcess_RemoveComponent | aiProcess_Triangulate |
                                            aiProcess_SortByPType);
    }
    if (scene == nullptr) {
      std::string reason = importer_.GetErrorString();
      std::replace(reason.begin(), reason.end(), '\n', ' ');
      if (reason.find("No meshes remaining") != std::string::npos) no_triangles();
      throw InputError(path_, 0, fmt::format("cannot be read as a mesh: {}", trim(reason)),
                       "export it again, or check it in a mesh viewer");
    }
    if (scene->mRootNode == nullptr || scene->mNumMeshes == 0) no_triangles();
    return *scene;
  }

  [[noreturn]] void no_triangles() const {
    throw InputError(path_, 0, "holds no triangle, points or lines alone",
                     "export the buildings as meshes of faces");
  }

  [[nodiscard]] bool names_terrain(const std::string& name) const {
    return std::any_of(options_.terrain_names.begin(), options_.terrain_names.end(),
                       [&name](const std::string& word) { return has_word(name, word); });
  }

  /// The node's own name, or its mesh's where that is made up by Assimp (STL, PLY, files with one mesh).
  [[nodiscard]] std::string name_of(const aiScene& scene, const aiNode& node) const {
    const auto usable = [](const std::string& name) {
      return !name.empty() && name.front() != '<' && name.front() != '$';
    };
    std::string name = node.mName.C_Str();
    if (usable(name) && &node != scene.mRootNode) return name;
    if (node.mNumMeshes == 1) {
      name = scene.mMeshes[node.mMeshes[0]]->mName.C_Str();
      if (usable(name)) return name;
    }
    return path_.stem().string();
  }

  void collect(const aiScene& scene, const aiNode& node, const Eigen::Affine3d& enu_from_node,
               bool under_terrain) {
    if (node.mNumMeshes > 0) {
      Node collected;
      collected.name = name_of(scene, node);
      bool said = false;
      NodeName named = marked_ ? read_node_name(collected.name) : split_surface(collected.name, &said);
      said = said || marked_;
      collected.named_terrain =
          said ? named.surface == Surface::Terrain : under_terrain || names_terrain(collected.name);
      if (said) {
        collected.name = std::move(named.name);
        collected.surface = named.surface;
      }
      for (unsigned m = 0; m < node.mNumMeshes; ++m) {
        add_triangles(*scene.mMeshes[node.mMeshes[m]], enu_from_node, collected);
      }
      if (!collected.triangles.empty()) nodes_.push_back(std::move(collected));
    }
    for (unsigned c = 0; c < node.mNumChildren; ++c) {
      const aiNode& child = *node.mChildren[c];
      collect(scene, child, enu_from_node * affine_from(child.mTransformation),
              under_terrain || names_terrain(child.mName.C_Str()));
    }
  }

  void add_triangles(const aiMesh& mesh, const Eigen::Affine3d& enu_from_node, Node& node) {
    if ((mesh.mPrimitiveTypes & aiPrimitiveType_TRIANGLE) == 0) return;
    const auto first = static_cast<std::uint32_t>(node.vertices.size());
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D& p = mesh.mVertices[v];
      const Eigen::Vector3d file(p.x, p.y, p.z);
      if (!file.allFinite()) {
        throw InputError(path_, 0,
                         fmt::format("node '{}' has a vertex that is not a finite number", node.name),
                         "export it again");
      }
      largest_coordinate_ = std::max(largest_coordinate_, file.cwiseAbs().maxCoeff());
      node.vertices.emplace_back(enu_from_node * file);
    }
    const bool mirrored = enu_from_node.linear().determinant() < 0;
    const Material material =
        mesh.mMaterialIndex < materials_.size() ? materials_[mesh.mMaterialIndex] : Material::Unknown;
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices != 3) continue;
      ++read_;
      if (std::any_of(face.mIndices, face.mIndices + 3, [&](unsigned v) { return v >= mesh.mNumVertices; })) {
        throw InputError(path_, 0, fmt::format("node '{}' has a face that names a missing vertex", node.name),
                         "export it again");
      }
      std::array<std::uint32_t, 3> t{first + face.mIndices[0], first + face.mIndices[1],
                                     first + face.mIndices[2]};
      if (mirrored) std::swap(t[1], t[2]);
      if (is_degenerate(node.vertices[t[0]], node.vertices[t[1]], node.vertices[t[2]])) {
        ++degenerate_;
        continue;
      }
      node.triangles.push_back(t);
      node.materials.push_back(material);
    }
  }

  void check_size() {
    for (Node& node : nodes_) {
      for (const auto& triangle : node.triangles) {
        for (const std::uint32_t v : triangle) extend(bounds_, node.vertices[v]);
      }
    }
    if (nodes_.empty()) {
      if (degenerate_ == 0) no_triangles();
      throw InputError(path_, 0,
                       fmt::format("holds no triangle of 1e-8 m^2 or more, but {} smaller ones", read_),
                       "set the city's scale if its unit is wrong");
    }
    const double size = (bounds_.max - bounds_.min).maxCoeff();
    if (size > kLargestCity_m || (size < kSmallestCity_m && whole_city_ && !marked_)) {
      throw InputError(path_, 0, fmt::format("the city would be {:.4g} m large, outside 1 m to 200 km", size),
                       "set the city's scale: the unit that the file declares seems wrong");
    }
    const double distance = (0.5 * (bounds_.min + bounds_.max)).norm();
    if (distance > kLargestCity_m && whole_city_) {
      throw InputError(path_, 0, fmt::format("the city would be {:.0f} km from its origin", distance / 1e3),
                       "export it about a local origin, or bring it there with the city's offset");
    }
  }

  /// Canyon's own files: nodes as they are.
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
    std::size_t turned = 0;
    std::size_t turned_objects = 0;
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
        const Orientation orientation = orient_outwards(node.vertices, triangles);
        const bool all_turned = orientation.turned == triangles.size();
        if (orientation.turned > 0 && !all_turned) {
          turned += orientation.turned;
          ++turned_objects;
        }
        tangled += orientation.orientable ? 0U : 1U;
        if (terrain[c]) {
          inside_out += face_up(node, triangles) ? 1U : 0U;
        } else {
          inside_out += all_turned ? 1U : 0U;
          open += orientation.closed ? 0U : 1U;
        }
        std::string name = several ? fmt::format("{}_{}", node.name, ++number) : node.name;
        append(mesh, std::move(name), terrain[c] ? Surface::Terrain : node.surface, node, components[c],
               triangles);
      }
    }
    if (turned > 0)
      note(fmt::format("{} triangles of {} objects turned to agree with their neighbours", turned,
                       turned_objects));
    if (inside_out > 0) note(fmt::format("{} objects were inside out and have been turned", inside_out));
    if (tangled > 0)
      note(fmt::format("{} objects have no consistent outside and are left as they are", tangled));
    if (open > 0) note(fmt::format("{} buildings are not closed (a missing floor aside)", open));
  }

  /// Chooses terrain by name where any node of the file is named so. Otherwise terrain is a node that is a
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
      note(fmt::format("node '{}' is taken as terrain: no face looks sideways", node.name));
      return terrain;
    }
    for (std::size_t c = 0; c < components.size(); ++c) {
      if (is_sheet(node, components[c]) &&
          plan_area(bounds_of(node, components[c])) >= kTerrainShare * plan_area(bounds_)) {
        terrain[c] = true;
        note(fmt::format("part {} of node '{}' is taken as terrain: a sheet under most of the city", c + 1,
                         node.name));
      }
    }
    return terrain;
  }

  /// Turns a sheet whose front looks down.
  static bool face_up(const Node& node, TriangleIndices& triangles) {
    double up = 0;
    double area = 0;
    for (const auto& [a, b, c] : triangles) {
      const Eigen::Vector3d normal =
          (node.vertices[b] - node.vertices[a]).cross(node.vertices[c] - node.vertices[a]);
      up += normal.z();
      area += normal.norm();
    }
    if (up >= -1e-6 * area) return false;
    for (auto& triangle : triangles) std::swap(triangle[1], triangle[2]);
    return true;
  }

  void append(Mesh& mesh, std::string name, Surface surface, const Node& node,
              const std::vector<std::uint32_t>& component, const TriangleIndices& triangles) const {
    // Passes only this component's vertices: append_object() looks at all that it is given.
    std::vector<std::uint32_t> used;
    for (const auto& triangle : triangles) used.insert(used.end(), triangle.begin(), triangle.end());
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    std::vector<Eigen::Vector3d> vertices;
    vertices.reserve(used.size());
    for (const std::uint32_t v : used) vertices.push_back(node.vertices[v]);
    TriangleIndices local = triangles;
    for (auto& triangle : local) {
      for (std::uint32_t& v : triangle) {
        v = static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), v) - used.begin());
      }
    }
    const std::size_t first = mesh.materials.size();
    append_object(mesh, std::move(name), surface,
                  surface == Surface::Terrain ? Material::Ground : Material::Unknown, vertices, local);
    if (surface == Surface::Terrain && !marked_) return;
    for (std::size_t t = 0; t < component.size(); ++t) {
      mesh.materials[first + t] = node.materials[component[t]];
    }
  }

  std::filesystem::path path_;
  MeshImportOptions options_;
  bool whole_city_ = true;
  bool marked_ = false;  ///< written by Canyon, see mesh_marks.hpp
  Assimp::Importer importer_;
  std::vector<Material> materials_;
  std::vector<Node> nodes_;
  std::vector<std::string> notes_, doubts_;
  Box bounds_;
  std::size_t read_ = 0;
  std::size_t degenerate_ = 0;
  double largest_coordinate_ = 0;
};

}  // namespace

City read_mesh_city(const std::filesystem::path& path, const MeshImportOptions& options,
                    std::string* caution) {
  return MeshImport(path, options, true).read(caution);
}

City read_mesh_part(const std::filesystem::path& path, const MeshImportOptions& options) {
  return MeshImport(path, options, false).read();
}

}  // namespace canyon::city
