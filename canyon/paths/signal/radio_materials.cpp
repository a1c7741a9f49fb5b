#include "canyon/paths/signal/radio_materials.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::signal {

namespace {

/// Electric constant [F/m], CODATA 2018.
constexpr double kElectricConstant = 8.8541878128e-12;

}  // namespace

RadioMaterial radio_material(city::Material material) {
  using city::Material;
  constexpr RadioMaterial kConcrete{5.24, 0, 0.0462, 0.7822, 0.20};
  switch (material) {
    case Material::Unknown:
    case Material::Concrete:
      return kConcrete;
    case Material::Glass:
      return {6.31, 0, 0.0036, 1.3394, 0.012};
    case Material::Brick:
      return {3.91, 0, 0.0238, 0.16, 0.1025};
    case Material::Metal:
      return {1, 0, 1e7, 0, 0};
    case Material::Stone:
      return {7.074, 0, 0.0055, 0.9262, 0.030};
    case Material::Wood:
      return {1.99, 0, 0.0047, 1.0718, 0.020};
    case Material::Plaster:
      return {2.73, 0, 0.0085, 0.9395, 0.0125};
    case Material::Ground:
      return {15, -0.1, 0.035, 1.63, 0};
    case Material::Foliage:
      return {1, 0, 0, 0, 0};
  }
  assert(false && "unknown material");
  return kConcrete;
}

std::complex<double> complex_permittivity(const RadioMaterial& material, double frequency_hz) {
  if (!(frequency_hz >= 1e9 && frequency_hz <= 10e9))
    throw InputError(fmt::format("frequency of {} Hz is outside the material tables", frequency_hz),
                     "give a carrier of 1e9 to 10e9 Hz");
  const double ghz = frequency_hz * 1e-9;
  const double conductivity = material.c * std::pow(ghz, material.d);  // [S/m]
  return {material.a * std::pow(ghz, material.b),
          -conductivity / (2 * geodesy::kPi * frequency_hz * kElectricConstant)};
}

double wavelength_m(double frequency_hz) {
  if (!(frequency_hz > 0) || !std::isfinite(frequency_hz))
    throw InputError(fmt::format("frequency of {} Hz", frequency_hz), "give a carrier above 0 Hz");
  return geodesy::kSpeedOfLight / frequency_hz;
}

namespace {

struct WoodlandRow {
  double mhz, specific_db_per_m, maximum_db;
};
constexpr std::array<WoodlandRow, 5> kWoodland{{{105.9, 0.04, 9.4},
                                                {466.475, 0.12, 18.0},
                                                {949.0, 0.17, 26.5},
                                                {1852.2, 0.30, 29.0},
                                                {2117.5, 0.34, 34.1}}};

double woodland_db(double depth_m, double mhz) {
  std::size_t i = 0;
  while (i + 2 < kWoodland.size() && mhz > kWoodland[i + 1].mhz) ++i;
  const WoodlandRow &low = kWoodland[i], &high = kWoodland[i + 1];
  const double t = std::log(mhz / low.mhz) / std::log(high.mhz / low.mhz);
  const double gamma = low.specific_db_per_m * std::pow(high.specific_db_per_m / low.specific_db_per_m, t);
  const double maximum = low.maximum_db * std::pow(high.maximum_db / low.maximum_db, t);
  return -maximum * std::expm1(-depth_m * gamma / maximum);
}

}  // namespace

double foliage_loss_db(FoliageModel model, double depth_m, double frequency_hz, double elevation_rad) {
  if (!(depth_m >= 0) || !std::isfinite(depth_m))
    throw InputError(fmt::format("foliage of {} m", depth_m), "give a depth of 0 m or more");
  const double mhz = frequency_hz * 1e-6;
  if (!(frequency_hz >= 105.9e6 && frequency_hz <= 2117.5e6))
    throw InputError(fmt::format("frequency of {} Hz is outside the foliage tables", frequency_hz),
                     "give a carrier of 105.9e6 to 2117.5e6 Hz");
  if (!(std::abs(elevation_rad) <= geodesy::kPi / 2))
    throw InputError(fmt::format("elevation of {} rad", elevation_rad), "give -pi/2 to pi/2");
  if (depth_m == 0) return 0;
  if (model == FoliageModel::Woodland) return woodland_db(depth_m, mhz);
  const double theta = std::max(1.0, geodesy::degrees(elevation_rad));
  return 0.25 * std::pow(mhz, 0.39) * std::pow(depth_m, 0.25) * std::pow(theta, 0.05);
}

namespace {

using Complex = std::complex<double>;
constexpr Complex kJ{0, 1};

/// sqrt(eta - sin^2) without cancellation at grazing angles on thin media; real part >= 0, imaginary part <=
/// 0: the wave in the medium decays.
Complex refracted_cosine(Complex eta, double cosine) {
  return std::sqrt(eta - 1.0 + cosine * cosine);
}

}  // namespace

LinearReflection reflect_half_space(Complex eta, double incidence_rad) {
  if (!(incidence_rad >= 0 && incidence_rad <= geodesy::kPi / 2))
    throw InputError(fmt::format("angle of incidence of {} rad", incidence_rad),
                     "give the angle between ray and normal, 0 to pi/2");
  if (!(eta.real() >= 1) || !(eta.imag() <= 0) || !std::isfinite(eta.real()) || !std::isfinite(eta.imag()))
    throw InputError(fmt::format("relative permittivity of {} {:+} j", eta.real(), eta.imag()),
                     "give eps' - j eps'' with eps' >= 1 and eps'' >= 0");
  const double cosine = std::cos(incidence_rad);
  const Complex w = refracted_cosine(eta, cosine);
  return {(cosine - w) / (cosine + w), (eta * cosine - w) / (eta * cosine + w)};
}

LinearReflection slab(Complex eta, double incidence_rad, double thickness_m, double wavelength_m) {
  if (!(wavelength_m > 0) || !std::isfinite(wavelength_m))
    throw InputError(fmt::format("wavelength of {} m", wavelength_m), "give one above 0 m");
  if (!(thickness_m >= 0) || !std::isfinite(thickness_m))
    throw InputError(fmt::format("slab of {} m", thickness_m), "give a thickness of 0 m or more");
  const LinearReflection surface = reflect_half_space(eta, incidence_rad);
  const Complex q =
      2 * geodesy::kPi * thickness_m / wavelength_m * refracted_cosine(eta, std::cos(incidence_rad));
  const Complex once = std::exp(-kJ * q), twice = once * once;
  const auto reflected = [&](Complex r) { return r * (1.0 - twice) / (1.0 - r * r * twice); };
  return {reflected(surface.perpendicular), reflected(surface.parallel)};
}

CircularReflection circular(const LinearReflection& linear) {
  return {(linear.perpendicular + linear.parallel) / 2.0, (linear.perpendicular - linear.parallel) / 2.0};
}

CircularWave reflect(const CircularWave& wave, const CircularReflection& reflection,
                     double plane_rotation_rad) {
  const Complex r = wave.rhcp * std::polar(1.0, -plane_rotation_rad);
  const Complex l = wave.lhcp * std::polar(1.0, plane_rotation_rad);
  return {reflection.co * r + reflection.cross * l, reflection.cross * r + reflection.co * l};
}

}  // namespace canyon::signal
