#include "canyon/receiver/tracking/signal_options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <tuple>

#include "canyon/base/input_error.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/receiver/tracking/channel.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/spoiled_options.hpp"

namespace canyon::tracking {
namespace {

using gnss::System;

TEST(CorrelationOf, TakesTheBranchOfTheFrontEnd) {
  SignalOptions options;
  options.front_end_bandwidth_hz = 8e6;
  options.wide_front_end_bandwidth_hz = 30e6;
  for (const System system : gnss::kAllSystems) {
    for (const gnss::Signal& signal : gnss::signals_of(system)) {
      const CorrelationOptions correlation = correlation_of(signal, options);
      EXPECT_EQ(correlation.modulation, signal.modulation);
      EXPECT_EQ(correlation.chip_rate_hz, signal.chip_rate_hz);
      EXPECT_EQ(correlation.bandwidth_hz, signal.chip_rate_hz >= 5e6 ? 30e6 : 8e6);
      EXPECT_NO_THROW(correlation.validate()) << signal.name;
    }
  }
}

TEST(SignalOptions, RefusesAPatternThatSaysNothingOfTheSkyAbove) {
  const auto refusal = [](const std::string& rows) {
    return test::refusal([&] {
      SignalOptions signal;
      options::Document document;
      document.kind = "signal";
      document.known = options::describe(signal).paths();
      options::read(options::parse_yaml("antenna_rows: " + rows + "\n", document, ""), document, signal);
    });
  };
  EXPECT_THAT(refusal("[[-90, -10, -10], [0, -6, -6]]"), testing::HasSubstr("rows end at 0 deg"));
  EXPECT_EQ(refusal("[[-90, -10, -10], [0, -6, -6], [85, 3, -10]]"), "");
  EXPECT_EQ(refusal("[[0, -5, -5]]"), "");
}

TEST(SignalOptions, NamesTheFieldThatIsOutOfRange) {
  const test::SpoiledOptions<SignalOptions> message;
  using Options = SignalOptions;
  using testing::HasSubstr;
  EXPECT_EQ(message([](Options&) {}), "");
  EXPECT_EQ(message([](Options& o) { o.offset_db["BeiDou"] = -30; }), "");
  EXPECT_THAT(message([](Options& o) { o.offset_db["BeiDou"] = 31; }), HasSubstr("BeiDou"));
  EXPECT_THAT(message([](Options& o) { o.offset_db["Compass"] = 1; }),
              HasSubstr("'Compass' is not a signal group"));
  EXPECT_THAT(message([](Options& o) { o.satellite_sigma_db = -1; }), HasSubstr("satellite_sigma_db"));
  EXPECT_THAT(message([](Options& o) { o.satellite_sigma_db = NAN; }), HasSubstr("satellite_sigma_db"));
  for (const double bandwidth : {0.0, 1.0e6, 6e8, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THAT(message([&](Options& o) { o.front_end_bandwidth_hz = bandwidth; }),
                HasSubstr("front_end_bandwidth_hz"));
  }
  EXPECT_EQ(message([](Options& o) { o.front_end_bandwidth_hz = 1.023e6; }), "");
  EXPECT_EQ(message([](Options& o) { o.front_end_bandwidth_hz = 511e6; }), "");
  EXPECT_THAT(message([](Options& o) { o.phase_threshold_dbhz = -1; }), HasSubstr("phase_threshold_dbhz"));
  EXPECT_THAT(message([](Options& o) { o.cn0_sigma_db = 11; }), HasSubstr("cn0_sigma_db"));
  EXPECT_THAT(message([](Options& o) { o.cn0_step_db = -0.1; }), HasSubstr("cn0_step_db"));
  EXPECT_THAT(message([](Options& o) { o.link.noise_figure_db = 30; }), HasSubstr("noise_figure_db"));
  EXPECT_THAT(message([](Options& o) { o.dll.spacing_chips = 0; }), HasSubstr("spacing_chips"));
  EXPECT_THAT(message([](Options& o) { o.pll.loop_bandwidth_hz = 0; }), HasSubstr("phase lock loop"));
  EXPECT_THAT(message([](Options& o) { o.lock.hold_s = -1; }), HasSubstr("hold_s"));
  EXPECT_EQ(message([](Options& o) { o.dll.loop_bandwidths_hz["E1"] = 0.2; }), "");
  EXPECT_THAT(message([](Options& o) { o.dll.spacings_chips["Galileo"] = 0.2; }), HasSubstr("'Galileo'"));
  EXPECT_THAT(message([](Options& o) { o.fll.loop_bandwidths_hz["L7"] = 1; }), HasSubstr("'L7'"));
  EXPECT_THAT(message([](Options& o) { o.fll.loop_bandwidths_hz["L6"] = 1; }), HasSubstr("tracks L6"));
  EXPECT_THAT(message([](Options& o) { o.pll.loop_bandwidths_hz["L5"] = 25; }), HasSubstr("25 Hz"));
}

// One receiver, two signals, each with its own loops: the noise has their deviations and memory.
TEST(SignalOptions, GivesEachSignalItsLoops) {
  SignalOptions options;
  options.enabled = true;
  options.dll.loop_bandwidth_hz = 0.05;
  options.dll.loop_bandwidths_hz["E1"] = 0.8;
  options.dll.spacings_chips["E1"] = 0.125;
  options.pll.loop_bandwidths_hz["E1"] = 10;
  options.fll.loop_bandwidths_hz["E1"] = 1;
  ChannelModel model(options, 1, "receiver");
  for (const auto& [name, system, bandwidth_hz, spacing, pll_hz, fll_hz] :
       {std::tuple("L1CA", System::GPS, 0.05, 0.5, 15.0, 5.0),
        std::tuple("E1", System::Galileo, 0.8, 0.125, 10.0, 1.0)}) {
    const auto signals = gnss::signals_of(system);
    const gnss::Signal& signal =
        *std::find_if(signals.begin(), signals.end(),
                      [name = std::string_view(name)](const gnss::Signal& s) { return s.name == name; });
    DllOptions loop;
    loop.spacing_chips = spacing;
    loop.loop_bandwidth_hz = bandwidth_hz;
    Channel channel(model, {system, 3}, signal, {});
    LoopErrors errors = channel.sample(model, {}, 40);
    const CodeTracker expected(correlation_of(signal, options), loop);
    EXPECT_DOUBLE_EQ(errors.code_sigma_m, CodeLoopNoise(expected).sigma_m(1e4)) << name;
    EXPECT_DOUBLE_EQ(errors.code_rate_per_s, 4 * bandwidth_hz);
    EXPECT_DOUBLE_EQ(errors.phase_sigma_cycles, pll_jitter_rad({pll_hz}, 40) / (2 * geodesy::kPi));
    EXPECT_DOUBLE_EQ(errors.doppler_sigma_hz, fll_jitter_hz({fll_hz}, 40));
    double before = 0, products = 0, squares = 0;
    for (int i = 1; i <= 20'000; ++i) {
      errors = channel.sample(model, geodesy::GpsTime() + i, 40);
      products += before * errors.code_m;
      squares += errors.code_m * errors.code_m;
      before = errors.code_m;
    }
    EXPECT_NEAR(products / squares, std::exp(-4 * bandwidth_hz), 0.05) << name;
  }
}

// A step of C/N0 in closed form, at 1 and at 10 Hz; noise follows the true one, and a gap resets the mean.
TEST(SignalOptions, StatedCn0IsAMean) {
  SignalOptions options;
  options.enabled = true;
  options.cn0_averaging_s = 0.7;
  ChannelModel model(options, 1, "receiver");
  const gnss::Signal& l1 = gnss::signals_of(System::GPS).front();
  for (const int rate_hz : {1, 10}) {
    Channel channel(model, {System::GPS, 3}, l1, {});
    EXPECT_NEAR(channel.sample(model, {}, 40).reported_cn0_dbhz, 40, 1e-9);
    LoopErrors errors;
    for (int i = 1; i <= 2 * rate_hz; ++i) {
      const double t = static_cast<double>(i) / rate_hz;
      errors = channel.sample(model, geodesy::GpsTime() + t, 20);
      const double mean = 100 + (10'000 - 100) * std::exp(-t / 0.7);
      EXPECT_NEAR(errors.reported_cn0_dbhz, 10 * std::log10(mean), 1e-6) << t;
    }
    Channel weak(model, {System::GPS, 3}, l1, {});
    EXPECT_EQ(errors.code_sigma_m, weak.sample(model, {}, 20).code_sigma_m);
    EXPECT_NEAR(channel.sample(model, geodesy::GpsTime() + 60, 30).reported_cn0_dbhz, 30, 1e-6);
  }
}

}  // namespace
}  // namespace canyon::tracking
