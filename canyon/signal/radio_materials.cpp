#include "canyon/signal/radio_materials.hpp"

#include <fmt/format.h>

#include <cassert>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::signal {
namespace {

/// Electric constant [F/m], CODATA 2018.
constexpr double kElectricConstant = 8.8541878128e-12;

double checked_ghz(double frequency_hz) {
  if (!(frequency_hz >= 1e9 && frequency_hz <= 10e9))
    throw InputError(fmt::format("frequency of {} Hz is outside the material tables", frequency_hz),
                     "give a carrier of 1e9 to 10e9 Hz");
  return frequency_hz * 1e-9;
}

}  // namespace

RadioMaterial radio_material(city::Material material) {
  using city::Material;
  constexpr RadioMaterial kConcrete{5.24, 0, 0.0462, 0.7822, 1, 100, 0.20};
  switch (material) {
    case Material::Unknown:
    case Material::Concrete:
      return kConcrete;
    case Material::Glass:
      return {6.31, 0, 0.0036, 1.3394, 0.1, 100, 0.012};
    case Material::Brick:
      return {3.91, 0, 0.0238, 0.16, 1, 40, 0.1025};
    case Material::Metal:
      return {1, 0, 1e7, 0, 1, 100, 0};
    case Material::Stone:
      return {7.074, 0, 0.0055, 0.9262, 1, 60, 0.030};
    case Material::Wood:
      return {1.99, 0, 0.0047, 1.0718, 0.001, 100, 0.020};
    case Material::Plaster:
      return {2.73, 0, 0.0085, 0.9395, 1, 100, 0.0125};
    case Material::Ground:
      return {15, -0.1, 0.035, 1.63, 1, 10, 0};
    case Material::Foliage:
      return {1, 0, 0, 0, 0.001, 100, 0};
  }
  assert(false && "unknown material");
  return kConcrete;
}

double relative_permittivity(const RadioMaterial& material, double frequency_hz) {
  return material.a * std::pow(checked_ghz(frequency_hz), material.b);
}

double conductivity_s_per_m(const RadioMaterial& material, double frequency_hz) {
  return material.c * std::pow(checked_ghz(frequency_hz), material.d);
}

std::complex<double> complex_permittivity(const RadioMaterial& material, double frequency_hz) {
  return {
      relative_permittivity(material, frequency_hz),
      -conductivity_s_per_m(material, frequency_hz) / (2 * geodesy::kPi * frequency_hz * kElectricConstant)};
}

double wavelength_m(double frequency_hz) {
  if (!(frequency_hz > 0) || !std::isfinite(frequency_hz))
    throw InputError(fmt::format("frequency of {} Hz", frequency_hz), "give a carrier above 0 Hz");
  return geodesy::kSpeedOfLight / frequency_hz;
}

}  // namespace canyon::signal
