#pragma once

#include <Eigen/Core>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "canyon/buildings/sources/city_model.hpp"
#include "canyon/buildings/sources/gml_document.hpp"

namespace canyon::buildings {

/// Geometries of a document by their ids, for references to them from elsewhere.
using GmlLibrary = std::unordered_map<std::string, GmlElement>;

/// Whether an element of that name is an object that read_gml_object() makes something of, or counts.
[[nodiscard]] bool is_gml_object(std::string_view name);

/// The ids that references of an object lead to and that neither the object nor `library` has.
[[nodiscard]] std::set<std::string> missing_references(const GmlElement& object, const GmlLibrary& library);

/// Adds an object of CityGML and the objects in it (parts, installations, reliefs) to a model, each with the
/// geometry of its best level of detail. References that lead nowhere are counted.
void read_gml_object(const GmlElement& object, const GmlLibrary& library, CityModel& model);

/// Where a geometry that many objects share stands: CityGML's implicit geometry.
struct GmlPlacement {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();  ///< before the reference point is added
  const GmlElement* reference = nullptr;                 ///< a Point
};

/// A polygon of an object.
struct GmlFace {
  const GmlElement* polygon = nullptr;
  bool reversed = false;
  std::string_view semantic;  ///< name of the thematic surface; empty without one
  int placement = -1;         ///< number of its GmlPlacement; -1: it has coordinates of its own
};

/// The polygons of one level of detail: of the object's own geometry, and of its thematic surfaces.
struct GmlDetail {
  std::vector<GmlFace> own, thematic;
  std::vector<GmlFace> footprint;  ///< of lod0FootPrint, of which lod0RoofEdge may be another view
};

/// Follows the geometry properties of objects, with their references.
class GmlFaces {
 public:
  GmlFaces(const GmlElement& root, const GmlLibrary& library);

  /// The levels of detail that an object has; the objects in it are passed over.
  [[nodiscard]] std::map<int, GmlDetail> details_of(const GmlElement& object);

  [[nodiscard]] const std::vector<GmlPlacement>& placements() const { return placements_; }
  /// Ids that were referred to and are not there.
  [[nodiscard]] const std::set<std::string>& missing() const { return missing_; }
  /// How many geometries are in files of their own.
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
  std::vector<GmlPlacement> placements_;
  std::set<std::string> missing_;
  std::size_t external_ = 0;
};

/// Whether the coordinates of an object's faces are right-handed in the order that the file has them, which
/// is that of east, north, up: its roofs look up and its grounds down then, and its solids have a positive
/// volume. 1: they are; -1: they are left-handed (north, east, up); 0: it does not tell.
[[nodiscard]] int handedness(const GmlElement& object);

/// The faces of a level of detail, each polygon once: the thematic surfaces, and what the object's own
/// geometry has beside them. Where both are shells of their own, the larger one.
[[nodiscard]] std::vector<GmlFace> merged_faces(const GmlDetail& detail);

}  // namespace canyon::buildings
