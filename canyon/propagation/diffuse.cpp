#include "canyon/propagation/diffuse.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/random.hpp"
#include "canyon/base/simd_clones.hpp"
#include "canyon/city/city.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/propagation/facade_rays.hpp"
#include "canyon/propagation/index/places.hpp"

namespace canyon::propagation {
namespace {

using Eigen::Vector3d;
using geodesy::kPi;

constexpr int kMostExponent = 20;

double power(double base, int exponent) {
  double result = 1;
  for (; exponent > 0; exponent >>= 1, base *= base)
    if ((exponent & 1) != 0) result *= base;
  return result;
}

/// lobe_integral() as constant + cos(theta) * (polynomial in sin^2(theta)).
struct LobeIntegral {
  double constant = 0;
  std::array<double, kMostExponent / 2> coefficient{};
  int terms = 0;

  explicit LobeIntegral(int exponent) : terms((exponent + 1) / 2) {
    double binomial = std::ldexp(1, -exponent);  // C(exponent, j) / 2^exponent
    for (int j = 0; j <= exponent; ++j) {
      const double share = binomial * 2 * kPi / (j + 1);
      if (j % 2 == 0) {
        constant += share;
      } else {
        double central = 1;  // C(2w, w) / 4^w
        for (int w = 0; w <= (j - 1) / 2; ++w) {
          coefficient[static_cast<std::size_t>(w)] += share * central;
          central *= (2 * w + 1.0) / (2 * w + 2.0);
        }
      }
      binomial *= static_cast<double>(exponent - j) / (j + 1);
    }
  }
  [[nodiscard]] double at(double cosine) const {
    const double sin2 = std::max(0.0, 1 - cosine * cosine);
    double sum = 0;
    for (int w = terms - 1; w >= 0; --w) sum = sum * sin2 + coefficient[static_cast<std::size_t>(w)];
    return constant + cosine * sum;
  }
};

/// Patches [first, last) of a satellite's, with detours of one bin.
struct Class {
  std::uint32_t first = 0, last = 0;
  double power = 0;  ///< if all of them were lit
};

/// The fields of all patches that each satellite needs, as arrays: a Patch takes four lines of the cache.
struct PatchArrays {
  std::vector<double> normal_x, normal_y, normal_z, towards_x, towards_y, towards_z, half_range_m, detour_m,
      share;
  /// For one satellite: cosine at the patch, excess of its path and its power, 0 where the patch faces away.
  std::vector<double> cos_lit, excess_m, power;
  std::vector<std::int32_t> bin;  ///< floor(excess / class_m)

  void fill(const std::vector<FacadePatch>& patches) {
    for (auto* v : {&normal_x, &normal_y, &normal_z, &towards_x, &towards_y, &towards_z, &half_range_m,
                    &detour_m, &share, &cos_lit, &excess_m, &power}) {
      v->resize(patches.size());
    }
    bin.resize(patches.size());
    for (std::size_t k = 0; k < patches.size(); ++k) {
      const FacadePatch& p = patches[k];
      normal_x[k] = p.normal.x(), normal_y[k] = p.normal.y(), normal_z[k] = p.normal.z();
      towards_x[k] = p.towards.x(), towards_y[k] = p.towards.y(), towards_z[k] = p.towards.z();
      half_range_m[k] = 0.5 * p.range_m;
      detour_m[k] = p.detour_m;
      share[k] = p.share;
    }
  }
};

/// PatchArrays::cos_lit, excess_m, power of Lambert's lobe, and bin. excess = detour + range (1 - towards .
/// s), without the loss of digits near 1.
CANYON_CLONES void light(std::size_t count, const double* __restrict nx, const double* __restrict ny,
                         const double* __restrict nz, const double* __restrict tx,
                         const double* __restrict ty, const double* __restrict tz,
                         const double* __restrict half_range, const double* __restrict detour,
                         const double* __restrict share, double sx, double sy, double sz, double bins_per_m,
                         double* __restrict cos_lit, double* __restrict excess, double* __restrict power,
                         std::int32_t* __restrict bin) {
  for (std::size_t k = 0; k < count; ++k) {
    cos_lit[k] = (nx[k] * sx + ny[k] * sy) + nz[k] * sz;
    power[k] = share[k] * 0.5 * (cos_lit[k] + std::abs(cos_lit[k]));
    const double dx = tx[k] - sx, dy = ty[k] - sy, dz = tz[k] - sz;
    excess[k] = detour[k] + half_range[k] * ((dx * dx + dy * dy) + dz * dz);
    bin[k] = static_cast<std::int32_t>(excess[k] * bins_per_m);
  }
}

/// Memory of one trace(); each thread keeps it, so that nothing is allocated once it has grown.
struct DiffuseScratch {
  FacadesAbout facades;  ///< of an antenna about which nothing is kept
  PatchArrays arrays;
  std::vector<std::uint32_t> facing, by_class;  ///< patches that face a satellite
  std::vector<std::uint32_t> patches_of_bin;
  std::vector<Class> classes;
};

DiffuseScratch& diffuse_scratch() {
  static thread_local DiffuseScratch scratch;
  return scratch;
}

/// A satellite that lights the facades about an antenna.
struct Lighting {
  Vector3d direction;
  FacadeLight::Direction grid;  ///< about it
  FacadesAbout* facades;
  FacadesAbout::Lit* lit;
};

}  // namespace

double lobe_integral(int exponent, double cos_incidence) {
  if (!(exponent >= 0 && exponent <= kMostExponent && cos_incidence >= 0 && cos_incidence <= 1))
    throw InputError(fmt::format("a lobe of exponent {} at cos(incidence) {}", exponent, cos_incidence),
                     "give an exponent from 0 to 20 and a cosine from 0 to 1");
  return LobeIntegral(exponent).at(cos_incidence);
}

struct DiffuseScattering::Impl {
  const raytrace::RayScene* scene;
  DiffuseOptions options;
  double min_power;
  LobeIntegral lobe;
  std::uint64_t root;  ///< of strengths
  FacadeRays rays;
  Places<FacadesAbout> places;

  Impl(const city::Mesh& mesh, const raytrace::RayScene& from, const DiffuseOptions& o, std::uint64_t seed)
      : scene(&from),
        options(o),
        min_power(std::pow(10, o.min_power_db / 10)),
        lobe(o.lobe_exponent),
        root(RandomStream(seed, "facades/strengths").next()),
        rays(mesh, from, o) {}

  void classify(const Lighting& by, DiffuseScratch& s) const;
  void scatter(const Vector3d& antenna, const Lighting& by, DiffuseScratch& s,
               std::vector<DiffusePath>& result) const;
  [[nodiscard]] double strength(const DiffusePath& path) const;
  [[nodiscard]] bool is_lit(const Lighting& by, std::uint32_t patch) const;
  [[nodiscard]] DiffusePath sum_up(const Vector3d& antenna, const Lighting& by, const Class& of,
                                   const DiffuseScratch& s) const;
};

bool DiffuseScattering::Impl::is_lit(const Lighting& by, std::uint32_t k) const {
  FacadePatch& patch = by.facades->patches[k];
  if (patch.moves) return !scene->occluded({patch.lifted, by.direction});
  bool sees = false;
  if (k < by.facades->fixed) {
    std::uint8_t& answer = by.lit->answers[k];
    if (answer == FacadesAbout::Lit::kUnknown) {
      answer = rays.light().sees(patch.cell, by.grid) ? FacadesAbout::Lit::kYes : FacadesAbout::Lit::kNo;
      by.lit->darkened |= answer == FacadesAbout::Lit::kNo;
    }
    sees = answer == FacadesAbout::Lit::kYes;
  } else {
    sees = rays.light().sees(patch.cell, by.grid);
  }
  return sees && !scene->occluded_by_instances({patch.lifted, by.direction});
}

/// By which the class's power is multiplied.
double DiffuseScattering::Impl::strength(const DiffusePath& path) const {
  if (options.strength_sigma_db == 0 && options.strength_median_db == 0) return 1;
  std::uint64_t bits = mix64(root + kGolden64 * path.bin + mix64(path.instance));
  if (path.instance == 0) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto piece = static_cast<std::int64_t>(std::floor(path.point[axis] / options.strength_piece_m));
      bits = mix64(bits + kGolden64 * static_cast<std::uint64_t>(piece));
    }
  }
  // Heads of 64 tossed coins: normal within 0.03 of its quantiles out to 2.5 deviations.
  const double normal = (std::popcount(mix64(bits)) - 32) / 4.0;
  constexpr double kNepersPerDb = 0.23025850929940457;  // ln(10) / 10, of powers
  return std::exp(kNepersPerDb * (options.strength_median_db + options.strength_sigma_db * normal));
}

/// A class as it arrives: power 0 where nothing of it is lit.
DiffusePath DiffuseScattering::Impl::sum_up(const Vector3d& antenna, const Lighting& by, const Class& of,
                                            const DiffuseScratch& s) const {
  DiffusePath path;
  std::optional<std::uint32_t> strongest;
  for (std::uint32_t i = of.first; i < of.last; ++i) {
    const std::uint32_t k = s.by_class[i];
    if (!is_lit(by, k)) continue;
    path.power += s.arrays.power[k];
    path.excess_m += s.arrays.power[k] * s.arrays.excess_m[k];
    if (!strongest || s.arrays.power[k] > s.arrays.power[*strongest]) strongest = k;
  }
  if (!strongest) return path;
  path.excess_m /= path.power;
  const FacadePatch& patch = by.facades->patches[*strongest];
  path.point = antenna + patch.arrival_m * patch.arrival;
  path.arrival = patch.arrival;
  path.triangle = patch.triangle;
  path.instance = patch.instance;
  path.bin = static_cast<std::uint32_t>(s.arrays.bin[*strongest]);
  return path;
}

/// The patches that face the satellite, by class.
void DiffuseScattering::Impl::classify(const Lighting& by, DiffuseScratch& s) const {
  const Vector3d& direction = by.direction;
  PatchArrays& a = s.arrays;
  const std::vector<FacadePatch>& patches = by.facades->patches;
  const std::size_t count = patches.size();
  light(count, a.normal_x.data(), a.normal_y.data(), a.normal_z.data(), a.towards_x.data(),
        a.towards_y.data(), a.towards_z.data(), a.half_range_m.data(), a.detour_m.data(), a.share.data(),
        direction.x(), direction.y(), direction.z(), 1 / options.class_m, a.cos_lit.data(), a.excess_m.data(),
        a.power.data(), a.bin.data());
  s.facing.clear();
  s.patches_of_bin.clear();
  const auto add = [&](std::uint32_t k) {
    if (!(a.power[k] > 0)) return;
    if (options.lobe_exponent != 0) {
      const FacadePatch& patch = patches[k];
      const double cos_psi = 2 * a.cos_lit[k] * patch.cos_seen + patch.leg.towards.dot(direction);
      a.power[k] *= power(std::max(0.0, 0.5 + 0.5 * cos_psi), options.lobe_exponent) /
                    (lobe.at(std::min(1.0, a.cos_lit[k])) * patch.cos_seen);
    }
    const auto bin = static_cast<std::size_t>(a.bin[k]);
    if (bin >= s.patches_of_bin.size()) s.patches_of_bin.resize(bin + 1, 0);
    ++s.patches_of_bin[bin];
    s.facing.push_back(k);
  };
  for (const std::uint32_t k : by.lit->open) add(k);
  for (std::uint32_t k = by.facades->fixed; k < count; ++k) add(k);
  s.classes.clear();
  std::uint32_t first = 0;
  for (const std::uint32_t in_bin : s.patches_of_bin) {
    Class of;
    of.first = of.last = first;
    first += in_bin;
    s.classes.push_back(of);
  }
  s.by_class.resize(s.facing.size());
  for (const std::uint32_t k : s.facing) {
    Class& of = s.classes[static_cast<std::size_t>(a.bin[k])];
    of.power += a.power[k];
    s.by_class[of.last++] = k;
  }
}

void DiffuseScattering::Impl::scatter(const Vector3d& antenna, const Lighting& by, DiffuseScratch& s,
                                      std::vector<DiffusePath>& result) const {
  classify(by, s);
  std::erase_if(s.classes, [&](const Class& of) { return of.first == of.last || of.power < min_power; });
  // Strongest first, so that rays are cast only for classes that may still be among the strongest.
  std::sort(s.classes.begin(), s.classes.end(), [](const Class& a, const Class& b) {
    return a.power != b.power ? a.power > b.power : a.first < b.first;
  });
  const auto stronger = [](const DiffusePath& a, const DiffusePath& b) {
    return a.power != b.power ? a.power > b.power : a.bin < b.bin;
  };
  const auto most = static_cast<std::size_t>(options.max_paths);
  for (const Class& of : s.classes) {
    if (result.size() == most && of.power < result.back().power) break;
    const DiffusePath path = sum_up(antenna, by, of, s);
    if (!(path.power > 0 && path.power >= min_power)) continue;
    if (result.size() == most) {
      if (!stronger(path, result.back())) continue;
      result.pop_back();
    }
    result.insert(std::upper_bound(result.begin(), result.end(), path, stronger), path);
  }
  std::erase_if(by.lit->open, [&](std::uint32_t k) { return by.lit->answers[k] == FacadesAbout::Lit::kNo; });
  for (DiffusePath& path : result) path.power *= strength(path);
  std::sort(result.begin(), result.end(),
            [](const DiffusePath& a, const DiffusePath& b) { return a.bin < b.bin; });
}

DiffuseScattering::DiffuseScattering(const city::Mesh& city, const raytrace::RayScene& scene,
                                     DiffuseOptions options, std::uint64_t seed) {
  options.validate();
  impl_ = std::make_shared<const Impl>(city, scene, options, seed);
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
      throw InputError(fmt::format("the direction ({}, {}, {}) to satellite {} is not of length 1",
                                   directions[i].x(), directions[i].y(), directions[i].z(), i),
                       "normalise it");
    }
    any = true;
  }
  if (!any || impl_->options.scattering_coefficient == 0) return;
  DiffuseScratch& s = diffuse_scratch();
  const auto lease = impl_->places.about(antenna);
  FacadesAbout& facades = lease.get() != nullptr ? *lease.get() : s.facades;
  if (lease.get() == nullptr) facades.from.reset();  // of another propagator, perhaps
  impl_->rays.look(antenna, facades);
  if (facades.patches.empty()) return;
  s.arrays.fill(facades.patches);
  if (facades.lit.size() < directions.size()) facades.lit.resize(directions.size());
  for (std::size_t i = 0; i < directions.size(); ++i) {
    if (!wanted[i]) continue;
    const FacadeLight::Direction grid = FacadeLight::direction(directions[i]);
    facades.lit[i].begin(grid.number, facades.fixed);
    impl_->scatter(antenna, {directions[i], grid, &facades, &facades.lit[i]}, s, result[i]);
  }
}

}  // namespace canyon::propagation
