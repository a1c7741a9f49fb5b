#include "canyon/paths/signal/path_strength.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/paths/propagation/index/knife_edge.hpp"
#include "canyon/paths/signal/radio_materials.hpp"
#include "tests/support/edge_reference.hpp"

namespace canyon::signal::path_strength_test {
namespace {

using Complex = std::complex<double>;
using city::Material;
using geodesy::kPi;
using geodesy::radians;
constexpr double kL1 = 1575.42e6;

double db(Complex amplitude) {
  return 20 * std::log10(std::abs(amplitude));
}

propagation::PathGeometry direct(double elevation_deg) {
  propagation::PathGeometry path;
  path.arrival_elevation_rad = radians(elevation_deg);
  return path;
}

propagation::PathGeometry reflected(double incidence_deg, Material material, double excess_m,
                                    double arrival_deg) {
  propagation::PathGeometry path = direct(arrival_deg);
  path.incidences[0].incidence_rad = radians(incidence_deg);
  path.incidences[0].material = material;
  path.incidence_count = 1;
  path.excess_m = excess_m;
  return path;
}

TEST(PathStrength, DirectPathIsOne) {
  for (const auto& antenna : {isotropic_antenna(), patch_antenna(), survey_antenna()})
    for (const double deg : {0.0, 7.0, 45.0, 90.0})
      EXPECT_LT(std::abs(path_amplitude(direct(deg), radians(deg), kL1, antenna) - 1.0), 1e-14);
}

TEST(PathStrength, MetalMirrorIsHeardThroughTheCrossPolarPattern) {
  const propagation::PathGeometry path = reflected(20, Material::Metal, 0, 30);
  const CircularWave wave = arriving_wave(path, kL1);
  EXPECT_LT(std::abs(wave.rhcp), 1e-3);
  EXPECT_NEAR(std::abs(wave.lhcp), 1, 1e-3);
  const AntennaPattern patch = patch_antenna();
  const AntennaGain gain = patch.gain(radians(30), kL1);
  EXPECT_NEAR(db(path_amplitude(path, radians(30), kL1, patch)), gain.lhcp_dbic - gain.rhcp_dbic, 0.02);
}

// Two metal walls restore RHCP: an even number of reflections.
TEST(PathStrength, TwoMetalMirrorsRestoreTheHand) {
  propagation::PathGeometry path = reflected(30, Material::Metal, 0, 40);
  path.incidences[1] = path.incidences[0];
  path.incidences[1].plane_rotation_rad = 0.7;
  path.incidence_count = 2;
  EXPECT_NEAR(std::abs(path_amplitude(path, radians(40), kL1, isotropic_antenna())), 1, 2e-3);
}

TEST(PathStrength, ConcreteHalfSpaceByHand) {
  StrengthOptions options;
  options.slabs = false;
  // mpmath, see fresnel_test.cpp: rs = -0.444005563526 + 0.0300513667662j, rp = 0.342626241088 -
  // 0.0299209122785j at 30 degrees; co = (rs + rp) / 2.
  const propagation::PathGeometry path = reflected(30, Material::Concrete, 0, 30);
  const Complex amplitude = path_amplitude(path, radians(30), kL1, isotropic_antenna(), options);
  EXPECT_NEAR(amplitude.real(), (-0.444005563526 + 0.342626241088) / 2, 1e-9);
  EXPECT_NEAR(amplitude.imag(), (0.0300513667662 - 0.0299209122785) / 2, 1e-9);
  // 20 cm of concrete absorb the reflection from the rear: within 1 dB of the half space.
  EXPECT_NEAR(db(arriving_wave(path, kL1).lhcp), db(arriving_wave(path, kL1, options).lhcp), 1);
}

TEST(PathStrength, PhaseIsThatOfTheExcessPath) {
  const double lambda = wavelength_m(kL1);
  const auto phase = [&](double excess) {
    return arriving_wave(reflected(70, Material::Glass, excess, 10), kL1).rhcp;
  };
  EXPECT_LT(std::abs(phase(lambda / 4) / phase(0) - Complex(0, -1)), 1e-12);
  EXPECT_LT(std::abs(phase(1000 * lambda) / phase(0) - 1.0), 1e-9);
  // For a slightly longer path the phase falls (exp(+j w t)).
  EXPECT_LT(std::arg(phase(0.01) / phase(0)), 0);
}

TEST(PathStrength, EdgeCountsItsDetourOnce) {
  const double lambda = wavelength_m(kL1);
  propagation::PathGeometry path = direct(25);
  for (const double excess : {0.0, 0.03, 0.4, 7.0}) {
    path.excess_m = excess;
    path.edge_nu = propagation::signed_knife_edge_nu(excess, lambda, true);
    const Complex amplitude = path_amplitude(path, radians(25), kL1, isotropic_antenna());
    EXPECT_LT(std::abs(amplitude - propagation::knife_edge_field(*path.edge_nu)), 1e-12) << excess;
    EXPECT_NEAR(db(amplitude), -propagation::test::exact_knife_edge_loss_db(*path.edge_nu), 1e-9);
  }
  // An edge near a clear path: direct and edge wave together are the whole field.
  path.excess_m = 0.05;
  path.edge_nu = propagation::signed_knife_edge_nu(0.05, lambda, false);
  const Complex both = 1.0 + path_amplitude(path, radians(25), kL1, isotropic_antenna());
  EXPECT_LT(std::abs(both - propagation::knife_edge_field(*path.edge_nu)), 1e-12);
}

TEST(PathStrength, FoliageTakesItsShare) {
  propagation::PathGeometry path = direct(30);
  path.foliage_depth_m = 10;
  EXPECT_NEAR(db(path_amplitude(path, radians(30), kL1, isotropic_antenna())),
              -foliage_loss_db(FoliageModel::Woodland, 10, kL1, radians(30)), 1e-12);
  EXPECT_EQ(std::abs(arriving_wave(reflected(40, Material::Foliage, 12, 20), kL1).lhcp), 0);
}

TEST(PathStrength, ThicknessOfTheIncidenceRules) {
  propagation::PathGeometry path = reflected(10, Material::Glass, 0, 20);
  const double lambda = wavelength_m(kL1), n = std::sqrt(6.31);
  path.incidences[0].incidence_rad = 0;
  path.incidences[0].thickness_m = lambda / n / 4;
  // (n^2 - 1) / (n^2 + 1), fresnel_test.cpp, less the glass's small loss
  EXPECT_NEAR(std::abs(arriving_wave(path, kL1).lhcp), (6.31 - 1) / (6.31 + 1), 0.01);
  path.incidences[0].thickness_m = 0;
  EXPECT_EQ(std::abs(arriving_wave(path, kL1).lhcp), 0);
  // Metal and ground have no rear: a thickness has no effect.
  path.incidences[0].material = Material::Metal;
  EXPECT_NEAR(std::abs(arriving_wave(path, kL1).lhcp), 1, 1e-3);
}

TEST(PathStrength, AntennaOutputIsTheMeanOverAzimuth) {
  const CircularWave wave{{0.3, -0.2}, {0.1, 0.5}};
  const AntennaGain gain{2, -7};
  // The antenna's LHCP response rotates relative to the RHCP one twice per revolution: mean of |R gR + L gL
  // e^(j a)|^2.
  double mean = 0;
  for (int i = 0; i < 360; ++i)
    mean +=
        std::norm(wave.rhcp * std::pow(10, 0.1) + wave.lhcp * std::polar(std::pow(10, -0.35), radians(i))) /
        360;
  EXPECT_NEAR(std::norm(antenna_output(wave, gain)), mean, 1e-13);
}

// The power of a facade's reflection is below the sum of both polarisations and above its RHCP part. Steep
// incidence weakens it by 10 dB and more, grazing incidence only a little.
TEST(PathStrength, FacadesAreWeakerThanTheLineOfSight) {
  const AntennaPattern patch = patch_antenna();
  for (const auto material : {Material::Concrete, Material::Glass, Material::Brick, Material::Stone,
                              Material::Wood, Material::Plaster})
    for (double deg = 0; deg <= 85; deg += 5) {
      const propagation::PathGeometry path = reflected(deg, material, 30, 30);
      const CircularWave wave = arriving_wave(path, kL1);
      const double power = std::norm(path_amplitude(path, radians(30), kL1, patch));
      EXPECT_LT(power, std::norm(wave.rhcp) + std::norm(wave.lhcp));
      EXPECT_GT(power, std::norm(wave.rhcp));
      EXPECT_LT(power, deg <= 45 ? 0.1 : 1.0) << static_cast<int>(material) << " at " << deg;
    }
}

// A traced path has the strength of its geometry, for any kind; a diffuse one that of its power alone.
TEST(PathStrength, TracedPathsByKind) {
  const AntennaPattern patch = patch_antenna();
  propagation::Path path;
  path.kind = propagation::PathKind::Reflected;
  path.order = 1;
  propagation::PathGeometry& geometry = path;
  geometry = reflected(50, Material::Glass, 21, 15);
  EXPECT_EQ(path_amplitude(path, radians(40), kL1, patch), path_amplitude(geometry, radians(40), kL1, patch));
  path.kind = propagation::PathKind::Diffracted;
  geometry = direct(22);
  path.excess_m = 0.4;
  path.edge_nu = propagation::signed_knife_edge_nu(0.4, wavelength_m(kL1), true);
  const Complex over_roof = path_amplitude(path, radians(22), kL1, patch);
  EXPECT_LT(std::abs(over_roof - propagation::knife_edge_field(*path.edge_nu)), 1e-12);
  path.edge_radius_m = 0.3, path.edge_leg_m = 25, path.edge_bending_rad = radians(10);
  const double rounded_db = propagation::rounded_edge_loss_db(0.3, 25, radians(10), wavelength_m(kL1));
  EXPECT_GT(rounded_db, 3);
  EXPECT_NEAR(db(path_amplitude(path, radians(22), kL1, patch)), db(over_roof) - rounded_db, 1e-9);
}

TEST(PathStrength, DiffusePathIsUnpolarised) {
  propagation::Path path;
  path.kind = propagation::PathKind::Diffuse;
  path.scattered_power = 0.01;
  path.excess_m = 30.2;
  path.arrival_elevation_rad = radians(15);
  // An antenna for one hand receives half the power; the phone, with equal gain in both hands, all of it.
  EXPECT_NEAR(db(path_amplitude(path, radians(60), kL1, isotropic_antenna())), -20 - 3.0103, 1e-4);
  const AntennaGain phone = phone_antenna().gain(0, kL1);
  ASSERT_EQ(phone.rhcp_dbic, phone.lhcp_dbic);
  const Complex amplitude = path_amplitude(path, radians(60), kL1, phone_antenna());
  EXPECT_NEAR(db(amplitude), -20, 1e-9);
  // Phase -2 pi 30.2 m / 0.190293673 m = -2 pi 158.7020 cycles.
  EXPECT_NEAR(std::arg(amplitude), 2 * kPi * (1 - 0.7020), 2 * kPi * 1e-4);
  // Mean over all states of polarisation, for which two opposite ones suffice: antenna_output() of each.
  const AntennaPattern patch = patch_antenna();
  const AntennaGain gain = patch.gain(radians(15), kL1);
  const double mean =
      (std::norm(antenna_output({0.1, 0}, gain)) + std::norm(antenna_output({0, 0.1}, gain))) / 2;
  const double direct = std::norm(antenna_output({1, 0}, patch.gain(radians(60), kL1)));
  EXPECT_NEAR(std::norm(path_amplitude(path, radians(60), kL1, patch)) / (mean / direct), 1, 1e-12);
}

// The mirror direction lacks the scattered power: P_specular = (1 - S^2) of the smooth wall's.
TEST(PathStrength, ScatteringWallsReflectLess) {
  propagation::PathGeometry path = reflected(40, Material::Concrete, 12, 20);
  const double smooth = std::norm(arriving_wave(path, kL1).lhcp);
  const double scattering = 0.4;
  path.incidences[0].specular_factor = std::sqrt(1 - scattering * scattering);
  EXPECT_NEAR(std::norm(arriving_wave(path, kL1).lhcp) / smooth, 1 - 0.16, 1e-12);
  path.incidences[0].specular_factor = 1.1;
  EXPECT_THROW(static_cast<void>(arriving_wave(path, kL1)), InputError);
  path.incidences[0].specular_factor = -0.1;
  EXPECT_THROW(static_cast<void>(arriving_wave(path, kL1)), InputError);
}

TEST(PathStrength, RefusesWhatIsOutOfRange) {
  propagation::Path diffuse;
  diffuse.kind = propagation::PathKind::Diffuse;
  diffuse.scattered_power = -0.1;
  EXPECT_THROW(static_cast<void>(path_amplitude(diffuse, 0, kL1, isotropic_antenna())), InputError);
  diffuse.scattered_power = 0.1;
  diffuse.excess_m = std::nan("");
  EXPECT_THROW(static_cast<void>(path_amplitude(diffuse, 0, kL1, isotropic_antenna())), InputError);
  propagation::PathGeometry path = direct(10);
  path.excess_m = -1;
  EXPECT_THROW(static_cast<void>(arriving_wave(path, kL1)), InputError);
  path = direct(10);
  path.incidence_count = 3;
  EXPECT_THROW(static_cast<void>(arriving_wave(path, kL1)), InputError);
  path = direct(10);
  path.edge_nu = std::nan("");
  EXPECT_THROW(static_cast<void>(arriving_wave(path, kL1)), InputError);
  EXPECT_THROW(static_cast<void>(arriving_wave(direct(10), 0)), InputError);
  EXPECT_THROW(static_cast<void>(arriving_wave(reflected(91, Material::Glass, 0, 0), kL1)), InputError);
}

}  // namespace
}  // namespace canyon::signal::path_strength_test
