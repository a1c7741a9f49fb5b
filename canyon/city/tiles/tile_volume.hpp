#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/json.hpp"

namespace canyon::tiles {

/// The bounding volume of a tile (3D Tiles 1.1, "Bounding volumes").
struct TileVolume {
  enum class Kind {
    Unknown,  ///< none, or of an extension such as S2 cells: touches every area
    Region,   ///< west, south, east, north [rad], lowest and highest ellipsoidal height [m]; no transform
    Box,      ///< centre and three half axes
    Sphere    ///< centre and radius
  };
  Kind kind = Kind::Unknown;
  std::vector<double> values;  ///< 6, 12 or 4

  /// One of the 4 (quadtree) or 8 (octree) equal parts `levels` below this volume: at index (x, y, z) of
  /// 2^levels in each direction (3D Tiles 1.1, "Implicit tiling").
  [[nodiscard]] TileVolume part(int levels, const std::array<std::uint32_t, 3>& index, bool octree) const;
  /// The middle, in the frame of the tileset's root; empty for Unknown.
  [[nodiscard]] std::optional<Eigen::Vector3d> centre(const Eigen::Matrix4d& transform) const;
  /// The radius of a sphere about the centre that contains it [m], in the same frame; 0 for Unknown.
  [[nodiscard]] double radius(const Eigen::Matrix4d& transform) const;
};
/// Throws InputError for lists of a wrong length, non-finite numbers, and regions not on the Earth.
[[nodiscard]] TileVolume read_volume(const Json& volume);

/// The area that is read: a box about an origin, or everything.
class TileArea {
 public:
  /// Everything.
  TileArea() = default;
  /// @param bbox_deg west, south, east, north
  /// @param local the tileset's frame is east-north-up about `frame`'s origin, not ECEF
  TileArea(const std::array<double, 4>& bbox_deg, const geodesy::LocalFrame& frame, bool local);

  [[nodiscard]] bool everything() const { return box_.isEmpty(); }
  /// Never false for a tile that overlaps the area. @param transform to the root's frame
  [[nodiscard]] bool touches(const TileVolume& volume, const Eigen::Matrix4d& transform) const;

 private:
  std::array<double, 4> region_rad_{};
  Eigen::AlignedBox3d box_;  ///< ENU [m]; empty: everything
  Eigen::Matrix4d enu_from_root_ = Eigen::Matrix4d::Identity();
};

/// A flag for each of many nodes: a constant, or a bit stream, lowest bit of each byte first.
class Availability {
 public:
  Availability() = default;
  explicit Availability(bool constant) : constant_(constant) {}
  /// Throws InputError if there are fewer than `bits` bits.
  Availability(std::string bytes, std::uint64_t bits);

  /// False beyond the end.
  [[nodiscard]] bool at(std::uint64_t index) const;

 private:
  bool constant_ = false;
  std::string bytes_;
};

/// A subtree of implicit tiling (3D Tiles 1.1, "Subtree file format"; with `bufferView` instead of
/// `bitstream` also of 3DTILES_implicit_tiling).
struct Subtree {
  Availability tiles;                  ///< by node number: level by level, in Morton order
  std::vector<Availability> contents;  ///< one for each content of a tile
  Availability children;               ///< of child subtrees, in Morton order
};

/// @param levels of the subtree
/// @param fetch returns the bytes of an external buffer. Throws InputError for a damaged subtree.
[[nodiscard]] Subtree read_subtree(std::string_view bytes, int levels, bool octree,
                                   const std::function<std::string(const std::string& uri)>& fetch);

/// Number of nodes of a subtree in all levels above `level`: also the number of the first node of `level`.
[[nodiscard]] std::uint64_t nodes_above(int level, bool octree);

}  // namespace canyon::tiles
