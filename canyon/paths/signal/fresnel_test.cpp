#include "canyon/paths/signal/radio_materials.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/paths/propagation/paths.hpp"

namespace canyon::signal {
namespace {

using Complex = std::complex<double>;
using geodesy::radians;
constexpr double kL1 = 1575.42e6;
constexpr Complex kJ{0, 1};

void expect_near(Complex value, Complex expected, double tolerance) {
  EXPECT_NEAR(value.real(), expected.real(), tolerance);
  EXPECT_NEAR(value.imag(), expected.imag(), tolerance);
}

// Snell's complex angle instead of P.2040's root: mpmath, 20 digits, n = sqrt(eta), t = asin(sin(theta) / n),
// rs = (cos theta - n cos t) / (cos theta + n cos t), rp = (n cos theta - cos t) / (n cos theta + cos t).
TEST(Fresnel, HalfSpaceAgreesWithSnellsComplexAngle) {
  struct Row {
    city::Material material;
    double deg;
    Complex perpendicular, parallel;
  };
  const std::vector<Row> rows{
      {city::Material::Concrete, 0, {-0.394510649773, 0.0301141581821}, {0.394510649773, -0.0301141581821}},
      {city::Material::Concrete, 30, {-0.444005563526, 0.0300513667662}, {0.342626241088, -0.0299209122785}},
      {city::Material::Concrete, 60, {-0.620959807908, 0.025526740671}, {0.107442283954, -0.029455436336}},
      {city::Material::Concrete,
       85,
       {-0.919725805794, 0.00676765110247},
       {-0.636755777744, -0.0163406876075}},
      {city::Material::Ground, 60, {-0.761359808106, 0.0064738723801}, {0.321169787573, -0.0123693102075}},
      {city::Material::Glass, 30, {-0.479528670642, 0.00239848887323}, {0.37886980679, -0.00245625334083}},
      {city::Material::Glass, 85, {-0.9271674118, 0.000498215707458}, {-0.614867171762, -0.0015132536393}}};
  for (const Row& row : rows) {
    const auto r =
        reflect_half_space(complex_permittivity(radio_material(row.material), kL1), radians(row.deg));
    expect_near(r.perpendicular, row.perpendicular, 1e-9);
    expect_near(r.parallel, row.parallel, 1e-9);
  }
}

TEST(Fresnel, NormalIncidenceIsTheClosedForm) {
  for (const double eps : {1.5, 4.0, 9.0, 81.0}) {
    const double n = std::sqrt(eps), closed = (1 - n) / (1 + n);
    const auto r = reflect_half_space(eps, 0);
    expect_near(r.perpendicular, closed, 1e-15);
    expect_near(r.parallel, -closed, 1e-15);
  }
}

TEST(Fresnel, ParallelVanishesAtBrewstersAngle) {
  for (const double eps : {1.99, 3.91, 6.31, 15.0}) {
    const double brewster = std::atan(std::sqrt(eps));
    EXPECT_LT(std::abs(reflect_half_space(eps, brewster).parallel), 1e-15) << eps;
    // It changes sign there: the reflected hand changes from LHCP to RHCP.
    EXPECT_GT(reflect_half_space(eps, brewster - 0.01).parallel.real(), 0);
    EXPECT_LT(reflect_half_space(eps, brewster + 0.01).parallel.real(), 0);
    const CircularReflection at = circular(reflect_half_space(eps, brewster));
    EXPECT_NEAR(std::abs(at.co), std::abs(at.cross), 1e-15);
  }
}

TEST(Fresnel, GrazingReflectsEverythingInTheSameHand) {
  for (const auto material : {city::Material::Concrete, city::Material::Ground, city::Material::Wood}) {
    const auto r = reflect_half_space(complex_permittivity(radio_material(material), kL1), geodesy::kPi / 2);
    expect_near(r.perpendicular, -1, 1e-12);
    expect_near(r.parallel, -1, 1e-12);
    expect_near(circular(r).co, -1, 1e-12);
    expect_near(circular(r).cross, 0, 1e-12);
  }
}

TEST(Fresnel, MetalReflectsEverythingInTheOtherHand) {
  const Complex eta = complex_permittivity(radio_material(city::Material::Metal), kL1);
  for (const double deg : {0.0, 30.0, 60.0, 85.0}) {
    const CircularReflection r = circular(reflect_half_space(eta, radians(deg)));
    // The skin effect leaves |eta|^(-1/2) / cos(theta) = 1e-4 / cos(theta).
    EXPECT_NEAR(std::abs(r.cross), 1, 3e-3) << deg;
    EXPECT_LT(std::abs(r.co), 3e-3) << deg;
  }
}

TEST(Fresnel, AirReflectsNothing) {
  for (const double deg : {0.0, 45.0, 89.9, 90.0}) {
    const auto r = reflect_half_space(1, radians(deg));
    EXPECT_EQ(std::abs(r.perpendicular) + std::abs(r.parallel), 0) << deg;
  }
}

TEST(Slab, ThickAndLossyIsAHalfSpace) {
  const Complex eta = complex_permittivity(radio_material(city::Material::Concrete), kL1);
  const LinearReflection s = slab(eta, radians(40), 3, wavelength_m(kL1));
  const LinearReflection half = reflect_half_space(eta, radians(40));
  expect_near(s.perpendicular, half.perpendicular, 1e-9);
  expect_near(s.parallel, half.parallel, 1e-9);
  EXPECT_EQ(std::abs(slab(eta, radians(40), 0, wavelength_m(kL1)).parallel), 0);
}

// A window of half a wave (in the glass) is transparent; one of a quarter reflects (n^2 - 1) / (n^2 + 1)
// (Born & Wolf, Principles of Optics, 1.6.4).
TEST(Slab, HalfWaveIsTransparentAndQuarterWaveReflectsMost) {
  const double n = std::sqrt(6.31), lambda = wavelength_m(kL1);
  EXPECT_LT(std::abs(slab(6.31, 0, lambda / n / 2, lambda).parallel), 1e-14);
  EXPECT_NEAR(std::abs(slab(6.31, 0, lambda / n / 4, lambda).parallel), (6.31 - 1) / (6.31 + 1), 1e-14);
}

// The ABCD matrix of the layer (P.2040-3, attachment 1: another derivation of the same physics): A = D = cos
// q, B = j Z sin q, C = j sin(q) / Z, R = (A + B/Z0 - C Z0 - D) / (A + B/Z0 + C Z0 + D).
TEST(Slab, AgreesWithTheAbcdMatrix) {
  for (const auto material : {city::Material::Concrete, city::Material::Glass, city::Material::Plaster}) {
    const Complex eta = complex_permittivity(radio_material(material), kL1);
    for (const double deg : {0.0, 33.0, 77.0})
      for (const double d : {0.0125, 0.1}) {
        const double c0 = std::cos(radians(deg));
        const Complex w = std::sqrt(eta - std::pow(std::sin(radians(deg)), 2));
        const Complex q = 2 * geodesy::kPi * d / wavelength_m(kL1) * w;
        // Wave impedances over free space's: 1 / (n cos) for TE, cos / n for TM; n cos t = w.
        const auto response = [&](Complex z, double z0) {
          const Complex a = std::cos(q), b = kJ * z * std::sin(q), c = kJ * std::sin(q) / z;
          const Complex sum = a + b / z0 + c * z0 + a;
          return (b / z0 - c * z0) / sum;
        };
        const Complex te_r = response(1.0 / w, 1 / c0);
        const Complex tm_r = response(w / eta, c0);
        const LinearReflection s = slab(eta, radians(deg), d, wavelength_m(kL1));
        expect_near(s.perpendicular, te_r, 1e-12);
        // The matrix compares tangential E, whose sign is opposite to that of p on the reflected ray.
        expect_near(s.parallel, -tm_r, 1e-12);
      }
  }
}

TEST(Circular, KeepsTheMeanPowerOfBothPolarisations) {
  const auto linear = reflect_half_space({5.24, -0.75}, radians(50));
  const CircularReflection c = circular(linear);
  EXPECT_NEAR(std::norm(c.co) + std::norm(c.cross),
              (std::norm(linear.perpendicular) + std::norm(linear.parallel)) / 2, 1e-15);
}

// Two reflections by fields in three dimensions: E split along s and p of each plane, reflected, recombined;
// its circular components in the last triad.
TEST(Circular, ChainOfTwoPlanesAgreesWithFieldsInThreeDimensions) {
  using Field = Eigen::Vector3cd;
  const Complex eta1{5.24, -0.75}, eta2{6.31, -0.08};
  const Eigen::Vector3d k0 = Eigen::Vector3d(0.3, -0.8, -0.6).normalized();
  const Eigen::Vector3d n1 = Eigen::Vector3d(-0.2, 1, 0.1).normalized();
  const Eigen::Vector3d k1 = k0 - 2 * k0.dot(n1) * n1;
  const Eigen::Vector3d n2 = Eigen::Vector3d(-1, -0.5, 0.25).normalized();
  const Eigen::Vector3d k2 = k1 - 2 * k1.dot(n2) * n2;
  ASSERT_LT(k0.dot(n1), 0);
  ASSERT_LT(k1.dot(n2), 0);
  const auto s_axis = [](const Eigen::Vector3d& k, const Eigen::Vector3d& n) -> Eigen::Vector3d {
    return k.cross(n).normalized();
  };
  const auto bounce = [&](const Field& e, const Eigen::Vector3d& in, const Eigen::Vector3d& out,
                          const Eigen::Vector3d& n, const LinearReflection& r) -> Field {
    const Eigen::Vector3d s = s_axis(in, n), p_in = in.cross(s), p_out = out.cross(s);
    const Complex es = s.cast<Complex>().dot(e), ep = p_in.cast<Complex>().dot(e);
    return r.perpendicular * es * s.cast<Complex>() + r.parallel * ep * p_out.cast<Complex>();
  };
  const auto r1 = reflect_half_space(eta1, std::acos(-k0.dot(n1)));
  const auto r2 = reflect_half_space(eta2, std::acos(-k1.dot(n2)));
  const Eigen::Vector3d s0 = s_axis(k0, n1), p0 = k0.cross(s0);
  const Field incident = (s0.cast<Complex>() - kJ * p0.cast<Complex>()) / std::sqrt(2.0);
  const Field field = bounce(bounce(incident, k0, k1, n1, r1), k1, k2, n2, r2);
  const Eigen::Vector3d s2 = s_axis(k2, n2), p2 = k2.cross(s2);
  const Complex es = s2.cast<Complex>().dot(field), ep = p2.cast<Complex>().dot(field);

  CircularWave wave = reflect({}, circular(r1));
  wave = reflect(wave, circular(r2), propagation::plane_rotation_rad(k1, n1, n2));
  expect_near(wave.rhcp, (es + kJ * ep) / std::sqrt(2.0), 1e-14);
  expect_near(wave.lhcp, (es - kJ * ep) / std::sqrt(2.0), 1e-14);
}

TEST(Circular, TurnOfThePlaneHasASign) {
  const Eigen::Vector3d up(0, 0, 1);
  // s = k x n: y for n along -x, and (cos, sin) of 90 + 30 deg for n rotated by 30 deg
  const Eigen::Vector3d a(1, 0, 0), b(std::cos(radians(30)), std::sin(radians(30)), 0);
  EXPECT_NEAR(propagation::plane_rotation_rad(up, a, b), radians(30), 1e-15);
  EXPECT_NEAR(propagation::plane_rotation_rad(up, b, a), -radians(30), 1e-15);
  EXPECT_EQ(propagation::plane_rotation_rad(up, up, b), 0);
}

TEST(Fresnel, RefusesWhatIsNoAngleOrMedium) {
  EXPECT_THROW(static_cast<void>(reflect_half_space(4, -0.1)), InputError);
  EXPECT_THROW(static_cast<void>(reflect_half_space(4, 1.6)), InputError);
  EXPECT_THROW(static_cast<void>(reflect_half_space({4, 1}, 0)), InputError);
  EXPECT_THROW(static_cast<void>(reflect_half_space(0.5, 0)), InputError);
  EXPECT_THROW(static_cast<void>(slab(4, 0, -1, 0.19)), InputError);
  EXPECT_THROW(static_cast<void>(slab(4, 0, 1, 0)), InputError);
}

}  // namespace
}  // namespace canyon::signal
