// Canyon's observation file with all bands, read by RTKLIB 2.4.3 b34 and by Canyon.
#include "canyon/outputs/encoding/stream.hpp"
#include "tests/integration/run_scenario.hpp"
#include "tests/support/rtklib_observations.hpp"

namespace canyon::encoding {
namespace {

TEST(RinexObservationFile, IsReadByRtklibInEveryBand) {
  const test::TemporaryFolder folder;
  const auto simulation = test::prepare(R"(
city: {open: true, origin: {latitude_deg: 22.298, longitude_deg: 114.178, height_m: 10}}
sky: {nominal: true, systems: [GPS, GLONASS, Galileo, BeiDou]}
start: 2026-03-01T10:00:00Z
duration_s: 30
trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}
receivers: [{name: rover, profile: survey,
             tracks: [L1CA, L1C, L2C, L5, E1, E5a, E5b, B1I, B1C, B2I, B2a, B3I, G1, G2]}]
)",
                                        folder.path());
  const auto file = open_file("rinex_observation", folder / "rover.obs", 0, describe_receiver(simulation, 0));
  simulation.run({file.get()});
  rinex::ObservationOptions all;
  all.all_signals = true;
  EXPECT_GT(test::expect_as_rtklib(folder / "rover.obs", all), 2000U);
}

}  // namespace
}  // namespace canyon::encoding
