#include "canyon/receiver/positioning/range_terms.hpp"

#include <gtest/gtest.h>

#include <string_view>
#include <utility>

#include "canyon/receiver/positioning/pseudorange_model.hpp"
#include "canyon/sky/range_errors.hpp"

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

// A fix subtracts the models that its options enable. RTCA DO-229's mapping is 1 at the zenith.
TEST(RangeTerms, ASolverTakesOffTheEnabledModels) {
  const Eigen::Vector3d receiver(6378137, 0, 0);
  const auto space_m = [&](bool corrected) {
    positioning::FixOptions options;
    options.correct_troposphere = corrected;
    positioning::Measurement measured;
    positioning::RangedSatellite satellite;
    satellite.measured = &measured;
    satellite.position = {2.6e7, 0, 0};
    positioning::look_up({&satellite, 1}, receiver, {}, options, {});
    return satellite.space_m;
  };
  EXPECT_EQ(space_m(false), 0);
  EXPECT_NEAR(space_m(true), sky::saastamoinen_zenith_m(geodesy::geodetic_from_ecef(receiver)), 1e-5);
}

}  // namespace
}  // namespace canyon::receiver
