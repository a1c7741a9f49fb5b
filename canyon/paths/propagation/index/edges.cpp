#include "canyon/paths/propagation/index/edges.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "canyon/base/arithmetic.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/mesh_topology.hpp"

namespace canyon::propagation {
namespace {

using Eigen::Vector3d;
using geodesy::kPi;

const double kSameDirection = std::cos(geodesy::radians(0.5));
constexpr double kLineTolerance = 0.5e-3;  // m
constexpr double kSameFace = 1e-3;  // rad about the edge: duplicate faces, common walls of two buildings
/// Faces deviate from one plane by at least 5 deg; seams of rounded walls stay below it.
constexpr double kMinRotation_rad = 0.087266462599716477;
constexpr double kFloorTolerance = 1e-3;  // m
constexpr double kEndSlack = 1e-9;        // m
constexpr double kMinSine = 1e-6;         // between edge and satellite
constexpr double kMinDistance = 1e-6;     // m, between antenna and line
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// A triangle as seen along an edge.
struct Face {
  double angle = 0;       ///< of its plane about the edge
  bool ascending = true;  ///< its front is on the side of growing angles
  std::uint32_t triangle = 0;
  Vector3d normal = Vector3d::UnitZ();  ///< unit, front
};

/// An edge between two vertices, before merging.
struct Piece {
  std::uint32_t from = 0, to = 0;  ///< welded vertices
  Edge edge;

  [[nodiscard]] Piece reversed() const {
    Piece r = *this;
    std::swap(r.from, r.to);
    r.edge.start = edge.start + edge.length_m * edge.direction;
    r.edge.direction = -edge.direction;
    std::swap(r.edge.normal[0], r.edge.normal[1]);
    std::swap(r.edge.triangle[0], r.edge.triangle[1]);
    return r;
  }
};

/// Triangles with edges that may diffract, welded, and their numbers in the mesh.
struct SolidTriangles {
  city::TriangleIndices corners;
  std::vector<std::uint32_t> number;

  SolidTriangles(const city::Mesh& mesh, bool terrain) {
    city::TriangleIndices welded = mesh.triangles;
    city::weld(mesh.vertices, welded);
    for (const city::Object& object : mesh.objects) {
      const bool diffracts = object.surface == city::Surface::Building ||
                             object.surface == city::Surface::Vehicle ||
                             (object.surface == city::Surface::Terrain && terrain);
      if (!diffracts) continue;
      for (std::uint32_t i = 0; i < object.triangle_count; ++i) {
        const std::uint32_t t = object.first_triangle + i;
        const auto& [a, b, c] = welded[t];
        if (city::is_degenerate(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c])) continue;
        corners.push_back(welded[t]);
        number.push_back(t);
      }
    }
  }
};

/// Sorts the faces at an edge by angle and removes duplicates. Of those at one angle the ascending come
/// first, so that the common wall of two buildings encloses no volume.
void order_faces(std::vector<Face>& faces) {
  std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) {
    return std::tie(a.angle, a.triangle) < std::tie(b.angle, b.triangle);
  });
  // Angles just below 2 pi equal those just above 0.
  while (faces.size() > 1 && faces.back().angle > faces.front().angle + 2 * kPi - kSameFace) {
    faces.back().angle -= 2 * kPi;
    std::rotate(faces.begin(), faces.end() - 1, faces.end());
  }
  std::size_t kept = 0;
  for (std::size_t begin = 0; begin < faces.size();) {
    std::size_t end = begin;
    std::optional<Face> ascending, descending;
    while (end < faces.size() && faces[end].angle <= faces[begin].angle + kSameFace) {
      auto& kind = faces[end].ascending ? ascending : descending;
      if (!kind) kind = faces[end];
      ++end;
    }
    if (ascending) faces[kept++] = *ascending;
    if (descending) faces[kept++] = *descending;
    begin = end;
  }
  faces.resize(kept);
}

/// Appends the wedges of air about one edge of the mesh, those wider than a half-space by kMinRotation_rad.
void append_wedges(const std::vector<Face>& faces, const Piece& blank, std::vector<Piece>& pieces) {
  const bool one_sheet =
      faces.size() == 1 || (faces.size() == 2 && faces[0].ascending && !faces[1].ascending &&
                            faces[1].angle - faces[0].angle <= kSameFace);
  if (one_sheet) {
    Piece piece = blank;
    piece.edge.exterior_rad = 2 * kPi;
    const Vector3d ascending = faces[0].ascending ? faces[0].normal : Vector3d(-faces[0].normal);
    piece.edge.normal = {ascending, -ascending};
    piece.edge.triangle = {faces[0].triangle, faces[0].triangle};
    pieces.push_back(piece);
    return;
  }
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const Face& from = faces[i];
    const Face& to = faces[(i + 1) % faces.size()];
    if (!from.ascending || to.ascending) continue;
    double air = to.angle - from.angle;
    if (i + 1 == faces.size()) air += 2 * kPi;
    if (air < kPi + kMinRotation_rad) continue;
    Piece piece = blank;
    piece.edge.exterior_rad = std::min(air, 2 * kPi);
    piece.edge.normal = {from.normal, to.normal};
    piece.edge.triangle = {from.triangle, to.triangle};
    pieces.push_back(piece);
  }
}

std::vector<Piece> pieces_of(const city::Mesh& mesh, bool terrain) {
  const SolidTriangles solid(mesh, terrain);
  std::vector<double> floor(mesh.triangles.size(), -1e300);  // lowest vertex of each triangle's object
  for (const city::Object& object : mesh.objects) {
    double lowest = 1e300;
    const auto begin = mesh.triangles.begin() + object.first_triangle;
    std::for_each(begin, begin + object.triangle_count, [&](const auto& triangle) {
      for (const std::uint32_t v : triangle) lowest = std::min(lowest, mesh.vertices[v].z());
    });
    std::fill_n(floor.begin() + object.first_triangle, object.triangle_count, lowest);
  }
  std::vector<Piece> pieces;
  std::vector<Face> faces;
  city::each_edge(solid.corners, [&](std::span<const city::TriangleSide> sides) {
    Piece blank;
    blank.from = static_cast<std::uint32_t>(sides[0].edge >> 32);
    blank.to = static_cast<std::uint32_t>(sides[0].edge);
    blank.edge.start = mesh.vertices[blank.from];
    const Vector3d& stop = mesh.vertices[blank.to];
    blank.edge.length_m = (stop - blank.edge.start).norm();
    blank.edge.direction = (stop - blank.edge.start) / blank.edge.length_m;
    const Vector3d& u = blank.edge.direction;
    const Vector3d x = u.unitOrthogonal(), y = u.cross(x);
    faces.clear();
    const auto opposite = [&](const city::TriangleSide& side) -> const Vector3d& {
      return mesh.vertices[solid.corners[side.triangle][(side.corner + 2) % 3]];
    };
    for (const city::TriangleSide& side : sides) {
      Face face;
      face.triangle = solid.number[side.triangle];
      face.normal = city::normal_of(mesh.vertices, mesh.triangles[face.triangle]).normalized();
      const Vector3d across = opposite(side) - blank.edge.start;
      face.ascending = face.normal.dot(u.cross(across)) > 0;
      // The normal is perpendicular to the edge within rounding; a sliver would give a worse angle.
      const Vector3d into = face.ascending ? Vector3d(face.normal.cross(u)) : Vector3d(u.cross(face.normal));
      face.angle = std::atan2(into.dot(y), into.dot(x));
      faces.push_back(face);
    }
    const double lowest = floor[solid.number[sides[0].triangle]] + kFloorTolerance;
    const bool missing_floor = sides.size() == 1 && blank.edge.start.z() <= lowest && stop.z() <= lowest &&
                               opposite(sides[0]).z() > lowest;
    order_faces(faces);
    if (!missing_floor) append_wedges(faces, blank, pieces);
  });
  return pieces;
}

/// Extends the longest pieces in both directions, since their directions are the most accurate.
std::vector<Edge> merge(std::vector<Piece> pieces) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> at_vertex;  // vertex, piece
  for (std::uint32_t i = 0; i < pieces.size(); ++i) {
    at_vertex.emplace_back(pieces[i].from, i);
    at_vertex.emplace_back(pieces[i].to, i);
  }
  std::sort(at_vertex.begin(), at_vertex.end());
  std::vector<std::uint32_t> order(pieces.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return pieces[a].edge.length_m > pieces[b].edge.length_m;
  });
  std::vector<char> used(pieces.size(), 0);
  std::vector<std::uint32_t> seeds;  // start pieces of the merged edges, sorted
  for (const std::uint32_t seed : order) {
    if (used[seed] != 0) continue;
    used[seed] = 1;
    Piece whole = pieces[seed];
    for (int route = 0; route < 2; ++route) {
      const Edge line = whole.edge;  // longest piece's direction and, at first, its whole length
      for (std::uint32_t next = 0; next != kNone;) {
        next = kNone;
        for (auto k = std::lower_bound(at_vertex.begin(), at_vertex.end(), std::pair(whole.to, 0u));
             k != at_vertex.end() && k->first == whole.to; ++k) {
          if (used[k->second] != 0) continue;
          const Piece& stored = pieces[k->second];
          const Piece piece = stored.from == whole.to ? stored : stored.reversed();
          const Vector3d stop = piece.edge.start + piece.edge.length_m * piece.edge.direction;
          const double along = (stop - line.start).dot(line.direction);
          const double off = (stop - line.start - along * line.direction).norm();
          if (off > kLineTolerance || piece.edge.direction.dot(line.direction) < kSameDirection ||
              piece.edge.normal[0].dot(line.normal[0]) < kSameDirection ||
              piece.edge.normal[1].dot(line.normal[1]) < kSameDirection)
            continue;
          next = k->second;
          used[next] = 1;
          whole.to = piece.to;
          whole.edge.length_m = along;
          whole.edge.deviation_m = std::max(whole.edge.deviation_m, off);
          break;
        }
      }
      whole = whole.reversed();
    }
    pieces[seed].edge = whole.edge;
    seeds.push_back(seed);
  }
  std::vector<Edge> edges;
  edges.reserve(seeds.size());
  for (const std::uint32_t seed : seeds) edges.push_back(pieces[seed].edge);
  return edges;
}

double squared_distance(const Vector3d& point, const Edge& edge) {
  const double along = std::clamp((point - edge.start).dot(edge.direction), 0.0, edge.length_m);
  return (edge.start + along * edge.direction - point).squaredNorm();
}

/// One block of edges, all in floats, written for vectorization: the path's inequality is squared, as a
/// square root may set errno.
CANYON_CLONES void mark_lanes(const float* __restrict ux, const float* __restrict uy,
                              const float* __restrict uz, const float* __restrict wx,
                              const float* __restrict wy, const float* __restrict wz,
                              const float* __restrict w2, const float* __restrict low,
                              const float* __restrict high, const float* __restrict ax,
                              const float* __restrict ay, const float* __restrict az,
                              const float* __restrict bx, const float* __restrict by,
                              const float* __restrict bz, std::size_t count, float sx, float sy, float sz,
                              const float* __restrict max_excess, float spread,
                              std::uint8_t* __restrict marks) {
  constexpr float kError = 4e-7f;  // of a product of unit vectors: three roundings, and those of its factors
  for (std::size_t i = 0; i < count; ++i) {
    const float cosine = ux[i] * sx + uy[i] * sy + uz[i] * sz;
    const float straight = wx[i] * sx + wy[i] * sy + wz[i] * sz + max_excess[i];
    const float first = ax[i] * sx + ay[i] * sy + az[i] * sz;
    const float second = bx[i] * sx + by[i] * sy + bz[i] * sz;
    // |w| sqrt(1 - cosine^2) - w.s <= max_excess, with the roundings of both sides
    const float bent2 = w2[i] * (1 - cosine * cosine - 4 * kError);
    const int hit =
        static_cast<int>(cosine >= low[i] - kError) & static_cast<int>(cosine <= high[i] + kError) &
        static_cast<int>(straight >= 0) & static_cast<int>(bent2 <= straight * straight) &
        (static_cast<int>(first >= -kError - spread) | static_cast<int>(second >= -kError - spread));
    marks[i] = static_cast<std::uint8_t>(hit);
  }
}

}  // namespace

Vector3d Edge::outward() const {
  const Vector3d into_first = normal[0].cross(direction);
  if (is_free()) return -into_first;
  return -(into_first + direction.cross(normal[1])).normalized();
}

std::optional<EdgePoint> diffraction_point(const Edge& edge, const Vector3d& antenna, const Vector3d& s) {
  const Vector3d& u = edge.direction;
  const Vector3d to_start = edge.start - antenna;
  const double start = to_start.dot(u);
  const Vector3d foot = to_start - start * u;  // from the antenna, perpendicular to the edge
  const double distance = foot.norm();
  const double cosine = s.dot(u);
  const double sine = s.cross(u).norm();
  if (!(distance > kMinDistance) || !(sine > kMinSine)) return std::nullopt;
  const double along = distance * cosine / sine;
  if (along < start - kEndSlack || along > start + edge.length_m + kEndSlack) return std::nullopt;
  const bool sees_first = edge.normal[0].dot(foot) < 0, sees_second = edge.normal[1].dot(foot) < 0;
  if (!sees_first && !sees_second) return std::nullopt;
  if (edge.normal[0].dot(s) < 0 && edge.normal[1].dot(s) < 0) return std::nullopt;

  EdgePoint result;
  const Vector3d leg = foot + along * u;
  result.point = antenna + leg;
  result.leg_m = distance / sine;
  const double half_chord = 0.5 * (leg / result.leg_m - s).norm();
  result.bending_rad = 2 * std::asin(std::min(1.0, half_chord));
  result.excess_m = 2 * result.leg_m * half_chord * half_chord;
  // If this is positive, the straight line, seen from the antenna, passes the edge on the side of growing
  // angles. The face that the antenna does not see is on that side if the antenna sees the first face only.
  const double side = u.cross(foot).dot(s);
  result.shadowed = (sees_first != sees_second) && (sees_first ? side > 0 : side < 0);
  return result;
}

void NearEdges::clear() {
  edge.clear();
  farthest_m = 0;
}

void NearEdges::resize(std::size_t size) {
  for (auto* v : {&along_x, &along_y, &along_z, &foot_x, &foot_y, &foot_z, &squared_distance, &low, &high,
                  &first_x, &first_y, &first_z, &second_x, &second_y, &second_z})
    v->resize(size);
}

void NearEdges::append(std::uint32_t index, const Edge& from, const Vector3d& antenna) {
  const Vector3d to_start = from.start - antenna;
  const double start = to_start.dot(from.direction), stop = start + from.length_m;
  const Vector3d foot = to_start - start * from.direction;
  const double distance2 = foot.squaredNorm();
  const std::size_t i = edge.size();
  if (i >= low.size()) resize(std::max(kLanes, 2 * i));
  edge.push_back(index);
  const auto put = [i](const Vector3d& v, std::vector<float>& x, std::vector<float>& y,
                       std::vector<float>& z) {
    x[i] = static_cast<float>(v.x());
    y[i] = static_cast<float>(v.y());
    z[i] = static_cast<float>(v.z());
  };
  put(from.direction, along_x, along_y, along_z);
  put(foot, foot_x, foot_y, foot_z);
  put(from.normal[0], first_x, first_y, first_z);
  put(from.normal[1], second_x, second_y, second_z);
  squared_distance[i] = static_cast<float>(distance2);
  // The cosine increases along the edge, so that its values at the ends are bounds.
  const auto cosine = [&](double along) { return along / std::sqrt(along * along + distance2); };
  low[i] = static_cast<float>(cosine(start - kEndSlack));
  high[i] = static_cast<float>(cosine(stop + kEndSlack));
  farthest_m = std::max(farthest_m, std::sqrt(distance2));
}

void NearEdges::pad() {
  resize((edge.size() + kLanes - 1) / kLanes * kLanes);
  const auto after = static_cast<std::ptrdiff_t>(edge.size());
  for (auto* v : {&along_x, &along_y, &along_z, &foot_x, &foot_y, &foot_z, &squared_distance, &first_x,
                  &first_y, &first_z, &second_x, &second_y, &second_z})
    std::fill(v->begin() + after, v->end(), 0.0F);
  std::fill(low.begin() + after, low.end(), 2.0F);
  std::fill(high.begin() + after, high.end(), -2.0F);
}

void mark_diffracting(const NearEdges& near, const Vector3d& s, double max_excess_m,
                      std::vector<std::uint8_t>& marks) {
  static thread_local std::vector<float> excess;
  excess.assign(near.low.size(), near.rounded_up(max_excess_m));
  mark_diffracting(near, s, excess, 0, marks);
}

void mark_diffracting(const NearEdges& near, const Vector3d& s, std::span<const float> max_excess_m,
                      double spread, std::vector<std::uint8_t>& marks) {
  const std::size_t count = near.low.size();
  marks.resize(count);
  mark_lanes(near.along_x.data(), near.along_y.data(), near.along_z.data(), near.foot_x.data(),
             near.foot_y.data(), near.foot_z.data(), near.squared_distance.data(), near.low.data(),
             near.high.data(), near.first_x.data(), near.first_y.data(), near.first_z.data(),
             near.second_x.data(), near.second_y.data(), near.second_z.data(), count,
             static_cast<float>(s.x()), static_cast<float>(s.y()), static_cast<float>(s.z()),
             max_excess_m.data(), static_cast<float>(spread), marks.data());
}

EdgeSet::EdgeSet(const city::Mesh& mesh, bool terrain) : edges_(merge(pieces_of(mesh, terrain))) {
  order_in_blocks();
}

/// Sorts along a Z-curve through cubes of 1/1024 of the bounds.
void EdgeSet::order_in_blocks() {
  Vector3d low = Vector3d::Constant(1e300), high = -low;
  const auto stop = [](const Edge& e) -> Vector3d { return e.start + e.length_m * e.direction; };
  const auto middle = [](const Edge& e) -> Vector3d { return e.start + 0.5 * e.length_m * e.direction; };
  for (const Edge& edge : edges_) {
    low = low.cwiseMin(middle(edge));
    high = high.cwiseMax(middle(edge));
  }
  const double cell = std::max(1e-3, (high - low).maxCoeff() / 1023);
  const auto code = [&](const Edge& edge) {
    const Vector3d at = (middle(edge) - low) / cell;
    std::uint32_t bits = 0;
    for (std::uint32_t bit = 0; bit < 10; ++bit)
      for (std::uint32_t k = 0; k < 3; ++k)
        bits |= (static_cast<std::uint32_t>(at[static_cast<int>(k)]) >> bit & 1u) << (3 * bit + k);
    return bits;
  };
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order;
  for (std::uint32_t i = 0; i < edges_.size(); ++i) order.emplace_back(code(edges_[i]), i);
  std::sort(order.begin(), order.end());
  std::vector<Edge> ordered;
  ordered.reserve(edges_.size());
  for (const auto& [position, i] : order) ordered.push_back(edges_[i]);
  edges_ = std::move(ordered);
  for (const Edge& edge : edges_)
    blocks_.append(edge.start.cwiseMin(stop(edge)), edge.start.cwiseMax(stop(edge)));
}

void EdgeSet::gather(const Vector3d& antenna, double reach_m, double clearance_m, NearEdges& out) const {
  out.clear();
  const double reach2 = reach_m * reach_m;
  blocks_.for_each_near(antenna, reach2, [&](std::size_t i) {
    const Edge& edge = edges_[i];
    if (!edge.is_seen_from(antenna, clearance_m) || squared_distance(antenna, edge) > reach2) return;
    out.append(static_cast<std::uint32_t>(i), edge, antenna);
  });
  out.pad();
}

}  // namespace canyon::propagation
