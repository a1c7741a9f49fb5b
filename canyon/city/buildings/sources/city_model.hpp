#pragma once

#include <Eigen/Core>
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

/// How files of a city model are read.
struct CityReadOptions {
  ModelOptions model;
  TerrainOptions heights;
  std::optional<LonLatBox> box;  ///< only what touches it
};

/// Whether a height above the ellipsoid [m] can be one of a building or of the ground below it: fill values
/// and other units cannot.
[[nodiscard]] constexpr bool is_height_of_city(double height_m) {
  return height_m >= -500 && height_m <= 10'000;
}

/// The names under which CityModel::leave_out() counts them.
inline constexpr const char* kElsewhere = "rings outside the area of their reference system";

/// The names and values of a city model's objects, by the names that the file gives them.
using CityAttributes = std::map<std::string, std::string>;

/// One object of a city model as its file has it, in WGS 84.
struct CityObject {
  std::string id, type;
  std::string parent;  ///< id of the object that it is a part of
  CityAttributes attributes;
  double lod = -1;  ///< of the surfaces; below 1 these are outlines; below 0: it has no geometry
  std::vector<MapSurface> surfaces;
  std::optional<Eigen::Vector3d> place;  ///< of a geometry that many objects share (lon, lat [deg], height)
  bool has_parts = false;
  bool named = true;  ///< the file has its id
};

/// Gathers the objects of the files of a city model, CityGML or CityJSON, as the features of a map: kinds,
/// tags, what replaces what, and counts of what is left out.
class CityModel {
 public:
  explicit CityModel(const CityReadOptions& options);

  [[nodiscard]] const CityReadOptions& options() const { return options_; }

  /// Everything that is added after this call belongs to `file`.
  void begin_file(const std::filesystem::path& file);
  /// Takes back what was added since begin_file().
  void drop_file();
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }

  /// Numbers of reference systems are used until the model ends. Throws InputError as ReferenceSystem does.
  /// @param ogc_name as the file names it; empty where it names none
  /// @param east_first that the file's format puts east first, whatever the authority says
  /// @param line for messages
  [[nodiscard]] std::size_t system(const std::string& ogc_name, bool east_first, int line);
  [[nodiscard]] const ReferenceSystem& reference(std::size_t system) const {
    return systems_[system].reference;
  }
  /// Who tells whether the file's objects have east first (1), north first (-1), or neither (0): asked where
  /// the authority lists north first and both orders have a place in the system's area of use.
  using Handedness = std::function<int()>;
  void ask_handedness(Handedness handedness) { handedness_ = std::move(handedness); }
  /// East (or longitude) first, as the file's order of axes is. That order is decided once for a file and
  /// system, by the first point whose place tells it.
  [[nodiscard]] Eigen::Vector3d east_first(std::size_t system, const Eigen::Vector3d& point);
  /// Converts in place: east, north, height to longitude, latitude [deg], ellipsoidal height [m]; NaN where
  /// the system does not reach. Longitudes are within 180 deg of the first of all.
  void to_wgs84(std::size_t system, std::vector<Eigen::Vector3d>& points);

  /// Converts in place to WGS 84: points of a geometry that many objects share [m], moved by `matrix` and
  /// then to `origin` (of the file, east first). In a geographic system they are east, north, up about it.
  void place(std::size_t system, const Eigen::Matrix4d& matrix, const Eigen::Vector3d& origin,
             std::vector<Eigen::Vector3d>& points);

  using Level = ReadReport::Level;
  void leave_out(const std::string& what, std::size_t count = 1, Level level = Level::Loss) {
    tally_.notes.tell(level, "left out {} " + what, {}, count);
  }
  /// One line of a kind; how often it was said is counted.
  void say(Level level, const std::string& line) { tally_.notes.tell(level, line); }
  void add(CityObject object);
  /// Whether a city is built of objects of that type.
  [[nodiscard]] static bool builds(std::string_view type);

  /// The features, sorted by id. Throws InputError where there are none and no box is asked for.
  /// @param name of all of the files, for messages
  [[nodiscard]] MapData finish(const std::filesystem::path& name);

 private:
  struct System {
    std::string name;
    ReferenceSystem reference;
    bool east_first = false;  ///< by the format
    std::optional<bool> swap;
    std::size_t files = 0;
  };
  /// What describe() tells of all files so far.
  struct Tally {
    ReadReport notes;
    std::map<std::string, std::size_t> kinds;
    std::size_t outside = 0, repeated = 0;
  };

  void add_building(CityObject object, bool part);
  void add_tree(CityObject object);
  void add_wood(CityObject object);
  [[nodiscard]] bool leaves_out_low(const MapFeature& feature);
  [[nodiscard]] static std::string id_and_place(const MapFeature& feature);
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
  std::map<std::string, CityAttributes> tags_of_wholes_;  ///< of the file's objects that have parts
  std::set<std::string> seen_;                            ///< id and place of the features of other files
  std::map<std::string, std::string> here_;               ///< the same of the file, by id
  Tally tally_, tally_before_;                            ///< the second: before the file
  Handedness handedness_;
  std::size_t files_ = 0;
};

/// Whether add_tags_of_attributes() looks at an attribute of that name.
[[nodiscard]] bool attribute_matters(std::string_view name);

/// A value of an attribute, a length in metres; other attributes as they are. Nothing for a length in a unit
/// that is not known.
/// @param unit as files name it ("ft", "#m", "urn:ogc:def:uom:EPSG::9002", "[ft_i]"); metres where it is
/// empty
[[nodiscard]] std::optional<std::string> value_in_metres(std::string_view name, std::string_view value,
                                                         std::string_view unit);
/// Such values, for CityModel::leave_out().
inline constexpr const char* kOtherUnit = "attributes in units of length that are not known";

/// Adds the tags of OpenStreetMap that the attributes of CityGML, CityJSON and of common extensions stand
/// for, where these tags are not there yet: `height`, `building:levels`, `building:material`,
/// `roof:material`, `start_date`, `diameter_crown`, and `building:structure` ("wood", "masonry", "concrete",
/// "steel") of PLATEAU's structure codes. Values that stand for "not known" (-9999, year 0001) are left out.
void add_tags_of_attributes(CityAttributes& tags);

/// Whether attributes say that a building is torn down or was never built: a demolition or an end of its
/// life that has_ended(), or such a status of the Dutch register of buildings.
[[nodiscard]] bool is_gone(const CityAttributes& attributes);

/// The value of the tag `building` for a building with these attributes, by its function, usage and class:
/// the codes of AdV ("31001_2020", four digits), of PLATEAU (three digits), or a word. "yes" where none is
/// known.
[[nodiscard]] std::string building_use(const CityAttributes& attributes);

}  // namespace canyon::buildings
