#include "canyon/city/buildings/sources/gml_objects.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon::buildings {
namespace {

/// The position of a geometry shared by many objects: CityGML's implicit geometry.
struct GmlTransform {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();  ///< before the reference point is added
  const GmlElement* reference = nullptr;                 ///< a Point
};

/// A polygon of an object.
struct GmlFace {
  const GmlElement* polygon = nullptr;
  bool reversed = false;
  std::string_view semantic;  ///< name of the thematic surface; empty without one
  int containment = -1;       ///< index of its GmlTransform; -1: it has its own coordinates
};

/// The polygons of one level of detail: of the object's own geometry, and of its thematic surfaces.
struct GmlDetail {
  std::vector<GmlFace> own, thematic;
  std::vector<GmlFace> footprint;  ///< of lod0FootPrint; lod0RoofEdge may describe the same
};

/// Collects geometry properties of objects, including their references.
class GmlFaces {
 public:
  GmlFaces(const GmlElement& root, const GmlLibrary& library);

  /// The levels of detail of an object, without nested objects.
  [[nodiscard]] std::map<int, GmlDetail> details_of(const GmlElement& object);

  [[nodiscard]] const std::vector<GmlTransform>& containments() const { return containments_; }
  /// Referenced ids that do not exist.
  [[nodiscard]] const std::set<std::string>& missing() const { return missing_; }
  /// The number of geometries in external files.
  [[nodiscard]] std::size_t external() const { return external_; }

 private:
  void index(const GmlElement& element);
  [[nodiscard]] const GmlElement* resolve(const std::string& href);
  void add_property(const GmlElement& property, std::string_view semantic, std::map<int, GmlDetail>& details);
  void add_thematic(const GmlElement& surface, std::map<int, GmlDetail>& details, int depth);
  void collect(const GmlElement& element, GmlFace like, int depth, std::vector<GmlFace>& faces);
  void collect_implicit(const GmlElement& geometry, GmlFace like, int depth, std::vector<GmlFace>& faces);

  const GmlLibrary& library_;
  std::unordered_map<std::string_view, const GmlElement*> by_id_;
  std::vector<GmlTransform> containments_;
  std::set<std::string> missing_;
  std::size_t external_ = 0;
};

constexpr int kDeepestReference = 64;

/// 2 of "lod2Solid"; empty for other names.
std::optional<int> lod_of_property(std::string_view name) {
  if (name.size() < 5 || name.substr(0, 3) != "lod" || name[3] < '0' || name[3] > '4') return std::nullopt;
  return name[3] - '0';
}

/// Takes names without the digits of "lod2Solid".
bool has_surfaces(std::string_view property) {
  const std::string_view kind = property.substr(4);
  return kind.find("Curve") == std::string_view::npos &&
         kind.find("TerrainIntersection") == std::string_view::npos && kind != "Point" &&
         kind != "PointCloud" && kind != "Network";
}

/// The older names of semantics renamed in CityGML 3.0.
std::string_view semantic_name(std::string_view surface) {
  if (surface == "WindowSurface") return "Window";
  if (surface == "DoorSurface") return "Door";
  return surface;
}

/// Equal for two descriptions of a face, independent of start corner and orientation: the number of corners,
/// the sum of their hashes, and the placement.
using FaceKey = std::tuple<std::size_t, std::uint64_t, int>;

std::uint64_t hash_of(const Eigen::Vector3d& point) {
  std::uint64_t hash = 0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::uint64_t bits = 0;
    const double value = point[axis] + 0.0;  // -0 is 0
    std::memcpy(&bits, &value, sizeof bits);
    // The finalizer of MurmurHash3.
    hash ^= bits;
    hash = (hash ^ (hash >> 33U)) * 0xff51afd7ed558ccdULL;
    hash = (hash ^ (hash >> 33U)) * 0xc4ceb9fe1a85ec53ULL;
    hash ^= hash >> 33U;
  }
  return hash;
}

FaceKey key_of(const GmlFace& face) {
  const std::vector<Eigen::Vector3d>& ring = face.polygon->rings.front();
  const bool closed = ring.size() > 1 && ring.front() == ring.back();
  const std::size_t count = ring.size() - (closed ? 1 : 0);
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < count; ++i) sum += hash_of(ring[i]);
  return {count, sum, face.containment};
}

/// Twice the area vector by Newell's method, in the square of the coordinates' unit.
Eigen::Vector3d twice_area_vector(const GmlFace& face) {
  const std::vector<Eigen::Vector3d>& ring = face.polygon->rings.front();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (std::size_t i = 2; i < ring.size(); ++i) normal += (ring[i - 1] - ring[0]).cross(ring[i] - ring[0]);
  return face.reversed ? Eigen::Vector3d(-normal) : normal;
}

/// The sum of twice the faces' areas, to compare descriptions.
double area_of(const std::vector<GmlFace>& faces) {
  double sum = 0;
  for (const GmlFace& face : faces) sum += twice_area_vector(face).norm();
  return sum;
}

GmlFaces::GmlFaces(const GmlElement& root, const GmlLibrary& library) : library_(library) {
  index(root);
}

void GmlFaces::index(const GmlElement& element) {
  if (!element.id.empty()) by_id_.emplace(element.id, &element);
  for (const GmlElement& child : element.children) index(child);
}

const GmlElement* GmlFaces::resolve(const std::string& href) {
  const std::string id = href.substr(href.find('#') + 1);  // the whole reference if there is no '#'
  if (const auto found = by_id_.find(id); found != by_id_.end()) return found->second;
  if (const auto found = library_.find(id); found != library_.end()) return &found->second;
  missing_.insert(id);
  return nullptr;
}

std::map<int, GmlDetail> GmlFaces::details_of(const GmlElement& object) {
  std::map<int, GmlDetail> details;
  int relief_lod = 0;
  if (const GmlElement* lod = object.child("lod"))
    relief_lod = static_cast<int>(std::clamp(parse_integer(lod->text).value_or(0), 0LL, 4LL));
  for (const GmlElement& property : object.children) {
    if (property.name == "boundedBy" || property.name == "boundary") {
      for (const GmlElement& surface : property.children) {
        const std::string& name = surface.name;
        const bool inside =  // visible only from rooms
            name == "InteriorWallSurface" || name == "CeilingSurface" || name == "FloorSurface";
        if (!inside && !is_gml_object(name)) add_thematic(surface, details, 0);
      }
    } else if (property.name == "tin") {
      collect(property, {}, 0, details[relief_lod].own);
    } else {
      add_property(property, {}, details);
    }
  }
  return details;
}

void GmlFaces::add_property(const GmlElement& property, std::string_view semantic,
                            std::map<int, GmlDetail>& details) {
  const std::optional<int> lod = lod_of_property(property.name);
  if (!lod || !has_surfaces(property.name)) return;
  GmlFace like;
  like.semantic = semantic;
  GmlDetail& detail = details[*lod];
  collect(property, like, 0,
          property.name == "lod0FootPrint" ? detail.footprint
          : semantic.empty()               ? detail.own
                                           : detail.thematic);
}

void GmlFaces::add_thematic(const GmlElement& surface, std::map<int, GmlDetail>& details, int depth) {
  if (depth > kDeepestReference) return;
  for (const GmlElement& property : surface.children) {
    add_property(property, semantic_name(surface.name), details);
    // Windows and doors.
    if (property.name != "opening" && property.name != "fillingSurface" && property.name != "filling")
      continue;
    for (const GmlElement& opening : property.children) add_thematic(opening, details, depth + 1);
  }
}

void GmlFaces::collect(const GmlElement& element, GmlFace like, int depth, std::vector<GmlFace>& faces) {
  if (depth > kDeepestReference) return;
  if (element.name == "ImplicitGeometry") {
    collect_implicit(element, like, depth, faces);
    return;
  }
  if (element.is_polygon()) {
    like.polygon = &element;
    faces.push_back(like);
    return;
  }
  if (element.name == "OrientableSurface" && element.reversed) like.reversed = !like.reversed;
  if (!element.href.empty()) {
    if (const GmlElement* target = resolve(element.href)) collect(*target, like, depth + 1, faces);
  }
  for (const GmlElement& child : element.children) {
    // The inner shells of a solid are cavities.
    if (element.name == "Solid" && child.name == "interior") continue;
    collect(child, like, depth + 1, faces);
  }
}

void GmlFaces::collect_implicit(const GmlElement& geometry, GmlFace like, int depth,
                                std::vector<GmlFace>& faces) {
  GmlTransform containment;
  if (const GmlElement* matrix = geometry.child("transformationMatrix")) {
    const std::vector<std::string_view> words = split_blanks(matrix->text);
    for (std::size_t i = 0; i < 16 && words.size() == 16; ++i) {
      containment.matrix(static_cast<Eigen::Index>(i / 4), static_cast<Eigen::Index>(i % 4)) =
          parse_double(words[i]).value_or(0);
    }
  }
  if (const GmlElement* reference = geometry.child("referencePoint")) {
    const GmlElement* point = reference->child("Point");
    if (point == nullptr && !reference->href.empty()) point = resolve(reference->href);
    if (point != nullptr && !point->positions.empty()) containment.reference = point;
  }
  if (containment.reference == nullptr) return;
  containments_.push_back(containment);
  like.containment = static_cast<int>(containments_.size()) - 1;
  if (geometry.child("libraryObject") != nullptr) ++external_;
  for (const char* name : {"relativeGMLGeometry", "relativeGeometry"})
    if (const GmlElement* relative = geometry.child(name)) collect(*relative, like, depth + 1, faces);
}

/// The faces of a level of detail, each polygon once: the thematic surfaces, and additional faces of the
/// object's own geometry. If both are separate shells, the larger one.
std::vector<GmlFace> merged_faces(const GmlDetail& detail) {
  std::vector<GmlFace> faces;
  std::set<FaceKey> seen;
  const auto add_all = [&](const std::vector<GmlFace>& more) {
    for (const GmlFace& face : more)
      if (seen.insert(key_of(face)).second) faces.push_back(face);
  };
  if (!detail.footprint.empty()) {
    add_all(detail.footprint);
    return faces;
  }
  add_all(detail.thematic);
  const std::size_t thematic = faces.size();
  add_all(detail.own);
  const std::size_t neighbour = faces.size() - thematic;
  const bool one_shell = thematic == 0 || 2 * neighbour <= detail.own.size();
  if (one_shell) return faces;
  // Two descriptions of the same object.
  const bool own = area_of(detail.own) > area_of(detail.thematic);
  faces.clear();
  seen.clear();
  add_all(own ? detail.own : detail.thematic);
  return faces;
}

/// Objects other than those of CityModel::builds() that it counts.
const std::set<std::string_view> kCounted{"MassPointRelief",
                                          "BreaklineRelief",
                                          "RasterRelief",
                                          "Road",
                                          "Railway",
                                          "Track",
                                          "Square",
                                          "Waterway",
                                          "LandUse",
                                          "WaterBody",
                                          "TransportationComplex",
                                          "GenericCityObject",
                                          "GenericOccupiedSpace",
                                          "GenericUnoccupiedSpace",
                                          "GenericThematicSurface"};
/// Objects that CityModel::add() uses, and those that it only counts.
bool is_city_object(std::string_view name) {
  return CityModel::builds(name) || kCounted.count(name) > 0;
}
/// Container objects without geometry.
bool only_holds_others(std::string_view name) {
  return name == "ReliefFeature" || name == "CityObjectGroup";
}

class GmlObjectReader {
 public:
  GmlObjectReader(const GmlElement& root, const GmlLibrary& library, CityModel& model)
      : faces_(root, library), model_(model) {}

  void read(const GmlElement& element, const std::string& parent) {
    CityObject object;
    object.id = element.id.empty() ? fmt::format("{} of line {}", element.name, element.line) : element.id;
    object.named = !element.id.empty();
    object.type = element.name;
    object.parent = parent;
    // Nested objects claim their polygons first.
    for (const GmlElement& property : element.children) {
      for (const GmlElement& child : property.children) {
        if (!is_gml_object(child.name)) continue;
        object.has_parts = object.has_parts || child.name == "BuildingPart" || child.name == "BridgePart" ||
                           child.name == "TunnelPart";
        read(child, only_holds_others(element.name) ? std::string() : object.id);
      }
    }
    if (only_holds_others(element.name)) return;
    if (is_city_object(element.name)) {
      read_attributes(element, object.attributes);
      read_geometry(element, object);
    }
    model_.add(std::move(object));
  }

  void count_what_is_missing() {
    if (!faces_.missing().empty())
      model_.leave_out("references to geometries that the file does not have", faces_.missing().size());
    if (faces_.external() > 0) model_.leave_out("geometries in external files", faces_.external());
  }

 private:
  /// @param holder element with the text of the value and its unit
  void take(const std::string& name, const GmlElement& holder, CityAttributes& attributes) {
    if (const auto value = value_in_metres(name, trim(holder.text), holder.unit))
      attributes.emplace(name, *value);
    else
      model_.leave_out(kOtherUnit);
  }

  void read_attributes(const GmlElement& element, CityAttributes& attributes) {
    for (const GmlElement& child : element.children) {
      if (is_gml_object(child.name) || child.name == "boundedBy" || child.name == "boundary" ||
          child.name.rfind("lod", 0) == 0)
        continue;
      const GmlElement* value = child.child("value");
      // <stringAttribute name="function"><value>..., and <Height><value>... of CityGML 3.0
      const std::string& name = child.key.empty() ? child.name : child.key;
      const GmlElement& holder = value != nullptr ? *value : child;
      if (!holder.text.empty() && attribute_matters(name))
        take(name, holder, attributes);
      else if (child.name == "Height" && value != nullptr)
        take("measuredHeight", *value, attributes);
      // Extensions (uro:buildingDetails) wrap their attributes.
      if (value == nullptr && child.rings.empty()) {
        for (const GmlElement& inner : child.children)
          if (!is_gml_object(inner.name)) read_wrapped(inner, attributes);
      }
    }
  }
  void read_wrapped(const GmlElement& element, CityAttributes& attributes) {
    if (element.name == "Height") {
      if (const GmlElement* value = element.child("value")) take("measuredHeight", *value, attributes);
      return;
    }
    read_attributes(element, attributes);
  }

  /// The usable levels of detail, best first. Levels with rooms, and outlines, are last.
  [[nodiscard]] std::vector<int> preferred(const std::map<int, GmlDetail>& details) const {
    constexpr int kWithRooms = 4;
    const ModelOptions& wanted = model_.options().model;
    std::vector<int> lods;
    for (auto detail = details.rbegin(); detail != details.rend(); ++detail)
      if (detail->first >= 1 && detail->first <= wanted.highest_lod()) lods.push_back(detail->first);
    if (!wanted.lod && details.count(kWithRooms) > 0) lods.push_back(kWithRooms);
    if (details.count(0) > 0) lods.push_back(0);
    return lods;
  }

  void read_geometry(const GmlElement& element, CityObject& object) {
    const std::map<int, GmlDetail> details = faces_.details_of(element);
    for (const int lod : preferred(details)) {
      std::vector<GmlFace> faces = merged_faces(details.at(lod));
      // A part has them already.
      faces.erase(std::remove_if(faces.begin(), faces.end(),
                                 [&](const GmlFace& face) {
                                   return face.containment < 0 && taken_.count(face.polygon) > 0;
                                 }),
                  faces.end());
      if (faces.empty()) continue;
      object.lod = lod;
      for (const GmlFace& face : faces)
        if (face.containment < 0) taken_.insert(face.polygon);
      add_surfaces(faces, object);
      if (!object.surfaces.empty()) break;
    }
    if (!faces_.containments().empty()) transform_object(object);
  }

  /// The first implicit geometry of the current object.
  void transform_object(CityObject& object) {
    const std::size_t first = transforms_seen_;
    transforms_seen_ = faces_.containments().size();
    if (first == transforms_seen_) return;
    const Eigen::Vector3d position = origin_of(faces_.containments()[first]);
    if (position.allFinite()) object.transform_to_wgs84 = position;
  }

  /// Longitude, latitude [deg], ellipsoidal height [m].
  Eigen::Vector3d origin_of(const GmlTransform& containment) {
    const GmlElement& point = *containment.reference;
    const std::size_t system = system_of(point);
    std::vector<Eigen::Vector3d> points{model_.east_first(system, point.positions.front())};
    model_.to_wgs84(system, points);
    return points.front();
  }

  std::size_t system_of(const GmlElement& element) {
    const std::string* name = element.system.get();
    const auto known = systems_.find(name);
    if (known != systems_.end()) return known->second;
    const std::size_t system = model_.system(name == nullptr ? std::string() : *name, false, element.line);
    systems_.emplace(name, system);
    return system;
  }

  using Points = std::vector<Eigen::Vector3d>;

  void transform_relative(const GmlTransform& containment, Points& points) {
    const std::size_t system = system_of(*containment.reference);
    model_.transform_to_wgs84(system, containment.matrix,
                              model_.east_first(system, containment.reference->positions.front()), points);
  }

  void add_surfaces(const std::vector<GmlFace>& faces, CityObject& object) {
    // Points in WGS 84 by placement and reference system, in the order of the faces.
    struct Batch {
      Points points;
      std::size_t taken = 0;
    };
    std::map<std::pair<int, std::size_t>, Batch> batches;
    const auto batch_of = [&](const GmlFace& face) -> Batch& {
      return batches[{face.containment, face.containment < 0 ? system_of(*face.polygon) : 0}];
    };
    for (const GmlFace& face : faces) {
      Points& points = batch_of(face).points;
      for (const Points& ring : face.polygon->rings) points.insert(points.end(), ring.begin(), ring.end());
    }
    for (auto& [key, batch] : batches) {
      if (key.first < 0) {
        for (Eigen::Vector3d& p : batch.points) p = model_.east_first(key.second, p);
        model_.to_wgs84(key.second, batch.points);
      } else {
        transform_relative(faces_.containments()[static_cast<std::size_t>(key.first)], batch.points);
      }
    }
    std::size_t off_earth = 0;
    for (const GmlFace& face : faces) {
      MapSurface surface;
      surface.semantic = face.semantic;
      Batch& batch = batch_of(face);
      bool outer = true, good = true;
      for (const Points& raw : face.polygon->rings) {
        Points ring;
        for (std::size_t i = 0; i < raw.size(); ++i) {
          const Eigen::Vector3d& point = batch.points[batch.taken++];
          if (ring.empty() || ring.back() != point) ring.push_back(point);
        }
        if (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
        if (face.reversed) std::reverse(ring.begin(), ring.end());
        const bool finite =
            std::all_of(ring.begin(), ring.end(), [](const Eigen::Vector3d& p) { return p.allFinite(); });
        if (!finite) ++off_earth;
        const bool low_or_high =
            finite && std::any_of(ring.begin(), ring.end(),
                                  [](const Eigen::Vector3d& p) { return !is_height_of_city(p.z()); });
        if (low_or_high) {
          model_.leave_out("rings with heights outside -500 to 10,000 m");
          ring.clear();
        }
        if (raw.empty())
          model_.leave_out("rings whose coordinates are not numbers or not whole points");
        else if (finite && !low_or_high && ring.size() < 3)
          model_.leave_out("rings of fewer than three points");
        if (finite && ring.size() >= 3)
          if (outer)
            surface.outer = std::move(ring);
          else
            surface.inners.push_back(std::move(ring));
        else if (outer)
          good = false;
        outer = false;
      }
      if (good) object.surfaces.push_back(std::move(surface));
    }
    if (off_earth > 0) {
      model_.leave_out(kElsewhere, off_earth);
      model_.add_line(
          ReadReport::Level::Loss,
          fmt::format("object \"{}\" has coordinates outside the area of its reference system", object.id));
    }
  }

  GmlFaces faces_;
  CityModel& model_;
  std::set<const GmlElement*> taken_;
  std::map<const std::string*, std::size_t> systems_;
  std::size_t transforms_seen_ = 0;
};

}  // namespace

bool is_gml_object(std::string_view name) {
  return is_city_object(name) || only_holds_others(name);
}

std::set<std::string> missing_references(const GmlElement& object, const GmlLibrary& library) {
  GmlFaces faces(object, library);
  const auto follow = [&](const auto& self, const GmlElement& element) -> void {
    (void)faces.details_of(element);
    for (const GmlElement& property : element.children) {
      for (const GmlElement& child : property.children)
        if (is_gml_object(child.name)) self(self, child);
    }
  };
  follow(follow, object);
  return faces.missing();
}

void read_gml_object(const GmlElement& object, const GmlLibrary& library, CityModel& model) {
  GmlObjectReader reader(object, library, model);
  reader.read(object, {});
  reader.count_what_is_missing();
}

int handedness(const GmlElement& object) {
  const GmlLibrary none;
  GmlFaces faces(object, none);
  double roofs = 0, grounds = 0, volume = 0;
  for (const auto& [lod, detail] : faces.details_of(object)) {
    for (const GmlFace& face : detail.thematic) {
      const double up = twice_area_vector(face).z();
      if (face.semantic == "RoofSurface") roofs += up;
      if (face.semantic == "GroundSurface") grounds += up;
    }
    if (lod == 0 || detail.own.empty() || detail.own.front().polygon->rings.front().empty()) continue;
    const Eigen::Vector3d about = detail.own.front().polygon->rings.front().front();
    for (const GmlFace& face : detail.own) {
      const std::vector<Eigen::Vector3d>& ring = face.polygon->rings.front();
      if (!ring.empty()) volume += twice_area_vector(face).dot(ring.front() - about);
    }
  }
  for (const GmlElement& property : object.children) {
    for (const GmlElement& child : property.children) {
      // The parts decide if the whole has no shape of its own.
      if (roofs == 0 && is_gml_object(child.name)) roofs = handedness(child);
    }
  }
  // Ground faces have the wrong orientation most often.
  const double reported = roofs != 0 ? roofs : volume != 0 ? volume : -grounds;
  return reported > 0 ? 1 : reported < 0 ? -1 : 0;
}

}  // namespace canyon::buildings
