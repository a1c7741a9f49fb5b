#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/city/buildings/sources/city_model.hpp"
#include "canyon/city/buildings/sources/model_kind.hpp"

namespace canyon::buildings {

/// An element of GML without its namespace. A polygon (Polygon, PolygonPatch, Triangle, Rectangle) has its
/// rings instead of children; points are as in the file, two-dimensional ones with height 0.
struct GmlElement {
  std::string name;
  std::string id;    ///< gml:id
  std::string href;  ///< xlink:href
  std::string key;   ///< the attribute `name`, of generic attributes
  std::string unit;  ///< the attribute `uom`
  std::string text;
  bool reversed = false;                      ///< orientation="-"
  std::shared_ptr<const std::string> system;  ///< srsName in effect here; null if there is none
  int line = 0;                               ///< of its end tag
  std::vector<Eigen::Vector3d> positions;     ///< of a Point or a curve
  /// The rings of a polygon, the exterior first. A ring with a coordinate that is not a number is empty.
  std::vector<std::vector<Eigen::Vector3d>> rings;
  std::vector<GmlElement> children;

  [[nodiscard]] bool is_polygon() const { return !rings.empty(); }
  /// The first child of that name; null if there is none.
  [[nodiscard]] const GmlElement* child(std::string_view child_name) const;
};

/// The box of a CityModel, gml:boundedBy.
struct GmlEnvelope {
  Eigen::Vector3d lower, upper;
  std::shared_ptr<const std::string> system;
  int line = 0;
};

/// The bytes of a file, unpacked as GzipFile does. Throws InputError if the packed data end early.
[[nodiscard]] ByteReader file_bytes(const std::filesystem::path& path);

/// Functions that receive a document's parts during reading.
struct GmlSink {
  std::function<bool(const GmlEnvelope&)> envelope;  ///< false stops the reading
  std::function<bool(GmlElement)> member;            ///< an object of the model; false likewise
};

/// Reads a document with expat, one object of the model at a time, so memory holds only the largest one.
/// Appearances, addresses and rooms are skipped. Throws InputError with the line: not XML or cut short, not a
/// CityModel, entity declarations (they can expand without bound), elements nested more than 200 deep,
/// coordinates that are not numbers.
void read_gml(const std::filesystem::path& file, const ByteReader& bytes, const GmlSink& sink);

}  // namespace canyon::buildings
