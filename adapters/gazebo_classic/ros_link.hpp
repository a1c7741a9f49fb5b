#pragma once

#include <ros/node_handle.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace canyon::adapters::gazebo_classic {

/// Something that publishes or subscribes. Every function is called from the link's thread, where it may wait
/// for a master.
class RosClient {
 public:
  virtual ~RosClient() = default;
  /// Called when ROS runs and its master answers. Returns false where it failed and must be called again.
  virtual bool connect(ros::NodeHandle& node) = 0;
  /// Topics advertised, each with its type: a master that begins anew receives them, and subscribers that
  /// are connected stay so. A client without any is then disconnected, and connected again.
  [[nodiscard]] virtual std::vector<std::pair<std::string, std::string>> advertised() const { return {}; }
  /// Ends what connect() began; called where that never was, too.
  virtual void disconnect() = 0;
};

/// This process and ROS: one for all receivers. A thread of its own looks for the master every 2 s, so that
/// nobody else ever waits for one; it says once that there is none and once that it has come. Where ROS runs
/// in this process already (gazebo_ros) that node is used, else one named gazebo_canyon_... is made, without
/// handlers for signals. Ends when nobody holds it.
class RosLink {
 public:
  /// Waits for nothing. Throws InputError where ROS_MASTER_URI is not an address.
  [[nodiscard]] static std::shared_ptr<RosLink> get();
  /// Waits at most 2 s for the thread to take leave of ROS; a master that hangs is left behind.
  ~RosLink();
  RosLink(const RosLink&) = delete;
  RosLink& operator=(const RosLink&) = delete;

  /// Returns at once; the client connects as soon as there is a master.
  void add(std::shared_ptr<RosClient> client);
  /// Returns at once; the thread disconnects and drops the client.
  void remove(const std::shared_ptr<RosClient>& client);

  /// Takes topic names for one receiver of this process: all or, where another has one of them, none. The
  /// name that is taken, or "".
  [[nodiscard]] std::string claim(const std::vector<std::string>& topics);
  void release(const std::vector<std::string>& topics);

 private:
  struct State;
  explicit RosLink(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

}  // namespace canyon::adapters::gazebo_classic
