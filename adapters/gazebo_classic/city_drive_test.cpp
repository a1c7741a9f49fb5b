// A drive through a city in gzserver beside the same drive in `canyon simulate`, which wrote satellites.csv.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <tuple>

#include "adapters/gazebo_classic/testing/city_world.hpp"
#include "adapters/gazebo_classic/testing/gnss_listener.hpp"
#include "adapters/gazebo_classic/testing/in_process_server.hpp"
#include "canyon/base/text.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

struct Seen {
  std::string visibility;
  double excess_m = 0;
};
using Key = std::pair<std::int64_t, std::string>;  // time of week [ms], satellite

std::map<Key, Seen> read_satellites(const std::filesystem::path& file) {
  std::map<Key, Seen> seen;
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    const auto fields = split(line, ',');
    const double tow = parse_double(fields.at(1)).value();
    Seen& satellite = seen[{std::llround(tow * 1e3), std::string(fields.at(2))}];
    satellite.visibility = fields.at(5);
    satellite.excess_m = parse_double(fields.at(6)).value_or(0);
  }
  return seen;
}

const char* word(msgs::GnssSatellite::Visibility visibility) {
  switch (visibility) {
    case msgs::GnssSatellite::LOS:
      return "LOS";
    case msgs::GnssSatellite::LOS_MULTIPATH:
      return "LOS+multipath";
    case msgs::GnssSatellite::NLOS:
      return "NLOS";
    default:
      return "blocked";
  }
}

void compare_drive(const std::string& city, int seconds) {
  const std::filesystem::path folder = test::prepared_city(city);
  if (folder.empty()) {
    GTEST_SKIP() << "SKIPPED: no " << city << " in CANYON_GAZEBO_DATA (tests/gazebo/prepare.sh writes it)";
  }
  const std::map<Key, Seen> expected = read_satellites(folder / "satellites.csv");
  test::InProcessServer& server = test::InProcessServer::get();
  const auto world = server.load(test::city_world(
      folder, 0.1,
      test::city_car(
          folder, test::city_sky(folder) + "<profile>ideal</profile><publishers><ros>0</ros></publishers>")));
  test::GnssListener listener(world->Name(), "~/car/antenna/gnss");
  server.step(static_cast<unsigned>(10 * seconds));
  ASSERT_TRUE(listener.at(seconds, std::chrono::seconds(60)));

  std::size_t compared = 0, epochs = 0, other_visibility = 0, reflected = 0;
  double largest_m = 0;
  for (const msgs::GnssReceiver& message : listener.all()) {
    const auto tow_ms = (message.gps_time_of_week_ns() + 500'000) / 1'000'000;
    if (message.sim_time_ns() % 1'000'000'000 != 0) continue;
    ++epochs;
    for (const msgs::GnssSatellite& satellite : message.satellites()) {
      const auto found = expected.find({tow_ms, satellite.id()});
      ASSERT_NE(found, expected.end()) << satellite.id() << " at " << tow_ms;
      ++compared;
      if (found->second.visibility != word(satellite.visibility())) {
        ++other_visibility;
        ADD_FAILURE() << fmt::format("{} at {} ms: {} in gzserver, {} in canyon simulate", satellite.id(),
                                     tow_ms, word(satellite.visibility()), found->second.visibility);
        continue;
      }
      if (satellite.visibility() != msgs::GnssSatellite::NLOS) continue;
      ++reflected;
      largest_m = std::max(largest_m, std::abs(satellite.excess_m() - found->second.excess_m));
    }
  }
  EXPECT_GE(epochs, static_cast<std::size_t>(seconds));
  EXPECT_GT(reflected, static_cast<std::size_t>(seconds) / 2);
  EXPECT_EQ(other_visibility, 0U);
  // Meshes hold floats, the file 0.1 mm.
  EXPECT_LT(largest_m, 2e-3);
  fmt::print("{}: {} epochs, {} satellites, {} of other visibility; {} NLOS, excess within {:.2g} m\n", city,
             epochs, compared, other_visibility, reflected, largest_m);
}

// The paper's algorithm by Gazebo's rays and by the engine's, along the whole drive.
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
