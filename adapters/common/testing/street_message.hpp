#pragma once

#include <gtest/gtest.h>

#include <string>

#include "adapters/common/testing/street.hpp"
#include "gnss.pb.h"

namespace canyon::test {

/// Visibility and excess path of every satellite of the street by the closed forms.
inline void expect_street(const msgs::GnssReceiver& message, double StreetSatellite::*excess_m,
                          double tolerance_m) {
  ASSERT_EQ(static_cast<std::size_t>(message.satellites_size()), street_satellites().size());
  for (int i = 0; i < message.satellites_size(); ++i) {
    const msgs::GnssSatellite& satellite = message.satellites(i);
    const StreetSatellite& expected = street_satellites()[static_cast<std::size_t>(i)];
    const std::string which = "azimuth " + std::to_string(expected.azimuth_deg) + ", elevation " +
                              std::to_string(expected.elevation_deg);
    // The antenna is a few metres from the origin, for which the angles are given.
    EXPECT_NEAR(satellite.elevation_rad(), geodesy::radians(expected.elevation_deg), 1e-4) << which;
    const double m = expected.*excess_m;
    if (m == 0) {
      EXPECT_TRUE(satellite.visibility() == msgs::GnssSatellite::LOS ||
                  satellite.visibility() == msgs::GnssSatellite::LOS_MULTIPATH)
          << which;
    } else if (m < 0) {
      EXPECT_EQ(satellite.visibility(), msgs::GnssSatellite::BLOCKED) << which;
    } else {
      EXPECT_EQ(satellite.visibility(), msgs::GnssSatellite::NLOS) << which;
      EXPECT_NEAR(satellite.excess_m(), m, tolerance_m) << which;
    }
  }
}

}  // namespace canyon::test
