// Declared in canyon/city/buildings/sources/gml_document.hpp.
#include "canyon/city/buildings/sources/gml_document.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <optional>
#include <set>
#include <tuple>

#include "canyon/base/text.hpp"

namespace canyon::buildings {
namespace {

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

/// Whether a thematic surface is seen from rooms only.
bool is_inside(std::string_view surface) {
  return surface == "InteriorWallSurface" || surface == "CeilingSurface" || surface == "FloorSurface";
}

/// The semantics that CityGML 3.0 calls otherwise.
std::string_view semantic_name(std::string_view surface) {
  if (surface == "WindowSurface") return "Window";
  if (surface == "DoorSurface") return "Door";
  return surface;
}

/// Where two descriptions of a face agree, whatever corner they begin with and whichever way they turn: the
/// number of corners, the sum of their hashes, and the placement.
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
  return {count, sum, face.placement};
}

/// Twice the area vector by Newell's method, in the square of the coordinates' unit.
Eigen::Vector3d twice_area_vector(const GmlFace& face) {
  const std::vector<Eigen::Vector3d>& ring = face.polygon->rings.front();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (std::size_t i = 2; i < ring.size(); ++i) normal += (ring[i - 1] - ring[0]).cross(ring[i] - ring[0]);
  return face.reversed ? Eigen::Vector3d(-normal) : normal;
}

/// The sum of twice the faces' areas, by which descriptions are compared.
double area_of(const std::vector<GmlFace>& faces) {
  double sum = 0;
  for (const GmlFace& face : faces) sum += twice_area_vector(face).norm();
  return sum;
}

}  // namespace

GmlFaces::GmlFaces(const GmlElement& root, const GmlLibrary& library) : library_(library) {
  index(root);
}

void GmlFaces::index(const GmlElement& element) {
  if (!element.id.empty()) by_id_.emplace(element.id, &element);
  for (const GmlElement& child : element.children) index(child);
}

const GmlElement* GmlFaces::resolve(const std::string& href) {
  const std::string id = href.substr(href.find('#') + 1);  // all of it without a mark
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
        if (!is_gml_object(surface.name) && !is_inside(surface.name)) add_thematic(surface, details, 0);
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
  GmlPlacement placement;
  if (const GmlElement* matrix = geometry.child("transformationMatrix")) {
    const std::vector<std::string_view> words = split_blanks(matrix->text);
    for (std::size_t i = 0; i < 16 && words.size() == 16; ++i) {
      placement.matrix(static_cast<Eigen::Index>(i / 4), static_cast<Eigen::Index>(i % 4)) =
          parse_double(words[i]).value_or(0);
    }
  }
  if (const GmlElement* reference = geometry.child("referencePoint")) {
    const GmlElement* point = reference->child("Point");
    if (point == nullptr && !reference->href.empty()) point = resolve(reference->href);
    if (point != nullptr && !point->positions.empty()) placement.reference = point;
  }
  if (placement.reference == nullptr) return;
  placements_.push_back(placement);
  like.placement = static_cast<int>(placements_.size()) - 1;
  if (geometry.child("libraryObject") != nullptr) ++external_;
  for (const char* name : {"relativeGMLGeometry", "relativeGeometry"}) {
    if (const GmlElement* relative = geometry.child(name)) collect(*relative, like, depth + 1, faces);
  }
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
      // The parts decide where the whole has no shape of its own.
      if (roofs == 0 && is_gml_object(child.name)) roofs = handedness(child);
    }
  }
  // Grounds are the faces that are drawn the wrong way round most often.
  const double told = roofs != 0 ? roofs : volume != 0 ? volume : -grounds;
  return told > 0 ? 1 : told < 0 ? -1 : 0;
}

std::vector<GmlFace> merged_faces(const GmlDetail& detail) {
  std::vector<GmlFace> faces;
  std::set<FaceKey> seen;
  const auto add_all = [&](const std::vector<GmlFace>& more) {
    for (const GmlFace& face : more) {
      if (seen.insert(key_of(face)).second) faces.push_back(face);
    }
  };
  if (!detail.footprint.empty()) {
    add_all(detail.footprint);
    return faces;
  }
  add_all(detail.thematic);
  const std::size_t thematic = faces.size();
  add_all(detail.own);
  const std::size_t beside = faces.size() - thematic;
  const bool one_shell = thematic == 0 || 2 * beside <= detail.own.size();
  if (one_shell) return faces;
  // Two views of the same thing.
  const bool own = area_of(detail.own) > area_of(detail.thematic);
  faces.clear();
  seen.clear();
  add_all(own ? detail.own : detail.thematic);
  return faces;
}

}  // namespace canyon::buildings
