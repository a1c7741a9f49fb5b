#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "adapters/common/host_settings.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/environment.hpp"

namespace canyon::adapters {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using Kind = live::OptionsRequest::Kind;

// A host's thread that serves its desk, and calls from another thread.
TEST(FaultServices, ChangeAReceiverWhereThatIsAllowed) {
  const auto config = simulation::parse_live_config(
      "{sky: {nominal: true, systems: [GPS]}, start: 2026-06-01T08:00:00Z, profile: ideal}", "test");
  simulation::ReceiverRunner car(config, std::make_shared<simulation::CityScene>(city::City{}),
                                 *config.start);
  simulation::ReceiverRunner other(config, std::make_shared<simulation::CityScene>(city::City{}),
                                   *config.start);
  const auto desk = std::make_shared<live::RequestQueue>();
  std::atomic<bool> stop{false};
  std::thread host([&] {
    while (!stop) {
      desk->serve([&] { return std::vector<live::ReceiverHandle>{{"car", &car}, {"other", &other}}; });
      std::this_thread::yield();
    }
  });

  RosSettings settings;
  const live::FaultRequestHandler closed = hosted_faults(desk, "car", settings);
  EXPECT_TRUE(closed.call(Kind::Faults, "").success);
  for (const Kind kind : {Kind::AddFault, Kind::EndFault}) {
    const live::ServiceReply refused = closed.call(kind, "{outage: {}}");
    EXPECT_FALSE(refused.success);
    EXPECT_THAT(refused.message, HasSubstr("<ros><changes>true</changes></ros>"));
  }
  settings.changes = true;
  const live::FaultRequestHandler open = hosted_faults(desk, "car", settings);
  const live::ServiceReply added = open.call(Kind::AddFault, "{name: dark, outage: {}}");
  EXPECT_TRUE(added.success);
  EXPECT_EQ(added.message, "added car: dark");
  EXPECT_EQ(open.call(Kind::Faults, "").message, "car: dark (outage) from 0 s, at work");
  const live::ServiceReply wrong = open.call(Kind::AddFault, "{outage: {satelites: G05}}");
  EXPECT_FALSE(wrong.success);
  EXPECT_THAT(wrong.message, StartsWith("refused: "));
  stop = true;
  host.join();
  EXPECT_EQ(car.faults().size(), 1U);
  EXPECT_TRUE(other.faults().empty());
  // The desk is no longer served.
  desk->close();
  EXPECT_FALSE(open.call(Kind::EndFault, "dark").success);
}

}  // namespace
}  // namespace canyon::adapters
