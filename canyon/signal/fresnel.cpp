#include "canyon/signal/fresnel.hpp"

#include <fmt/format.h>

#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::signal {
namespace {

using Complex = std::complex<double>;
constexpr Complex kJ{0, 1};

void check_incidence(double incidence_rad) {
  if (!(incidence_rad >= 0 && incidence_rad <= geodesy::kPi / 2))
    throw InputError(fmt::format("angle of incidence of {} rad", incidence_rad),
                     "give the angle between ray and normal, 0 to pi/2");
}

void check_wavelength(double wavelength_m) {
  if (!(wavelength_m > 0) || !std::isfinite(wavelength_m))
    throw InputError(fmt::format("wavelength of {} m", wavelength_m), "give one above 0 m");
}

/// sqrt(eta - sin^2) without the cancellation that grazing angles on thin media would bring; real part >= 0,
/// imaginary part <= 0: the wave in the medium decays.
Complex refracted_cosine(Complex eta, double cosine) {
  return std::sqrt(eta - 1.0 + cosine * cosine);
}

}  // namespace

LinearReflection reflect_half_space(Complex eta, double incidence_rad) {
  check_incidence(incidence_rad);
  if (!(eta.real() >= 1) || !(eta.imag() <= 0) || !std::isfinite(eta.real()) || !std::isfinite(eta.imag()))
    throw InputError(fmt::format("relative permittivity of {} {:+} j", eta.real(), eta.imag()),
                     "give eps' - j eps'' with eps' >= 1 and eps'' >= 0");
  const double cosine = std::cos(incidence_rad);
  const Complex w = refracted_cosine(eta, cosine);
  return {(cosine - w) / (cosine + w), (eta * cosine - w) / (eta * cosine + w)};
}

SlabResponse slab(Complex eta, double incidence_rad, double thickness_m, double wavelength_m) {
  check_wavelength(wavelength_m);
  if (!(thickness_m >= 0) || !std::isfinite(thickness_m))
    throw InputError(fmt::format("slab of {} m", thickness_m), "give a thickness of 0 m or more");
  const LinearReflection surface = reflect_half_space(eta, incidence_rad);
  const Complex q =
      2 * geodesy::kPi * thickness_m / wavelength_m * refracted_cosine(eta, std::cos(incidence_rad));
  const Complex once = std::exp(-kJ * q), twice = once * once;
  const auto reflected = [&](Complex r) { return r * (1.0 - twice) / (1.0 - r * r * twice); };
  const auto transmitted = [&](Complex r) { return (1.0 - r * r) * once / (1.0 - r * r * twice); };
  return {{reflected(surface.perpendicular), reflected(surface.parallel)},
          {transmitted(surface.perpendicular), transmitted(surface.parallel)}};
}

CircularReflection circular(const LinearReflection& linear) {
  return {(linear.perpendicular + linear.parallel) / 2.0, (linear.perpendicular - linear.parallel) / 2.0};
}

CircularWave reflect(const CircularWave& wave, const CircularReflection& reflection, double plane_turn_rad) {
  const Complex r = wave.rhcp * std::polar(1.0, -plane_turn_rad);
  const Complex l = wave.lhcp * std::polar(1.0, plane_turn_rad);
  return {reflection.co * r + reflection.cross * l, reflection.cross * r + reflection.co * l};
}

double roughness_factor(double height_sigma_m, double incidence_rad, double wavelength_m) {
  check_incidence(incidence_rad);
  check_wavelength(wavelength_m);
  if (!(height_sigma_m >= 0) || !std::isfinite(height_sigma_m))
    throw InputError(fmt::format("roughness of {} m", height_sigma_m),
                     "give a standard deviation of 0 m or more");
  const double g = 2 * geodesy::kPi / wavelength_m * height_sigma_m * std::cos(incidence_rad);
  return std::exp(-2 * g * g);
}

}  // namespace canyon::signal
