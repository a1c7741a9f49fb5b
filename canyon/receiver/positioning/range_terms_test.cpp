#include "canyon/receiver/positioning/range_terms.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string_view>
#include <utility>

#include "canyon/receiver/positioning/pseudorange_model.hpp"
#include "tests/support/refusal.hpp"

namespace canyon::receiver {
namespace {

TEST(RangeTerms, NumbersAreThePlacesInTheTable) {
  using Id = RangeTermId;
  constexpr std::pair<Id, std::string_view> kNames[]{{Id::Geometry, "geometry"},
                                                     {Id::SatelliteClock, "satellite clock"},
                                                     {Id::GroupDelay, "group delay"},
                                                     {Id::Ionosphere, "ionosphere"},
                                                     {Id::Troposphere, "troposphere"},
                                                     {Id::OrbitError, "orbit error"},
                                                     {Id::ReceiverClock, "receiver clock"},
                                                     {Id::Bias, "bias"},
                                                     {Id::Multipath, "multipath"},
                                                     {Id::Noise, "noise"},
                                                     {Id::CarrierPhaseOffset, "turn of the carrier"}};
  ASSERT_EQ(range_terms().size(), std::size(kNames));
  ASSERT_LE(range_terms().size(), kMaxRangeTerms);
  for (const auto& [id, name] : kNames) EXPECT_EQ(range_terms()[static_cast<std::size_t>(id)].name, name);
}

// IS-GPS-200, 20.3.3.3.3.1: a code contains minus the satellite's clock, and its group delay; a carrier only
// the clock.
TEST(RangeTerms, AReceiverTakesOffWhatTheMessagesSay) {
  orbit::SatelliteState satellite;
  satellite.clock_bias_s = 1e-5;
  satellite.group_delay_s = 2e-9;
  satellite.more_group_delays_s[0] = 5e-9;
  ModelState state;
  state.satellite = &satellite;
  const CodeAndCarrier l1 = modelled_range(RangeTermOf::Satellite, state);
  EXPECT_NEAR(l1.code, 299792458 * (2e-9 - 1e-5), 1e-9);
  EXPECT_NEAR(l1.carrier, -299792458 * 1e-5, 1e-9);
  state.signal = &gnss::signals_of(gnss::System::GPS)[1];
  EXPECT_NEAR(modelled_range(RangeTermOf::Satellite, state).code - l1.code, 299792458 * 3e-9, 1e-9);
}

// A fix subtracts the model of a new row, independent of the switches of the others.
TEST(RangeTerms, ASolverTakesOffTheModelOfANewRow) {
  add_range_term({"made up", RangeTermOf::Space, [](const RangeState&) { return CodeAndCarrier{}; },
                  [](const ModelState& state) {
                    return CodeAndCarrier{2 * std::sin(state.look_angles.elevation_rad), 0};
                  }});
  positioning::Measurement measured;
  positioning::RangedSatellite satellite;
  satellite.measured = &measured;
  satellite.position = {2.6e7, 0, 0};
  positioning::look_up({&satellite, 1}, {6378137, 0, 0}, {}, {}, {});
  remove_range_term();
  EXPECT_NEAR(satellite.space_m, 2, 1e-9);  // at the zenith
}

// Arrays have kMaxRangeTerms elements: a further one would be written beyond their end.
TEST(RangeTerms, NoMoreThanTheArraysHold) {
  const std::size_t own = range_terms().size();
  const RangeTerm term{"made up", RangeTermOf::Space, [](const RangeState&) { return CodeAndCarrier{}; }};
  for (std::size_t k = own; k < kMaxRangeTerms; ++k) add_range_term(term);
  EXPECT_THAT(test::refusal([&] { add_range_term(term); }),
              ::testing::HasSubstr("no space for the range term 'made up': a range has at most 16 terms"));
  EXPECT_EQ(range_terms().size(), kMaxRangeTerms);
  for (std::size_t k = 0; k < kMaxRangeTerms; ++k) remove_range_term();
  EXPECT_EQ(range_terms().size(), own);
  EXPECT_THROW(add_range_term({"empty", RangeTermOf::Space, nullptr}), InputError);
}

}  // namespace
}  // namespace canyon::receiver
