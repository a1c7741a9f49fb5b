// Declared in canyon/city/buildings/builder_steps.hpp.
#include "canyon/city/buildings/builder_steps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "canyon/base/text.hpp"
#include "canyon/city/buildings/shapes/footprint.hpp"
#include "canyon/city/buildings/shapes/solid.hpp"
#include "canyon/city/city.hpp"

namespace canyon::buildings {
namespace {

constexpr double kRoof_m = 0.5, kWall_m = 0.4, kDeck_m = 1, kLayer_m = 6;
constexpr double kPiece_m = 30, kOverlap_m = 0.5;

bool is_footway(const TagMap& tags) {
  const std::string_view highway = tag(tags, "highway");
  return highway == "footway" || highway == "path" || highway == "steps" || highway == "cycleway" ||
         highway == "pedestrian";
}

double width_m(const TagMap& tags) {
  const double lanes = length_tag_m(tags, "lanes", 1, 16, 0);
  const double otherwise = lanes > 0                       ? 3.5 * lanes
                           : is_footway(tags)              ? 3
                           : !tag(tags, "railway").empty() ? 5
                                                           : 8;
  return length_tag_m(tags, "width", 1, 100, otherwise);
}

double inner_height_m(const TagMap& tags) {
  const double headroom = length_tag_m(tags, "maxheight", 1.5, 20, 0);
  if (headroom > 0) return headroom + 0.3;
  return is_footway(tags) ? 3 : 5;
}

/// A stretch of a way over ground that counts as level.
struct Piece {
  std::vector<Point2> line;
  double ground_m = 0;
};

std::vector<Piece> pieces_of(const std::vector<Eigen::Vector3d>& line, bool level) {
  std::vector<Piece> pieces;
  if (level) {
    Piece& whole = pieces.emplace_back();
    whole.ground_m = line.front().z();
    for (const Eigen::Vector3d& point : line) {
      whole.line.emplace_back(point.head<2>());
      whole.ground_m = std::min(whole.ground_m, point.z());
    }
    return pieces;
  }
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Eigen::Vector3d step = line[i + 1] - line[i];
    const double length = step.head<2>().norm();
    if (length < 1e-3) continue;
    const int count = static_cast<int>(std::ceil(length / kPiece_m));
    for (int k = 0; k < count; ++k) {
      // Pieces overlap within the way, and end at its mouths.
      const double more = kOverlap_m / length;
      const bool first = i == 0 && k == 0, last = i + 2 == line.size() && k + 1 == count;
      const double from = static_cast<double>(k) / count - (first ? 0 : more);
      const double to = static_cast<double>(k + 1) / count + (last ? 0 : more);
      const Eigen::Vector3d a = line[i] + from * step, b = line[i] + to * step;
      pieces.push_back({{a.head<2>(), b.head<2>()}, std::min(a.z(), b.z())});
    }
  }
  return pieces;
}

}  // namespace

PassageKind passage_kind(const TagMap& tags) {
  const std::string_view tunnel = tag(tags, "tunnel"), bridge = tag(tags, "bridge");
  if (!tunnel.empty() && tunnel != "no") return PassageKind::Tunnel;
  return !bridge.empty() && bridge != "no" ? PassageKind::Bridge : PassageKind::Covered;
}

bool append_passage(city::Mesh& mesh, const std::string& id, const TagMap& tags,
                    const std::vector<Eigen::Vector3d>& line, bool level) {
  const PassageKind kind = passage_kind(tags);
  const double half_m = width_m(tags) / 2;
  const std::size_t before = mesh.objects.size();
  const auto append = [&](const std::vector<Polygon2>& polygons, double from_m, double to_m,
                          double ground_m) {
    Shape shape;
    shape.min_height_m = from_m;
    shape.height_m = to_m;
    std::vector<std::string> ignored;
    for (const Polygon2& polygon : polygons) {
      const std::size_t count = mesh.objects.size() - before;
      append_solid(mesh, count == 0 ? id : fmt::format("{}#{}", id, count + 1), city::Surface::Building,
                   polygon, shape, ground_m, ground_m, ignored);
    }
  };
  for (const Piece& piece : pieces_of(line, level)) {
    if (kind == PassageKind::Bridge) {
      const double deck_m = kLayer_m * length_tag_m(tags, "layer", 1, 5, 1);
      append(ribbon(piece.line, half_m), deck_m, deck_m + kDeck_m, piece.ground_m);
      continue;
    }
    const double inner_m = inner_height_m(tags);
    const bool walls = kind == PassageKind::Tunnel;
    const std::vector<Polygon2> over = ribbon(piece.line, half_m + (walls ? kWall_m : 0));
    append(over, inner_m, inner_m + kRoof_m, piece.ground_m);
    if (walls) append(subtract(over, ribbon(piece.line, half_m)), 0, inner_m, piece.ground_m);
  }
  return mesh.objects.size() > before;
}

}  // namespace canyon::buildings
