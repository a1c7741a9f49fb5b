// The requests to the graphical client, received by a mock.
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <gz/msgs/boolean.pb.h>
#include <gz/msgs/marker_v.pb.h>

#include <map>
#include <memory>
#include <mutex>
#include <thread>

#include "adapters/gz_sim/testing/sim_server.hpp"
#include "adapters/gz_sim/testing/street_world.hpp"

namespace canyon::adapters::gz_sim {
namespace {

using gz::msgs::Marker;
using test::SimServer;

/// A scene that stores its markers, like gz-sim's MarkerManager.
class Window {
 public:
  Window() {
    std::function<bool(const gz::msgs::Marker_V&, gz::msgs::Boolean&)> draw =
        [scene = scene_](const gz::msgs::Marker_V& request, gz::msgs::Boolean& reply) {
          const std::lock_guard lock(scene->mutex);
          for (const Marker& marker : request.marker()) {
            if (marker.action() == Marker::ADD_MODIFY) {
              Marker& kept = scene->markers[marker.id()];
              kept.MergeFrom(marker);
              scene->space = marker.ns();
            } else if (marker.action() == Marker::DELETE_MARKER) {
              scene->markers.erase(marker.id());
            } else {
              scene->markers.clear();
            }
          }
          reply.set_data(true);
          return true;
        };
    if (!node_.Advertise("/marker_array", draw)) throw std::runtime_error("no service");
  }
  std::map<std::uint64_t, Marker> markers() const {
    const std::lock_guard lock(scene_->mutex);
    return scene_->markers;
  }
  std::string space() const {
    const std::lock_guard lock(scene_->mutex);
    return scene_->space;
  }

 private:
  struct Scene {
    std::mutex mutex;
    std::map<std::uint64_t, Marker> markers;
    std::string space;
  };
  std::shared_ptr<Scene> scene_ = std::make_shared<Scene>();
  gz::transport::Node node_;
};

TEST(Markers, ShowRaysAndBubbleToAWindow) {
  const std::string visuals =
      "<propagation><model>specular</model></propagation>"
      "<visuals><rays>true</rays><bubble>true</bubble></visuals>";
  SimServer::prepare();
  Window window;
  auto server = std::make_unique<SimServer>(
      test::street_world(test::street_car(test::navsat(test::paper_elements() + visuals))));
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (window.markers().empty() && std::chrono::steady_clock::now() < deadline) {
    server->step(10);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  const auto markers = window.markers();
  EXPECT_EQ(window.space(), "canyon/car::body/antenna");
  // Each of the street's eight satellites (test::street_satellites()) has at least one ray.
  int rays = 0, balls = 0, at_antenna = 0;
  for (const auto& [id, marker] : markers) {
    EXPECT_GT(marker.scale().x(), 0);
    EXPECT_GT(marker.material().diffuse().a(), 0) << "a new marker comes with its colour";
    if (marker.type() == Marker::CYLINDER) {
      ++rays;
      // Whether an end of it is the antenna's position in the world.
      const auto &p = marker.pose().position(), &s = marker.scale();
      const auto& q = marker.pose().orientation();
      const gz::math::Vector3d axis =
          gz::math::Quaterniond(q.w(), q.x(), q.y(), q.z()).RotateVector({0, 0, s.z() / 2});
      const gz::math::Vector3d middle(p.x(), p.y(), p.z()), antenna(3, 0, 2);
      at_antenna += (middle - axis).Distance(antenna) < 1e-3 || (middle + axis).Distance(antenna) < 1e-3;
    } else if (marker.type() == Marker::SPHERE) {
      ++balls;
    }
  }
  EXPECT_GE(rays, 8);
  EXPECT_GE(at_antenna, 5);
  EXPECT_GE(balls, 2) << "the bubble, and ends of rays";
  server.reset();
  while (!window.markers().empty() && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_TRUE(window.markers().empty()) << "nothing of a world that has ended stays";
}

}  // namespace
}  // namespace canyon::adapters::gz_sim
