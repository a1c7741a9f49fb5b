#include "canyon/receiver/positioning/range_terms.hpp"

#include <gtest/gtest.h>

#include <string_view>
#include <utility>

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
                                                     {Id::CarrierTurn, "turn of the carrier"}};
  ASSERT_EQ(range_terms().size(), std::size(kNames));
  ASSERT_LE(range_terms().size(), kMostRangeTerms);
  for (const auto& [id, name] : kNames) EXPECT_EQ(range_terms()[static_cast<std::size_t>(id)].name, name);
}

// IS-GPS-200, 20.3.3.3.3.1: a code holds minus the satellite's clock, and its group delay; a carrier the
// clock alone.
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

}  // namespace
}  // namespace canyon::receiver
