#include "canyon/paths/signal/path_strength.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::signal {
namespace {

using geodesy::radians;
using gnss::System;

const gnss::Signal& near_l1(System system) {
  return gnss::signals_of(system).front();
}

TEST(LinkBudget, NoiseDensityIsKT) {
  LinkBudgetOptions options;
  options.noise_figure_db = 0;
  options.antenna_temperature_k = 290;
  EXPECT_NEAR(noise_density_dbw_per_hz(options), -203.975, 0.001);  // the -174 dBm/Hz of every link budget
  // A published GPS budget: T_a 211 K, noise figure 1.3 dB over 300 K, 316 K in total, -203.6 dBW/Hz.
  options.antenna_temperature_k = 211;
  options.noise_figure_db = 1.3;
  EXPECT_NEAR(noise_density_dbw_per_hz(options), -203.6, 0.06);
}

// From the satellite's side: transmit antenna gains 13.8, 15.1 and 11.8 dBi towards 5, 50 and 90 degrees of
// elevation, ranges of 25150, 21410 and 20180 km (published GPS L1 link budget), atmosphere 0.4 dB at 5
// degrees.
TEST(LinkBudget, ElevationRiseAgreesWithABudgetFromTheSatellite) {
  const auto received = [](double gain_db, double range_km, double atmosphere_db) {
    return gain_db - 20 * std::log10(range_km) - atmosphere_db;
  };
  const double low = received(13.8, 25150, 0.4);
  EXPECT_NEAR(elevation_rise_db(radians(5)), 0, 1e-12);
  EXPECT_NEAR(elevation_rise_db(radians(50)), received(15.1, 21410, 0.05) - low, 1.3);
  EXPECT_NEAR(elevation_rise_db(radians(90)), received(11.8, 20180, 0.04) - low, 1.3);
  EXPECT_NEAR(elevation_rise_db(radians(40)), 2, 1e-12);
  EXPECT_EQ(elevation_rise_db(radians(-20)), elevation_rise_db(0));
}

TEST(LinkBudget, ClearSkyIsWhatReceiversReport) {
  const AntennaPattern patch = patch_antenna(), survey = survey_antenna();
  const auto cn0 = [](double deg, const AntennaPattern& antenna) {
    return los_cn0_dbhz(near_l1(System::GPS), radians(deg), antenna);
  };
  EXPECT_GT(cn0(90, patch), 45);
  EXPECT_LT(cn0(90, patch), 50);
  EXPECT_GT(cn0(90, survey), cn0(90, patch));
  EXPECT_LT(cn0(90, survey), 53);
  // About 40 at ten degrees, and increasing to the zenith
  EXPECT_GT(cn0(10, patch), 38);
  EXPECT_LT(cn0(10, patch), 44);
  EXPECT_LT(cn0(0, patch), cn0(10, patch));
  EXPECT_LT(cn0(10, patch), cn0(45, patch));
  // By hand at 40 degrees, isotropic: -158.5 + 3 + 2 - 1 - 10 log10(1.380649e-23 * (211 + 290 * (10^0.2 -
  // 1)))
  EXPECT_NEAR(cn0(40, isotropic_antenna()), -154.5 + 202.7943, 1e-4);
  EXPECT_NEAR(los_cn0_dbhz(near_l1(System::Galileo), 1, patch) - los_cn0_dbhz(near_l1(System::GPS), 1, patch),
              1.25, 1e-12);
  EXPECT_NEAR(los_cn0_dbhz(near_l1(System::BeiDou), 1, patch) - los_cn0_dbhz(near_l1(System::GPS), 1, patch),
              -4.5, 1e-12);
}

TEST(LinkBudget, OptionsAreChecked) {
  LinkBudgetOptions options;
  options.antenna_temperature_k = 0;
  EXPECT_THROW(options.validate(), InputError);
  options = {};
  options.noise_figure_db = -1;
  EXPECT_THROW(options.validate(), InputError);
  EXPECT_THROW(static_cast<void>(elevation_rise_db(std::nan(""))), InputError);
}

}  // namespace
}  // namespace canyon::signal
