#include "adapters/gazebo_classic/ros_link.hpp"

#include <fmt/format.h>
#include <ros/init.h>
#include <ros/master.h>
#include <ros/this_node.h>
#include <ros/xmlrpc_manager.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <gazebo/common/Console.hh>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "adapters/gazebo_classic/ros_master.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using namespace std::chrono_literals;

constexpr auto kLookEvery = 2s;
constexpr auto kResponseTimeout = 1000ms;
constexpr auto kLeaveWithin = 2s;

/// The shutdown of a node and the start of its successor must not overlap. Never destroyed: a thread that
/// waits for its master may outlive static objects.
std::timed_mutex& ros_in_use() {
  static auto* mutex = new std::timed_mutex;
  return *mutex;
}

MasterAddress master_of_environment() {
  const char* uri = std::getenv("ROS_MASTER_URI");
  if (uri == nullptr || *uri == '\0') return {"localhost", 11311};  // roscore's default
  if (auto address = parse_master_uri(uri)) return *address;
  throw InputError(
      fmt::format("ROS_MASTER_URI is '{}', which is not the address of a ROS master", uri),
      "set it as http://HOST:PORT, or disable ROS with <publishers><ros>false</ros></publishers>");
}

void log(const std::string& message) {
  gzmsg << "[canyon] " << message << std::endl;
}

}  // namespace

struct RosLink::State {
  std::mutex mutex;
  std::condition_variable changed;
  bool stop = false;                                // members from here on are protected by `mutex`
  bool news = false;                                // a client joins or leaves
  bool ended = false;                               // the thread has left ROS
  std::vector<std::shared_ptr<RosClient>> joining;  // not connected yet
  std::vector<std::shared_ptr<RosClient>> leaving;
  std::set<std::string> claimed;

  MasterAddress master;
  int stop_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);

  // The thread's own state.
  std::optional<ros::NodeHandle> node;
  std::vector<std::shared_ptr<RosClient>> connected;
  bool warned_missing = false;
  bool lost = false;
  bool shut_down = false;

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    if (stop_fd >= 0) close(stop_fd);
  }

  void run() {
    std::unique_lock in_use(ros_in_use(), std::defer_lock);
    for (;;) {
      if (in_use.owns_lock() || in_use.try_lock_for(100ms)) find_topics();
      std::unique_lock lock(mutex);
      if (in_use.owns_lock()) changed.wait_for(lock, kLookEvery, [this] { return stop || news; });
      if (stop) break;
    }
    if (in_use.owns_lock()) leave();
  }

  void find_topics() {
    drop_leaving();
    if (shut_down) return;
    if (node && !ros::ok()) {  // rosnode kill, or gazebo_ros ended
      log("ROS was shut down; publishing on ROS has ended");
      shut_down = true;
      return;
    }
    const std::string name = node ? ros::this_node::getName() : "/gazebo_canyon";
    const MasterReply result = query_master(master, name, kResponseTimeout, stop_fd);
    {
      const std::lock_guard lock(mutex);
      if (stop) return;
    }
    if (result != MasterReply::None) {
      found(result);
    } else if (!node && !warned_missing) {
      log("no ROS master at " + master.uri() + "; topics are published when there is one");
      warned_missing = true;
    } else if (node && !lost) {
      log("the ROS master at " + master.uri() + "is lost; topics return with it");
      lost = true;
    }
  }

  void found(MasterReply result) {
    if (!node) {
      node.emplace();
      log("publishing on ROS, master " + master.uri() + ", as node " + ros::this_node::getName());
    } else if (result == MasterReply::Unknown && !connected.empty()) {
      notify_new_master();
    }
    lost = false;
    connect_joining();
  }

  void connect_joining() {
    std::vector<std::shared_ptr<RosClient>> clients;
    {
      const std::lock_guard lock(mutex);
      clients.swap(joining);
    }
    for (const std::shared_ptr<RosClient>& client : clients) {
      bool is_connected = false;
      try {
        is_connected = client->connect(*node);
      } catch (const std::exception& e) {  // two types on one topic, for example
        gzerr << "[canyon] ROS: " << e.what() << std::endl;
        continue;
      }
      if (is_connected) {
        connected.push_back(client);
      } else {
        const std::lock_guard lock(mutex);
        joining.push_back(client);  // until the next check
      }
    }
  }

  void drop_leaving() {
    std::vector<std::shared_ptr<RosClient>> clients;
    {
      const std::lock_guard lock(mutex);
      news = false;
      clients.swap(leaving);
      for (const auto& client : clients)
        joining.erase(std::remove(joining.begin(), joining.end(), client), joining.end());
    }
    for (const auto& client : clients) {
      connected.erase(std::remove(connected.begin(), connected.end(), client), connected.end());
      client->disconnect();
    }
  }

  void notify_new_master() {
    for (const std::shared_ptr<RosClient>& client : connected) {
      const auto topics = client->advertised();
      for (const auto& [topic, type] : topics) {
        XmlRpc::XmlRpcValue request, result, payload;
        request[0] = ros::this_node::getName();
        request[1] = topic;
        request[2] = type;
        request[3] = ros::XMLRPCManager::instance()->getServerURI();
        if (!ros::master::execute("registerPublisher", request, result, payload, false)) return;
      }
      if (!topics.empty()) continue;
      client->disconnect();
      client->connect(*node);
    }
    log("the ROS master restarted; topics are registered again");
  }

  void leave() {
    drop_leaving();
    for (const auto& client : connected) client->disconnect();
    connected.clear();
    node.reset();  // the last handle shuts the node down
  }
};

RosLink::RosLink(std::shared_ptr<State> state) : state_(std::move(state)) {
  std::thread([s = state_] {
    try {
      s->run();
    } catch (const std::exception& e) {
      gzerr << "[canyon] ROS ended: " << e.what() << std::endl;
    }
    const std::lock_guard lock(s->mutex);
    s->ended = true;
    s->changed.notify_all();
  }).detach();
}

RosLink::~RosLink() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->stop = true;
    state_->changed.notify_all();
  }
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = write(state_->stop_fd, &one, sizeof one);
  std::unique_lock lock(state_->mutex);
  state_->changed.wait_for(lock, kLeaveWithin, [this] { return state_->ended; });
}

std::shared_ptr<RosLink> RosLink::get() {
  static std::mutex mutex;
  static std::weak_ptr<RosLink> existing;
  const std::lock_guard lock(mutex);
  if (auto link = existing.lock()) return link;
  auto state = std::make_shared<State>();
  if (ros::isInitialized()) {
    state->master = {ros::master::getHost(), static_cast<std::uint16_t>(ros::master::getPort())};
  } else {
    state->master = master_of_environment();
    // roscpp ends the process if it finds no address. No network access here.
    ros::init(ros::M_string{{"__master", state->master.uri()}}, "gazebo_canyon",
              ros::init_options::NoSigintHandler | ros::init_options::AnonymousName);
    ros::master::setRetryTimeout(ros::WallDuration(2));  // a master lost between query and registration
  }
  const std::shared_ptr<RosLink> link(new RosLink(std::move(state)));
  existing = link;
  return link;
}

void RosLink::add(std::shared_ptr<RosClient> client) {
  const std::lock_guard lock(state_->mutex);
  state_->joining.push_back(std::move(client));
  state_->news = true;
  state_->changed.notify_all();
}

void RosLink::remove(const std::shared_ptr<RosClient>& client) {
  const std::lock_guard lock(state_->mutex);
  state_->leaving.push_back(client);
  state_->news = true;
  state_->changed.notify_all();
}

std::string RosLink::claim(const std::vector<std::string>& topics) {
  const std::lock_guard lock(state_->mutex);
  for (const std::string& topic : topics)
    if (state_->claimed.count(topic) != 0) return topic;
  state_->claimed.insert(topics.begin(), topics.end());
  return {};
}

void RosLink::release(const std::vector<std::string>& topics) {
  const std::lock_guard lock(state_->mutex);
  for (const std::string& topic : topics) state_->claimed.erase(topic);
}

}  // namespace canyon::adapters::gazebo_classic
