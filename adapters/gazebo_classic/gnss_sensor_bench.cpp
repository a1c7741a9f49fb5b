// The cost of a receiver's update in the prepared Hong Kong world (or a named one): the world's steps with
// the receiver minus those without, satellites with 62 rays, by each engine. Also Gazebo's speed with and
// without it. Run manually: CANYON_GAZEBO_DATA=... gazebo_gnss_sensor_bench [CITY]
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "adapters/gazebo_classic/physics_rays.hpp"
#include "adapters/gazebo_classic/testing/city_world.hpp"
#include "adapters/gazebo_classic/testing/in_process_server.hpp"
#include "adapters/gazebo_classic/world_geometry.hpp"
#include "canyon/base/geodesy/constants.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

constexpr int kSatellites = 31;

// 31 directions spread over the sky above 10 deg.
std::string frozen_sky() {
  std::string azimuth, elevation;
  for (int i = 0; i < kSatellites; ++i) {
    azimuth += fmt::format("{:.6f} ", std::fmod(2.399963 * i, 2 * geodesy::kPi));  // the golden angle
    elevation += fmt::format("{:.6f} ", std::asin(0.18 + 0.8 * (i + 0.5) / kSatellites));
  }
  return "<sky><frozen><satAzimuth>" + azimuth + "</satAzimuth><satElevation>" + elevation +
         "</satElevation></frozen></sky><profile>ideal</profile><publishers><ros>0</ros></publishers>";
}

double seconds_of(unsigned steps) {
  const auto begin = std::chrono::steady_clock::now();
  test::InProcessServer::get().step(steps);
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// Median over rounds [s] of `steps` steps of each world in turn.
double measure(const std::string& world, unsigned steps) {
  test::InProcessServer::get().load(world);
  seconds_of(20);
  std::vector<double> rounds;
  for (int i = 0; i < 5; ++i) rounds.push_back(seconds_of(steps));
  std::sort(rounds.begin(), rounds.end());
  return rounds[rounds.size() / 2];
}

// Only the 62 rays, repeatedly from the car's position in the loaded world.
void compare_rays() {
  const gazebo::physics::WorldPtr world = gazebo::physics::get_world();
  const gazebo::physics::LinkPtr link = world->ModelByName("car")->GetLink("base");
  const ignition::math::Vector3d at = link->WorldPose().Pos();
  std::vector<PhysicsRay> rays;
  for (int i = 0; i < kSatellites; ++i) {
    const Eigen::Vector3d s = geodesy::enu_from_azimuth_elevation(
        std::fmod(2.399963 * i, 2 * geodesy::kPi), std::asin(0.18 + 0.8 * (i + 0.5) / kSatellites));
    rays.push_back({{at.X(), at.Y(), at.Z()}, s, 5000});
    rays.push_back({{at.X(), at.Y(), at.Z()}, {-s.x(), -s.y(), s.z()}, 300});
  }
  const auto time = [](const auto& cast) {
    constexpr int kTimes = 1000;
    cast();
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < kTimes; ++i) cast();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() / kTimes;
  };
  PhysicsRays physics(link, nullptr, "bench");
  std::vector<double> ranges(rays.size());
  const double physics_s = time([&] { physics.cast(rays, nullptr, ranges); });
  const auto geometry = WorldGeometry::of(world, {false, {}});
  geometry->update(nullptr);
  const raytrace::RayScene& scene = geometry->scene()->scene;
  std::size_t met = 0, agree = 0;
  const double embree_s = time([&] {
    met = agree = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const bool hit = scene.cast({rays[i].origin, rays[i].direction, rays[i].max_range_m}).has_value();
      met += hit ? 1 : 0;
      agree += hit == std::isfinite(ranges[i]) ? 1 : 0;
    }
  });
  const double update_s = time([&] { geometry->update(nullptr); });
  fmt::print(
      "the {} rays alone ({} meet something, {} agree): physics {:.1f} us, embree {:.1f} us, {:.1f} times "
      "cheaper; "
      "the geometry's update {:.1f} us\n",
      rays.size(), met, agree, physics_s * 1e6, embree_s * 1e6, physics_s / embree_s, update_s * 1e6);
}

int run(const std::string& city) {
  const std::filesystem::path folder = test::prepared_city(city);
  if (folder.empty()) {
    fmt::print(stderr, "no {} in CANYON_GAZEBO_DATA; tests/gazebo/prepare.sh writes it\n", city);
    return 2;
  }
  const auto car = [&](const std::string& engine, const std::string& model, double rate_hz) {
    std::string model_car = test::city_car(
        folder, frozen_sky() + test::city_sky(folder).substr(test::city_sky(folder).find("<start>")) +
                    fmt::format("<rate_hz>{}</rate_hz>", rate_hz) + "<ray_engine>" + engine +
                    "</ray_engine><propagation><model>" + model + "</model></propagation>");
    return model_car;
  };
  const std::string bare = [&] {
    std::string model = test::city_car(folder, "");
    const std::size_t begin = model.find("<sensor"), end = model.find("</sensor>") + 9;
    return model.erase(begin, end - begin);
  }();

  // The cost of 62 rays of Gazebo's own ray sensor, none of them directed: the method of the paper's
  // prototype.
  {
    std::string sensor =
        "<sensor name='lidar' type='ray'><ray><scan><horizontal><samples>62</samples><resolution>1"
        "</resolution><min_angle>-3.1</min_angle><max_angle>3.1</max_angle></horizontal><vertical>"
        "<samples>1</samples><min_angle>0.7</min_angle><max_angle>0.7</max_angle></vertical></scan>"
        "<range><min>0.1</min><max>5000</max></range></ray></sensor>";
    std::string model = test::city_car(folder, "");
    const std::size_t begin = model.find("<sensor"), end = model.find("</sensor>") + 9;
    test::InProcessServer::get().load(
        test::city_world(folder, 0.1, model.replace(begin, end - begin, sensor)));
    seconds_of(20);
    const auto lidar =
        std::dynamic_pointer_cast<gazebo::sensors::RaySensor>(gazebo::sensors::get_sensor("lidar"));
    const auto first = std::chrono::steady_clock::now();
    constexpr int kScans = 100;
    for (int i = 0; i < kScans; ++i) lidar->LaserShape()->Update();
    const double scan_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - first).count() / kScans;
    fmt::print("Gazebo's own ray sensor with {} rays: {:.1f} us a scan\n", 2 * kSatellites, scan_s * 1e6);
  }

  // Every step is an update: 0.1 s, 10 Hz.
  constexpr unsigned kSteps = 400;
  const double without = measure(test::city_world(folder, 0.1, bare), kSteps);
  fmt::print("{}, {} satellites ({} rays), one update of a receiver:\n", city, kSatellites, 2 * kSatellites);
  double physics = 0;
  for (const auto& [engine, model] :
       {std::pair("physics", "mirror"), std::pair("embree", "mirror"), std::pair("embree", "specular")}) {
    const double with = measure(test::city_world(folder, 0.1, car(engine, model, 10)), kSteps);
    const double update_s = (with - without) / kSteps;
    if (physics == 0) physics = update_s;
    fmt::print(
        "  {:8} {:9} {:9.1f} us   {:6.1f} times cheaper than physics   {:.3f} % of real time at 10 Hz\n",
        engine, model, update_s * 1e6, physics / update_s, update_s * 10 * 100);
  }
  compare_rays();

  // Gazebo in normal operation: physics at 1 kHz, as fast as possible.
  constexpr unsigned kFine = 5000;
  const double plain = measure(test::city_world(folder, 0.001, bare), kFine);
  const double busy = measure(test::city_world(folder, 0.001, car("embree", "specular", 10)), kFine);
  fmt::print(
      "real-time factor, steps of 1 ms: {:.2f} without a receiver, {:.2f} with one (embree, specular, 10 "
      "Hz)\n",
      kFine * 1e-3 / plain, kFine * 1e-3 / busy);
  test::InProcessServer::get().unload();
  return 0;
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic

int main(int argc, char** argv) {
  const int status = canyon::adapters::gazebo_classic::run(argc > 1 ? argv[1] : "hongkong");
  std::fflush(nullptr);
  std::_Exit(status);  // Gazebo's statics are destroyed in a bad order
}
