#include "canyon/propagation/facade_rays.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "canyon/city/city.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/propagation/diffuse.hpp"

namespace canyon::propagation {
namespace {

using Eigen::Vector3d;
using geodesy::kPi;

/// Patches seen more grazingly than this (0.06 deg) weigh no more in the directive lobe, whose share of a ray
/// grows as 1 / cos(theta_s).
constexpr double kLeastCosine = 1e-3;
/// A patch that is seen more grazingly from the start of its ray than from the antenna weighs no more.
constexpr double kMostWeight = 4;

/// For each triangle its reflectance; 0 where nothing scatters.
std::vector<double> reflectances(const city::Mesh& mesh, std::optional<double> of_all) {
  std::vector<double> result(mesh.triangles.size(), 0);
  for (const city::Object& object : mesh.objects) {
    if (object.surface != city::Surface::Building && object.surface != city::Surface::Vehicle) continue;
    for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t)
      result[t] = of_all ? *of_all : reflectance(mesh.materials[t]);
  }
  return result;
}

/// Unit, about the normal, with a density of cos / pi: of two numbers from [0, 1).
Vector3d lambert_direction(const Vector3d& normal, double u, double v) {
  const double across = std::sqrt(u), along = std::sqrt(1 - u);
  const Vector3d x = normal.unitOrthogonal();
  return across * (std::cos(2 * kPi * v) * x + std::sin(2 * kPi * v) * normal.cross(x)) + along * normal;
}

/// Number `index` of an even sequence in [0, 1) (Weyl's, of an irrational step).
double even(std::size_t index, double step) {
  const double x = (static_cast<double>(index) + 0.5) * step;
  return x - std::floor(x);
}

/// The antenna's side of a path that begins with `first`.
void see(const Vector3d& antenna, const FacadePatch& first, FacadePatch& patch) {
  const Vector3d way = patch.point - antenna;
  patch.range_m = way.norm();
  patch.towards = way / patch.range_m;
  if (&patch == &first) {
    patch.leg.towards = patch.arrival = patch.towards;
    patch.arrival_m = patch.range_m;
    patch.cos_seen = -patch.normal.dot(patch.towards);
    patch.weight =
        patch.cos_seen > 0
            ? std::min(kMostWeight, patch.area_m2 * patch.cos_seen / (patch.range_m * patch.range_m))
            : 0;
    patch.share = patch.scattered * patch.weight;
  } else {
    patch.arrival = first.arrival;
    patch.arrival_m = first.arrival_m;
    patch.detour_m = first.arrival_m + patch.onward_m - patch.range_m;
    patch.cos_seen = -patch.normal.dot(patch.leg.towards);
    patch.share = first.weight * patch.scattered;
  }
  patch.cos_seen = std::max(patch.cos_seen, kLeastCosine);
}

}  // namespace

double reflectance(city::Material material) {
  switch (material) {
    case city::Material::Unknown:
    case city::Material::Concrete:
      return 0.215;
    case city::Material::Glass:
      return 0.437;
    case city::Material::Brick:
      return 0.082;
    case city::Material::Metal:
      return 1;
    case city::Material::Stone:
      return 0.322;
    case city::Material::Wood:
      return 0.132;
    case city::Material::Plaster:
      return 0.150;
    case city::Material::Ground:
      return 0.350;
    case city::Material::Foliage:
      return 0;
  }
  return 0;
}

FacadeRays::FacadeRays(const city::Mesh& mesh, const raytrace::RayScene& scene, const DiffuseOptions& options)
    : scene_(&scene),
      options_(options),
      scattered_(options.scattering_coefficient * options.scattering_coefficient),
      city_(reflectances(mesh, options.wall_reflectance)),
      light_(scene) {
  const double low = std::sin(options.lowest_elevation_rad);
  const double golden = kPi * (3 - std::sqrt(5.0));
  for (int i = 0; i < options.rays; ++i) {
    const double z = low + (1 - low) * (i + 0.5) / options.rays, across = std::sqrt(1 - z * z);
    const double turn = std::fmod(i * golden, 2 * kPi);
    sphere_.emplace_back(across * std::cos(turn), across * std::sin(turn), z);
    sphere_.back().normalize();
  }
  share_ = 2 * kPi * (1 - low) / options.rays / (options.lobe_exponent == 0 ? kPi : 1);
}

double FacadeRays::reflectance_of(const raytrace::Hit& hit) const {
  if (hit.instance == 0) return city_[hit.triangle];
  const std::vector<raytrace::PlacedInstance>& placed = scene_->placed_instances();
  const auto it =
      std::lower_bound(placed.begin(), placed.end(), hit.instance,
                       [](const raytrace::PlacedInstance& p, std::uint32_t id) { return p.id < id; });
  assert(it != placed.end() && it->id == hit.instance);
  return instances_.of(*it, [this](const city::Mesh& mesh) {
    return std::make_unique<const std::vector<double>>(reflectances(mesh, options_.wall_reflectance));
  })[hit.triangle];
}

/// Where the rays to the static city begin.
Vector3d FacadeRays::start(const Vector3d& antenna) const {
  Vector3d middle = kBlock_m * ((antenna / kBlock_m).array().floor() + 0.5).matrix();
  const Vector3d way = middle - antenna;
  const double range_m = way.norm();
  if (range_m < 1e-6 || scene_->occluded_by_city({antenna, way / range_m, range_m})) return antenna;
  return middle;
}

/// How a ray goes on behind a facade; at the last bounce where too little is left of it.
FacadeLeg FacadeRays::onward(FacadeLeg leg, double reflected, const Vector3d& normal) const {
  const double k = leg.bounce;
  leg.carried *= reflected;
  leg.bounce = leg.carried < share_ * 1e-3 ? options_.bounces : leg.bounce + 1;
  if (even(leg.ray, 0.7548776662466927 + k) < scattered_) {
    leg.scattered_before = true;
    leg.towards = lambert_direction(normal, even(leg.ray, 0.5698402909980532 + k),
                                    even(leg.ray, 0.8191725133961645 + k));
  } else {
    leg.towards += 2 * std::max(-normal.dot(leg.towards), kLeastCosine) * normal;
    leg.towards.normalize();
  }
  return leg;
}

std::optional<raytrace::Hit> FacadeRays::cast(const raytrace::Ray& ray, bool instances) const {
  const double step_m = scene_->surface_offset_m(ray.origin);
  std::optional<raytrace::Hit> hit = scene_->cast(ray, step_m);
  while (!instances && hit && hit->instance != 0) hit = scene_->cast(ray, hit->range_m + step_m);
  return hit;
}

/// Appends the patches that a ray meets from `origin` on. @param before the last facade, null: none.
/// @param instances whether it meets these
void FacadeRays::follow(const Vector3d& origin, FacadeLeg leg, const FacadePatch* before, bool instances,
                        std::vector<FacadePatch>& patches) const {
  Vector3d from = origin;
  double onward_m = before != nullptr ? before->onward_m : 0;
  double way_m = before != nullptr ? before->arrival_m + onward_m : 0;
  std::uint32_t triangle = before != nullptr ? before->triangle : 0;
  std::uint32_t instance = before != nullptr ? before->instance : 0;
  while (leg.bounce < options_.bounces) {
    const auto hit = cast({from, leg.towards, options_.max_range_m - way_m}, instances);
    const double reflected = hit ? reflectance_of(*hit) : 0;
    if (!(reflected > 0)) return;
    way_m += hit->range_m;
    FacadePatch& patch = patches.emplace_back();
    patch.leg = leg;
    patch.point = from + hit->range_m * leg.towards;
    patch.normal = hit->front ? hit->normal : Vector3d(-hit->normal);
    patch.lifted = patch.point + scene_->surface_offset_m(patch.point) * patch.normal;
    patch.moves = hit->instance != 0;
    if (!patch.moves) patch.cell = light_.cell(hit->triangle, patch.point, hit->front);
    patch.scattered = leg.carried * reflected * (leg.scattered_before ? 1 : scattered_);
    if (leg.bounce == 0) {
      patch.area_m2 = hit->range_m * hit->range_m / std::max(-patch.normal.dot(leg.towards), kLeastCosine);
      triangle = hit->triangle;
      instance = hit->instance;
    } else {
      onward_m += hit->range_m;
    }
    patch.onward_m = onward_m;
    patch.triangle = triangle;
    patch.instance = instance;
    leg = onward(leg, reflected, patch.normal);
    patch.next = leg;
    from = patch.lifted;
  }
}

/// Cuts the paths whose ways an instance blocks, and appends where their rays go instead.
void FacadeRays::follow_around_instances(const Vector3d& antenna, FacadesAbout& facades) const {
  std::vector<FacadePatch>& patches = facades.patches;
  std::uint32_t k = 0;
  for (std::uint32_t ray = 0; ray < sphere_.size(); ++ray) {
    const std::uint32_t first = k;
    Vector3d from = antenna;
    FacadeLeg leg{ray, 0, share_, false, sphere_[ray]};
    bool blocked = false;
    for (; k < facades.fixed && patches[k].leg.ray == ray; ++k) {
      if (!blocked) {
        leg = patches[k].leg;
        const double range_m = (patches[k].point - from).norm();
        blocked = scene_->occluded_by_instances({from, (patches[k].point - from) / range_m, range_m});
      }
      if (blocked) {
        patches[k].share = 0;
      } else {
        from = patches[k].lifted;
        leg = patches[k].next;
      }
    }
    if (leg.bounce >= options_.bounces) continue;
    // Where the static city ends a ray, an instance may be in front of that.
    if (!blocked && !scene_->occluded_by_instances({from, leg.towards, options_.max_range_m})) continue;
    const auto begin = static_cast<std::uint32_t>(patches.size());
    const std::uint32_t before = first + static_cast<std::uint32_t>(leg.bounce) - 1;
    follow(from, leg, leg.bounce > 0 ? &patches[before] : nullptr, true, patches);
    if (begin == patches.size()) continue;
    if (blocked && leg.bounce == 0) patches[begin].area_m2 *= patches[first].weight;
    for (std::size_t i = begin; i < patches.size(); ++i)
      see(antenna, patches[leg.bounce > 0 ? first : begin], patches[i]);
  }
}

void FacadeRays::look(const Vector3d& antenna, FacadesAbout& facades) const {
  std::vector<FacadePatch>& patches = facades.patches;
  const Vector3d from = start(antenna);
  if (facades.from != from) {
    facades.from = from;
    patches.clear();
    for (std::uint32_t ray = 0; ray < sphere_.size(); ++ray)
      follow(from, {ray, 0, share_, false, sphere_[ray]}, nullptr, false, patches);
    facades.fixed = static_cast<std::uint32_t>(patches.size());
    for (FacadesAbout::Lit& lit : facades.lit) lit.direction = ~0U;
  }
  patches.resize(facades.fixed);
  std::size_t first = 0;
  for (std::size_t k = 0; k < patches.size(); ++k) {
    if (patches[k].leg.bounce == 0) first = k;
    see(antenna, patches[first], patches[k]);
  }
  if (!scene_->placed_instances().empty()) follow_around_instances(antenna, facades);
}

}  // namespace canyon::propagation
