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
    Unknown,  ///< none, or of an extension such as S2 cells: touches everything
    Region,   ///< west, south, east, north [rad], lowest and highest ellipsoidal height [m]; no transform
    Box,      ///< centre and three half axes
    Sphere    ///< centre and radius
  };
  Kind kind = Kind::Unknown;
  std::vector<double> values;  ///< 6, 12 or 4

  /// One of the 4 (quadtree) or 8 (octree) equal parts `levels` below this: at (x, y, z) of 2^levels each way
  /// (3D Tiles 1.1, "Implicit tiling").
  [[nodiscard]] TileVolume part(int levels, const std::array<std::uint32_t, 3>& place, bool octree) const;
  /// The middle, in the frame of the tileset's root; empty for Unknown.
  [[nodiscard]] std::optional<Eigen::Vector3d> centre(const Eigen::Matrix4d& transform) const;
  /// The radius of a sphere about the centre that holds it [m], in the same frame; 0 for Unknown.
  [[nodiscard]] double radius(const Eigen::Matrix4d& transform) const;
};
/// Throws InputError for lists of a wrong length, numbers that are not finite, and regions that are not on
/// the Earth.
[[nodiscard]] TileVolume read_volume(const Json& volume);

/// The place that is read: a box about an origin, or everything.
class TileArea {
 public:
  /// Everything.
  TileArea() = default;
  /// @param bbox_deg west, south, east, north
  /// @param local the tileset's frame is east-north-up about `frame`'s origin, not ECEF
  TileArea(const std::array<double, 4>& bbox_deg, const geodesy::LocalFrame& frame, bool local);

  [[nodiscard]] bool everything() const { return box_.isEmpty(); }
  /// Never false for a tile with something in the area. @param transform to the root's frame
  [[nodiscard]] bool touches(const TileVolume& volume, const Eigen::Matrix4d& transform) const;

 private:
  std::array<double, 4> region_rad_{};
  Eigen::AlignedBox3d box_;  ///< ENU [m]; empty: everything
  Eigen::Matrix4d enu_from_root_ = Eigen::Matrix4d::Identity();
};

/// A yes or no for each of many places: a constant, or a stream of bits, the lowest of each byte first.
class Availability {
 public:
  Availability() = default;
  explicit Availability(bool constant) : constant_(constant) {}
  /// Throws InputError where there are fewer than `bits` bits.
  Availability(std::string bytes, std::uint64_t bits);

  /// False beyond the end.
  [[nodiscard]] bool at(std::uint64_t index) const;

 private:
  bool constant_ = false;
  std::string bytes_;
};

/// A subtree of implicit tiling (3D Tiles 1.1, "Subtree file format"; with `bufferView` in place of
/// `bitstream` also of 3DTILES_implicit_tiling).
struct Subtree {
  Availability tiles;                  ///< by number of the node: level by level, in Morton order
  std::vector<Availability> contents;  ///< one for each content of a tile
  Availability children;               ///< of subtrees, in Morton order
};

/// @param levels of the subtree
/// @param fetch gives the bytes of an outer buffer. Throws InputError for a damaged subtree.
[[nodiscard]] Subtree read_subtree(std::string_view bytes, int levels, bool octree,
                                   const std::function<std::string(const std::string& uri)>& fetch);

/// Nodes of a subtree in all levels above `level`: the number of the first node of that level.
[[nodiscard]] std::uint64_t nodes_above(int level, bool octree);

}  // namespace canyon::tiles
