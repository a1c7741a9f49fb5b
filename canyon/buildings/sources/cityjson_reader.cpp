#include "canyon/buildings/sources/cityjson_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/buildings/sources/reference_system.hpp"
#include "canyon/buildings/sources/terrain.hpp"

namespace canyon::buildings {
namespace {

constexpr std::string_view kCure = "check the file with cjval or val3dity, or export it again";

/// How many objects are left out, by the message about them.
using Counts = std::map<std::string, std::size_t>;

double lod_of(const Json& geometry) {
  const Json& lod = geometry["lod"];  // a number in 1.0, text since 1.1
  if (lod.is_number()) return lod.get<double>();
  return lod.is_string() ? parse_double(lod.text()).value_or(-1) : -1;
}

/// A tag's text; empty for a value that is not a scalar.
std::string text_of(const Json& value) {
  if (value.is_string()) return value.text();
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_integer()) return fmt::format("{}", value.get<long long>());
  if (value.is_number()) return fmt::format("{}", value.get<double>());
  return {};
}

class Reader {
 public:
  Reader(const std::filesystem::path& path, double max_lod, const TerrainOptions& heights)
      : path_(path), max_lod_(max_lod), heights_(heights) {}

  MapData read();

 private:
  [[noreturn]] void fail(std::string_view problem, std::string_view cure = kCure) const {
    throw InputError(path_, line_, problem, cure);
  }
  [[noreturn]] void fail_object(const std::string& key, std::string_view problem) const {
    fail(fmt::format("city object \"{}\": {}", key, problem));
  }
  Json parse(std::string_view text, int first_line);
  void read_header(const Json& root);
  void read_objects(const Json& root);
  void read_vertices(const Json& root);
  void read_object(const std::string& key, const Json& object);
  void read_attributes(const Json& object, MapFeature& feature) const;
  const Json* choose_geometry(const std::string& key, const Json& object);
  void add_surfaces(const std::string& key, const Json& geometry, MapFeature& feature);
  void add_outline(const std::string& key, const Json& geometry, MapFeature& feature);
  /// The surfaces of any geometry, as (polygon, its value in semantics.values).
  std::vector<std::pair<const Json*, const Json*>> flatten(const std::string& key,
                                                           const Json& geometry) const;
  std::vector<Eigen::Vector3d> ring(const std::string& key, const Json& indices);
  std::optional<MapSurface> surface(const std::string& key, const Json& polygon);
  void drop_replaced_outlines();
  void finish();

  std::filesystem::path path_;
  double max_lod_;
  TerrainOptions heights_;
  int line_ = 0;
  std::optional<ReferenceSystem> system_;
  Eigen::Vector3d scale_ = Eigen::Vector3d::Ones();
  Eigen::Vector3d translate_ = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> vertices_;  ///< lon, lat [deg], ellipsoidal height [m]; NaN where impossible
  std::vector<bool> beyond_poles_;
  std::optional<double> longitude_;  ///< of the first vertex: others are within 180 deg of it
  MapData data_;
  Counts left_out_;
};

Json Reader::parse(std::string_view text, int first_line) {
  try {
    return Json::parse(text);
  } catch (const JsonError& e) {
    if (e.byte() == 0) throw;
    const std::size_t at = std::min<std::size_t>(e.byte() - 1, text.size());
    const auto lines = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    line_ = first_line + static_cast<int>(lines);
    if (at + 1 >= text.size()) fail("JSON ends early", "is the file cut short? fetch it again");
    fail(fmt::format("not JSON (byte {} of the text)", e.byte()), "give a CityJSON file");
  }
}

void Reader::read_header(const Json& root) {
  if (root["type"] == "FeatureCollection" || root["type"] == "Feature") {
    fail("is GeoJSON, which is not read as a map", "give OpenStreetMap data or CityJSON of the buildings");
  }
  if (root["type"] == "CityJSONFeature") {
    fail("a sequence begins with a CityJSON object, and this is a CityJSONFeature",
         "give the whole sequence");
  }
  if (root["type"] != "CityJSON") {
    fail("not CityJSON: no \"type\": \"CityJSON\"", "give a CityJSON file (1.0, 1.1 or 2.0)");
  }
  const Json& version = root["version"];
  const std::string number = version.is_string() ? version.text() : "";
  if (number.rfind("1.0", 0) != 0 && number.rfind("1.1", 0) != 0 && number.rfind("2.0", 0) != 0) {
    fail(fmt::format("CityJSON version {} is not known",
                     version.is_null() ? "(none)" : version.dump(-1, Json::Order::ByKey)),
         "convert it to 2.0, e.g. with cjio's upgrade");
  }
  if (const Json* transform = root.find("transform")) {
    const auto vector = [&](const char* name) {
      const Json& value = (*transform)[name];
      Eigen::Vector3d result;
      if (!value.is_array() || value.size() != 3)
        fail(fmt::format("transform.{} is not three numbers", name));
      for (std::size_t i = 0; i < 3; ++i) {
        if (!value[i].is_number()) fail(fmt::format("transform.{} is not three numbers", name));
        result[static_cast<Eigen::Index>(i)] = value[i].get<double>();
      }
      return result;
    };
    scale_ = vector("scale");
    translate_ = vector("translate");
    if (!scale_.allFinite() || !translate_.allFinite() || !(scale_.array() != 0).all()) {
      fail("transform.scale must not be zero");
    }
    if (scale_.x() != scale_.y()) {
      data_.warnings.push_back(fmt::format("{}: transform.scale is {} along x and {} along y: damaged?",
                                           path_.filename().string(), scale_.x(), scale_.y()));
    }
  } else if (number.rfind("1.0", 0) != 0) {
    fail("no transform, which CityJSON 1.1 and later require");
  }
  const Json& reference = root["metadata"]["referenceSystem"];
  if (!reference.is_string()) {
    fail("metadata.referenceSystem is missing: the place of the city is unknown",
         "set it, e.g. with cjio's crs_assign");
  }
  const std::string name = reference_name(reference.text());
  if (name.empty()) {
    fail(fmt::format("reference system \"{}\" is not one of EPSG or OGC's CRS84", reference.text()),
         "name its EPSG code, e.g. with cjio's crs_assign");
  }
  system_.emplace(path_, name, heights_);
  data_.warnings.insert(data_.warnings.end(), system_->notes().begin(), system_->notes().end());
}

void Reader::read_vertices(const Json& root) {
  const Json& list = root["vertices"];
  if (!list.is_array()) fail("\"vertices\" is missing or not a list");
  vertices_.clear();
  vertices_.reserve(list.size());
  for (const Json& vertex : list) {
    if (!vertex.is_array() || vertex.size() != 3 || !vertex[0].is_number() || !vertex[1].is_number() ||
        !vertex[2].is_number()) {
      fail(fmt::format("vertex {} is not three numbers", vertices_.size()));
    }
    const Eigen::Vector3d raw(vertex[0].get<double>(), vertex[1].get<double>(), vertex[2].get<double>());
    vertices_.emplace_back(raw.cwiseProduct(scale_) + translate_);
  }
  beyond_poles_.assign(vertices_.size(), false);
  if (system_->geographic()) {
    for (std::size_t i = 0; i < vertices_.size(); ++i) beyond_poles_[i] = std::abs(vertices_[i].y()) > 90;
  }
  system_->to_wgs84(vertices_);
  for (Eigen::Vector3d& vertex : vertices_) {
    if (!longitude_ && vertex.allFinite()) longitude_ = vertex.x();
    if (longitude_) vertex.x() = longitude_near(vertex.x(), *longitude_);
  }
}

std::vector<Eigen::Vector3d> Reader::ring(const std::string& key, const Json& indices) {
  if (!indices.is_array()) fail_object(key, "a ring is not a list of vertex numbers");
  std::vector<Eigen::Vector3d> points;
  std::size_t last = 0;
  std::size_t first = 0;
  for (const Json& index : indices) {
    if (!index.is_integer())
      fail_object(key, fmt::format("vertex number {} is not an integer", index.dump(-1, Json::Order::ByKey)));
    const auto number = index.get<long long>();
    if (number < 0 || static_cast<std::size_t>(number) >= vertices_.size()) {
      fail_object(key, fmt::format("vertex number {} is out of range (there are {} vertices)", number,
                                   vertices_.size()));
    }
    const auto i = static_cast<std::size_t>(number);
    if (!vertices_[i].allFinite()) {
      fail_object(key, beyond_poles_[i]
                           ? fmt::format("vertex {} is beyond the poles; CityJSON has longitude first", i)
                           : fmt::format("vertex {} is outside the area of its reference system", i));
    }
    if (!points.empty() && i == last) continue;
    if (points.empty()) first = i;
    points.push_back(vertices_[i]);
    last = i;
  }
  if (points.size() > 1 && last == first) points.pop_back();
  return points;
}

std::optional<MapSurface> Reader::surface(const std::string& key, const Json& polygon) {
  if (!polygon.is_array()) fail_object(key, "a surface is not a list of rings");
  MapSurface result;
  bool outer = true;
  for (const Json& indices : polygon) {
    std::vector<Eigen::Vector3d> points = ring(key, indices);
    if (points.size() < 3) {
      ++left_out_["rings of fewer than three points"];
      if (outer) return std::nullopt;
    } else if (outer) {
      result.outer = std::move(points);
    } else {
      result.inners.push_back(std::move(points));
    }
    outer = false;
  }
  if (outer) return std::nullopt;
  return result;
}

std::vector<std::pair<const Json*, const Json*>> Reader::flatten(const std::string& key,
                                                                 const Json& geometry) const {
  static const Json kNull;
  const auto child = [](const Json& values, std::size_t i) -> const Json& {
    return values.is_array() && i < values.size() ? values[i] : kNull;
  };
  const std::string type = text_of(geometry["type"]);
  const Json& boundaries = geometry["boundaries"];
  if (!boundaries.is_array()) fail_object(key, "its geometry has no boundaries");
  const Json& values = geometry["semantics"]["values"];
  std::vector<std::pair<const Json*, const Json*>> surfaces;
  const auto add_shell = [&](const Json& shell, const Json& shell_values) {
    if (!shell.is_array()) fail_object(key, fmt::format("a {}'s boundaries are nested too little", type));
    for (std::size_t i = 0; i < shell.size(); ++i) surfaces.emplace_back(&shell[i], &child(shell_values, i));
  };
  const auto add_solid = [&](const Json& solid, const Json& solid_values) {
    if (!solid.is_array()) fail_object(key, fmt::format("a {}'s boundaries are nested too little", type));
    if (!solid.empty()) add_shell(solid[0], child(solid_values, 0));  // inner shells are cavities
  };
  if (type == "MultiSurface" || type == "CompositeSurface") {
    add_shell(boundaries, values);
  } else if (type == "Solid") {
    add_solid(boundaries, values);
  } else {  // MultiSolid, CompositeSolid
    for (std::size_t i = 0; i < boundaries.size(); ++i) add_solid(boundaries[i], child(values, i));
  }
  return surfaces;
}

void Reader::add_surfaces(const std::string& key, const Json& geometry, MapFeature& feature) {
  const Json& types = geometry["semantics"]["surfaces"];
  for (const auto& [polygon, value] : flatten(key, geometry)) {
    auto made = surface(key, *polygon);
    if (!made) continue;
    if (value->is_integer()) {
      const auto number = value->get<long long>();
      if (number < 0 || !types.is_array() || static_cast<std::size_t>(number) >= types.size()) {
        fail_object(key, fmt::format("semantic number {} is out of range", number));
      }
      const Json& type = types[static_cast<std::size_t>(number)];
      made->semantic = text_of(type["type"]);
    }
    feature.surfaces.push_back(std::move(*made));
  }
}

void Reader::add_outline(const std::string& key, const Json& geometry, MapFeature& feature) {
  const auto lon_lat = [](const std::vector<Eigen::Vector3d>& points) {
    MapRing result;
    for (const auto& p : points) result.emplace_back(p.x(), p.y());
    return result;
  };
  for (const auto& [polygon, value] : flatten(key, geometry)) {
    const auto made = surface(key, *polygon);
    if (!made) continue;
    MapPolygon& outline = feature.polygons.emplace_back();
    outline.outer = lon_lat(made->outer);
    for (const auto& inner : made->inners) outline.inners.push_back(lon_lat(inner));
  }
}

const Json* Reader::choose_geometry(const std::string& key, const Json& object) {
  const Json* geometries = object.find("geometry");
  if (geometries == nullptr) return nullptr;
  if (!geometries->is_array()) fail_object(key, "\"geometry\" is not a list");
  static const std::set<std::string> kUsable{"MultiSurface", "CompositeSurface", "Solid", "MultiSolid",
                                             "CompositeSolid"};
  const Json* best = nullptr;
  double best_lod = -1;
  for (const Json& geometry : *geometries) {
    if (!geometry.is_object()) fail_object(key, "a geometry is not a JSON object");
    const std::string type = text_of(geometry["type"]);
    if (kUsable.count(type) == 0) {
      ++left_out_["geometries of type " + (type.empty() ? "(none)" : type)];
      continue;
    }
    const double lod = lod_of(geometry);
    if (lod <= max_lod_ && lod > best_lod) {
      best = &geometry;
      best_lod = lod;
    }
  }
  return best;
}

void Reader::read_attributes(const Json& object, MapFeature& feature) const {
  const Json& attributes = object["attributes"];
  if (!attributes.is_object()) return;
  for (const auto& [name, value] : attributes.members()) {
    const std::string text = text_of(value);
    if (!text.empty()) feature.tags[name] = text;
  }
  // Names of CityJSON's (CityGML's) attributes and of common exports, beside the tags that Canyon reads.
  constexpr std::array<std::pair<const char*, const char*>, 10> kSame{
      {{"measuredHeight", "height"},
       {"storeysAboveGround", "building:levels"},
       {"material", "building:material"},
       {"buildingMaterial", "building:material"},
       {"facadeMaterial", "building:material"},
       {"wallMaterial", "building:material"},
       {"roofMaterial", "roof:material"},
       {"roof_material", "roof:material"},
       {"yearOfConstruction", "start_date"},
       {"oorspronkelijkbouwjaar", "start_date"}}};
  for (const auto& [from, to] : kSame) {
    const auto found = feature.tags.find(from);
    if (found != feature.tags.end()) feature.tags.emplace(to, found->second);
  }
}

void Reader::read_object(const std::string& key, const Json& object) {
  if (!object.is_object()) fail_object(key, "is not a JSON object");
  const std::string type = text_of(object["type"]);
  const bool part = type == "BuildingPart";
  if (!part && type != "Building") {
    ++left_out_["city objects of type " + (type.empty() ? "(none)" : type)];
    return;
  }
  MapFeature feature;
  feature.id = key;
  feature.kind = part ? FeatureKind::Part : FeatureKind::Building;
  feature.tags[part ? "building:part" : "building"] = "yes";
  read_attributes(object, feature);
  const Json& parents = object["parents"];
  if (part && parents.is_array() && !parents.empty()) feature.belongs_to = text_of(parents[0]);
  const Json* geometry = choose_geometry(key, object);
  if (geometry != nullptr) {
    lod_of(*geometry) < 1 ? add_outline(key, *geometry, feature) : add_surfaces(key, *geometry, feature);
  }
  if (feature.surfaces.empty() && feature.polygons.empty()) {
    const Json& children = object["children"];
    const bool whole_of_parts = children.is_array() && !children.empty();
    if (!whole_of_parts)
      ++left_out_[fmt::format("buildings and parts without a geometry up to LoD {}", max_lod_)];
    return;
  }
  data_.features.push_back(std::move(feature));
}

void Reader::read_objects(const Json& root) {
  const Json& objects = root["CityObjects"];
  if (!objects.is_object()) fail("\"CityObjects\" is missing or not a JSON object");
  read_vertices(root);
  for (const auto& [key, object] : objects.members()) read_object(key, object);
}

void Reader::drop_replaced_outlines() {
  std::set<std::string> with_solid_parts;
  for (const MapFeature& feature : data_.features) {
    if (!feature.surfaces.empty() && !feature.belongs_to.empty()) with_solid_parts.insert(feature.belongs_to);
  }
  const auto replaced = [&](const MapFeature& feature) {
    return feature.surfaces.empty() && with_solid_parts.count(feature.id) > 0;
  };
  data_.features.erase(std::remove_if(data_.features.begin(), data_.features.end(), replaced),
                       data_.features.end());
}

void Reader::finish() {
  drop_replaced_outlines();
  std::stable_sort(data_.features.begin(), data_.features.end(),
                   [](const MapFeature& a, const MapFeature& b) { return a.id < b.id; });
  for (const auto& [what, count] : left_out_) {
    data_.warnings.push_back(fmt::format("{}: left out {} {}", path_.filename().string(), count, what));
  }
  line_ = 0;
  if (data_.features.empty()) {
    fail(fmt::format("has no Building or BuildingPart with a geometry up to LoD {}", max_lod_),
         "give a CityJSON file of buildings, or a higher max LoD");
  }
  for (const MapFeature& feature : data_.features) data_.bounds.extend(feature.bounds());
  const LonLat middle = data_.bounds.center();
  if (!system_->in_area_of_use(middle)) {
    data_.warnings.push_back(
        fmt::format("{}: lies at longitude {:.4f}, latitude {:.4f}, outside the area that its reference "
                    "system is made for; check "
                    "metadata.referenceSystem and transform.translate",
                    path_.filename().string(), middle.x(), middle.y()));
  }
  if (system_->geoid().above_sea_level()) {
    data_.geoid_undulation_m = system_->geoid().undulation_m(middle);
  }
}

MapData Reader::read() {
  TextFile file(path_);
  data_.source = path_.filename().string();
  const std::string_view text = file.text();
  // A sequence has a whole CityJSON object on its first line and more lines after it.
  const std::size_t end = text.find('\n');
  const bool sequence = end != std::string_view::npos && !trim(text.substr(end)).empty() &&
                        Json::try_parse(text.substr(0, end)).has_value();
  try {
    if (!sequence) {
      const Json root = parse(text, 1);
      read_header(root);
      read_objects(root);
    } else {
      while (const auto line = file.next_line()) {
        line_ = file.line();
        if (trim(*line).empty()) continue;
        const Json root = parse(*line, line_);
        if (!system_) {
          read_header(root);
          continue;
        }
        if (root["type"] != "CityJSONFeature") fail("not a CityJSONFeature");
        read_objects(root);
      }
    }
  } catch (const JsonError& e) {
    fail(fmt::format("not as CityJSON has it ({})", e.what()));
  }
  finish();
  return std::move(data_);
}

}  // namespace

MapData read_cityjson(const std::filesystem::path& path, double max_lod, const TerrainOptions& heights) {
  heights.validate();
  if (!(max_lod >= 0)) throw InputError(fmt::format("max LoD {} is not at least 0", max_lod));
  return Reader(path, max_lod, heights).read();
}

}  // namespace canyon::buildings
