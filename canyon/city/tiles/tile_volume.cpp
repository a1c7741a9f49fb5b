#include "canyon/city/tiles/tile_volume.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/meshes/json_values.hpp"

namespace canyon::tiles {
namespace {

/// Maximum height of ground and buildings from the area's plane, with the Earth's curvature over 500 km.
constexpr double kReach_m = 30e3;

Eigen::Vector3d times(const Eigen::Matrix4d& m, const Eigen::Vector3d& v) {
  return m.topLeftCorner<3, 3>() * v + m.topRightCorner<3, 1>();
}

double region_width(const std::vector<double>& region) {
  const double width = region[2] - region[0];
  return width < 0 ? width + 2 * geodesy::kPi : width;
}

/// Whether two intervals of longitudes [rad] intersect, each given by its west end and width.
bool longitudes_meet(double west, double width, double other_west, double other_width) {
  const auto rotated = [](double angle) {
    const double rotation = std::fmod(angle, 2 * geodesy::kPi);
    return rotation < 0 ? rotation + 2 * geodesy::kPi : rotation;
  };
  return rotated(other_west - west) <= width || rotated(west - other_west) <= other_width;
}

/// Rejects degrees given as radians, and latitudes exchanged with longitudes.
void check_region(const std::vector<double>& region) {
  constexpr double kRounding = 1e-6;
  const auto within = [](double angle, double maximum) { return std::abs(angle) <= maximum + kRounding; };
  if (within(region[0], geodesy::kPi) && within(region[2], geodesy::kPi) &&
      within(region[1], geodesy::kPi / 2) && within(region[3], geodesy::kPi / 2) && region[1] <= region[3])
    return;
  throw InputError(
      fmt::format("has a bounding region of west {:g}, south {:g}, east {:g}, north {:g} rad", region[0],
                  region[1], region[2], region[3]),
      "regions are longitudes within 3.14 and latitudes within 1.57 rad: make the tileset again");
}

constexpr std::uint32_t kSubtreeMagic = 0x74627573;

class SubtreeReader {
 public:
  SubtreeReader(const Json& json, std::string_view binary,
                const std::function<std::string(const std::string&)>& fetch)
      : json_(json), binary_(binary), fetch_(fetch) {}

  [[nodiscard]] Subtree read(int levels, bool octree) const {
    const std::uint64_t nodes = nodes_above(levels, octree);
    const std::uint64_t children = nodes_above(levels + 1, octree) - nodes;
    Subtree out;
    out.tiles = availability(json_.at("tileAvailability"), nodes);
    out.children = availability(json_.at("childSubtreeAvailability"), children);
    const Json* content_availability = json_.find("contentAvailability");
    const Json& several = meshes::extension(json_, "3DTILES_multiple_contents")["contentAvailability"];
    if (several.is_array()) content_availability = &several;
    if (content_availability != nullptr && content_availability->is_array())
      for (const Json& each : *content_availability) out.contents.push_back(availability(each, nodes));
    else if (content_availability != nullptr)
      out.contents.push_back(availability(*content_availability, nodes));
    return out;
  }

 private:
  [[nodiscard]] Availability availability(const Json& of, std::uint64_t bits) const {
    if (of.contains("constant")) return Availability(meshes::count_member(of, "constant") != 0);
    const char* key = of.contains("bitstream") ? "bitstream" : "bufferView";
    const Json& view = member("bufferViews", meshes::count_member(of, key));
    const Json& buffer = member("buffers", meshes::count_member(view, "buffer"));
    const std::string uri = meshes::text_member(buffer, "uri");
    const std::string outer = uri.empty() ? std::string() : fetch_(uri);
    const std::string_view bytes =
        meshes::piece(uri.empty() ? binary_ : std::string_view(outer),
                      meshes::count_member(view, "byteOffset", 0), meshes::count_member(view, "byteLength"));
    return Availability(std::string(bytes), bits);
  }

  [[nodiscard]] const Json& member(std::string_view list, std::uint64_t index) const {
    const Json& items = json_.at(list);
    if (!items.is_array() || index >= items.size())
      throw InputError(fmt::format("{} {} does not exist", list, index));
    return items[static_cast<std::size_t>(index)];
  }

  const Json& json_;
  std::string_view binary_;
  const std::function<std::string(const std::string&)>& fetch_;
};

}  // namespace

TileVolume read_volume(const Json& volume) {
  TileVolume out;
  if (!volume.is_object()) return out;
  if (out.values = meshes::numbers_member(volume, "region", 6); !out.values.empty()) {
    check_region(out.values);
    out.kind = TileVolume::Kind::Region;
  } else if (out.values = meshes::numbers_member(volume, "box", 12); !out.values.empty()) {
    out.kind = TileVolume::Kind::Box;
  } else if (out.values = meshes::numbers_member(volume, "sphere", 4); !out.values.empty()) {
    out.kind = TileVolume::Kind::Sphere;
  }
  return out;
}

TileVolume TileVolume::part(int levels, const std::array<std::uint32_t, 3>& index, bool octree) const {
  TileVolume out = *this;
  const double parts = std::ldexp(1.0, levels);
  if (kind == Kind::Region) {
    const double width = region_width(values) / parts, depth = (values[3] - values[1]) / parts;
    out.values[0] = values[0] + index[0] * width;
    out.values[2] = out.values[0] + width;
    out.values[1] = values[1] + index[1] * depth;
    out.values[3] = out.values[1] + depth;
    if (octree) {
      const double height = (values[5] - values[4]) / parts;
      out.values[4] = values[4] + index[2] * height;
      out.values[5] = out.values[4] + height;
    }
  } else if (kind == Kind::Box) {
    for (std::size_t axis = 0; axis < (octree ? 3U : 2U); ++axis) {
      for (std::size_t i = 0; i < 3; ++i) {
        const double half = values[3 + 3 * axis + i];
        out.values[3 + 3 * axis + i] = half / parts;
        out.values[i] += half * ((2.0 * index[axis] + 1) / parts - 1);
      }
    }
  }
  return out;
}

std::optional<Eigen::Vector3d> TileVolume::centre(const Eigen::Matrix4d& transform) const {
  if (kind == Kind::Unknown) return std::nullopt;
  if (kind != Kind::Region) return times(transform, Eigen::Vector3d(values.data()));
  double longitude = values[0] + region_width(values) / 2;
  if (longitude > geodesy::kPi) longitude -= 2 * geodesy::kPi;
  return geodesy::ecef_from_geodetic({(values[1] + values[3]) / 2, longitude, (values[4] + values[5]) / 2});
}

double TileVolume::radius(const Eigen::Matrix4d& transform) const {
  if (kind == Kind::Unknown) return 0;
  if (kind == Kind::Region) {
    const double half = std::max(region_width(values), values[3] - values[1]) / 2;
    return geodesy::kSemiMajorAxis * half + std::abs(values[5] - values[4]) / 2;
  }
  double square = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d half =
        kind == Kind::Box
            ? Eigen::Vector3d(&values[3 + 3 * axis])
            : Eigen::Vector3d(values[3] * Eigen::Vector3d::Unit(static_cast<Eigen::Index>(axis)));
    square += (transform.topLeftCorner<3, 3>() * half).squaredNorm();
  }
  return std::sqrt(square);
}

TileArea::TileArea(const std::array<double, 4>& bbox_deg, const geodesy::LocalFrame& frame, bool local) {
  for (std::size_t i = 0; i < 4; ++i) region_rad_[i] = geodesy::radians(bbox_deg[i]);
  const auto& [west, south, east, north] = region_rad_;
  for (const double longitude : {west, (west + east) / 2, east})
    for (const double latitude : {south, (south + north) / 2, north})
      box_.extend(frame.local_from_geodetic({latitude, longitude, frame.origin().height_m}));
  box_.min().z() -= kReach_m;
  box_.max().z() += kReach_m;
  if (local) return;
  enu_from_root_.topLeftCorner<3, 3>() = frame.ecef_from_local_rotation().transpose();
  enu_from_root_.topRightCorner<3, 1>() = frame.local_from_ecef(Eigen::Vector3d::Zero());
}

bool TileArea::touches(const TileVolume& volume, const Eigen::Matrix4d& transform) const {
  if (everything() || volume.kind == TileVolume::Kind::Unknown) return true;
  const std::vector<double>& of = volume.values;
  if (volume.kind == TileVolume::Kind::Region) {
    const auto& [west, south, east, north] = region_rad_;
    return of[1] <= north && of[3] >= south && longitudes_meet(west, east - west, of[0], region_width(of));
  }
  const Eigen::Matrix4d to_enu = enu_from_root_ * transform;
  const Eigen::Vector3d centre = times(to_enu, Eigen::Vector3d(of.data()));
  Eigen::Vector3d half = Eigen::Vector3d::Zero();
  if (volume.kind == TileVolume::Kind::Box) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      half += (to_enu.topLeftCorner<3, 3>() * Eigen::Vector3d(&of[3 + 3 * axis])).cwiseAbs();
  } else {
    // Row norms, because a sphere's projection on an axis is as long as that axis' row.
    half = std::abs(of[3]) * to_enu.topLeftCorner<3, 3>().rowwise().norm();
  }
  return box_.intersects(Eigen::AlignedBox3d(Eigen::Vector3d(centre - half), Eigen::Vector3d(centre + half)));
}

Availability::Availability(std::string bytes, std::uint64_t bits) : bytes_(std::move(bytes)) {
  if (bytes_.size() < (bits + 7) / 8) {
    throw InputError(fmt::format("a list of {} bits has {} bytes", bits, bytes_.size()),
                     "get the subtree again");
  }
}

bool Availability::at(std::uint64_t index) const {
  if (bytes_.empty()) return constant_;
  if (index / 8 >= bytes_.size()) return false;
  return (static_cast<unsigned char>(bytes_[static_cast<std::size_t>(index / 8)]) >> (index % 8) & 1U) != 0;
}

Subtree read_subtree(std::string_view bytes, int levels, bool octree,
                     const std::function<std::string(const std::string& uri)>& fetch) {
  std::string_view text = bytes, binary;
  if (bytes.size() >= 4 && meshes::little<std::uint32_t>(bytes, 0) == kSubtreeMagic) {
    if (meshes::little<std::uint32_t>(bytes, 4) != 1) {
      throw InputError(fmt::format("is a subtree of version {}; only version 1 exists",
                                   meshes::little<std::uint32_t>(bytes, 4)));
    }
    const auto length = meshes::little<std::uint64_t>(bytes, 8);
    text = meshes::piece(bytes, 24, length);
    binary = meshes::piece(bytes, 24 + length, meshes::little<std::uint64_t>(bytes, 16));
  }
  try {
    const Json json = Json::parse(text);
    return SubtreeReader(json, binary, fetch).read(levels, octree);
  } catch (const JsonError& error) {
    throw InputError(fmt::format("has invalid JSON: {}", error.what()), "get the subtree again");
  }
}

std::uint64_t nodes_above(int level, bool octree) {
  std::uint64_t nodes = 0;
  for (int i = 0; i < level; ++i) nodes = nodes * (octree ? 8 : 4) + 1;
  return nodes;
}

}  // namespace canyon::tiles
