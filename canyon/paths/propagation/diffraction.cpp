#include "canyon/paths/propagation/diffraction.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <tuple>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/paths/propagation/index/antenna_cache.hpp"
#include "canyon/paths/propagation/index/clear_rays.hpp"
#include "canyon/paths/propagation/index/knife_edge.hpp"
#include "canyon/paths/propagation/index/near_pairs.hpp"
#include "canyon/paths/propagation/index/per_instance.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::propagation {
namespace {

using Eigen::Vector3d;

/// Paths of one satellite closer than this are one.
constexpr double kSamePoint = 2e-3;  // m
/// Faces must be free from the edge for this far; a quarter of the wavelength of L1.
constexpr double kStep = 0.05;  // m
/// A point is lifted by at most this multiple of the offset, if the angle between the faces is nearly 0.
constexpr double kMaxLift = 4;
/// Of L1, for nu and the loss; excess paths do not depend on it.
constexpr double kWavelength_m = geodesy::kSpeedOfLight / gnss::kL1_hz;

/// A path by the geometry of one edge, before the test for obstacles.
struct Candidate {
  std::uint32_t satellite = 0;
  DiffractedPath path;
  Vector3d lifted = Vector3d::Zero();  ///< the point, off the edge
  double offset_m = 0;
  const Edge* edge = nullptr;
  SetPose pose;
};

/// Memory of one trace(); kept by each thread, so that nothing is allocated once it has grown.
struct DiffractionScratch {
  NearEdges near;
  std::vector<std::uint8_t> marks;
  std::vector<Candidate> candidates;
};

DiffractionScratch& diffraction_scratch() {
  static thread_local DiffractionScratch scratch;
  return scratch;
}

/// Off the edge into the air, so that the point is `offset_m` above both faces.
Vector3d lift(const Edge& edge, double offset_m) {
  const Vector3d outward = edge.outward();
  const double above = std::max(outward.dot(edge.normal[0]), 1 / kMaxLift);
  return offset_m / above * outward;
}

}  // namespace

double DiffractionOptions::max_excess_m() const {
  // J(nu) = 6.9 + 20 log10(y) with y = sqrt(x^2 + 1) + x, x = nu - 0.1, whose root is x = (y - 1 / y) / 2.
  const double y = std::pow(10, (max_loss_db - 6.9) / 20);
  const double nu = 0.1 + 0.5 * (y - 1 / y);
  return kWavelength_m * nu * nu / 4;
}

struct EdgeDiffraction::Impl {
  const raytrace::RayScene* scene;
  DiffractionOptions options;
  double shadow_excess, lit_excess;  ///< largest ones with the straight line blocked, and clear
  EdgeSet city;
  AntennaCache<NearBends> bends;

  PerInstance<EdgeSet> instances;

  Impl(const city::Mesh& mesh, const raytrace::RayScene& from, const DiffractionOptions& o)
      : scene(&from),
        options(o),
        shadow_excess(o.max_excess_m()),
        lit_excess(kWavelength_m * o.max_clear_nu * o.max_clear_nu / 4),
        city(mesh, o.terrain) {}

  const EdgeSet& edges_of(const raytrace::PosedInstance& posed) const {
    return instances.of(posed, [this](const city::Mesh& mesh) {
      return std::make_unique<const EdgeSet>(mesh, options.terrain);
    });
  }

  /// Appends the candidates of every edge of one set.
  void find(const EdgeSet& set, raytrace::InstanceId instance, const SetPose& pose, const Vector3d& antenna,
            std::span<const Vector3d> directions, std::span<const bool> blocked,
            DiffractionScratch& s) const {
    const Vector3d here = pose.moved_back(antenna);
    const double clearance = 2 * scene->surface_offset_m(antenna);
    set.gather(here, options.max_range_m, clearance, s.near);
    if (s.near.edge.empty()) return;
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const Vector3d towards = pose.rotated_to_local(directions[i]);
      mark_diffracting(s.near, towards, blocked[i] ? shadow_excess : lit_excess, s.marks);
      for_each_mark(s.marks.data(), s.marks.size(), [&](std::size_t k) {
        bend(set, s.near.edge[k], instance, pose, antenna, here, static_cast<std::uint32_t>(i), towards,
             blocked[i], s);
      });
    }
  }

  /// Appends the candidates of every edge of the movable instances.
  void find_at_instances(const Vector3d& antenna, std::span<const Vector3d> directions,
                         std::span<const bool> blocked, DiffractionScratch& s) const {
    for (const raytrace::PosedInstance& posed : scene->posed_instances())
      find(edges_of(posed), posed.id, &posed.enu_from_instance, antenna, directions, blocked, s);
  }

  /// Appends the candidate of an edge of the city.
  void bend_known(const KnownEdge& at, const Vector3d& antenna, std::span<const Vector3d> directions,
                  std::span<const bool> blocked, DiffractionScratch& s) const {
    if (!city.edges()[at.edge].is_seen_from(antenna, 2 * scene->surface_offset_m(antenna))) return;
    bend(city, at.edge, 0, nullptr, antenna, antenna, at.satellite, directions[at.satellite],
         blocked[at.satellite], s);
  }

  /// Appends the candidate of one edge, computed in doubles. `here` and `towards` in the set's frame.
  void bend(const EdgeSet& set, std::uint32_t index, raytrace::InstanceId instance, const SetPose& pose,
            const Vector3d& antenna, const Vector3d& here, std::uint32_t satellite, const Vector3d& towards,
            bool blocked, DiffractionScratch& s) const {
    const Edge& edge = set.edges()[index];
    const auto at = diffraction_point(edge, here, towards);
    if (!at || at->excess_m > (blocked ? shadow_excess : lit_excess) || at->leg_m > options.max_range_m ||
        at->bending_rad > options.max_bending_rad)
      return;
    const double nu = signed_knife_edge_nu(at->excess_m, kWavelength_m, true);

    Candidate& c = s.candidates.emplace_back();
    c.satellite = satellite;
    c.path.point = pose.moved(at->point);
    c.path.arrival = (c.path.point - antenna) / at->leg_m;
    c.path.excess_m = at->excess_m;
    c.path.bending_rad = at->bending_rad;
    c.path.leg_m = at->leg_m;
    c.path.nu = blocked && at->shadowed ? nu : -nu;
    c.path.loss_db = approximate_knife_edge_loss_db(blocked ? nu : -nu);
    c.path.edge = index;
    c.path.instance = instance;
    const double offset = scene->surface_offset_m(c.path.point) + edge.deviation_m;
    c.lifted = c.path.point + pose.rotated(lift(edge, offset));
    c.offset_m = offset;
    c.edge = &edge;
    c.pose = pose;
  }

  /// Keeps the strongest clear candidates of each satellite.
  void choose(const Vector3d& antenna, std::span<const Vector3d> directions, DiffractionScratch& s,
              std::span<std::vector<DiffractedPath>> result) const {
    // Weakest last: the search stops once a satellite has its paths.
    std::sort(s.candidates.begin(), s.candidates.end(), [](const Candidate& a, const Candidate& b) {
      return std::tie(a.satellite, a.path.excess_m, a.path.instance, a.path.edge) <
             std::tie(b.satellite, b.path.excess_m, b.path.instance, b.path.edge);
    });
    for (auto& paths : result) paths.clear();
    for (const Candidate& c : s.candidates) {
      std::vector<DiffractedPath>& paths = result[c.satellite];
      if (paths.size() >= static_cast<std::size_t>(options.max_paths)) continue;
      const bool seen = std::any_of(paths.begin(), paths.end(), [&](const DiffractedPath& path) {
        return (path.point - c.path.point).squaredNorm() < kSamePoint * kSamePoint;
      });
      if (!seen && is_clear(antenna, directions[c.satellite], c)) paths.push_back(c.path);
    }
  }

  /// Both legs, and the air on the edge's faces: if another body continues there, there is no edge. A seam of
  /// coplanar walls of two buildings looks like one edge of each, and a wall of sheets without common
  /// vertices like the free edges of its pieces.
  [[nodiscard]] bool is_clear(const Vector3d& antenna, const Vector3d& direction, const Candidate& c) const {
    const Vector3d leg = c.lifted - antenna;
    const double range = leg.norm();
    if (scene->occluded({antenna, leg / range, range}, scene->surface_offset_m(antenna)) ||
        scene->occluded({c.lifted, direction}))
      return false;
    const Edge& edge = *c.edge;
    if (edge.is_free()) {
      // Across the plane of the sheet, just beyond its rim.
      const Vector3d across = c.pose.rotated(edge.normal[0]);
      return !scene->occluded({c.lifted - 2 * c.offset_m * across, across, 4 * c.offset_m});
    }
    return !scene->occluded({c.lifted, c.pose.rotated(edge.normal[0].cross(edge.direction)), kStep}) &&
           !scene->occluded({c.lifted, c.pose.rotated(edge.direction.cross(edge.normal[1])), kStep});
  }
};

EdgeDiffraction::EdgeDiffraction(const city::Mesh& city, const raytrace::RayScene& scene,
                                 DiffractionOptions options) {
  options.validate();
  impl_ = std::make_shared<const Impl>(city, scene, options);
}

const DiffractionOptions& EdgeDiffraction::options() const {
  return impl_->options;
}

const EdgeSet& EdgeDiffraction::edges() const {
  return impl_->city;
}

void EdgeDiffraction::trace(const Vector3d& antenna, std::span<const Vector3d> directions,
                            std::span<const bool> blocked,
                            std::span<std::vector<DiffractedPath>> result) const {
  assert(directions.size() == blocked.size() && directions.size() == result.size());
  const Impl& impl = *impl_;
  DiffractionScratch& s = diffraction_scratch();
  s.candidates.clear();
  const auto lease = impl.bends.about(antenna);
  if (NearBends* bends = lease.get()) {
    bends->hold(impl.city, antenna, directions, impl.options.max_range_m,
                2 * impl.scene->surface_offset_m(antenna));
    for (std::uint32_t i = 0; i < directions.size(); ++i) {
      const double excess_m = blocked[i] ? impl.shadow_excess : impl.lit_excess;
      for (const std::uint32_t edge : bends->of(i, excess_m))
        impl.bend_known({i, edge}, antenna, directions, blocked, s);
    }
  } else {
    impl.find(impl.city, 0, nullptr, antenna, directions, blocked, s);
  }
  impl.find_at_instances(antenna, directions, blocked, s);
  impl.choose(antenna, directions, s, result);
}

void EdgeDiffraction::retrace(const Vector3d& antenna, std::span<const Vector3d> directions,
                              std::span<const bool> blocked, std::span<const KnownEdge> known,
                              std::span<std::vector<DiffractedPath>> result) const {
  const Impl& impl = *impl_;
  DiffractionScratch& s = diffraction_scratch();
  s.candidates.clear();
  for (const KnownEdge& at : known) impl.bend_known(at, antenna, directions, blocked, s);
  impl.find_at_instances(antenna, directions, blocked, s);
  impl.choose(antenna, directions, s, result);
}

}  // namespace canyon::propagation
