#include "canyon/city/buildings/sources/city_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/named.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/meshes/polygon.hpp"

namespace canyon::buildings {
namespace {

enum class Role : std::uint8_t { Building, Part, Structure, Tree, Wood, Relief };

/// The outdoor objects of CityGML 1.0 to 3.0 and CityJSON 1.0 to 2.0.
const auto kRoles = dictionary<Role>(
    {{"Building", Role::Building},
     {"BuildingPart", Role::Part},
     {"BuildingInstallation|BuildingConstructiveElement|Bridge|BridgePart|BridgeInstallation|"
      "BridgeConstructionElement|BridgeConstructiveElement|Tunnel|TunnelPart|TunnelInstallation|"
      "TunnelConstructiveElement|OtherConstruction|CityFurniture",
      Role::Structure},
     {"SolitaryVegetationObject", Role::Tree},
     {"PlantCover", Role::Wood},
     {"TINRelief", Role::Relief}});

Eigen::AlignedBox3d extent_of(const std::vector<MapSurface>& surfaces) {
  Eigen::AlignedBox3d box;
  for (const MapSurface& surface : surfaces)
    for (const Eigen::Vector3d& corner : surface.outer) box.extend(corner);
  return box;
}

MapRing lon_lat(const std::vector<Eigen::Vector3d>& points) {
  MapRing ring;
  ring.reserve(points.size());
  for (const Eigen::Vector3d& p : points) ring.emplace_back(p.x(), p.y());
  return ring;
}

/// The outlines of surfaces, without vertical ones.
std::vector<MapPolygon> outlines_of(const std::vector<MapSurface>& surfaces) {
  constexpr double kThinnest_deg2 = 1e-13;  // 1 cm by 1 m
  std::vector<MapPolygon> outlines;
  for (const MapSurface& surface : surfaces) {
    MapRing ring = lon_lat(surface.outer);
    if (std::abs(meshes::twice_area(ring)) < 2 * kThinnest_deg2) continue;
    MapPolygon& outline = outlines.emplace_back();
    outline.outer = std::move(ring);
    for (const auto& inner : surface.inners) outline.inners.push_back(lon_lat(inner));
  }
  return outlines;
}

/// Counts the buildings and parts, and those with each attribute that affects facades.
std::string attributes_line(const MapData& data) {
  std::size_t all = 0, uses = 0, years = 0, structures = 0, materials = 0;
  for (const MapFeature& feature : data.features) {
    const bool part = feature.kind == FeatureKind::Part;
    if (!part && feature.kind != FeatureKind::Building) continue;
    ++all;
    const auto own = feature.tags.find(part ? "building:part" : "building");
    const auto whole = feature.tags.find("building");
    uses += (own != feature.tags.end() && own->second != "yes") ||
            (whole != feature.tags.end() && whole->second != "yes");
    years += feature.tags.count("start_date");
    structures += feature.tags.count("building:structure");
    materials += feature.tags.count("building:material");
  }
  return fmt::format(
      "attributes  of {} buildings and parts {} have a use, {} a year, {} a structure, {} a material", all,
      uses, years, structures, materials);
}

/// Names of CityGML's and CityJSON's attributes and of common exports, besides the tags that Canyon reads.
constexpr std::array<std::pair<std::string_view, std::string_view>, 14> kSameAs{
    {{"measuredHeight", "height"},
     {"averageHeight", "height"},
     {"storeysAboveGround", "building:levels"},
     {"material", "building:material"},
     {"buildingMaterial", "building:material"},
     {"facadeMaterial", "building:material"},
     {"wallMaterial", "building:material"},
     {"roofMaterial", "roof:material"},
     {"roof_material", "roof:material"},
     {"yearOfConstruction", "start_date"},
     {"dateOfConstruction", "start_date"},
     {"oorspronkelijkbouwjaar", "start_date"},
     {"crownDiameter", "diameter_crown"},
     {"trunkDiameter", "diameter"}}};

/// Further attributes that are read.
constexpr std::array<std::string_view, 10> kOthers{{"function", "usage", "class", "buildingStructureType",
                                                    "height", "species", "yearOfDemolition",
                                                    "dateOfDemolition", "terminationDate", "status"}};

/// The Dutch register of buildings: torn down, not built, and permitted but not started.
constexpr std::array<std::string_view, 4> kGoneStatus{
    {"Pand gesloopt", "Niet gerealiseerd pand", "Bouwvergunning verleend", "Pand ten onrechte opgevoerd"}};

/// AdV's functions of buildings (31001 in ALKIS' list of kinds of objects) as values of OSM's `building`.
const auto kAdvUses = dictionary<std::string_view>({{"1000|1100|1110|1120|1123", "residential"},
                                                    {"1010", "house"},
                                                    {"1020|1021|1022|1023|1024", "residential"},
                                                    {"2000|2010|2050|2054|2055|2056", "commercial"},
                                                    {"2020|2030", "office"},
                                                    {"2051|2052", "retail"},
                                                    {"2070|2071|2072", "hotel"},
                                                    {"2100|2110|2111|2112|2120", "industrial"},
                                                    {"2140|2143", "warehouse"},
                                                    {"2460|2461", "parking"},
                                                    {"2463", "garage"},
                                                    {"2720", "farm"},
                                                    {"2721", "barn"},
                                                    {"2724", "stable"},
                                                    {"2740|2741", "greenhouse"},
                                                    {"3010|3012|3013|3015", "office"},
                                                    {"3020|3021", "school"},
                                                    {"3023", "university"},
                                                    {"3041|3042", "church"},
                                                    {"3043", "chapel"},
                                                    {"3050|3051", "hospital"}});

/// PLATEAU's codes of usage.
const auto kPlateauUses = dictionary<std::string_view>({{"401|421", "office"},
                                                        {"402|404", "commercial"},
                                                        {"403", "hotel"},
                                                        {"411|413|415", "house"},
                                                        {"412|414", "apartments"},
                                                        {"422", "school"},
                                                        {"431", "warehouse"},
                                                        {"441|452", "industrial"},
                                                        {"451", "farm"}});

/// PLATEAU's codes of structure. 610 (not wood) and 611 (not known) give no information.
const auto kPlateauStructures = dictionary<std::string_view>(
    {{"601", "wood"}, {"602|603", "concrete"}, {"604|605", "steel"}, {"606", "masonry"}});

std::string_view value_of(const CityAttributes& attributes, const std::string& name) {
  const auto found = attributes.find(name);
  return found == attributes.end() ? std::string_view() : trim(found->second);
}

bool is_word(std::string_view text) {
  constexpr std::size_t kMax = 32;
  return text.size() <= kMax && std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
         });
}

/// The value of `building` for a code or word; empty if it is not known.
std::string use_of(std::string_view value) {
  // "31001_2020", "2020", "411"
  const std::string_view code = value.substr(value.find_last_of("_:") + 1);  // all without a separator
  const bool digits =
      !code.empty() && std::all_of(code.begin(), code.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (!digits) return is_word(value) ? lower_case(value) : std::string();
  if (code.size() != 3 && code.size() != 4) return {};
  const auto& uses = code.size() == 4 ? kAdvUses : kPlateauUses;
  const auto found = uses.find(code);
  return found == uses.end() ? std::string() : std::string(found->second);
}

/// Whether an attribute's value means "not known", or is impossible.
bool is_filler(std::string_view tag, std::string_view value) {
  const std::optional<double> number = parse_double(value);
  if (tag == "height") return number && (*number <= 0 || *number >= 2000);
  if (tag == "building:levels") return number && (*number < 0 || *number > 300);
  if (tag == "start_date") {
    const std::optional<double> year = parse_double(value.substr(0, 4));
    return !year || *year < 1000 || *year > 2200;
  }
  return value.empty();
}

}  // namespace

CityModel::CityModel(const CityReadOptions& options) : options_(options) {
  options_.model.validate();
  options_.heights.validate();
}

void CityModel::begin_file(const std::filesystem::path& file) {
  finish_file();
  file_ = file;
  handedness_ = nullptr;
  ++files_;
  tally_before_ = tally_;
}

void CityModel::drop_file() {
  data_.features.resize(first_feature_);
  lods_.resize(first_feature_);
  data_.relief.resize(first_relief_);
  tally_ = tally_before_;
  tags_of_wholes_.clear();
  here_.clear();
  for (const std::size_t index : systems_of_file_) --systems_[index].files;
  systems_of_file_.clear();
  --files_;
}

/// Distinguishes objects, except for duplicates.
std::string CityModel::id_and_location(const MapFeature& feature) {
  const LonLat middle = feature.bounds().center();
  return fmt::format("{} {:.7f} {:.7f}", feature.id, middle.x(), middle.y());
}

std::size_t CityModel::system(const std::string& ogc_name, bool east_first, int line) {
  std::string name = reference_name(ogc_name);
  if (name.empty() && !options_.model.crs.empty()) {
    name = reference_name(options_.model.crs);
    if (name.empty()) {
      throw InputError(fmt::format("crs '{}' is not an EPSG reference system", options_.model.crs),
                       "give its code, e.g. EPSG:25832, or EPSG:25832+7837 with heights");
    }
    add_line(Level::Remark,
             ogc_name.empty()
                 ? fmt::format("reference system from crs, {}", name)
                 : fmt::format("reference system \"{}\" is unknown; using {} from crs", ogc_name, name));
  }
  if (name.empty()) {
    throw InputError(file_, line,
                     ogc_name.empty()
                         ? std::string("names no reference system: the position of the city is unknown")
                         : fmt::format("reference system \"{}\" is not one of EPSG or OGC's CRS84", ogc_name),
                     "name it with crs (--crs), e.g. EPSG:25832");
  }
  east_first = east_first || ogc_name.find("CRS84") != std::string::npos;
  auto found = std::find_if(systems_.begin(), systems_.end(), [&](const System& system) {
    return system.name == name && system.east_first == east_first;
  });
  if (found == systems_.end()) {
    systems_.push_back({name, ReferenceSystem(file_, name, options_.heights), east_first, {}, 0});
    found = std::prev(systems_.end());
    data_.notes.append(found->reference.notes());
  }
  const auto index = static_cast<std::size_t>(found - systems_.begin());
  if (systems_of_file_.insert(index).second) {
    ++found->files;
    found->swap.reset();
  }
  return index;
}

Eigen::Vector3d CityModel::east_first(std::size_t index, const Eigen::Vector3d& point) {
  System& system = systems_[index];
  if (!system.swap) {
    const auto plausible = [&](bool swap) {
      return system.reference.finds(swap ? LonLat(point.y(), point.x()) : LonLat(point.x(), point.y()));
    };
    const bool by_authority = !system.east_first && system.reference.north_first();
    const bool likely = plausible(by_authority);
    const bool other = !system.east_first && plausible(!by_authority);
    if (!likely && !other) return by_authority ? Eigen::Vector3d(point.y(), point.x(), point.z()) : point;
    // Many files put east first, independent of the authority's order.
    const bool unsure = likely && other && by_authority;
    const int reported = unsure && handedness_ ? handedness_() : 0;
    system.swap = reported != 0 ? reported < 0 : likely ? by_authority : !by_authority;
    if (*system.swap != by_authority) {
      add_line(unsure ? Level::Guess : Level::Remark,
               fmt::format("coordinates have {} first, against the axis order of {}, and are read so{}",
                           by_authority ? "east or longitude" : "north or latitude", system.name,
                           reported != 0 ? ", because roofs face up only in this order" : ""));
    } else if (unsure && reported == 0) {
      add_line(
          Level::Guess,
          fmt::format(
              "coordinates are read with north or latitude first, the axis order of {}; the other order is "
              "also possible",
              system.name));
    }
  }
  return *system.swap ? Eigen::Vector3d(point.y(), point.x(), point.z()) : point;
}

void CityModel::to_wgs84(std::size_t index, std::vector<Eigen::Vector3d>& points) {
  systems_[index].reference.to_wgs84(points);
  for (Eigen::Vector3d& point : points) {
    if (!longitude_ && point.allFinite())
      longitude_ = options_.box ? options_.box->middle_longitude() : point.x();
    if (longitude_) point.x() = longitude_near(point.x(), *longitude_);
  }
}

void CityModel::transform_to_wgs84(std::size_t index, const Eigen::Matrix4d& matrix,
                                   const Eigen::Vector3d& origin, std::vector<Eigen::Vector3d>& points) {
  for (Eigen::Vector3d& p : points) p = (matrix * p.homogeneous()).head<3>();
  if (!systems_[index].reference.geographic()) {
    for (Eigen::Vector3d& p : points) p += origin;
    to_wgs84(index, points);
    return;
  }
  std::vector<Eigen::Vector3d> posed{origin};
  to_wgs84(index, posed);
  const Eigen::Vector3d& at = posed.front();
  if (!at.allFinite()) {
    std::fill(points.begin(), points.end(), at);
    return;
  }
  const geodesy::LocalFrame frame(geodesy::Geodetic::from_degrees(at.y(), longitude_near(at.x(), 0), at.z()));
  for (Eigen::Vector3d& p : points) {
    const geodesy::Geodetic point = frame.geodetic_from_local(p);
    p = {longitude_near(geodesy::degrees(point.longitude_rad), at.x()), geodesy::degrees(point.latitude_rad),
         point.height_m};
  }
}

bool CityModel::in_box(const Eigen::AlignedBox2d& bounds) const {
  if (!options_.box) return true;
  const LonLatBox whole = options_.box->unwrapped();
  return Eigen::AlignedBox2d(LonLat(whole.west, whole.south), LonLat(whole.east, whole.north))
      .intersects(bounds);
}

void CityModel::keep(MapFeature feature, const CityObject& object) {
  const Eigen::AlignedBox2d bounds = feature.bounds();
  if (!in_box(bounds)) {
    ++tally_.outside;
    return;
  }
  // Neighbouring tiles repeat the objects on their borders.
  const std::string key = id_and_location(feature);
  if (files_ > 1 && seen_.count(key) > 0) {
    ++tally_.repeated;
    return;
  }
  const auto [first, fresh] = here_.emplace(object.named ? feature.id : key, key);
  if (!fresh && first->second == key)
    return leave_out("objects that the file has twice, with the same id at the same position", 1,
                     Level::Remark);
  if (!fresh) add_line(Level::Remark, "objects at different positions have the same id: all are built");
  ++tally_.kinds[object.lod < 0 ? object.type : fmt::format("{} LoD {:g}", object.type, object.lod)];
  data_.features.push_back(std::move(feature));
  lods_.push_back(object.lod);
}

bool CityModel::builds(std::string_view type) {
  return kRoles.count(type) > 0;
}

void CityModel::add(CityObject object) {
  const auto role = kRoles.find(object.type);
  if (role == kRoles.end()) {
    leave_out("city objects of type " + (object.type.empty() ? "(none)" : object.type), 1, Level::Remark);
    return;
  }
  if (is_gone(object.attributes)) {
    leave_out(object.type + " objects that are demolished or not built by their attributes", 1, Level::Guess);
    return;
  }
  switch (role->second) {
    case Role::Building:
    case Role::Part:
      add_building(std::move(object), role->second == Role::Part);
      break;
    case Role::Structure:
      if (object.surfaces.empty() || object.lod < 1) {
        leave_out(
            fmt::format("{} objects without surfaces up to LoD {}", object.type, options_.model.lod_text()));
      } else {
        MapFeature feature;
        feature.id = object.id;
        feature.kind = FeatureKind::Structure;
        feature.surfaces = std::move(object.surfaces);
        feature.belongs_to = object.parent;
        keep(std::move(feature), object);
      }
      break;
    case Role::Tree:
      add_tree(std::move(object));
      break;
    case Role::Wood:
      add_wood(std::move(object));
      break;
    case Role::Relief:
      if (object.surfaces.empty()) {
        leave_out("reliefs without triangles");
        break;
      }
      ++tally_.kinds[fmt::format("TINRelief LoD {:g}", object.lod)];
      std::move(object.surfaces.begin(), object.surfaces.end(), std::back_inserter(data_.relief));
      break;
  }
}

void CityModel::add_building(CityObject object, bool part) {
  MapFeature feature;
  feature.id = object.id;
  feature.kind = part ? FeatureKind::Part : FeatureKind::Building;
  feature.tags = std::move(object.attributes);
  add_tags_of_attributes(feature.tags);
  feature.tags[part ? "building:part" : "building"] = building_use(feature.tags);
  feature.belongs_to = object.parent;
  if (object.has_parts) tags_of_wholes_[object.id] = feature.tags;
  if (object.lod >= 1)
    feature.surfaces = std::move(object.surfaces);
  else
    feature.polygons = outlines_of(object.surfaces);
  if (feature.surfaces.empty() && feature.polygons.empty()) {
    if (!object.has_parts) {
      leave_out(
          fmt::format("buildings and parts without a geometry up to LoD {}", options_.model.lod_text()));
    }
    return;
  }
  keep(std::move(feature), object);
}

bool CityModel::leaves_out_low(const MapFeature& feature) {
  constexpr double kLowest_m = 1;  // lower plants do not obstruct an antenna
  const auto height = feature.tags.find("height");
  const auto value = height == feature.tags.end() ? std::nullopt : parse_double(height->second);
  if (!value || *value >= kLowest_m) return false;
  leave_out("plants lower than 1 m", 1, Level::Remark);
  return true;
}

void CityModel::add_tree(CityObject object) {
  const Eigen::AlignedBox3d extent = extent_of(object.surfaces);
  MapFeature feature;
  feature.id = object.id;
  feature.kind = FeatureKind::Tree;
  feature.tags = std::move(object.attributes);
  add_tags_of_attributes(feature.tags);
  if (object.transform_to_wgs84) {
    feature.line = {object.transform_to_wgs84->head<2>()};
    feature.base_m = object.transform_to_wgs84->z();
  } else if (!extent.isEmpty()) {
    feature.line = {extent.center().head<2>()};
    feature.base_m = extent.min().z();
  } else {
    leave_out("trees without a position");
    return;
  }
  if (!extent.isEmpty()) {
    feature.base_m = extent.min().z();
    constexpr double kMetresPerDegree = 111'200;
    const double across = std::cos(geodesy::radians(extent.center().y()));
    const double crown_m = kMetresPerDegree * std::max(extent.sizes().x() * across, extent.sizes().y());
    feature.tags.emplace("height", fmt::format("{:.2f}", extent.sizes().z()));
    feature.tags.emplace("diameter_crown", fmt::format("{:.2f}", crown_m));
  }
  if (!leaves_out_low(feature)) keep(std::move(feature), object);
}

void CityModel::add_wood(CityObject object) {
  MapFeature feature;
  feature.id = object.id;
  feature.kind = FeatureKind::Wood;
  feature.tags = std::move(object.attributes);
  add_tags_of_attributes(feature.tags);
  feature.polygons = outlines_of(object.surfaces);
  if (feature.polygons.empty()) {
    leave_out("plant covers without an area");
    return;
  }
  const double thick_m = extent_of(object.surfaces).sizes().z();
  constexpr double kThick_m = 1;  // a flat cover on a slope gets its height from an attribute
  if (thick_m >= kThick_m) feature.tags.emplace("height", fmt::format("{:.2f}", thick_m));
  if (!leaves_out_low(feature)) keep(std::move(feature), object);
}

void CityModel::finish_file() {
  std::vector<MapFeature>& features = data_.features;
  // The level of detail of the parts of each whole.
  std::map<std::string, double> lod_of_parts;
  for (std::size_t i = first_feature_; i < features.size(); ++i) {
    MapFeature& feature = features[i];
    if (feature.kind != FeatureKind::Part || feature.belongs_to.empty()) continue;
    double& best = lod_of_parts.emplace(feature.belongs_to, lods_[i]).first->second;
    best = std::max(best, lods_[i]);
    const auto whole = tags_of_wholes_.find(feature.belongs_to);
    if (whole == tags_of_wholes_.end()) continue;
    for (const char* key :
         {"building", "building:material", "building:structure", "roof:material", "start_date"}) {
      const auto tag = whole->second.find(key);
      if (tag != whole->second.end()) feature.tags.insert(*tag);
    }
  }
  // A whole with less detail duplicates its parts.
  std::size_t kept = first_feature_;
  for (std::size_t i = first_feature_; i < features.size(); ++i) {
    const auto parts = lod_of_parts.find(features[i].id);
    const bool replaced = parts != lod_of_parts.end() && features[i].kind != FeatureKind::Part &&
                          std::floor(lods_[i]) < std::floor(parts->second);
    if (replaced) {
      add_line(Level::Remark, "a building is replaced by its parts, which have more detail");
      continue;
    }
    if (kept != i) {
      features[kept] = std::move(features[i]);
      lods_[kept] = lods_[i];
    }
    ++kept;
  }
  features.resize(kept);
  lods_.resize(kept);
  for (std::size_t i = first_feature_; i < kept; ++i) seen_.insert(id_and_location(features[i]));
  here_.clear();
  first_feature_ = kept;
  first_relief_ = data_.relief.size();
  tags_of_wholes_.clear();
  systems_of_file_.clear();
}

void CityModel::describe(MapData& data) const {
  const auto remark = [&](const std::string& line) { data.notes.add_line(Level::Remark, line); };
  std::vector<std::string> kinds;
  kinds.reserve(tally_.kinds.size());
  for (const auto& [kind, count] : tally_.kinds) kinds.push_back(fmt::format("{} {}", count, kind));
  remark(fmt::format("objects     {}", fmt::join(kinds, ", ")));
  for (const System& system : systems_) {
    if (system.files == 0) continue;
    remark(fmt::format(
        "reference   {} ({}){}", system.name, system.reference.title(),
        files_ > 1 ? fmt::format(" of {} file{}", system.files, system.files == 1 ? "" : "s") : ""));
  }
  remark(attributes_line(data));
  if (!data.relief.empty()) remark(fmt::format("relief      {} surfaces of the ground", data.relief.size()));
  if (tally_.outside > 0) remark(fmt::format("box         {} objects outside left out", tally_.outside));
  if (tally_.repeated > 0)
    remark(fmt::format("tiles       {} objects are in several files, read once", tally_.repeated));
}

MapData CityModel::finish(const std::filesystem::path& name) {
  finish_file();
  const std::string file = name.filename().string();
  std::stable_sort(data_.features.begin(), data_.features.end(),
                   [](const MapFeature& a, const MapFeature& b) { return a.id < b.id; });
  if (data_.features.empty() && !options_.box) {  // else nothing may be in the box
    std::string why;
    for (const std::string& line : tally_.notes.lines())
      if (line.starts_with("left out ")) why += (why.empty() ? " (" : ", ") + line;
    if (!why.empty()) why += ")";
    const bool is_external = why.find(kElsewhere) != std::string::npos;
    throw InputError(name, 0,
                     fmt::format("has no building or other object with a geometry up to LoD {}{}",
                                 options_.model.lod_text(), why),
                     is_external
                         ? "check its reference system; eastings with their zone in front (32691000) are "
                           "EPSG:4647 and the like (--crs)"
                         : "give a file with buildings, or a higher lod");
  }
  for (const MapFeature& feature : data_.features) data_.bounds.extend(feature.bounds());
  data_.source = file;
  describe(data_);
  data_.notes.append(tally_.notes, file);
  if (data_.features.empty()) return std::move(data_);
  const LonLat middle = data_.bounds.center();
  for (const System& system : systems_) {
    if (!data_.geoid_undulation_m && system.reference.geoid().above_sea_level())
      data_.geoid_undulation_m = system.reference.geoid().undulation_m(middle);
    if (system.reference.in_area_of_use(middle)) continue;
    data_.notes.add_line(
        Level::Guess,
        fmt::format(
            "{}: is at longitude {:.4f}, latitude {:.4f}, outside the area for which its reference system "
            "{} is defined; check this system and the coordinates",
            file, middle.x(), middle.y(), system.name));
  }
  return std::move(data_);
}

bool attribute_matters(std::string_view name) {
  return std::any_of(kSameAs.begin(), kSameAs.end(),
                     [name](const auto& pair) { return pair.first == name; }) ||
         std::find(kOthers.begin(), kOthers.end(), name) != kOthers.end();
}

std::optional<std::string> value_in_metres(std::string_view name, std::string_view value,
                                           std::string_view unit) {
  const auto same =
      std::find_if(kSameAs.begin(), kSameAs.end(), [name](const auto& pair) { return pair.first == name; });
  const std::string_view tag = same == kSameAs.end() ? name : same->second;
  unit = trim(unit);
  if (unit.empty() || (tag != "height" && tag != "diameter_crown" && tag != "diameter"))
    return std::string(value);
  const auto metres = metres_of_unit(lower_case(unit.substr(unit.find_last_of("#:/") + 1)));
  if (!metres) return std::nullopt;
  const std::optional<double> number = parse_double(value);
  if (!number || *metres == 1) return std::string(value);
  return fmt::format("{:.10g}", *number * *metres);
}

void add_tags_of_attributes(CityAttributes& tags) {
  for (const auto& [from, to] : kSameAs) {
    const std::string_view value = value_of(tags, std::string(from));
    if (!value.empty() && !is_filler(to, value)) tags.emplace(to, value);
  }
  const auto structure = kPlateauStructures.find(value_of(tags, "buildingStructureType"));
  if (structure == kPlateauStructures.end()) return;
  tags.emplace("building:structure", structure->second);
  // Concrete and steel frames have facades of any material.
  if (structure->second == "wood") tags.emplace("building:material", "wood");
  if (structure->second == "masonry") tags.emplace("building:material", "brick");
}

bool is_gone(const CityAttributes& attributes) {
  for (const char* name : {"yearOfDemolition", "dateOfDemolition", "terminationDate"})
    if (has_ended(value_of(attributes, name)).value_or(false)) return true;
  return std::find(kGoneStatus.begin(), kGoneStatus.end(), value_of(attributes, "status")) !=
         kGoneStatus.end();
}

std::string building_use(const CityAttributes& attributes) {
  for (const char* name : {"function", "usage", "class"}) {
    std::string use = use_of(value_of(attributes, name));
    if (!use.empty()) return use;
  }
  return "yes";
}

}  // namespace canyon::buildings
