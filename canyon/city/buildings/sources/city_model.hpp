#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/city/buildings/sources/map_data.hpp"
#include "canyon/city/buildings/sources/map_options.hpp"
#include "canyon/city/buildings/sources/reference_system.hpp"

namespace canyon::buildings {

/// Options for reading the files of a city model.
struct CityReadOptions {
  ModelOptions model;
  TerrainOptions heights;
  std::optional<LonLatBox> box;  ///< only objects that touch it
};

/// Whether a height above the ellipsoid [m] is plausible for a building or the ground below it; fill values
/// and wrong units are not.
[[nodiscard]] constexpr bool is_height_of_city(double height_m) {
  return height_m >= -500 && height_m <= 10'000;
}

/// Texts of items that CityModel::leave_out() counts.
inline constexpr const char* kElsewhere = "rings outside the area of their reference system";

/// The attribute values of a city model's objects, by the file's attribute names.
using CityAttributes = std::map<std::string, std::string>;

/// One object of a city model as in its file, in WGS 84.
struct CityObject {
  std::string id, type;
  std::string parent;  ///< id of the whole of which the object is a part
  CityAttributes attributes;
  double lod = -1;  ///< of the surfaces; below 1 these are outlines; below 0: no geometry
  std::vector<MapSurface> surfaces;
  std::optional<Eigen::Vector3d>
      transform_to_wgs84;  ///< of a geometry shared by many objects (lon, lat [deg], height)
  bool has_parts = false;
  bool named = true;  ///< the id is from the file
};

/// Collects the objects of the files of a city model, CityGML or CityJSON, as the features of a map: kinds,
/// tags, replacements of wholes by parts, and counts of omitted objects.
class CityModel {
 public:
  explicit CityModel(const CityReadOptions& options);

  [[nodiscard]] const CityReadOptions& options() const { return options_; }

  /// Objects added after this call belong to `file`.
  void begin_file(const std::filesystem::path& file);
  /// Removes everything added since begin_file().
  void drop_file();
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }

  /// The number of a reference system, valid for the model's lifetime. Throws as ReferenceSystem does.
  /// @param ogc_name as in the file; empty if the file names none
  /// @param east_first the file's format puts east first, independent of the authority
  /// @param line for messages
  [[nodiscard]] std::size_t system(const std::string& ogc_name, bool east_first, int line);
  [[nodiscard]] const ReferenceSystem& reference(std::size_t system) const {
    return systems_[system].reference;
  }
  /// Returns whether the file's objects have east first (1), north first (-1), or neither (0). Called if the
  /// authority lists north first and both orders are in the system's area of use.
  using Handedness = std::function<int()>;
  void query_handedness(Handedness handedness) { handedness_ = std::move(handedness); }
  /// The point with east (or longitude) first, by the axis order of the file. This order is decided once for
  /// a file and system, by the first point whose position is unambiguous.
  [[nodiscard]] Eigen::Vector3d east_first(std::size_t system, const Eigen::Vector3d& point);
  /// Converts in place: east, north, height to longitude, latitude [deg], ellipsoidal height [m]; NaN outside
  /// the system's range. Longitudes are within 180 deg of the first point's.
  void to_wgs84(std::size_t system, std::vector<Eigen::Vector3d>& points);

  /// Converts in place to WGS 84: points of a geometry shared by many objects [m], transformed by `matrix`
  /// and then moved to `origin` (of the file, east first). In a geographic system: east, north, up.
  void transform_to_wgs84(std::size_t system, const Eigen::Matrix4d& matrix, const Eigen::Vector3d& origin,
                          std::vector<Eigen::Vector3d>& points);

  using Level = ReadReport::Level;
  void leave_out(const std::string& what, std::size_t count = 1, Level level = Level::Loss) {
    tally_.notes.add_counted(level, "left out {} " + what, {}, count);
  }
  /// One line of a kind; repetitions are counted.
  void add_line(Level level, const std::string& line) { tally_.notes.add_counted(level, line); }
  void add(CityObject object);
  /// Whether a city has objects of that type.
  [[nodiscard]] static bool builds(std::string_view type);

  /// The features, sorted by id. Throws InputError if there are none and no box is requested.
  /// @param name of all files, for messages
  [[nodiscard]] MapData finish(const std::filesystem::path& name);

 private:
  struct System {
    std::string name;
    ReferenceSystem reference;
    bool east_first = false;  ///< by the format
    std::optional<bool> swap;
    std::size_t files = 0;
  };
  /// The contents of describe() for all files so far.
  struct Tally {
    ReadReport notes;
    std::map<std::string, std::size_t> kinds;
    std::size_t outside = 0, repeated = 0;
  };

  void add_building(CityObject object, bool part);
  void add_tree(CityObject object);
  void add_wood(CityObject object);
  [[nodiscard]] bool leaves_out_low(const MapFeature& feature);
  [[nodiscard]] static std::string id_and_location(const MapFeature& feature);
  void keep(MapFeature feature, const CityObject& object);
  [[nodiscard]] bool in_box(const Eigen::AlignedBox2d& bounds) const;
  void finish_file();
  void describe(MapData& data) const;

  CityReadOptions options_;
  std::filesystem::path file_;
  std::vector<System> systems_;
  std::set<std::size_t> systems_of_file_;
  std::optional<double> longitude_;  ///< of the first point
  MapData data_;
  std::vector<double> lods_;                              ///< of data_.features
  std::size_t first_feature_ = 0;                         ///< of the file
  std::size_t first_relief_ = 0;                          ///< likewise
  std::map<std::string, CityAttributes> tags_of_wholes_;  ///< of the file's objects with parts
  std::set<std::string> seen_;                            ///< id and position of the features of other files
  std::map<std::string, std::string> here_;               ///< the same for this file, by id
  Tally tally_, tally_before_;                            ///< the second: state before the file
  Handedness handedness_;
  std::size_t files_ = 0;
};

/// Whether add_tags_of_attributes() uses an attribute of that name.
[[nodiscard]] bool attribute_matters(std::string_view name);

/// A value of an attribute: lengths in metres, others unchanged. Empty for a length of unknown unit.
/// @param unit as in files ("ft", "#m", "urn:ogc:def:uom:EPSG::9002", "[ft_i]"); empty: metres
[[nodiscard]] std::optional<std::string> value_in_metres(std::string_view name, std::string_view value,
                                                         std::string_view unit);
/// Counter text of these values, for CityModel::leave_out().
inline constexpr const char* kOtherUnit = "attributes in units of length that are not known";

/// Adds missing OpenStreetMap tags from the attributes of CityGML, CityJSON and common extensions: `height`,
/// `building:levels`, `building:material`, `roof:material`, `start_date`, `diameter_crown`, and
/// `building:structure` ("wood", "masonry", "concrete", "steel") from PLATEAU's structure codes. Placeholders
/// for "not known" (-9999, year 0001) are ignored.
void add_tags_of_attributes(CityAttributes& tags);

/// Whether attributes mark a building as torn down or never built: a demolition date or end of life that
/// has_ended(), or such a status of the Dutch register of buildings.
[[nodiscard]] bool is_gone(const CityAttributes& attributes);

/// The value of the tag `building` for these attributes, by function, usage and class: codes of AdV
/// ("31001_2020", four digits), of PLATEAU (three digits), or a word. "yes" if none is known.
[[nodiscard]] std::string building_use(const CityAttributes& attributes);

}  // namespace canyon::buildings
