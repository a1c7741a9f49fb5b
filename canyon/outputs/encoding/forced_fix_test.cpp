// Codes of a fix forced by a fault.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "canyon/city/city.hpp"
#include "canyon/outputs/encoding/mavlink.hpp"
#include "canyon/outputs/encoding/nmea.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/ubx_device.hpp"

namespace canyon::encoding {
namespace {

/// Its last epoch.
class LastEpoch final : public simulation::EpochSink {
 public:
  void write(const simulation::Epoch& epoch) override {
    last = epoch;
    last.arrival = nullptr;
    last.navigation = nullptr;
    last.environment = nullptr;
  }
  void finish() override {}
  simulation::Epoch last;
};

// NMEA 0183: GGA, quality indicator; UBX-22008968 3.15.13: fixType, carrSoln in bits 7 and 6 of flags, hAcc;
// common.xml: GPS_FIX_TYPE.
TEST(ForcedFix, HasItsCodeInEveryFormat) {
  struct Case {
    const char* fix;
    int quality;
    std::uint64_t type, carrier, hacc_mm;
    int mavlink;
  };
  for (const auto& [word, quality, type, carrier, hacc_mm, mavlink] :
       {Case{"none", 0, 0, 0, 0xFFFFFFFF, 1}, Case{"single", 1, 3, 0, 1414, 3},
        Case{"differential", 2, 3, 0, 707, 4}, Case{"float", 5, 3, 1, 283, 5},
        Case{"fixed", 4, 3, 2, 14, 6}}) {
    const simulation::Scenario scenario = simulation::parse_scenario(
        fmt::format(
            "city: {{open: true, origin: {{latitude_deg: 22.3, longitude_deg: 114.17, height_m: 0}}}}\n"
            "sky: {{nominal: true}}\nstart: 2026-06-01T08:00:00Z\nduration_s: 2\n"
            "trajectory: {{position: {{east_m: 0, north_m: 0, up_m: 2}}}}\n"
            "receivers: [{{name: rover, profile: ideal}}]\nfaults: [{{force: {{fix: {}}}}}]\n",
            word),
        "s.yaml");
    city::City field;
    field.frame = geodesy::LocalFrame(*scenario.city.origin);
    LastEpoch sink;
    (void)simulation::Simulation(scenario, field).run({&sink});
    EXPECT_THAT(nmea_epoch(sink.last),
                testing::ContainsRegex(fmt::format("GGA,[^,]*,[^,]*,[^,]*,[^,]*,[^,]*,{},", quality)));
    const auto messages = test::UbxDevice().encode(sink.last);
    const test::Message& pvt = test::find(messages, 0x0107);
    EXPECT_EQ(pvt.u(20, 1), type) << word;
    EXPECT_EQ(pvt.u(21, 1) >> 6, carrier) << word;
    EXPECT_EQ(pvt.u(40, 4), hacc_mm) << word;
    EXPECT_EQ(gps_raw_int(sink.last).fix_type, mavlink) << word;
    EXPECT_EQ(hil_gps(sink.last).fix_type, mavlink) << word;
  }
}

}  // namespace
}  // namespace canyon::encoding
