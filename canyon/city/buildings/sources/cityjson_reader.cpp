#include "canyon/city/buildings/sources/cityjson_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/read_report.hpp"
#include "canyon/base/text.hpp"

namespace canyon::buildings {
namespace {

constexpr std::string_view kHint = "check the file with cjval or val3dity, or export it again";

/// A tag's text; empty for a value that is not a scalar.
std::string text_of(const Json& value) {
  if (value.is_string()) return value.text();
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_integer()) return fmt::format("{}", value.get<long long>());
  if (value.is_number()) return fmt::format("{}", value.get<double>());
  return {};
}

bool is_point(const Json& vertex) {
  return vertex.is_array() && vertex.size() == 3 && vertex[0].is_number() && vertex[1].is_number() &&
         vertex[2].is_number();
}

class CityJsonReader {
 public:
  CityJsonReader(TextFile& file, CityModel& model) : file_(file), model_(model), notes_(file.path()) {}

  void read() {
    const std::string_view text = file_.text();
    // A sequence has a complete CityJSON object on its first line, followed by more lines.
    const std::size_t end = text.find('\n');
    const bool sequence = end != std::string_view::npos && !trim(text.substr(end)).empty() &&
                          Json::try_parse(text.substr(0, end)).has_value();
    try {
      if (!sequence) {
        const Json root = parse(text, 1);
        read_header(root);
        read_objects(root);
      } else {
        while (const auto line = file_.next_line()) {
          line_ = file_.line();
          if (trim(*line).empty()) continue;
          const Json root = parse(*line, line_);
          if (!system_ || root["type"] == "CityJSON") {  // again if sequences were concatenated
            read_header(root);
            continue;
          }
          if (root["type"] != "CityJSONFeature") fail("not a CityJSONFeature");
          read_objects(root);
        }
      }
    } catch (const JsonError& e) {
      fail(fmt::format("not valid CityJSON ({})", e.what()));
    }
    notes_.require_majority(good_);
    for (const std::string& line : notes_.lines()) model_.add_line(ReadReport::Level::Loss, line);
  }

 private:
  [[noreturn]] void fail(std::string_view problem, std::string_view hint = kHint) const {
    throw InputError(file_.path(), line_, problem, hint);
  }
  [[noreturn]] void fail_object(const std::string& key, std::string_view problem) const {
    fail(fmt::format("city object \"{}\": {}", key, problem));
  }

  Json parse(std::string_view text, int first_line) {
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

  void read_header(const Json& root) {
    if (root["type"] == "FeatureCollection" || root["type"] == "Feature")
      fail("is GeoJSON, which is not read as a map", "give OpenStreetMap data or CityJSON of the buildings");
    if (root["type"] == "CityJSONFeature") {
      fail("a sequence must begin with a CityJSON object, but this is a CityJSONFeature",
           "give the whole sequence");
    }
    if (root["type"] != "CityJSON")
      fail("not CityJSON: no \"type\": \"CityJSON\"", "give a CityJSON file (1.0, 1.1 or 2.0)");
    const Json& version = root["version"];
    const std::string number = version.is_string() ? version.text() : "";
    if (number.rfind("1.0", 0) != 0 && number.rfind("1.1", 0) != 0 && number.rfind("2.0", 0) != 0) {
      fail(fmt::format("CityJSON version {} is not known",
                       version.is_null() ? "(none)" : version.dump(-1, Json::Order::ByKey)),
           "convert it to 2.0, e.g. with cjio's upgrade");
    }
    read_transform(root, number.rfind("1.0", 0) != 0);
    if (const Json* templates = root.find("geometry-templates")) templates_ = *templates;
    const Json& reference = root["metadata"]["referenceSystem"];
    system_ = model_.system(reference.is_string() ? reference.text() : std::string(), true, 0);
  }

  void read_transform(const Json& root, bool needed) {
    const Json* transform = root.find("transform");
    if (transform == nullptr) {
      if (needed) fail("no transform, which CityJSON 1.1 and later require");
      return;
    }
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
    if (!scale_.allFinite() || !translate_.allFinite() || !(scale_.array() != 0).all())
      fail("transform.scale must not be zero");
  }

  void read_vertices(const Json& root) {
    const Json& list = root["vertices"];
    if (!list.is_array()) fail("\"vertices\" is missing or not a list");
    vertices_.clear();
    vertices_.reserve(list.size());
    faults_.assign(list.size(), {});
    for (const Json& vertex : list) {
      if (!is_point(vertex)) {
        faults_[vertices_.size()] = "is not three numbers";
        vertices_.push_back(Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
        continue;
      }
      const Eigen::Vector3d raw(vertex[0].get<double>(), vertex[1].get<double>(), vertex[2].get<double>());
      vertices_.emplace_back(raw.cwiseProduct(scale_) + translate_);
    }
    if (!templates_.is_null()) raw_ = vertices_;
    const bool geographic = model_.reference(*system_).geographic();
    for (std::size_t i = 0; geographic && i < vertices_.size(); ++i)
      if (std::abs(vertices_[i].y()) > 90) faults_[i] = "is beyond the poles; CityJSON has longitude first";
    model_.to_wgs84(*system_, vertices_);
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      if (!faults_[i].empty()) continue;
      if (!vertices_[i].allFinite())
        faults_[i] = "is outside the area of its reference system";
      else if (!is_height_of_city(vertices_[i].z()))
        faults_[i] = "has a height outside -500 to 10,000 m";
    }
  }

  std::vector<Eigen::Vector3d> ring(const std::string& key, const Json& indices) {
    if (!indices.is_array()) fail_object(key, "a ring is not a list of vertex numbers");
    std::vector<Eigen::Vector3d> points;
    std::size_t last = 0;
    std::size_t first = 0;
    for (const Json& index : indices) {
      if (!index.is_integer())
        fail_object(key,
                    fmt::format("vertex number {} is not an integer", index.dump(-1, Json::Order::ByKey)));
      const auto number = index.get<long long>();
      if (number < 0 || static_cast<std::size_t>(number) >= vertices_.size()) {
        fail_object(key, fmt::format("vertex number {} is out of range (there are {} vertices)", number,
                                     vertices_.size()));
      }
      const auto i = static_cast<std::size_t>(number);
      if (!faults_[i].empty()) fail_object(key, fmt::format("vertex {} {}", i, faults_[i]));
      if (!points.empty() && i == last) continue;
      if (points.empty()) first = i;
      points.push_back(vertices_[i]);
      last = i;
    }
    if (points.size() > 1 && last == first) points.pop_back();
    return points;
  }

  std::optional<MapSurface> surface(const std::string& key, const Json& polygon) {
    if (!polygon.is_array()) fail_object(key, "a surface is not a list of rings");
    MapSurface result;
    bool outer = true;
    for (const Json& indices : polygon) {
      std::vector<Eigen::Vector3d> points = ring(key, indices);
      if (points.size() < 3) {
        model_.leave_out("rings of fewer than three points");
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

  /// The surfaces of any geometry, as (polygon, its value in semantics.values).
  std::vector<std::pair<const Json*, const Json*>> flatten(const std::string& key,
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
      for (std::size_t i = 0; i < shell.size(); ++i)
        surfaces.emplace_back(&shell[i], &child(shell_values, i));
    };
    const auto add_solid = [&](const Json& solid, const Json& solid_values) {
      if (!solid.is_array()) fail_object(key, fmt::format("a {}'s boundaries are nested too little", type));
      if (!solid.empty()) add_shell(solid[0], child(solid_values, 0));  // inner shells are cavities
    };
    if (type == "MultiSurface" || type == "CompositeSurface")
      add_shell(boundaries, values);
    else if (type == "Solid")
      add_solid(boundaries, values);
    else  // MultiSolid, CompositeSolid
      for (std::size_t i = 0; i < boundaries.size(); ++i) add_solid(boundaries[i], child(values, i));
    return surfaces;
  }

  void add_surfaces(const std::string& key, const Json& geometry, CityObject& object) {
    const Json& types = geometry["semantics"]["surfaces"];
    for (const auto& [polygon, value] : flatten(key, geometry)) {
      auto made = surface(key, *polygon);
      if (!made) continue;
      if (value->is_integer()) {
        const auto number = value->get<long long>();
        if (number < 0 || !types.is_array() || static_cast<std::size_t>(number) >= types.size())
          fail_object(key, fmt::format("semantic number {} is out of range", number));
        const Json& type = types[static_cast<std::size_t>(number)];
        made->semantic = text_of(type["type"]);
      }
      object.surfaces.push_back(std::move(*made));
    }
  }

  /// The geometry that an instance repeats; null if there is none of that number.
  const Json* template_of(const Json& instance) const {
    const Json& number = instance["template"];
    const Json& list = templates_["templates"];
    if (!number.is_integer() || !list.is_array()) return nullptr;
    const auto index = number.get<long long>();
    if (index < 0 || static_cast<std::size_t>(index) >= list.size()) return nullptr;
    const Json& geometry = list[static_cast<std::size_t>(index)];
    return geometry.is_object() ? &geometry : nullptr;
  }

  std::vector<Eigen::Vector3d> template_vertices() const {
    std::vector<Eigen::Vector3d> points;
    const Json& list = templates_["vertices-templates"];
    for (std::size_t i = 0; list.is_array() && i < list.size(); ++i) {
      const Json& vertex = list[i];
      if (!is_point(vertex)) fail(fmt::format("vertex {} of the templates is not three numbers", i));
      points.emplace_back(vertex[0].get<double>(), vertex[1].get<double>(), vertex[2].get<double>());
    }
    return points;
  }

  void add_template(const std::string& key, const Json& instance, CityObject& object) {
    const Json& origin = instance["boundaries"];
    if (!origin.is_array() || origin.size() != 1 || !origin[0].is_integer() ||
        origin[0].get<long long>() < 0 || static_cast<std::size_t>(origin[0].get<long long>()) >= raw_.size())
      fail_object(key, "a GeometryInstance has no vertex number");
    const auto number = static_cast<std::size_t>(origin[0].get<long long>());
    if (vertices_[number].allFinite()) object.transform_to_wgs84 = vertices_[number];
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    const Json& rows = instance["transformationMatrix"];
    for (std::size_t i = 0; i < 16 && rows.is_array() && rows.size() == 16; ++i) {
      if (!rows[i].is_number()) fail_object(key, "transformationMatrix is not 16 numbers");
      matrix(static_cast<Eigen::Index>(i / 4), static_cast<Eigen::Index>(i % 4)) = rows[i].get<double>();
    }
    std::vector<Eigen::Vector3d> posed = template_vertices();
    model_.transform_to_wgs84(*system_, matrix, raw_[number], posed);
    std::vector<std::string_view> none(posed.size());
    const auto exchange = [&] {
      std::swap(vertices_, posed);
      std::swap(faults_, none);
    };
    exchange();
    try {
      add_surfaces(key, *template_of(instance), object);
    } catch (const InputError&) {
      exchange();
      throw;
    }
    exchange();
  }

  double lod_of(const Json& geometry) const {
    const Json* own = text_of(geometry["type"]) == "GeometryInstance" ? template_of(geometry) : &geometry;
    if (own == nullptr) return -1;
    const Json& lod = (*own)["lod"];  // a number in 1.0, text since 1.1
    if (lod.is_number()) return lod.get<double>();
    return lod.is_string() ? parse_double(lod.text()).value_or(-1) : -1;
  }

  const Json* choose_geometry(const std::string& key, const Json& object) {
    const Json* geometries = object.find("geometry");
    if (geometries == nullptr) return nullptr;
    if (!geometries->is_array()) fail_object(key, "\"geometry\" is not a list");
    static const std::set<std::string> kUsable{"MultiSurface", "CompositeSurface", "Solid",
                                               "MultiSolid",   "CompositeSolid",   "GeometryInstance"};
    const Json* best = nullptr;
    double best_lod = -1;
    for (const Json& geometry : *geometries) {
      if (!geometry.is_object()) fail_object(key, "a geometry is not a JSON object");
      const std::string type = text_of(geometry["type"]);
      if (kUsable.count(type) == 0) {
        model_.leave_out("geometries of type " + (type.empty() ? "(none)" : type));
        continue;
      }
      const double lod = lod_of(geometry);
      if (lod <= model_.options().model.highest_lod() && lod > best_lod) {
        best = &geometry;
        best_lod = lod;
      }
    }
    return best;
  }

  void read_attributes(const Json& object, CityAttributes& read) {
    const Json& attributes = object["attributes"];
    if (!attributes.is_object()) return;
    for (const auto& [name, value] : attributes.members()) {
      // CityJSON itself uses metres; converters write units next to a value or around it.
      const Json& inner = value.is_object() && value.contains("value") ? value["value"] : value;
      std::string unit = value.is_object() ? text_of(value["uom"]) : "";
      if (unit.empty() && attribute_matters(name)) {
        for (const std::string& key : {"+" + name + "-uom", name + "-uom", name + "_uom"})
          if (unit.empty()) unit = text_of(attributes[key]);
      }
      const std::string text = text_of(inner);
      if (text.empty()) continue;
      if (const auto metres = value_in_metres(name, text, unit))
        read[name] = *metres;
      else
        model_.leave_out(kOtherUnit);
    }
  }

  void read_object(const std::string& key, const Json& object) {
    if (!object.is_object()) fail_object(key, "is not a JSON object");
    CityObject read;
    read.id = key;
    read.type = text_of(object["type"]);
    read_attributes(object, read.attributes);
    const Json& parents = object["parents"];
    if (parents.is_array() && !parents.empty()) read.parent = text_of(parents[0]);
    const Json& children = object["children"];
    read.has_parts = children.is_array() && !children.empty();
    const Json* geometry = choose_geometry(key, object);
    if (geometry != nullptr) {
      read.lod = lod_of(*geometry);
      if (text_of((*geometry)["type"]) == "GeometryInstance")
        add_template(key, *geometry, read);
      else
        add_surfaces(key, *geometry, read);
    }
    model_.add(std::move(read));
  }

  void read_objects(const Json& root) {
    const Json& objects = root["CityObjects"];
    if (!objects.is_object()) fail("\"CityObjects\" is missing or not a JSON object");
    read_vertices(root);
    for (const auto& [key, object] : objects.members()) {
      const std::size_t bad = notes_.losses();
      notes_.guard([&, &key = key, &object = object] {
        try {
          read_object(key, object);
        } catch (const JsonError& e) {
          fail_object(key, fmt::format("not valid CityJSON ({})", e.what()));
        }
      });
      if (notes_.losses() == bad) ++good_;
    }
  }

  TextFile& file_;
  CityModel& model_;
  ReadReport notes_;  ///< of objects
  std::size_t good_ = 0;
  int line_ = 0;
  std::optional<std::size_t> system_;
  Eigen::Vector3d scale_ = Eigen::Vector3d::Ones();
  Eigen::Vector3d translate_ = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> raw_;       ///< as in the file, scaled
  std::vector<Eigen::Vector3d> vertices_;  ///< lon, lat [deg], ellipsoidal height [m]; NaN if impossible
  std::vector<std::string_view> faults_;   ///< of vertices, reason if invalid; empty for good ones
  Json templates_;
};

}  // namespace

void read_cityjson(TextFile& file, CityModel& model) {
  CityJsonReader(file, model).read();
}

}  // namespace canyon::buildings
