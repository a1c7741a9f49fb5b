// The cost of receivers with the default profile in the prepared Hong Kong world (or a named one): processor
// time per second of simulated time, and Gazebo Sim's real-time factor at its own pace, with none, one and
// twenty receivers at 10 Hz on parked cars in the drive's streets. Run manually: CANYON_GAZEBO_DATA=...
// gz_receivers_bench [CITY]
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <map>
#include <memory>
#include <regex>
#include <vector>

#include "adapters/common/testing/prepared_city.hpp"
#include "adapters/gz_sim/testing/sim_server.hpp"
#include "adapters/gz_sim/testing/street_world.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::adapters::gz_sim {
namespace {

constexpr double kSeconds = 4;
constexpr unsigned kStep_ms = 4;

double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// The city with twenty cars, of which `count` have a receiver.
std::string world_with(const std::filesystem::path& folder, int count) {
  const std::string name = folder.filename().string();
  std::string world = canyon::test::read_bytes(folder / (name + ".world"));
  world = std::regex_replace(world, std::regex("<max_step_size>[^<]*"),
                             fmt::format("<max_step_size>{}", kStep_ms * 1e-3));
  world =
      std::regex_replace(world, std::regex("<uri>(" + name + "_model/)"), "<uri>" + folder.string() + "/$1");
  std::string inside =
      "<plugin filename='gz-sim-physics-system' name='gz::sim::systems::Physics'/>" + test::kGnssSystem;
  for (int i = 0; i < 20; ++i) {
    const std::string sensor = "<sensor name='antenna' type='navsat'><update_rate>10</update_rate><canyon>" +
                               canyon::test::city_sky(folder) + "</canyon></sensor>";
    inside += fmt::format(
        "<model name='car{}'><link "
        "name='body'><gravity>false</gravity><inertial><mass>1</mass></inertial>{}</link>"
        "<plugin filename='CanyonDriveSystem' name='canyon::DriveSystem'><trajectory>{}</trajectory>"
        "<format>urbannav</format></plugin></model>",
        i, i < count ? sensor : "", (folder / "truth.csv").string());
  }
  world.insert(world.rfind("</world>"), inside);
  return world;
}

struct Cost {
  std::vector<double> processor, factor;
};
double median(std::vector<double> of) {
  std::sort(of.begin(), of.end());
  return of[of.size() / 2];
}

int run(int argc, char** argv) {
  const std::filesystem::path folder = canyon::test::prepared_city(argc > 1 ? argv[1] : "hongkong");
  if (folder.empty()) {
    fmt::print(stderr, "no such city in CANYON_GAZEBO_DATA (tests/gazebo/prepare.sh writes it)\n");
    return 2;
  }
  const int counts[] = {0, 1, 20};
  std::map<int, std::unique_ptr<test::SimServer>> servers;
  std::map<int, Cost> costs;
  for (const int count : counts) {
    servers[count] = std::make_unique<test::SimServer>(world_with(folder, count));
    servers[count]->step(50);
  }
  for (int round = 0; round < 7; ++round) {
    for (const int count : counts) {
      const auto begin = std::chrono::steady_clock::now();
      const double before = processor_s();
      servers[count]->step(static_cast<unsigned>(1000 * kSeconds / kStep_ms));
      const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      costs[count].processor.push_back((processor_s() - before) / kSeconds);
      costs[count].factor.push_back(kSeconds / wall);
    }
  }
  const double none = median(costs[0].processor);
  for (const int count : counts) {
    const Cost& cost = costs[count];
    fmt::print("{:2} receivers: {:.4f} s of processor for 1 s of simulated time", count,
               median(cost.processor));
    if (count > 0)
      fmt::print(", {:.2f} % of real time for each", 100 * (median(cost.processor) - none) / count);
    fmt::print("; real-time factor {:.3f}\n", median(cost.factor));
  }
  return 0;
}

}  // namespace
}  // namespace canyon::adapters::gz_sim

int main(int argc, char** argv) {
  return canyon::adapters::gz_sim::run(argc, argv);
}
