// A drive through a city in gzserver compared with the same drive in `canyon simulate`, which wrote
// satellites.csv.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "adapters/common/testing/drive_comparison.hpp"
#include "adapters/gazebo_classic/testing/city_world.hpp"
#include "adapters/gazebo_classic/testing/gnss_listener.hpp"
#include "adapters/gazebo_classic/testing/in_process_server.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

void compare_drive(const std::string& city, int seconds) {
  const std::filesystem::path folder = test::prepared_city(city);
  if (folder.empty()) {
    GTEST_SKIP() << "SKIPPED: no " << city << " in CANYON_GAZEBO_DATA (tests/gazebo/prepare.sh writes it)";
  }
  test::InProcessServer& server = test::InProcessServer::get();
  const auto world = server.load(test::city_world(
      folder, 0.1,
      test::city_car(
          folder, test::city_sky(folder) + "<profile>ideal</profile><publishers><ros>0</ros></publishers>")));
  test::GnssListener listener(world->Name(), "~/car/antenna/gnss");
  server.step(static_cast<unsigned>(10 * seconds));
  ASSERT_TRUE(listener.at(seconds, std::chrono::seconds(60)));

  // Meshes have floats, the file a resolution of 0.1 mm.
  canyon::test::expect_drive(city, folder, seconds, listener.all(), 2e-3);
}

// The paper's algorithm with Gazebo's rays and with the engine's, along the whole drive.
TEST(CityDrive, BothEnginesSeeTheSame) {
  const std::filesystem::path folder = test::prepared_city("hongkong").empty()
                                           ? test::prepared_city("synthetic")
                                           : test::prepared_city("hongkong");
  if (folder.empty())
    GTEST_SKIP() << "SKIPPED: no city in CANYON_GAZEBO_DATA (tests/gazebo/prepare.sh writes it)";
  constexpr int kSeconds = 90;
  std::vector<std::vector<msgs::GnssReceiver>> seen;
  for (const std::string engine : {"physics", "embree"}) {
    test::InProcessServer& server = test::InProcessServer::get();
    const auto world = server.load(test::city_world(
        folder, 0.1,
        test::city_car(folder, test::city_sky(folder) + "<profile>ideal</profile><ray_engine>" + engine +
                                   "</ray_engine><propagation><model>mirror</model></propagation>"
                                   "<publishers><ros>0</ros></publishers>")));
    test::GnssListener listener(world->Name(), "~/car/antenna/gnss");
    server.step(10 * kSeconds);
    ASSERT_TRUE(listener.at(kSeconds, std::chrono::seconds(60)));
    seen.push_back(listener.all());
  }
  ASSERT_EQ(seen[0].size(), seen[1].size());
  std::size_t compared = 0, nlos = 0, other = 0;
  double largest_m = 0;
  for (std::size_t i = 0; i < seen[0].size(); ++i) {
    ASSERT_EQ(seen[0][i].sim_time_ns(), seen[1][i].sim_time_ns());
    for (int k = 0; k < seen[0][i].satellites_size(); ++k) {
      const msgs::GnssSatellite& physics = seen[0][i].satellites(k);
      const msgs::GnssSatellite& embree = seen[1][i].satellites(k);
      ++compared;
      if (physics.visibility() != embree.visibility()) {
        ++other;
      } else if (physics.visibility() == msgs::GnssSatellite::NLOS) {
        ++nlos;
        largest_m = std::max(largest_m, std::abs(physics.excess_m() - embree.excess_m()));
      }
    }
  }
  EXPECT_GT(nlos, 100U);
  EXPECT_EQ(other, 0U);
  EXPECT_LT(largest_m, 5e-3);
  fmt::print("{} satellites, {} of other visibility, {} NLOS, excess within {:.2g} m\n", compared, other,
             nlos, largest_m);
}

TEST(CityDrive, SyntheticIsThatOfCanyonSimulate) {
  compare_drive("synthetic", 94);
}

TEST(CityDrive, HongKongIsThatOfCanyonSimulate) {
  compare_drive("hongkong", 484);
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic
