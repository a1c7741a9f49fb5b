#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "canyon/city/fwd.hpp"
#include "canyon/paths/propagation/index/bounds_blocks.hpp"

namespace canyon::propagation {

/// A diffracting edge: a straight convex edge between two faces, or the free edge of a single one.
/// Angles around an edge are counted from face 0 through the air to face 1: the direction from the edge into
/// face 0 is normal[0] x direction and has the angle 0, the one into face 1 is direction x normal[1] and has
/// `exterior_rad`. A free edge has its sheet as both faces, with opposite normals and 2 pi of air between.
struct Edge {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d direction{1, 0, 0};               ///< unit
  double length_m = 0;
  double exterior_rad = 0;  ///< of air between the faces, (pi, 2 pi]
  std::array<Eigen::Vector3d, 2> normal{Eigen::Vector3d::UnitZ(),
                                        Eigen::Vector3d::UnitZ()};  ///< unit, of the faces, into the air
  std::array<std::uint32_t, 2> triangle{};  ///< one per face at the edge; equal for a free edge
  double deviation_m = 0;                   ///< of the farthest vertex from the straight line

  /// Unit; bisects the air between the faces.
  [[nodiscard]] Eigen::Vector3d outward() const;
  /// A free edge: 2 pi of air around a sheet, open or closed with zero thickness.
  [[nodiscard]] bool is_free() const { return normal[0].dot(normal[1]) < -1 + 1e-9; }
  /// Whether a point is more than `clearance_m` + twice the deviation above the plane of a face.
  [[nodiscard]] bool is_seen_from(const Eigen::Vector3d& point, double clearance_m) const {
    const Eigen::Vector3d from = point - start;
    return std::max(normal[0].dot(from), normal[1].dot(from)) > clearance_m + 2 * deviation_m;
  }
};

/// The path of a plane wave around an edge.
struct EdgePoint {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< on the edge
  double leg_m = 0;                                 ///< from the antenna to the point, above 0
  double excess_m = 0;                              ///< excess over the straight line, at least 0
  double bending_rad = 0;  ///< between the leg and the direction to the satellite, [0, pi]
  bool shadowed = false;   ///< the edge's own faces, extended to infinity, block the straight line
};

/// The diffraction point for an antenna and a satellite at infinity in direction `s` (unit), in closed form.
/// The path |P - A| - s.(P - A) is stationary over the edge's points P if leg and satellite direction make
/// the same angle with the edge (Keller's cone: J. B. Keller, "Geometrical theory of diffraction", J. Opt.
/// Soc. Am. 52 (1962), 116-130). With w the vector from the antenna to the nearest point of the edge's line
/// and c = s.u, P is at |w| c / sqrt(1 - c^2) along u from that point; it is a minimum, as the path is
/// convex. Excess = leg (1 - cos(bending)), computed as leg |e - s|^2 / 2, e the leg's direction, which loses
/// no digits near the shadow boundary: within 1e-12 of the leg + 4e-16 of the coordinates.
///
/// Empty if the point is beyond the edge's ends (1 nm of slack), if antenna or satellite is behind both
/// faces, if the satellite is within 1e-6 rad of the edge's own direction, or the antenna within 1 um of its
/// line. Ignores other obstacles.
[[nodiscard]] std::optional<EdgePoint> diffraction_point(const Edge& edge, const Eigen::Vector3d& antenna,
                                                         const Eigen::Vector3d& s);

/// Edges within reach of an antenna, prepared for testing many directions at once: structure of arrays in
/// floats relative to the antenna.
struct NearEdges {
  std::vector<std::uint32_t> edge;  ///< index into the set; not padded
  std::vector<float> along_x, along_y, along_z;
  std::vector<float> foot_x, foot_y, foot_z;  ///< nearest point of the edge's line, from the antenna [m]
  std::vector<float> squared_distance;        ///< of the line [m^2]
  std::vector<float> low, high;               ///< cosines, along the edge, of the directions to its ends
  double farthest_m = 0;                      ///< of the lines
  /// Normals of both faces.
  std::vector<float> first_x, first_y, first_z, second_x, second_y, second_z;
  /// After pad() all arrays except `edge` are padded to a multiple of this with edges that match nothing;
  /// before pad(), they are longer than that.
  static constexpr std::size_t kLanes = 32;

  void clear();
  void append(std::uint32_t index, const Edge& edge, const Eigen::Vector3d& antenna);
  void pad();
  /// Upper bound: the rounding of a foot some hundred metres away changes an excess by up to 1e-6 of it.
  [[nodiscard]] float rounded_up(double excess_m) const {
    return static_cast<float>(excess_m * (1 + 1e-6) + 1e-4 + 2e-6 * farthest_m);
  }

 private:
  void resize(std::size_t size);
};

/// Marks edges that may diffract a satellite in direction `s` to the antenna with an excess path of at most
/// `max_excess_m`. Never misses one that diffraction_point() finds; `marks` gets the padded length.
void mark_diffracting(const NearEdges& near, const Eigen::Vector3d& s, double max_excess_m,
                      std::vector<std::uint8_t>& marks);
/// As above, with one bound per edge (rounded_up(), of the padded length), for directions up to `spread` from
/// `s`, whose cosines are within `low` and `high`.
void mark_diffracting(const NearEdges& near, const Eigen::Vector3d& s, std::span<const float> max_excess_m,
                      double spread, std::vector<std::uint8_t>& marks);

/// The diffracting edges of a mesh, built once. Foliage has none. Const members are thread-safe.
class EdgeSet {
 public:
  /// No edges.
  EdgeSet() = default;
  /// Triangles meet at an edge if they share the positions of two vertices. The faces around each edge are
  /// sorted by angle, so that common walls of two buildings, roofs that continue over them and duplicate
  /// faces make no edge. Edges are merged if one continues the other with the same faces: directions and
  /// normals within 0.5 deg, vertices within 0.5 mm of the line of the longest. The lower edge of a wall
  /// without a floor (its vertices within 1 mm of its object's lowest one, the wall above) is no edge. The
  /// mesh must pass city::check_mesh(). @param terrain crests of its triangles as well
  explicit EdgeSet(const city::Mesh& mesh, bool terrain = false);

  [[nodiscard]] std::span<const Edge> edges() const { return edges_; }

  /// Edges with a point within `reach_m` of the antenna that are seen from there (Edge::is_seen_from()).
  void gather(const Eigen::Vector3d& antenna, double reach_m, double clearance_m, NearEdges& out) const;

 private:
  void order_in_blocks();

  std::vector<Edge> edges_;  ///< ordered so that neighbours are adjacent
  BoundsBlocks blocks_;
};

}  // namespace canyon::propagation
