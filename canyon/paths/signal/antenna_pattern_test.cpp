#include "canyon/paths/signal/antenna_pattern.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::signal {
namespace {

using geodesy::radians;

// ITU Radio Regulations' bands; u-blox ZED-F9H integration manual, table 27: 3 and 2 dBic.
TEST(AntennaPattern, HearsTheBandsThatItIsMadeFor) {
  constexpr double kL5_hz = 1176.45e6, kB3_hz = 1268.52e6;
  EXPECT_FALSE(patch_antenna().receives(Band::Lower));
  EXPECT_THROW(static_cast<void>(patch_antenna().gain(1, kL5_hz)), InputError);
  const AntennaPattern dual = dual_patch_antenna();
  for (const double elevation_deg : {-90.0, -15.0, 0.0, 37.0, 90.0}) {
    const double e = radians(elevation_deg);
    EXPECT_EQ(dual.gain(e, gnss::kL1_hz).rhcp_dbic, patch_antenna().gain(e, gnss::kL1_hz).rhcp_dbic);
    EXPECT_NEAR(dual.gain(e, kL5_hz).rhcp_dbic, dual.gain(e, gnss::kL1_hz).rhcp_dbic - 1, 1e-12);
    EXPECT_NEAR(dual.gain(e, kB3_hz).lhcp_dbic, dual.gain(e, gnss::kL1_hz).lhcp_dbic - 1, 1e-12);
  }
  const AntennaPattern own("rows", {{0, 1, -10}}, {{0, -2, -12}});
  EXPECT_EQ(own.gain(0.3, gnss::kL1_hz).rhcp_dbic, 1);
  EXPECT_EQ(own.gain(0.3, kL5_hz).lhcp_dbic, -12);
}

TEST(AntennaPattern, InterpolatesBetweenRowsAndHoldsTheEnds) {
  const AntennaPattern pattern("p", {{-10, -20, -30}, {10, 0, -20}, {50, 4, -10}});
  EXPECT_EQ(pattern.gain(radians(-90), gnss::kL1_hz).rhcp_dbic, -20);
  EXPECT_NEAR(pattern.gain(radians(0), gnss::kL1_hz).rhcp_dbic, -10, 1e-12);
  EXPECT_NEAR(pattern.gain(radians(0), gnss::kL1_hz).lhcp_dbic, -25, 1e-12);
  EXPECT_NEAR(pattern.gain(radians(20), gnss::kL1_hz).rhcp_dbic, 1, 1e-12);
  EXPECT_NEAR(pattern.gain(radians(20), gnss::kL1_hz).lhcp_dbic, -17.5, 1e-12);
  EXPECT_EQ(pattern.gain(radians(90), gnss::kL1_hz).lhcp_dbic, -10);
}

// Ranges of docs/propagation.md, from manufacturers' documents.
TEST(AntennaPattern, NamedPatternsLieWithinTheCitedRanges) {
  const AntennaPattern survey = survey_antenna(), patch = patch_antenna();
  for (double deg = 0; deg <= 90; deg += 0.5) {
    const AntennaGain s = survey.gain(radians(deg), gnss::kL1_hz), p = patch.gain(radians(deg), gnss::kL1_hz);
    // Reference station antenna: below 7 at zenith, above 0 from 45, above -5 from 10, above -10 from 0
    // degrees
    EXPECT_LT(s.rhcp_dbic, 7);
    EXPECT_GT(s.rhcp_dbic, deg >= 45 ? 0 : deg >= 10 ? -5 : -10) << deg;
    // and an axial ratio within 1 dB from 60, 2 dB from 10, 4 dB from 5 degrees.
    const double axial_limit_db = deg >= 60 ? 1 : deg >= 10 ? 2 : deg >= 5 ? 4 : 5;
    EXPECT_LT(cross_polar_discrimination_db(s.rhcp_dbic - s.lhcp_dbic), axial_limit_db + 0.01) << deg;
    EXPECT_LE(p.rhcp_dbic, 3);
    EXPECT_GT(p.rhcp_dbic, p.lhcp_dbic);
  }
  EXPECT_NEAR(patch.gain(radians(90), gnss::kL1_hz).rhcp_dbic - patch.gain(0, gnss::kL1_hz).rhcp_dbic, 9,
              1e-12);
  EXPECT_NEAR(cross_polar_discrimination_db(patch.gain(radians(90), gnss::kL1_hz).rhcp_dbic -
                                            patch.gain(radians(90), gnss::kL1_hz).lhcp_dbic),
              2, 1e-9);
}

// An antenna's gain is at most its directivity: the mean over the sphere of both hands is at most 1 (0 dB).
TEST(AntennaPattern, NamedPatternsGiveNoMorePowerThanTheyTake) {
  for (const AntennaPattern& pattern :
       {isotropic_antenna(), patch_antenna(), survey_antenna(), phone_antenna()}) {
    double mean = 0, weight = 0;
    for (double deg = -89.75; deg < 90; deg += 0.5) {
      const AntennaGain g = pattern.gain(radians(deg), gnss::kL1_hz);
      const double w = std::cos(radians(deg));
      mean += w * (std::pow(10, g.rhcp_dbic / 10) + std::pow(10, g.lhcp_dbic / 10));
      weight += w;
    }
    EXPECT_LE(mean / weight, 1.0 + 1e-12) << pattern.name();
    EXPECT_GT(mean / weight, 0.3) << pattern.name();
  }
}

TEST(AntennaPattern, AxialRatioAndDiscriminationAreOneEllipse) {
  EXPECT_NEAR(cross_polar_discrimination_db(3), 15.34, 0.005);  // 20 log10(2.4125 / 0.4125)
  EXPECT_NEAR(cross_polar_discrimination_db(1), 24.81, 0.005);
  // The ellipse of circular amplitudes 1 and x has axes 1 + x and 1 - x.
  EXPECT_NEAR(cross_polar_discrimination_db(20), 20 * std::log10(1.1 / 0.9), 1e-12);
  for (const double db : {0.5, 2.0, 9.0})
    EXPECT_NEAR(cross_polar_discrimination_db(cross_polar_discrimination_db(db)), db, 1e-10);
  EXPECT_TRUE(std::isinf(cross_polar_discrimination_db(0)));
  EXPECT_THROW(static_cast<void>(cross_polar_discrimination_db(-1)), InputError);
  EXPECT_THROW(static_cast<void>(cross_polar_discrimination_db(std::nan(""))), InputError);
}

TEST(AntennaPattern, NamesAndRowsAreChecked) {
  EXPECT_EQ(antenna_by_name("survey").name(), "survey");
  EXPECT_THROW(static_cast<void>(antenna_by_name("pach")), InputError);
  EXPECT_THROW(AntennaPattern("p", {}), InputError);
  EXPECT_THROW(AntennaPattern("p", {{10, 0, 0}, {10, 0, 0}}), InputError);
  EXPECT_THROW(AntennaPattern("p", {{91, 0, 0}}), InputError);
  EXPECT_THROW(AntennaPattern("p", {{0, std::nan(""), 0}}), InputError);
  EXPECT_THROW(static_cast<void>(isotropic_antenna().gain(std::nan(""), gnss::kL1_hz)), InputError);
}

}  // namespace
}  // namespace canyon::signal
