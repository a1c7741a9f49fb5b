#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "canyon/city/buildings/sources/city_model.hpp"
#include "canyon/city/buildings/sources/model_kind.hpp"

namespace canyon::buildings {

/// An element of GML without its namespace. A polygon (Polygon, PolygonPatch, Triangle, Rectangle) has its
/// rings in place of children; points are as the file has them, two-dimensional ones with height 0.
struct GmlElement {
  std::string name;
  std::string id;    ///< gml:id
  std::string href;  ///< xlink:href
  std::string key;   ///< the attribute `name`, of generic attributes
  std::string unit;  ///< the attribute `uom`
  std::string text;
  bool reversed = false;                      ///< orientation="-"
  std::shared_ptr<const std::string> system;  ///< srsName that holds here; null where none does
  int line = 0;                               ///< of its end
  std::vector<Eigen::Vector3d> positions;     ///< of a Point or a curve
  /// The rings of a polygon, the exterior first. A ring with a coordinate that is not a number is empty.
  std::vector<std::vector<Eigen::Vector3d>> rings;
  std::vector<GmlElement> children;

  [[nodiscard]] bool is_polygon() const { return !rings.empty(); }
  /// The first child of that name; null where there is none.
  [[nodiscard]] const GmlElement* child(std::string_view child_name) const;
};

/// The box of a CityModel, gml:boundedBy.
struct GmlEnvelope {
  Eigen::Vector3d lower, upper;
  std::shared_ptr<const std::string> system;
  int line = 0;
};

/// The bytes of a file, unpacked as GzipFile does. Throws InputError where the packed data end early.
[[nodiscard]] ByteReader file_bytes(const std::filesystem::path& path);

/// Functions that take a document's parts while it is read.
struct GmlSink {
  std::function<bool(const GmlEnvelope&)> envelope;  ///< false ends the reading
  std::function<bool(GmlElement)> member;            ///< an object of the model; false likewise
};

/// Reads a document with expat, one object of the model at a time: memory holds the largest of them.
/// Appearances, addresses and rooms are passed over. Throws InputError with the line: not XML or cut short,
/// not a CityModel, entity declarations (they can unpack without bound), elements nested more than 200 deep,
/// coordinates that are not numbers.
void read_gml(const std::filesystem::path& file, const ByteReader& bytes, const GmlSink& sink);

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
