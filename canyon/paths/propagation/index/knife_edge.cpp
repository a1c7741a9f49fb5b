#include "canyon/paths/propagation/index/knife_edge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::propagation {

namespace {

using Complex = std::complex<double>;
using geodesy::kPi;

/// sum (j pi/2)^n x^(2n+1) / (n! (2n+1)): A&S 7.3.11 and 7.3.13 combined.
Complex fresnel_series(double x) {
  const double u = kPi / 2 * x * x;
  double term = x;
  Complex sum = x;
  for (int n = 1; n < 60; ++n) {
    term *= u / n;
    const double part = term / (2 * n + 1);
    if (n % 4 == 0) sum += part;
    if (n % 4 == 1) sum += Complex(0, part);
    if (n % 4 == 2) sum -= part;
    if (n % 4 == 3) sum -= Complex(0, part);
    if (part < 1e-17 * std::abs(x)) break;
  }
  return sum;
}

/// int_x^inf exp(j pi s^2 / 2) ds for x >= 1.6, by the even part of the continued fraction of erfc(z), z =
/// sqrt(pi)/2 (1 - j) x, with Lentz's method: sqrt(pi) e^(z^2) erfc(z) = 2z / (2z^2 + 1 - 1*2 / (2z^2 + 5 -
/// 3*4 / (2z^2 + 9 - ...))).
Complex fresnel_tail(double x) {
  const double u = kPi * x * x;  // 2 z^2 = -j u
  const auto inverse = [](const Complex& z) { return std::conj(z) / std::norm(z); };
  Complex b(1, -u), d = inverse(b), c = b, h = d;
  for (int n = 1; n < 500; ++n) {
    const double a = -(2.0 * n - 1) * (2.0 * n);
    b += 4.0;
    d = inverse(a * d + b);
    c = n == 1 ? b : b + a * inverse(c);
    const Complex step = c * d;
    h *= step;
    if (std::abs(step.real() - 1) + std::abs(step.imag()) < 1e-16) break;
  }
  // (1 + j)/2 erfc(z) with e^(-z^2) = e^(j pi x^2 / 2) and 2z / sqrt(pi) = (1 - j) x. The cycles x^2/4 are
  // computed from x = whole + part (whole^2 mod 4 is 0 or 1): x^2 itself would lose the fraction's digits.
  const double whole = std::floor(x), part = x - whole;
  const double cycles =
      (std::fmod(whole, 2.0) == 0 ? 0.0 : 0.25) + std::fmod(whole * part / 2, 1.0) + part * part / 4;
  return x * h * std::polar(1.0, 2 * kPi * cycles);
}

}  // namespace

Complex fresnel_integral(double x) {
  if (std::isnan(x)) throw InputError("Fresnel integral of NaN", "give a number");
  const double magnitude = std::abs(x);
  // Beyond 1e13 the ripple, 1 / (pi x), is below the error bound.
  Complex value;
  if (magnitude < 1.6)
    value = fresnel_series(magnitude);
  else if (magnitude < 1e13)
    value = Complex(0.5, 0.5) - fresnel_tail(magnitude);
  else
    value = {0.5, 0.5};
  return x < 0 ? -value : value;
}

Complex knife_edge_field(double nu) {
  // In the shadow the difference 1/2 - C cancels; the tail itself keeps its digits.
  if (nu >= 1.6 && nu < 1e13) return Complex(0.5, 0.5) * std::conj(fresnel_tail(nu));
  const Complex f = fresnel_integral(nu);
  return Complex(0.5, 0.5) * Complex(0.5 - f.real(), f.imag() - 0.5);
}

Complex edge_wave(double nu) {
  return nu >= 0 ? knife_edge_field(nu) : -knife_edge_field(-nu);
}

double approximate_knife_edge_loss_db(double nu) {
  if (nu <= -0.78) return 0;
  const double v = nu - 0.1;
  return 6.9 + 20 * std::log10(std::sqrt(v * v + 1) + v);
}

double rounded_edge_loss_db(double radius_m, double leg_m, double bending_rad, double wavelength_m) {
  if (!(radius_m >= 0) || !(wavelength_m > 0))
    throw InputError(fmt::format("edge of radius {} m at a wavelength of {} m", radius_m, wavelength_m),
                     "give a radius of 0 m or more and a wavelength above 0 m");
  if (radius_m == 0) return 0;
  if (!(leg_m > 0) || !(bending_rad >= 0 && bending_rad <= kPi))
    throw InputError(fmt::format("ray bent by {} rad, {} m away", bending_rad, leg_m),
                     "give an angle from 0 to pi and a distance above 0 m");
  const double k = std::cbrt(kPi * radius_m / wavelength_m);
  const double m = radius_m / (leg_m * k), mn = bending_rad * k, root = std::sqrt(m);
  const double radius_term = 7.2 * root - 2 * m + 3.6 * m * root - 0.8 * m * m;
  const double angle_term = mn <= 4 ? 12.5 * mn : 17 * mn - 6 - 20 * std::log10(mn);
  return std::max(0.0, radius_term + angle_term);
}

double signed_knife_edge_nu(double excess_m, double wavelength_m, bool blocked) {
  if (!(excess_m >= 0)) throw InputError(fmt::format("excess path of {} m", excess_m), "give 0 m or more");
  if (!(wavelength_m > 0))
    throw InputError(fmt::format("wavelength of {} m", wavelength_m), "give one above 0 m");
  const double nu = 2 * std::sqrt(excess_m / wavelength_m);
  return blocked ? nu : -nu;
}

}  // namespace canyon::propagation
