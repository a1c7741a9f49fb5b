#pragma once

#include "canyon/options/fwd.hpp"

namespace canyon::propagation {

struct EdgeOptions {
  /// Edges of the terrain as well: crests of its triangles.
  bool terrain = false;
  /// Free edges: of sheets, and of meshes that do not close. The lower edge of a wall without a
  /// floor (its vertices at its object's lowest one within 1 mm, the wall above) never is one.
  bool free_edges = true;
  /// Least angle [rad] by which the faces turn away from one plane. Seams of rounded walls stay below it.
  /// [0.001, pi/2], in degrees [0.0573, 90].
  double min_turn_rad = 0.087266462599716477;  // 5 deg
  [[nodiscard]] bool operator==(const EdgeOptions&) const = default;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
void visit(options::Visitor& v, EdgeOptions& o);

}  // namespace canyon::propagation
