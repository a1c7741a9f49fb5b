#pragma once

#include <ros/node_handle.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace canyon::adapters::gazebo_classic {

/// A client that publishes or subscribes. Called from the link's thread, where it may wait for a master.
class RosClient {
 public:
  virtual ~RosClient() = default;
  /// Called when ROS runs and its master responds. Returns false to be called again after a failure.
  virtual bool connect(ros::NodeHandle& node) = 0;
  /// Advertised topics, each with its type: they are registered again at a restarted master, and connected
  /// subscribers stay connected. A client without topics is disconnected and connected again.
  [[nodiscard]] virtual std::vector<std::pair<std::string, std::string>> advertised() const { return {}; }
  /// Undoes connect(); also called without a connect().
  virtual void disconnect() = 0;
};

/// This process and ROS: one for all receivers. Its own thread searches for the master every 2 s, so that no
/// other thread waits for one; it logs once that there is none and once that it was found. If ROS already
/// runs in this process (gazebo_ros), uses that node, else makes one named gazebo_canyon_..., without signal
/// handlers. Ends with its last owner.
class RosLink {
 public:
  /// Waits for nothing. Throws InputError if ROS_MASTER_URI is not an address.
  [[nodiscard]] static std::shared_ptr<RosLink> get();
  /// Waits at most 2 s for the thread to unregister from ROS; abandons a hanging master.
  ~RosLink();
  RosLink(const RosLink&) = delete;
  RosLink& operator=(const RosLink&) = delete;

  /// Returns at once; the client connects when there is a master.
  void add(std::shared_ptr<RosClient> client);
  /// Returns at once; the thread disconnects and removes the client.
  void remove(const std::shared_ptr<RosClient>& client);

  /// Reserves topic names for one receiver of this process: all or, if another has one of them, none. Returns
  /// a name that is in use, or "".
  [[nodiscard]] std::string claim(const std::vector<std::string>& topics);
  void release(const std::vector<std::string>& topics);

 private:
  struct State;
  explicit RosLink(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

}  // namespace canyon::adapters::gazebo_classic
