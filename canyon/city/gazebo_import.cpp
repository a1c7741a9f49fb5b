#include "canyon/city/gazebo_import.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/input_files.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/gazebo_elements.hpp"
#include "canyon/city/gazebo_export.hpp"
#include "canyon/city/link_shapes.hpp"
#include "canyon/city/mesh_file.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/city/mesh_topology.hpp"
#include "canyon/city/meshes/xml_file.hpp"

namespace canyon::city {
namespace {

using sdf::add_polylines;
using sdf::add_primitive;
using sdf::attribute;
using sdf::child_text;
using sdf::Element;
using sdf::Frames;
using sdf::is_true;
using sdf::numbers;
using sdf::SdfFile;
using sdf::text_of;

constexpr int kDeepestNesting = 16;
constexpr const char* kNothingThere = "it blocks and reflects no signal";

class GazeboImport {
 public:
  explicit GazeboImport(const std::filesystem::path& path)
      : path_(path), frames_([this](const SdfFile& source, const Element& include) {
          return included_model(source, include);
        }) {}

  City read() {
    const SdfFile& source = open(model_file(path_));
    top_ = source.path;
    const Element& sdf = *source.document.RootElement();
    city_.name = path_.filename().string();
    if (city_.name.empty()) city_.name = path_.parent_path().filename().string();
    const Element* world = sdf.FirstChildElement("world");
    if (world != nullptr) {
      if (world->NextSiblingElement("world") != nullptr)
        notes_.add_line(Level::Loss, "only the first of several worlds is read");
      read_origin(source, *world);
      read_state(source, *world);
      read_models(source, *world, Eigen::Affine3d::Identity(), "", 0, true);
    } else {
      note_no_origin();
      read_models(source, sdf, Eigen::Affine3d::Identity(), "", 0);
    }
    if (city_.mesh.triangles.empty()) {
      if (!absent_.empty()) throw InputError(absent_.front());
      const std::string why = fmt::format("{}", fmt::join(notes_.lines(Level::Loss), ", "));
      throw InputError(
          path_, 0, why.empty() ? "has no triangle" : fmt::format("has no triangle that is read; {}", why),
          moving_.empty() ? "give its links collisions or visuals"
                          : "set <static>true</static> in the models of the city: others can move");
    }
    note_moving();
    note_absent();
    const Eigen::Matrix3d enu_from_world =
        Eigen::AngleAxisd(heading_rad_, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    if (heading_rad_ != 0)
      for (Eigen::Vector3d& v : city_.mesh.vertices) v = enu_from_world * v;
    note_degenerate(notes_, degenerate_);
    if (moved_ > 0)
      city_.notes.add_line(Level::Remark,
                           fmt::format("{} models have the poses of the world's <state>", moved_));
    city_.notes.append(notes_, path_);
    check_mesh(city_.mesh, city_.name);
    return std::move(city_);
  }

 private:
  struct PartFile {
    Mesh mesh;
    bool marked = false;
  };

  using Level = ReadReport::Level;

  /// Gazebo Classic saves the poses of models and the deleted models, and restores both.
  void read_state(const SdfFile& source, const Element& world) {
    const Element* const state = world.FirstChildElement("state");
    if (state == nullptr) return;
    for (const Element* e = state->FirstChildElement("model"); e != nullptr;
         e = e->NextSiblingElement("model"))
      read_model_state(source, *e);
    if (const Element* const gone = state->FirstChildElement("deletions"))
      for (const Element* e = gone->FirstChildElement("name"); e != nullptr;
           e = e->NextSiblingElement("name"))
        deleted_.insert(text_of(*e));
    if (const Element* const added = state->FirstChildElement("insertions"))
      read_models(source, *added, Eigen::Affine3d::Identity(), "", 0, true);
  }
  void read_model_state(const SdfFile& source, const Element& model) {
    const std::string name = attribute(model, "name");
    if (model.FirstChildElement("pose") != nullptr) state_[name] = Frames::numbers_of(source, model);
    if (const Element* const scale = model.FirstChildElement("scale")) {
      const std::vector<double> s = numbers(source, *scale, 3, 1e6);
      const bool scaled = std::any_of(s.begin(), s.end(), [](double x) { return std::abs(x - 1) > 1e-6; });
      if (scaled)
        notes_.add_line(Level::Loss,
                        fmt::format("the world's <state> scales '{}', which is read unscaled", name));
    }
  }
  /// The pose of a world's model: from the state, else its own.
  Eigen::Affine3d posed_transform(const std::string& name, const Eigen::Affine3d& own, int depth) {
    const auto found = depth == 0 ? state_.find(name) : state_.end();
    if (found == state_.end() || found->second.isApprox(own, 1e-9)) return own;
    ++moved_;
    return found->second;
  }

  /// Whether the world's state deletes a model.
  bool is_deleted(const std::string& name, int depth) {
    const bool deleted = depth == 0 && deleted_.count(name) > 0;
    if (deleted)
      city_.notes.add_counted(Level::Remark, "{} models that the world's <state> deletes left out");
    return deleted;
  }

  void note_no_origin() {
    notes_.add_line(Level::Guess,
                    "no spherical_coordinates: the origin is latitude 0, longitude 0, height 0");
  }

  void note_absent() {
    for (const InputError& fault : absent_)
      city_.notes.add_counted(Level::Loss, fmt::format("{}; left out: {}", fault.what(), kNothingThere));
  }

  void note_moving() {
    if (moving_.empty()) return;
    const auto named = moving_.begin() + std::min<std::ptrdiff_t>(std::ssize(moving_), 5);
    notes_.add_line(Level::Guess,
                    fmt::format("models that can move (without <static>true</static>) left out: {} ({}{})",
                                moving_.size(), fmt::join(moving_.begin(), named, ", "),
                                named == moving_.end() ? "" : ", ..."));
  }

  /// A model's folder is replaced by the file named in its model.config.
  std::filesystem::path model_file(const std::filesystem::path& path) {
    std::error_code error;
    if (!std::filesystem::exists(path, error)) throw InputError(path, 0, "no such file");
    if (!std::filesystem::is_directory(path, error)) return path;
    const std::filesystem::path config = path / "model.config";
    if (!std::filesystem::exists(config, error)) {
      if (std::filesystem::exists(path / "model.sdf", error)) return path / "model.sdf";
      throw InputError(path, 0, "is a folder without model.config",
                       "name a world, or a Gazebo model's folder");
    }
    tinyxml2::XMLDocument document;
    meshes::read_xml(config, document);
    // The newest SDF version of several.
    std::string best = "model.sdf";
    double newest = -1;
    for (const Element* e = document.RootElement()->FirstChildElement("sdf"); e != nullptr;
         e = e->NextSiblingElement("sdf")) {
      const double version = parse_double(attribute(*e, "version")).value_or(0);
      if (version > newest && !text_of(*e).empty()) {
        newest = version;
        best = text_of(*e);
      }
    }
    const std::filesystem::path file = file_named_by(config, best);
    if (!std::filesystem::exists(file, error))
      throw InputError(config, 0, fmt::format("names '{}', which does not exist", best));
    return file;
  }

  const SdfFile& open(const std::filesystem::path& path) {
    std::unique_ptr<SdfFile>& kept = sources_[std::filesystem::absolute(path).lexically_normal().string()];
    if (kept) return *kept;
    auto source = std::make_unique<SdfFile>();
    source->path = path;
    meshes::read_xml(path, source->document);
    const Element& root = *source->document.RootElement();
    if (std::string_view(root.Name()) != "sdf") {
      throw source->error(root, fmt::format("begins with <{}>, not with <sdf>", root.Name()),
                          "name an SDF world or model (URDF: convert it with gz sdf -p)");
    }
    kept = std::move(source);
    return *kept;
  }

  void read_origin(const SdfFile& source, const Element& world) {
    const Element* coordinates = world.FirstChildElement("spherical_coordinates");
    if (coordinates == nullptr) {
      note_no_origin();
      return;
    }
    const auto word = [&](const char* name, std::string_view only) {
      const std::string text = child_text(*coordinates, name);
      if (!text.empty() && text != only)
        throw source.error(*coordinates->FirstChildElement(name), fmt::format("<{}> '{}'", name, text),
                           fmt::format("Canyon reads {}", only));
    };
    word("surface_model", "EARTH_WGS84");
    word("world_frame_orientation", "ENU");
    const auto number = [&](const char* name, double largest) {
      const Element* element = coordinates->FirstChildElement(name);
      return element == nullptr ? 0.0 : numbers(source, *element, 1, largest)[0];
    };
    heading_rad_ = geodesy::radians(number("heading_deg", 360));
    city_.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(
        number("latitude_deg", 90), number("longitude_deg", 180), number("elevation", 1e4)));
  }

  /// Whether a world's model is static; <static> of its include overrides its own.
  static bool is_static(const Element& model, const Element* include = nullptr) {
    const bool included = include != nullptr && include->FirstChildElement("static") != nullptr;
    return is_true(lower_case(child_text(included ? *include : model, "static")));
  }

  /// <model> and <include> children of a world, a model or <sdf>. @param only_static skips movable models
  void read_models(const SdfFile& source, const Element& parent, const Eigen::Affine3d& world_from_parent,
                   const std::string& scope, int depth, bool only_static = false) {
    if (depth > kDeepestNesting) {
      throw source.error(parent,
                         fmt::format("models are nested or included more than {} deep", kDeepestNesting),
                         "look for a model that includes itself");
    }
    for (const Element* e = parent.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const std::string_view kind = e->Name();
      if (kind == "model") {
        if (only_static && !is_static(*e)) {
          moving_.push_back(attribute(*e, "name"));
          continue;
        }
        const std::string name = attribute(*e, "name");
        if (is_deleted(name, depth)) continue;
        read_model(
            source, *e,
            world_from_parent * posed_transform(name, frames_.child_pose({&source, &parent}, *e), depth),
            scope, name, depth);
      } else if (kind == "include") {
        read_include({&source, &parent}, *e, world_from_parent, scope, depth, only_static);
      } else if (kind == "actor" || kind == "population" || kind == "road") {
        notes_.add_counted(Level::Loss, fmt::format("{{}} <{}> left out", kind));
      }
    }
  }

  void read_model(const SdfFile& source, const Element& model, const Eigen::Affine3d& world_from_model,
                  const std::string& scope, const std::string& name, int depth) {
    if (name == kGroundPlaneModel) {
      city_.notes.add_line(Level::Remark, "the ground plane under a city without terrain is not part of it");
      return;
    }
    const std::string inner = scope.empty() ? name : scope + "::" + name;
    for (const Element* link = model.FirstChildElement("link"); link != nullptr;
         link = link->NextSiblingElement("link")) {
      const char* kind = link->FirstChildElement("collision") != nullptr ? "collision" : "visual";
      for (const Element* e = link->FirstChildElement(kind); e != nullptr; e = e->NextSiblingElement(kind)) {
        const Element* geometry = e->FirstChildElement("geometry");
        if (geometry == nullptr) throw source.error(*e, fmt::format("<{}> without <geometry>", kind));
        read_geometry(source, *geometry, world_from_model * frames_.shape_pose({&source, &model}, *link, *e),
                      fmt::format("{}::{}::{}", inner, attribute(*link, "name"), attribute(*e, "name")));
      }
    }
    read_models(source, model, world_from_model, inner, depth + 1);
  }

  void read_include(const Frames::Scope& parent, const Element& include,
                    const Eigen::Affine3d& world_from_parent, const std::string& scope, int depth,
                    bool only_static) {
    const SdfFile& source = *parent.source;
    const Frames::Scope included = included_model(source, include);
    if (included.element == nullptr) return;
    std::string name = child_text(include, "name");
    if (name.empty()) name = attribute(*included.element, "name");
    if (only_static && !is_static(*included.element, &include)) {
      moving_.push_back(name);
      return;
    }
    if (is_deleted(name, depth)) return;
    if (depth >= kDeepestNesting) {
      throw source.error(include,
                         fmt::format("models are nested or included more than {} deep", kDeepestNesting),
                         "look for a model that includes itself");
    }
    read_model(*included.source, *included.element,
               world_from_parent * posed_transform(name, frames_.child_pose(parent, include), depth), scope,
               name, depth + 1);
  }

  /// The model of an <include>, cached; a missing or damaged model omits only itself.
  Frames::Scope included_model(const SdfFile& source, const Element& include) {
    const auto [known, fresh] = included_.try_emplace(&include);
    if (!fresh) return known->second;
    try {
      known->second = find_included(source, include);
    } catch (const InputError& fault) {
      absent_.push_back(fault);
    }
    return known->second;
  }
  Frames::Scope find_included(const SdfFile& source, const Element& include) {
    const std::string uri = child_text(include, "uri");
    if (uri.empty()) throw source.error(include, "<include> without <uri>");
    const std::optional<std::filesystem::path> found = resolve(source, uri);
    if (!found) {
      const std::string last = lower_case(uri.substr(uri.find_last_of('/') + 1));
      if (last == "sun" || last == "ground_plane" || last == "ground plane") {
        city_.notes.add_line(Level::Remark, fmt::format("'{}' of Gazebo's own collection left out", uri));
        return {};
      }
      throw source.error(include, fmt::format("'{}' is not in the file's folder", uri),
                         "put the model's folder next to the world and name it model://FOLDER");
    }
    const SdfFile& file = open(model_file(*found));
    const Element* const model = file.document.RootElement()->FirstChildElement("model");
    if (model == nullptr)
      city_.notes.add_counted(Level::Remark, "{} includes without a model (lights) left out");
    return {&file, model};
  }

  /// The location of a URI's file or folder, if it exists.
  [[nodiscard]] std::optional<std::filesystem::path> resolve(const SdfFile& source,
                                                             const std::string& uri) const {
    namespace fs = std::filesystem;
    const std::size_t scheme_end = uri.find("://");
    const std::string scheme = scheme_end == std::string::npos ? "" : uri.substr(0, scheme_end);
    const std::string rest = scheme_end == std::string::npos ? uri : uri.substr(scheme_end + 3);
    const fs::path here = fs::absolute(source.path).lexically_normal();
    const fs::path top = fs::absolute(path_).lexically_normal();
    std::vector<std::pair<fs::path, fs::path>> folders;  // of a file, or as seen from there
    if (scheme.empty() || scheme == "file") folders = {{here, {}}};
    if (scheme == "model" || scheme == "package")
      folders = {{here, {}}, {here, "models"}, {here, ".."}, {top, {}}, {top, "models"}};
    std::error_code error;
    for (const auto& [by, folder] : folders) {
      const fs::path path = (by.parent_path() / folder).lexically_normal() / rest;
      if (!fs::exists(path, error)) continue;
      if (is_in_folder_of(path, by, folder) || is_in_folder_of(path, top_)) return path;
      throw InputError(source.path, 0,
                       fmt::format("names '{}', which is outside the folder of this file", uri),
                       "put its folder next to the world and name it model://FOLDER");
    }
    return std::nullopt;
  }

  void read_geometry(const SdfFile& source, const Element& geometry,
                     const Eigen::Affine3d& world_from_geometry, const std::string& name) {
    const Element* shape = geometry.FirstChildElement();
    if (shape == nullptr) return;
    const std::string_view kind = shape->Name();
    if (kind == "mesh") return read_mesh(source, *shape, world_from_geometry, name);
    std::vector<std::string> notes;
    LinkShapes shapes(notes);
    if (!add_polylines(source, geometry, shapes, {name}) && !add_primitive(source, *shape, shapes, {name})) {
      if (kind != "empty")
        notes_.add_counted(Level::Loss,
                           fmt::format("{{}} <{}> geometries left out: {}", kind, kNothingThere));
      return;
    }
    Mesh mesh = shapes.take();
    if (mesh.objects.empty() && !notes.empty()) {
      const std::string& line = notes.back();  // "'NAME' is left out: WHY"
      throw source.error(*shape, fmt::format("<{}>: {}", kind, line.substr(line.rfind(": ") + 2)));
    }
    notes_.add_line(Level::Loss, notes);
    append(std::move(mesh), world_from_geometry);
  }

  void read_mesh(const SdfFile& source, const Element& shape, Eigen::Affine3d world_from_mesh,
                 const std::string& name) {
    const std::string uri = child_text(shape, "uri");
    if (uri.empty()) throw source.error(shape, "<mesh> without <uri>");
    if (shape.FirstChildElement("submesh") != nullptr)
      notes_.add_counted(Level::Guess, "{} <submesh> choices left out: the whole mesh is read");
    if (const Element* e = shape.FirstChildElement("scale")) {
      const std::vector<double> s = numbers(source, *e, 3, 1e6);
      const Eigen::Vector3d scale(s[0], s[1], s[2]);
      if (!(scale.cwiseAbs().minCoeff() > 0)) throw source.error(*e, "scale of 0");
      world_from_mesh.scale(scale);
    }
    const std::optional<std::filesystem::path> path = mesh_path(source, shape, uri);
    if (!path) return;
    const std::string key = path->lexically_normal().string();
    const auto [found, fresh] = meshes_.try_emplace(key);
    if (fresh) found->second = part_of(*path);
    const PartFile& part = found->second;
    Mesh mesh = part.mesh;
    for (Object& object : mesh.objects)
      if (!part.marked) object.name = fmt::format("{}::{}", name, object.name);
    if (!part.marked && split_surface(name).surface == Surface::Terrain) {
      for (Object& object : mesh.objects) object.surface = Surface::Terrain;
      mesh.materials.assign(mesh.materials.size(), Material::Ground);
    }
    append(std::move(mesh), world_from_mesh);
  }

  /// The path of a mesh; empty, with the reason stored, if it may not be read or does not exist.
  std::optional<std::filesystem::path> mesh_path(const SdfFile& source, const Element& shape,
                                                 const std::string& uri) {
    try {
      if (auto path = resolve(source, uri)) return path;
      throw source.error(shape, fmt::format("mesh '{}' is not in the file's folder", uri),
                         "put it there, or name it by a path relative to the file");
    } catch (const InputError& fault) {
      absent_.push_back(fault);
      return std::nullopt;
    }
  }

  /// A mesh file; empty, with the reason stored, if it cannot be read.
  PartFile part_of(const std::filesystem::path& path) {
    try {
      City part = read_mesh_part(path, {});
      notes_.append(part.notes, path);
      return {std::move(part.mesh), has_mesh_mark(path)};
    } catch (const InputError& fault) {
      absent_.push_back(fault);
      return {};
    }
  }

  /// Appends the objects of a mesh.
  void append(Mesh mesh, const Eigen::Affine3d& world_from_mesh) {
    for (Eigen::Vector3d& vertex : mesh.vertices) vertex = world_from_mesh * vertex;
    if (world_from_mesh.linear().determinant() < 0)
      for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
    for (const Object& object : mesh.objects) {
      const auto object_value = [&object](const auto& all) {
        const auto first = all.begin() + object.first_triangle;
        return std::vector(first, first + object.triangle_count);
      };
      degenerate_ += append_object(city_.mesh, object.name, object.surface, object_value(mesh.materials),
                                   mesh.vertices, object_value(mesh.triangles));
    }
  }

  std::filesystem::path path_, top_;  ///< as given, and the file it refers to
  City city_;
  double heading_rad_ = 0;
  std::map<std::string, std::unique_ptr<SdfFile>> sources_;
  std::map<std::string, PartFile> meshes_;
  ReadReport notes_;                              ///< losses and guesses that name the world
  std::vector<std::string> moving_;               ///< names of the world's models that are not static
  std::map<std::string, Eigen::Affine3d> state_;  ///< poses of the world's models
  std::set<std::string> deleted_;                 ///< names of these
  std::size_t moved_ = 0;                         ///< models moved by the state
  std::size_t degenerate_ = 0;
  Frames frames_;
  std::map<const Element*, Frames::Scope> included_;  ///< models of <include>
  std::vector<InputError> absent_;                    ///< why meshes and included models were not read
};

}  // namespace

City read_gazebo_world(const std::filesystem::path& path) {
  return GazeboImport(path).read();
}

}  // namespace canyon::city
