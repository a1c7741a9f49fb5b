#include "canyon/tracking/signal_options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "canyon/base/input_error.hpp"
#include "canyon/options/describe.hpp"
#include "canyon/options/read.hpp"
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
      EXPECT_EQ(correlation.bandwidth_hz, signal.chip_rate_hz == 10.23e6 ? 30e6 : 8e6);
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
  EXPECT_THAT(message([](Options& o) { o.offset_db["Compass"] = 1; }), HasSubstr("'Compass' is not a group"));
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
  EXPECT_THAT(message([](Options& o) { o.strength.roughness_m = 2; }), HasSubstr("roughness_m"));
  EXPECT_THAT(message([](Options& o) { o.dll.spacing_chips = 0; }), HasSubstr("spacing_chips"));
  EXPECT_THAT(message([](Options& o) { o.pll.loop_bandwidth_hz = 0; }), HasSubstr("phase lock loop"));
  EXPECT_THAT(message([](Options& o) { o.fll.noise_factor = 3; }), HasSubstr("noise_factor"));
  EXPECT_THAT(message([](Options& o) { o.lock.hold_s = -1; }), HasSubstr("hold_s"));
}

}  // namespace
}  // namespace canyon::tracking
