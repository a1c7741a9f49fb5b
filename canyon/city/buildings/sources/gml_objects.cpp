// Declared in canyon/city/buildings/sources/gml_document.hpp.
#include "canyon/city/buildings/sources/gml_document.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon::buildings {
namespace {

/// Objects beside those of CityModel::builds() that it counts.
const std::set<std::string_view> kCounted{"MassPointRelief",
                                          "BreaklineRelief",
                                          "RasterRelief",
                                          "Road",
                                          "Railway",
                                          "Track",
                                          "Square",
                                          "Waterway",
                                          "LandUse",
                                          "WaterBody",
                                          "TransportationComplex",
                                          "GenericCityObject",
                                          "GenericOccupiedSpace",
                                          "GenericUnoccupiedSpace",
                                          "GenericThematicSurface"};
/// Objects that CityModel::add() knows, and those that it only counts.
bool is_city_object(std::string_view name) {
  return CityModel::builds(name) || kCounted.count(name) > 0;
}
/// Hold other objects and have no geometry.
bool only_holds_others(std::string_view name) {
  return name == "ReliefFeature" || name == "CityObjectGroup";
}

bool is_part(std::string_view name) {
  return name == "BuildingPart" || name == "BridgePart" || name == "TunnelPart";
}

class GmlObjectReader {
 public:
  GmlObjectReader(const GmlElement& root, const GmlLibrary& library, CityModel& model)
      : faces_(root, library), model_(model) {}

  void read(const GmlElement& element, const std::string& parent) {
    CityObject object;
    object.id = element.id.empty() ? fmt::format("{} of line {}", element.name, element.line) : element.id;
    object.named = !element.id.empty();
    object.type = element.name;
    object.parent = parent;
    // Objects inside this object take their polygons first.
    for (const GmlElement& property : element.children) {
      for (const GmlElement& child : property.children) {
        if (!is_gml_object(child.name)) continue;
        object.has_parts = object.has_parts || is_part(child.name);
        read(child, only_holds_others(element.name) ? std::string() : object.id);
      }
    }
    if (only_holds_others(element.name)) return;
    if (is_city_object(element.name)) {
      read_attributes(element, object.attributes);
      read_geometry(element, object);
    }
    model_.add(std::move(object));
  }

  void count_what_is_missing() {
    if (!faces_.missing().empty())
      model_.leave_out("references to geometries that the file does not have", faces_.missing().size());
    if (faces_.external() > 0) model_.leave_out("geometries in files of their own", faces_.external());
  }

 private:
  /// @param holder has the text of the value and its unit
  void take(const std::string& name, const GmlElement& holder, CityAttributes& attributes) {
    if (const auto value = value_in_metres(name, trim(holder.text), holder.unit)) {
      attributes.emplace(name, *value);
    } else {
      model_.leave_out(kOtherUnit);
    }
  }

  void read_attributes(const GmlElement& element, CityAttributes& attributes) {
    for (const GmlElement& child : element.children) {
      if (is_gml_object(child.name) || child.name == "boundedBy" || child.name == "boundary" ||
          child.name.rfind("lod", 0) == 0)
        continue;
      const GmlElement* value = child.child("value");
      // <stringAttribute name="function"><value>..., and <Height><value>... of CityGML 3.0
      const std::string& name = child.key.empty() ? child.name : child.key;
      const GmlElement& holder = value != nullptr ? *value : child;
      if (!holder.text.empty() && attribute_matters(name)) {
        take(name, holder, attributes);
      } else if (child.name == "Height" && value != nullptr) {
        take("measuredHeight", *value, attributes);
      }
      // Extensions (uro:buildingDetails) wrap their attributes.
      if (value == nullptr && child.rings.empty()) {
        for (const GmlElement& inner : child.children) {
          if (!is_gml_object(inner.name)) read_wrapped(inner, attributes);
        }
      }
    }
  }
  void read_wrapped(const GmlElement& element, CityAttributes& attributes) {
    if (element.name == "Height") {
      if (const GmlElement* value = element.child("value")) take("measuredHeight", *value, attributes);
      return;
    }
    read_attributes(element, attributes);
  }

  /// The levels of detail that may be taken, the best first. One that has rooms, and outlines, come last.
  [[nodiscard]] std::vector<int> preferred(const std::map<int, GmlDetail>& details) const {
    constexpr int kWithRooms = 4;
    const ModelOptions& wanted = model_.options().model;
    std::vector<int> lods;
    for (auto detail = details.rbegin(); detail != details.rend(); ++detail) {
      if (detail->first >= 1 && detail->first <= wanted.highest_lod()) lods.push_back(detail->first);
    }
    if (!wanted.lod && details.count(kWithRooms) > 0) lods.push_back(kWithRooms);
    if (details.count(0) > 0) lods.push_back(0);
    return lods;
  }

  void read_geometry(const GmlElement& element, CityObject& object) {
    const std::map<int, GmlDetail> details = faces_.details_of(element);
    for (const int lod : preferred(details)) {
      std::vector<GmlFace> faces = merged_faces(details.at(lod));
      // A part has them already.
      faces.erase(std::remove_if(faces.begin(), faces.end(),
                                 [&](const GmlFace& face) {
                                   return face.placement < 0 && taken_.count(face.polygon) > 0;
                                 }),
                  faces.end());
      if (faces.empty()) continue;
      object.lod = lod;
      for (const GmlFace& face : faces) {
        if (face.placement < 0) taken_.insert(face.polygon);
      }
      add_surfaces(faces, object);
      if (!object.surfaces.empty()) break;
    }
    if (!faces_.placements().empty()) place_object(object);
  }

  /// The first implicit geometry of the object that is read.
  void place_object(CityObject& object) {
    const std::size_t first = placements_seen_;
    placements_seen_ = faces_.placements().size();
    if (first == placements_seen_) return;
    const Eigen::Vector3d place = origin_of(faces_.placements()[first]);
    if (place.allFinite()) object.place = place;
  }

  /// Longitude, latitude [deg], ellipsoidal height [m].
  Eigen::Vector3d origin_of(const GmlPlacement& placement) {
    const GmlElement& point = *placement.reference;
    const std::size_t system = system_of(point);
    std::vector<Eigen::Vector3d> points{model_.east_first(system, point.positions.front())};
    model_.to_wgs84(system, points);
    return points.front();
  }

  std::size_t system_of(const GmlElement& element) {
    const std::string* name = element.system.get();
    const auto known = systems_.find(name);
    if (known != systems_.end()) return known->second;
    const std::size_t system = model_.system(name == nullptr ? std::string() : *name, false, element.line);
    systems_.emplace(name, system);
    return system;
  }

  using Points = std::vector<Eigen::Vector3d>;

  void place_relative(const GmlPlacement& placement, Points& points) {
    const std::size_t system = system_of(*placement.reference);
    model_.place(system, placement.matrix, model_.east_first(system, placement.reference->positions.front()),
                 points);
  }

  void add_surfaces(const std::vector<GmlFace>& faces, CityObject& object) {
    // Points in WGS 84 by placement and reference system, in the order of the faces.
    struct Batch {
      Points points;
      std::size_t taken = 0;
    };
    std::map<std::pair<int, std::size_t>, Batch> batches;
    const auto batch_of = [&](const GmlFace& face) -> Batch& {
      return batches[{face.placement, face.placement < 0 ? system_of(*face.polygon) : 0}];
    };
    for (const GmlFace& face : faces) {
      Points& points = batch_of(face).points;
      for (const Points& ring : face.polygon->rings) points.insert(points.end(), ring.begin(), ring.end());
    }
    for (auto& [key, batch] : batches) {
      if (key.first < 0) {
        for (Eigen::Vector3d& p : batch.points) p = model_.east_first(key.second, p);
        model_.to_wgs84(key.second, batch.points);
      } else {
        place_relative(faces_.placements()[static_cast<std::size_t>(key.first)], batch.points);
      }
    }
    std::size_t off_earth = 0;
    for (const GmlFace& face : faces) {
      MapSurface surface;
      surface.semantic = face.semantic;
      Batch& batch = batch_of(face);
      bool outer = true, good = true;
      for (const Points& raw : face.polygon->rings) {
        Points ring;
        for (std::size_t i = 0; i < raw.size(); ++i) {
          const Eigen::Vector3d& point = batch.points[batch.taken++];
          if (ring.empty() || ring.back() != point) ring.push_back(point);
        }
        if (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
        if (face.reversed) std::reverse(ring.begin(), ring.end());
        const bool finite =
            std::all_of(ring.begin(), ring.end(), [](const Eigen::Vector3d& p) { return p.allFinite(); });
        if (!finite) ++off_earth;
        const bool low_or_high =
            finite && std::any_of(ring.begin(), ring.end(),
                                  [](const Eigen::Vector3d& p) { return !is_height_of_city(p.z()); });
        if (low_or_high) {
          model_.leave_out("rings beyond -500 to 10,000 m of height");
          ring.clear();
        }
        if (raw.empty()) {
          model_.leave_out("rings whose coordinates are not numbers or not whole points");
        } else if (finite && !low_or_high && ring.size() < 3) {
          model_.leave_out("rings of fewer than three points");
        }
        if (finite && ring.size() >= 3) {
          if (outer) {
            surface.outer = std::move(ring);
          } else {
            surface.inners.push_back(std::move(ring));
          }
        } else if (outer) {
          good = false;
        }
        outer = false;
      }
      if (good) object.surfaces.push_back(std::move(surface));
    }
    if (off_earth > 0) {
      model_.leave_out(kElsewhere, off_earth);
      model_.say(
          ReadReport::Level::Loss,
          fmt::format("object \"{}\" has coordinates outside the area of its reference system", object.id));
    }
  }

  GmlFaces faces_;
  CityModel& model_;
  std::set<const GmlElement*> taken_;
  std::map<const std::string*, std::size_t> systems_;
  std::size_t placements_seen_ = 0;
};

}  // namespace

bool is_gml_object(std::string_view name) {
  return is_city_object(name) || only_holds_others(name);
}

std::set<std::string> missing_references(const GmlElement& object, const GmlLibrary& library) {
  GmlFaces faces(object, library);
  const auto follow = [&](const auto& self, const GmlElement& element) -> void {
    (void)faces.details_of(element);
    for (const GmlElement& property : element.children) {
      for (const GmlElement& child : property.children) {
        if (is_gml_object(child.name)) self(self, child);
      }
    }
  };
  follow(follow, object);
  return faces.missing();
}

void read_gml_object(const GmlElement& object, const GmlLibrary& library, CityModel& model) {
  GmlObjectReader reader(object, library, model);
  reader.read(object, {});
  reader.count_what_is_missing();
}

}  // namespace canyon::buildings
