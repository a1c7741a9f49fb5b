#include "canyon/paths/propagation/diffuse.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "canyon/base/arithmetic.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/random.hpp"
#include "canyon/city/city.hpp"
#include "canyon/paths/propagation/index/facade_light.hpp"
#include "canyon/paths/propagation/index/per_instance.hpp"

namespace canyon::propagation {
namespace {

using Eigen::Vector3d;
using geodesy::kPi;

/// Smaller cosines of patches are set to this one (0.06 deg from grazing).
constexpr double kMinSeenCosine = 1e-3;
/// Length [m] of a piece of facade with one scattering strength.
constexpr double kPiece_m = 8;
/// Puts a wall at a whole coordinate into one row of cubes; on their faces, rounding would select the cube.
constexpr double kPieceShift_m = 1e-3;

/// A piece of facade that a ray of the antenna hits, directly or over others.
struct Patch {
  Vector3d arrival;            ///< unit, from the antenna towards the origin of its waves
  Vector3d towards;            ///< unit, from the antenna to the patch
  Vector3d normal;             ///< unit, to the side that was hit
  Vector3d lifted;             ///< the point, off the surface
  bool moves = false;          ///< on a movable instance
  FacadeLight::Cell cell;      ///< on the city
  double range_m = 0;          ///< straight-line range from the antenna
  double detour_m = 0;         ///< of the path over other facades against the straight line
  double arrival_m = 0;        ///< from the antenna to the first facade of the path
  double cos_seen = 0;         ///< between the normal and the ray
  double fraction = 0;         ///< fraction of the incident power at normal incidence
  std::uint32_t triangle = 0;  ///< of the first facade, of `instance`
  std::uint32_t instance = 0;
};

/// Patches [first, last) of a satellite, with detours of one bin.
struct Class {
  std::uint32_t first = 0, last = 0;
  double power = 0;  ///< if all of them are lit
};

/// Fields of all patches that each satellite needs, as arrays: a Patch occupies four cache lines.
struct PatchArrays {
  std::vector<double> normal_x, normal_y, normal_z, towards_x, towards_y, towards_z, half_range_m, detour_m,
      fraction;
  /// For one satellite: cosine at the patch, excess of its path and its power, 0 if the patch faces away.
  std::vector<double> cos_lit, excess_m, power;
  std::vector<std::int32_t> bin;  ///< floor(excess / class_m)

  void fill(const std::vector<Patch>& patches) {
    for (auto* v : {&normal_x, &normal_y, &normal_z, &towards_x, &towards_y, &towards_z, &half_range_m,
                    &detour_m, &fraction, &cos_lit, &excess_m, &power})
      v->resize(patches.size());
    bin.resize(patches.size());
    for (std::size_t k = 0; k < patches.size(); ++k) {
      const Patch& p = patches[k];
      normal_x[k] = p.normal.x(), normal_y[k] = p.normal.y(), normal_z[k] = p.normal.z();
      towards_x[k] = p.towards.x(), towards_y[k] = p.towards.y(), towards_z[k] = p.towards.z();
      half_range_m[k] = 0.5 * p.range_m;
      detour_m[k] = p.detour_m;
      fraction[k] = p.fraction;
    }
  }
};

/// PatchArrays::cos_lit, excess_m, power and bin. excess = detour + range (1 - towards . s), accurate near 1.
CANYON_CLONES void light(std::size_t count, const double* __restrict nx, const double* __restrict ny,
                         const double* __restrict nz, const double* __restrict tx,
                         const double* __restrict ty, const double* __restrict tz,
                         const double* __restrict half_range, const double* __restrict detour,
                         const double* __restrict fraction, double sx, double sy, double sz,
                         double bins_per_m, double* __restrict cos_lit, double* __restrict excess,
                         double* __restrict power, std::int32_t* __restrict bin) {
  for (std::size_t k = 0; k < count; ++k) {
    cos_lit[k] = (nx[k] * sx + ny[k] * sy) + nz[k] * sz;
    power[k] = fraction[k] * 0.5 * (cos_lit[k] + std::abs(cos_lit[k]));
    const double dx = tx[k] - sx, dy = ty[k] - sy, dz = tz[k] - sz;
    excess[k] = detour[k] + half_range[k] * ((dx * dx + dy * dy) + dz * dz);
    bin[k] = static_cast<std::int32_t>(excess[k] * bins_per_m);
  }
}

/// Memory of one trace(); kept by each thread, so that nothing is allocated once it has grown.
struct DiffuseScratch {
  std::vector<Patch> patches;
  PatchArrays arrays;
  std::vector<std::uint32_t> facing, by_class;  ///< patches that face a satellite
  std::vector<std::uint32_t> patches_of_bin;
  std::vector<Class> classes;
};

/// Reflectance of each triangle; 0 if it does not scatter.
std::vector<double> reflectances(const city::Mesh& mesh, std::optional<double> requested) {
  std::vector<double> result(mesh.triangles.size(), 0);
  for (const city::Object& object : mesh.objects) {
    if (object.surface != city::Surface::Building && object.surface != city::Surface::Vehicle) continue;
    for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t)
      result[t] = requested ? *requested : reflectance(mesh.materials[t]);
  }
  return result;
}

/// Unit, around the normal, with a density of cos / pi: from two numbers in [0, 1).
Vector3d lambert_direction(const Vector3d& normal, double u, double v) {
  const double across = std::sqrt(u), along = std::sqrt(1 - u);
  const Vector3d x = normal.unitOrthogonal();
  return across * (std::cos(2 * kPi * v) * x + std::sin(2 * kPi * v) * normal.cross(x)) + along * normal;
}

/// Number `index` of a uniform sequence in [0, 1) (Weyl's, of an irrational step).
double even(std::size_t index, double step) {
  const double x = (static_cast<double>(index) + 0.5) * step;
  return x - std::floor(x);
}

/// Heads of 64 coin tosses: normal within 0.03 of its quantiles out to 2.5 deviations.
double normal_of(std::uint64_t bits) {
  return (std::popcount(mix64(bits)) - 32) / 4.0;
}

/// For comparing powers: those of equal facades differ in the last digits, which differ between C libraries.
float coarse(double power) {
  return static_cast<float>(power);
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

struct DiffuseScattering::Impl {
  const raytrace::RayScene* scene;
  DiffuseOptions options;
  std::vector<Vector3d> sphere;  ///< directions of the rays
  double fraction;               ///< of one ray: d(Omega) / pi
  double scattered;              ///< S^2
  double min_power;
  std::uint64_t root;        ///< of strengths
  std::vector<double> city;  ///< reflectances()
  FacadeLight facades;
  PerInstance<std::vector<double>> instances;

  Impl(const city::Mesh& mesh, const raytrace::RayScene& from, const DiffuseOptions& o, std::uint64_t seed)
      : scene(&from),
        options(o),
        min_power(std::pow(10, o.min_power_db / 10)),
        root(RandomStream(seed, "facades/strengths").next()),
        city(reflectances(mesh, o.wall_reflectance)),
        facades(from) {
    const double low = std::sin(o.lowest_elevation_rad);
    const double golden = kPi * (3 - std::sqrt(5.0));
    for (int i = 0; i < o.rays; ++i) {
      const double z = low + (1 - low) * (i + 0.5) / o.rays, across = std::sqrt(1 - z * z);
      const double rotation = std::fmod(i * golden, 2 * kPi);
      sphere.emplace_back(across * std::cos(rotation), across * std::sin(rotation), z);
      sphere.back().normalize();
    }
    scattered = o.scattering_coefficient * o.scattering_coefficient;
    fraction = 2 * kPi * (1 - low) / o.rays / kPi;
  }

  [[nodiscard]] double reflectance_of(const raytrace::Hit& hit) const {
    if (hit.instance == 0) return city[hit.triangle];
    const std::vector<raytrace::PosedInstance>& posed = scene->posed_instances();
    const auto it =
        std::lower_bound(posed.begin(), posed.end(), hit.instance,
                         [](const raytrace::PosedInstance& p, std::uint32_t id) { return p.id < id; });
    assert(it != posed.end() && it->id == hit.instance);
    return instances.of(*it, [this](const city::Mesh& mesh) {
      return std::make_unique<const std::vector<double>>(reflectances(mesh, options.wall_reflectance));
    })[hit.triangle];
  }

  /// All patches that rays from the antenna hit, and the patches that these rays hit next.
  void look_around(const Vector3d& antenna, std::vector<Patch>& patches) const {
    patches.clear();
    for (std::size_t i = 0; i < sphere.size(); ++i) {
      Vector3d from = antenna, towards = sphere[i];
      double travelled_m = 0, carried = fraction;
      bool scattered_before = false;
      for (int bounce = 0; bounce < options.bounces; ++bounce) {
        const auto hit =
            scene->cast({from, towards, options.max_range_m - travelled_m}, scene->surface_offset_m(from));
        const double reflected = hit ? reflectance_of(*hit) : 0;
        if (!(reflected > 0)) break;
        travelled_m += hit->range_m;
        const Vector3d point = from + hit->range_m * towards;
        Patch patch;
        if (bounce == 0) {
          patch.arrival = patch.towards = towards;
          patch.arrival_m = patch.range_m = hit->range_m;
          patch.triangle = hit->triangle;
          patch.instance = hit->instance;
        } else {
          patch = patches.back();  // its waves arrive as those of the previous patch
          patch.range_m = (point - antenna).norm();
          patch.towards = (point - antenna) / patch.range_m;
          patch.detour_m = travelled_m - patch.range_m;
        }
        patch.normal = hit->front ? hit->normal : Vector3d(-hit->normal);
        patch.lifted = point + scene->surface_offset_m(point) * patch.normal;
        patch.moves = hit->instance != 0;
        if (!patch.moves) patch.cell = facades.cell(hit->triangle, point, hit->front);
        patch.cos_seen = std::max(-patch.normal.dot(towards), kMinSeenCosine);
        patch.fraction = carried * reflected * (scattered_before ? 1 : scattered);
        patches.push_back(patch);
        carried *= reflected;
        if (carried < fraction * 1e-3) break;
        const double k = static_cast<double>(bounce);
        if (even(i, 0.7548776662466927 + k) < scattered) {
          scattered_before = true;
          towards = lambert_direction(patch.normal, even(i, 0.5698402909980532 + k),
                                      even(i, 0.8191725133961645 + k));
        } else {
          towards += 2 * patch.cos_seen * patch.normal;
          towards.normalize();
        }
        from = patch.lifted;
      }
    }
  }

  /// The patches that face the satellite, by class.
  void classify(const Vector3d& direction, const FacadeLight::Direction& grid_direction,
                DiffuseScratch& s) const {
    PatchArrays& a = s.arrays;
    const std::size_t count = s.patches.size();
    light(count, a.normal_x.data(), a.normal_y.data(), a.normal_z.data(), a.towards_x.data(),
          a.towards_y.data(), a.towards_z.data(), a.half_range_m.data(), a.detour_m.data(), a.fraction.data(),
          direction.x(), direction.y(), direction.z(), 1 / options.class_m, a.cos_lit.data(),
          a.excess_m.data(), a.power.data(), a.bin.data());
    s.facing.clear();
    s.patches_of_bin.clear();
    for (std::uint32_t k = 0; k < count; ++k) {
      if (!(a.cos_lit[k] > 0)) continue;
      const auto bin = static_cast<std::size_t>(a.bin[k]);
      if (bin >= s.patches_of_bin.size()) s.patches_of_bin.resize(bin + 1, 0);
      ++s.patches_of_bin[bin];
      s.facing.push_back(k);
    }
    s.classes.clear();
    std::uint32_t first = 0;
    for (std::uint32_t& patches : s.patches_of_bin) {
      Class of;
      of.first = of.last = first;
      first += patches;
      s.classes.push_back(of);
    }
    s.by_class.resize(s.facing.size());
    for (const std::uint32_t k : s.facing) {
      Class& of = s.classes[static_cast<std::size_t>(a.bin[k])];
      of.power += a.power[k];
      s.by_class[of.last++] = k;
      facades.fetch(s.patches[k].cell, grid_direction);
    }
  }

  void scatter(const Vector3d& antenna, const Vector3d& direction, DiffuseScratch& s,
               std::vector<DiffusePath>& result) const {
    const FacadeLight::Direction grid_direction = FacadeLight::direction(direction);
    classify(direction, grid_direction, s);
    std::erase_if(s.classes, [&](const Class& of) { return of.first == of.last || of.power < min_power; });
    // Strongest first, so that rays are cast only for classes that can be among the strongest.
    std::sort(s.classes.begin(), s.classes.end(), [](const Class& a, const Class& b) {
      return a.power != b.power ? a.power > b.power : a.first < b.first;
    });
    const auto stronger = [](const DiffusePath& a, const DiffusePath& b) {
      return coarse(a.power) != coarse(b.power) ? coarse(a.power) > coarse(b.power) : a.bin < b.bin;
    };
    const auto maximum = static_cast<std::size_t>(options.max_paths);
    for (const Class& of : s.classes) {
      if (result.size() == maximum && coarse(of.power) < coarse(result.back().power)) break;
      const DiffusePath path = sum_up(antenna, direction, grid_direction, of, s);
      if (!(path.power > 0 && path.power >= min_power)) continue;
      if (result.size() == maximum) {
        if (!stronger(path, result.back())) continue;
        result.pop_back();
      }
      result.insert(std::upper_bound(result.begin(), result.end(), path, stronger), path);
    }
    for (DiffusePath& path : result) path.power *= strength(path);
    std::sort(result.begin(), result.end(),
              [](const DiffusePath& a, const DiffusePath& b) { return a.bin < b.bin; });
  }

  /// Number of a piece of facade: of the reflectors, and the cube of the point.
  [[nodiscard]] std::uint64_t piece(std::uint64_t of, raytrace::InstanceId instance,
                                    const Vector3d& point) const {
    std::uint64_t bits = mix64(root + kGolden64 * of + mix64(instance));
    if (instance == 0) {
      for (int axis = 0; axis < 3; ++axis) {
        const auto cube = static_cast<std::int64_t>(std::floor((point[axis] + kPieceShift_m) / kPiece_m));
        bits = mix64(bits + kGolden64 * static_cast<std::uint64_t>(cube));
      }
    }
    return bits;
  }

  /// Factor of the class's power.
  [[nodiscard]] double strength(const DiffusePath& path) const {
    if (options.strength_sigma_db == 0 && options.strength_median_db == 0) return 1;
    const double normal = normal_of(piece(path.bin, path.instance, path.point));
    constexpr double kNepersPerDb = 0.23025850929940457;  // ln(10) / 10, of powers
    return std::exp(kNepersPerDb * (options.strength_median_db + options.strength_sigma_db * normal));
  }

  [[nodiscard]] bool is_lit(Patch& patch, const Vector3d& direction,
                            const FacadeLight::Direction& grid_direction) const {
    if (patch.moves) return !scene->occluded({patch.lifted, direction});
    return facades.sees(patch.cell, grid_direction) &&
           (scene->posed_instances().empty() || !scene->occluded_by_instances({patch.lifted, direction}));
  }

  /// The result of a class: power 0 if no part of it is lit.
  [[nodiscard]] DiffusePath sum_up(const Vector3d& antenna, const Vector3d& direction,
                                   const FacadeLight::Direction& grid_direction, const Class& of,
                                   DiffuseScratch& s) const {
    DiffusePath path;
    std::optional<std::uint32_t> strongest;
    for (std::uint32_t i = of.first; i < of.last; ++i) {
      const std::uint32_t k = s.by_class[i];
      if (!is_lit(s.patches[k], direction, grid_direction)) continue;
      path.power += s.arrays.power[k];
      path.excess_m += s.arrays.power[k] * s.arrays.excess_m[k];
      if (!strongest || coarse(s.arrays.power[k]) > coarse(s.arrays.power[*strongest])) strongest = k;
    }
    if (!strongest) return path;
    path.excess_m /= path.power;
    const Patch& patch = s.patches[*strongest];
    path.point = antenna + patch.arrival_m * patch.arrival;
    path.arrival = patch.arrival;
    path.triangle = patch.triangle;
    path.instance = patch.instance;
    path.bin = static_cast<std::uint32_t>(s.arrays.bin[*strongest]);
    return path;
  }
};

DiffuseScattering::DiffuseScattering(const city::Mesh& city, const raytrace::RayScene& scene,
                                     DiffuseOptions options, std::uint64_t seed) {
  options.validate();
  impl_ = std::make_shared<const Impl>(city, scene, options, seed);
}

Vector3d DiffuseScattering::scattering_offset(const Path& path) const {
  constexpr double kOfEdges = 0.4;
  const double sigma = impl_->options.glint_sigma * (path.kind == PathKind::Diffracted ? kOfEdges : 1);
  const std::uint64_t bits = impl_->piece(path.reflector, path.instance, path.point);
  const Vector3d sideways = path.arrival.unitOrthogonal();
  return sigma * (normal_of(bits) * sideways + normal_of(mix64(bits)) * path.arrival.cross(sideways));
}

const DiffuseOptions& DiffuseScattering::options() const {
  return impl_->options;
}

void DiffuseScattering::trace(const Vector3d& antenna, std::span<const Vector3d> directions,
                              std::span<const bool> wanted,
                              std::span<std::vector<DiffusePath>> result) const {
  assert(directions.size() == wanted.size() && directions.size() == result.size());
  bool any = false;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    result[i].clear();
    if (!wanted[i]) continue;
    if (!(std::abs(directions[i].squaredNorm() - 1) <= 2e-6)) {
      throw InputError(fmt::format("the direction ({}, {}, {}) to satellite {} does not have length 1",
                                   directions[i].x(), directions[i].y(), directions[i].z(), i),
                       "normalise it");
    }
    any = true;
  }
  if (!any || impl_->scattered == 0) return;
  static thread_local DiffuseScratch scratch;
  DiffuseScratch& s = scratch;
  impl_->look_around(antenna, s.patches);
  if (s.patches.empty()) return;
  s.arrays.fill(s.patches);
  for (std::size_t i = 0; i < directions.size(); ++i)
    if (wanted[i]) impl_->scatter(antenna, directions[i], s, result[i]);
}

}  // namespace canyon::propagation
