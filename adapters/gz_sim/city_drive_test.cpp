// A drive through a city in Gazebo Sim compared with the same drive in `canyon simulate`.
#include <gtest/gtest.h>

#include <regex>

#include "adapters/common/testing/drive_comparison.hpp"
#include "adapters/common/testing/prepared_city.hpp"
#include "adapters/gz_sim/testing/sim_server.hpp"
#include "adapters/gz_sim/testing/street_world.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::adapters::gz_sim {
namespace {

/// The city's world as written by `canyon city build`, in steps of 0.1 s, with the systems and a car on
/// rails.
std::filesystem::path drive_world(const std::filesystem::path& folder, const std::filesystem::path& to) {
  const std::string name = folder.filename().string();
  std::string world = canyon::test::read_bytes(folder / (name + ".world"));
  world = std::regex_replace(world, std::regex("<max_step_size>[^<]*"), "<max_step_size>0.1");
  world = std::regex_replace(world, std::regex("<real_time_factor>[^<]*"), "<real_time_factor>0");
  world =
      std::regex_replace(world, std::regex("<uri>(" + name + "_model/)"), "<uri>" + folder.string() + "/$1");
  const std::string car =
      "<plugin filename='gz-sim-physics-system' name='gz::sim::systems::Physics'/>" + test::kGnssSystem +
      "<model name='car'><link name='body'><gravity>false</gravity><inertial><mass>1</mass></inertial>"
      "<sensor name='antenna' type='navsat'><update_rate>1</update_rate><canyon>" +
      canyon::test::city_sky(folder) +
      "<profile>ideal</profile></canyon></sensor></link>"
      "<plugin filename='CanyonDriveSystem' name='canyon::DriveSystem'><trajectory>" +
      (folder / "truth.csv").string() + "</trajectory><format>urbannav</format></plugin></model>";
  world.insert(world.rfind("</world>"), car);
  std::ofstream(to) << world;
  return to;
}

void compare_drive(const std::string& city, int seconds) {
  const std::filesystem::path folder = canyon::test::prepared_city(city);
  if (folder.empty()) {
    GTEST_SKIP() << "SKIPPED: no " << city << " in CANYON_GAZEBO_DATA (tests/gazebo/prepare.sh writes it)";
  }
  const canyon::test::TemporaryFolder own;
  gz::sim::ServerConfig config;
  config.SetSdfFile(drive_world(folder, own / "drive.sdf").string());
  test::SimServer server(config);
  test::GnssListener listener("/world/" + city + "/model/car/link/body/sensor/antenna/gnss");
  server.step(static_cast<unsigned>(10 * seconds));
  ASSERT_TRUE(listener.at(seconds, std::chrono::seconds(60)));
  canyon::test::expect_drive(city, folder, seconds, listener.all(), 1e-3);
}

TEST(CityDrive, SyntheticIsThatOfCanyonSimulate) {
  compare_drive("synthetic", 94);
}

TEST(CityDrive, HongKongIsThatOfCanyonSimulate) {
  compare_drive("hongkong", 484);
}

}  // namespace
}  // namespace canyon::adapters::gz_sim
