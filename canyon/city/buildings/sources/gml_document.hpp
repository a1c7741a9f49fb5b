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

}  // namespace canyon::buildings
