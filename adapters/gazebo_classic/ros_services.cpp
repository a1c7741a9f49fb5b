// Compiled as C++17: the generated class of a service has requests with std::allocator, on which its checksum
// depends (see adapters/ros/ros1_types.hpp).
#include "adapters/gazebo_classic/ros_services.hpp"

#include <canyon_msgs/FaultCommand.h>
#include <ros/advertise_service_options.h>
#include <ros/callback_queue.h>
#include <ros/service_server.h>
#include <ros/spinner.h>

#include <optional>

namespace canyon::adapters::gazebo_classic {
namespace {

using canyon_msgs::FaultCommand;

class Services final : public RosClient {
 public:
  explicit Services(std::vector<RosService> services) : services_(std::move(services)) {}

  bool connect(ros::NodeHandle& node) override {
    for (const RosService& service : services_) {
      // Its own queue and thread: needs no other spinner.
      auto options = ros::AdvertiseServiceOptions::create<FaultCommand>(
          service.name,
          [call = service.call](FaultCommand::Request& request, FaultCommand::Response& response) {
            const auto [success, message] = call(request.fault);
            response.success = static_cast<std::uint8_t>(success);
            response.message = message;
            return true;
          },
          ros::VoidConstPtr(), &queue_);
      servers_.push_back(node.advertiseService(options));
      if (servers_.back()) continue;
      servers_.clear();  // the master was lost
      return false;
    }
    spinner_.emplace(1, &queue_);
    spinner_->start();
    return true;
  }
  void disconnect() override {
    if (spinner_) spinner_->stop();
    spinner_.reset();
    for (ros::ServiceServer& server : servers_) server.shutdown();
    servers_.clear();
    queue_.clear();
  }

 private:
  const std::vector<RosService> services_;
  ros::CallbackQueue queue_;
  std::vector<ros::ServiceServer> servers_;
  std::optional<ros::AsyncSpinner> spinner_;
};

}  // namespace

std::shared_ptr<RosClient> make_ros_services(std::vector<RosService> services) {
  return std::make_shared<Services>(std::move(services));
}

}  // namespace canyon::adapters::gazebo_classic
