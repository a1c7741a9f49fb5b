#include <gtest/gtest.h>

#include <gmock/gmock.h>

#include "canyon/analysis/calibration/calibrate.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::calibration::estimate_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using Verdict = Estimate::Verdict;

Estimate estimate(const std::string& key, const std::string& before, const std::string& after,
                  Verdict verdict) {
  return {key, "dB", before, after, "1 to 2", verdict, "from a test"};
}

// Every profile of Canyon, with changed values, is the same receiver after reading it back.
TEST(ProfileText, ReadsBack) {
  for (const simulation::BuiltInProfile& built_in : simulation::built_in_profiles()) {
    simulation::Profile profile =
        simulation::parse_profile(std::string(built_in.text), std::string(built_in.name));
    const Values values{{"signal.offset_db", "[BeiDou-2&BeiDou-GEO=-3.5, Galileo=1]"},
                        {"exclude_signals", "[BeiDou-GEO]"},
                        {"signal.lock.reacquisition_s", "2.5"},
                        {"signal.antenna_rows", "[[-30, -18, -14], [0, -3, -12], [90, 2, -18]]"}};
    Values own = values;
    // Rows of only the upper band receive no signal of another.
    if (!profile.receiver.options.tracks.empty()) own.erase("signal.antenna_rows");
    set_values(own, profile.receiver);
    const std::vector<Estimate> estimates{
        estimate("signal.lock.reacquisition_s", "1", "2.5", Verdict::Fitted),
        estimate("signal.link.noise_figure_db", "4", "4", Verdict::Agrees),
        estimate("signal.lock.hold_s", "1", "1", Verdict::Unidentified)};
    const std::string text =
        profile_text(profile.receiver, estimates,
                     {"a \"quoted\" \\ receiver: here", std::string(built_in.name), {"A note."}});
    const simulation::Profile back = simulation::parse_profile(text, "mine.yaml");
    EXPECT_EQ(options::exact_text(back.receiver), options::exact_text(profile.receiver)) << text;
    EXPECT_EQ(back.description, "a \"quoted\" \\ receiver: here");
    EXPECT_THAT(text, HasSubstr("reacquisition_s: 2.5"));
    EXPECT_THAT(text, HasSubstr("# was 1; from a test, 95 % 1 to 2"));
    EXPECT_THAT(text, HasSubstr("#   signal.lock.hold_s: from a test"));
    EXPECT_THAT(text, HasSubstr("# A note."));
    EXPECT_THAT(text, Not(HasSubstr("max_iterations"))) << "a default that nobody spoke of";
  }
}

TEST(Values, AreSetAndToldByTheirKeys) {
  simulation::ReceiverConfig receiver;
  set_values({{"signal.lock.hold_s", "2"}, {"elevation_mask_deg", "7"}, {"tracks", "[L1CA, E1]"}}, receiver);
  EXPECT_EQ(receiver.options.signal.lock.hold_s, 2);
  EXPECT_EQ(receiver.options.tracks, (std::vector<std::string>{"L1CA", "E1"}));
  const Values values = values_of(receiver);
  EXPECT_EQ(values.at("signal.lock.hold_s"), "2");
  EXPECT_THROW(set_values({{"signal.lock.hold_s", "-2"}}, receiver), InputError);
  EXPECT_THROW(set_values({{"signal.lock.holds", "2"}}, receiver), InputError);
}

// Two digits of the deviation.
TEST(Rounded, AsTheDeviationDeserves) {
  EXPECT_EQ(rounded(12.3456, 0.5), "12.35");
  EXPECT_EQ(rounded(12.3456, 5), "12.3");
  EXPECT_EQ(rounded(12.3456, 50), "12");
  EXPECT_EQ(rounded(-0.04, 0.3), "-0.04");
}

}  // namespace
}  // namespace canyon::calibration::estimate_test
