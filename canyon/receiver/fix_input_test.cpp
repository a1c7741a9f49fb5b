#include "canyon/receiver/fix_input.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/receiver/receiver.hpp"

namespace canyon::receiver::ranging_test {
namespace {

using geodesy::kSpeedOfLight;

constexpr double kRange_m = 2.2e7;
const geodesy::GpsTime kStart{};

struct Made {
  const char* name;
  double sigma_m = 1;
  double error_m = 0;
  double cn0_dbhz = 45;
};

/// A GPS satellite whose codes contain `ionosphere_m` at L1 and TGD of 5 ns, which scale by (f1 / f)^2.
SatelliteObservation observe(const std::vector<Made>& signals, double ionosphere_m,
                             orbit::SatelliteState& state, double carrier_m = kRange_m,
                             geodesy::GpsTime since = kStart) {
  SatelliteObservation satellite;
  satellite.id = {gnss::System::GPS, 3};
  satellite.elevation_rad = 1;
  const auto all = gnss::signals_of(gnss::System::GPS);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double delay_s = 5e-9 * std::pow(all[0].carrier_hz / all[i].carrier_hz, 2);
    (i == 0 ? state.group_delay_s : state.more_group_delays_s[i - 1]) = delay_s;
    const auto made =
        std::find_if(signals.begin(), signals.end(), [&](const Made& m) { return m.name == all[i].name; });
    SignalObservation observed;
    observed.signal = &all[i];
    if (made != signals.end()) {
      const double ionosphere = ionosphere_m * std::pow(gnss::kL1_hz / all[i].carrier_hz, 2);
      positioning::Measurement m;
      m.id = satellite.id;
      m.carrier_frequency_hz = all[i].carrier_hz;
      m.pseudorange_m = carrier_m + ionosphere + kSpeedOfLight * delay_s + made->error_m;
      m.sigma_m = made->sigma_m;
      m.cn0_dbhz = made->cn0_dbhz;
      m.carrier_phase_cycles = (carrier_m - ionosphere) * all[i].carrier_hz / kSpeedOfLight + 1000;
      m.phase_since = since;
      observed.measurement = m;
    }
    if (i == 0) {
      static_cast<SignalObservation&>(satellite) = observed;
    } else {
      satellite.more.push_back(observed);
    }
  }
  return satellite;
}

/// The range that the fix uses: it subtracts the group delay of L1.
double cleaned_m(const FixInput::CombinedMeasurement& chosen, const orbit::SatelliteState& state) {
  return chosen.measurement.pseudorange_m - kSpeedOfLight * state.group_delay_s;
}

ReceiverOptions with(Combination combination, double ionosphere_sigma_m = 5) {
  ReceiverOptions options;
  options.noise.enabled = false;
  options.fix_input.combination = combination;
  options.fix_input.ionosphere_sigma_m = ionosphere_sigma_m;
  return options;
}

TEST(FixInput, TakesTheSignalsThatItIsTold) {
  orbit::SatelliteState state;
  const auto first = [&](std::vector<std::string> uses, const std::vector<Made>& signals) {
    ReceiverOptions options = with(Combination::First);
    options.fix_input.uses = std::move(uses);
    options.fix.cn0_mask_dbhz = 30;
    const auto chosen = FixInput(options).next(observe(signals, 0, state), state, kStart, 0);
    if (chosen) {
      EXPECT_NEAR(cleaned_m(*chosen, state), kRange_m, 1e-8);
    }
    return chosen ? chosen->measurement.carrier_frequency_hz : 0;
  };
  EXPECT_EQ(first({}, {{"L1CA"}, {"L5"}}), 1575.42e6);
  EXPECT_EQ(first({}, {{"L5"}}), 0);
  EXPECT_EQ(first({"L5", "L1CA"}, {{"L1CA"}, {"L5"}}), 1176.45e6);
  EXPECT_EQ(first({"L5", "L1CA"}, {{"L1CA"}, {"L2C"}}), 1575.42e6);
  EXPECT_EQ(first({"L5", "L1CA"}, {{"L1CA"}, {"L5", 1, 0, 20}}), 1575.42e6);  // below the mask
  EXPECT_EQ(first({"L5"}, {{"L1CA"}, {"L2C"}}), 0);
}

// (f1^2 P1 - f2^2 P2) / (f1^2 - f2^2) with sqrt(g^2 + 1) / (g - 1): 2.978 of L1 and L2, 2.588 of L1 and L5.
TEST(FixInput, IonosphereFreeTakesTheFarthest) {
  orbit::SatelliteState state;
  FixInput fix_input(with(Combination::IonosphereFree));
  const auto two = fix_input.next(observe({{"L1CA"}, {"L2C"}}, 12, state), state, kStart, 0);
  ASSERT_TRUE(two);
  EXPECT_NEAR(cleaned_m(*two, state), kRange_m, 1e-7);
  EXPECT_NEAR(two->measurement.sigma_m, 2.978, 5e-4);
  EXPECT_NEAR(two->measurement.sigma_factor, 2.978, 5e-4);
  EXPECT_EQ(two->measurement.ionosphere_fraction, 0);
  const auto three = fix_input.next(observe({{"L1CA"}, {"L2C"}, {"L5"}}, 12, state), state, kStart, 0);
  EXPECT_NEAR(three->measurement.sigma_m, 2.588, 5e-4);
  EXPECT_FALSE(fix_input.next(observe({{"L1CA"}}, 12, state), state, kStart, 0));
  ReceiverOptions corrects = with(Combination::IonosphereFree);
  corrects.fix.correct_ionosphere = true;
  const auto one = FixInput(corrects).next(observe({{"L1CA"}}, 12, state), state, kStart, 12);
  ASSERT_TRUE(one);
  EXPECT_EQ(one->measurement.ionosphere_fraction, 1);
}

// Compared with the joint least squares of x and the delay I with its prior, solved as a dense system here.
TEST(FixInput, UncombinedIsTheJointLeastSquares) {
  orbit::SatelliteState state;
  const std::vector<Made> signals{{"L1CA", 0.8, 1.5}, {"L2C", 2.0, -3}, {"L5", 0.3, 0.4}};
  const double prior_m = 3, model_m = 4, true_m = 9;
  ReceiverOptions options = with(Combination::Uncombined, prior_m);
  options.fix.correct_ionosphere = true;
  const auto chosen = FixInput(options).next(observe(signals, true_m, state), state, kStart, model_m);
  ASSERT_TRUE(chosen);

  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(4, 2);
  Eigen::VectorXd y(4);
  const double f[]{1575.42, 1227.60, 1176.45};
  for (int i = 0; i < 3; ++i) {
    const double g = std::pow(1575.42 / f[i], 2);
    const Made& s = signals[static_cast<std::size_t>(i)];
    design(i, 0) = 1 / s.sigma_m;
    design(i, 1) = g / s.sigma_m;
    y(i) = (g * true_m + s.error_m) / s.sigma_m;  // minus the range
  }
  design(3, 1) = 1 / prior_m;
  y(3) = model_m / prior_m;
  const Eigen::Matrix2d covariance = (design.transpose() * design).inverse();
  const Eigen::Vector2d x = covariance * (design.transpose() * y);
  const positioning::Measurement& m = chosen->measurement;
  // The fix corrects its fraction of the model.
  EXPECT_NEAR(cleaned_m(*chosen, state) - m.ionosphere_fraction * model_m - kRange_m, x(0), 1e-7);
  EXPECT_NEAR(m.sigma_m, std::sqrt(covariance(0, 0)), 1e-9);
  ASSERT_TRUE(chosen->ionosphere_m);
  EXPECT_NEAR(*chosen->ionosphere_m, x(1), 1e-7);
}

// An unknown delay gives the ionosphere-free combination, a known one the mean of the codes.
TEST(FixInput, UncombinedLiesBetweenItsLimits) {
  orbit::SatelliteState state;
  const std::vector<Made> signals{{"L1CA", 1, 0.7}, {"L2C", 1, -0.2}};
  const auto unknown =
      FixInput(with(Combination::Uncombined, 1000)).next(observe(signals, 0, state), state, kStart, 0);
  const auto free =
      FixInput(with(Combination::IonosphereFree)).next(observe(signals, 0, state), state, kStart, 0);
  EXPECT_NEAR(cleaned_m(*unknown, state), cleaned_m(*free, state), 1e-4);
  EXPECT_NEAR(unknown->measurement.sigma_m, 2.978, 5e-4);
  EXPECT_NEAR(unknown->measurement.ionosphere_fraction, 0, 1e-5);
  const auto known =
      FixInput(with(Combination::Uncombined, 1e-6)).next(observe(signals, 0, state), state, kStart, 0);
  EXPECT_NEAR(cleaned_m(*known, state) - kRange_m, 0.25, 1e-7);
  EXPECT_NEAR(known->measurement.sigma_m, std::sqrt(0.5), 1e-9);
  const auto one =
      FixInput(with(Combination::Uncombined, 4)).next(observe({{"L1CA", 3}}, 0, state), state, kStart, 0);
  EXPECT_NEAR(one->measurement.sigma_m, 5, 1e-12);
  EXPECT_FALSE(one->ionosphere_m);
}

TEST(FixInput, WeighsGroupsAsItIsTold) {
  orbit::SatelliteState state;
  ReceiverOptions options = with(Combination::First);
  options.fix_input.sigma_factor = {{"GPS", 2}, {"L1CA", 1.5}, {"GLONASS", 7}};
  const auto chosen = FixInput(options).next(observe({{"L1CA", 1}}, 0, state), state, kStart, 0);
  EXPECT_EQ(chosen->measurement.sigma_m, 3);
  // sigma^2 = floor + scale 10^(-C/N0 / 10), times the factor.
  options.fix.weights.weighting = positioning::Weighting::Cn0;
  const double plain = std::sqrt(10 + 22'500 * std::pow(10, -4.5));
  EXPECT_NEAR(options.fix.weights.sigma_m(chosen->measurement, 1), 3 * plain, 1e-12);
}

// The ionosphere grows by 0.01 m/s. In the steady state Hatch's filter lags by 2 (window - dt) dI/dt: in each
// epoch S - P decreases by 2 dI and keeps (1 - a) of it, 2 dI (1 - a) / a. With two carriers there is no lag.
TEST(FixInput, SmoothingDivergesByTwiceTheIonosphere) {
  orbit::SatelliteState state;
  for (const auto smoothing : {positioning::Smoothing::Hatch, positioning::Smoothing::DivergenceFree}) {
    ReceiverOptions options = with(Combination::First);
    options.fix_input.smoothing = {smoothing, 100};
    FixInput fix_input(options);
    double lag_m = 0;
    for (int k = 0; k < 2000; ++k) {
      const double ionosphere_m = 3 + 0.01 * k, carrier_m = kRange_m + 500.0 * k;
      const auto chosen = fix_input.next(observe({{"L1CA"}, {"L2C"}}, ionosphere_m, state, carrier_m), state,
                                         kStart + 1.0 * k, 0);
      lag_m = cleaned_m(*chosen, state) - carrier_m - ionosphere_m;
    }
    EXPECT_NEAR(lag_m, smoothing == positioning::Smoothing::Hatch ? -2 * 0.01 * 99 : 0, 2e-6);
  }
}

TEST(FixInput, SmoothingBeginsAnewAtACycleSlip) {
  orbit::SatelliteState state;
  ReceiverOptions options = with(Combination::First);
  options.fix_input.smoothing.smoothing = positioning::Smoothing::Hatch;
  FixInput fix_input(options);
  const auto at = [&](double s, double error_m, geodesy::GpsTime since) {
    return cleaned_m(*fix_input.next(observe({{"L1CA", 1, error_m}}, 0, state, kRange_m, since), state,
                                     kStart + s, 0),
                     state) -
           kRange_m;
  };
  EXPECT_NEAR(at(0, 4, kStart), 4, 1e-8);
  EXPECT_NEAR(at(1, 0, kStart), 2, 1e-8);
  EXPECT_NEAR(at(2, 0, kStart + 2.0), 0, 1e-8);  // slipped
  EXPECT_NEAR(at(3, 1, kStart + 2.0), 0.5, 1e-8);
}

}  // namespace
}  // namespace canyon::receiver::ranging_test
