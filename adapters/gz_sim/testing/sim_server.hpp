#pragma once

#include <unistd.h>

#include <cstdlib>
#include <functional>
#include <gz/common/Console.hh>
#include <gz/sim/Server.hh>
#include <gz/sim/ServerConfig.hh>
#include <gz/sim/System.hh>
#include <gz/transport/Node.hh>
#include <memory>
#include <stdexcept>
#include <string>

#include "adapters/common/testing/gnss_log.hpp"
#include "tests/support/source_dir.hpp"

namespace canyon::adapters::gz_sim::test {

/// Functions with which a test changes and reads a world in every step.
class Hands final : public gz::sim::System,
                    public gz::sim::ISystemPreUpdate,
                    public gz::sim::ISystemPostUpdate {
 public:
  using Ecm = gz::sim::EntityComponentManager;
  std::function<void(Ecm&)> next;         ///< called once, in the next step's PreUpdate
  std::function<void(const Ecm&)> watch;  ///< in every step's PostUpdate

  void PreUpdate(const gz::sim::UpdateInfo& info, Ecm& ecm) override {
    sim_time = info.simTime;
    if (next) std::exchange(next, nullptr)(ecm);
  }
  void PostUpdate(const gz::sim::UpdateInfo&, const Ecm& ecm) override {
    if (watch) watch(ecm);
  }
  std::chrono::steady_clock::duration sim_time{};
};

/// A headless Gazebo Sim server in the test's process, stepped manually, with its own transport partition.
class SimServer {
 public:
  explicit SimServer(const std::string& sdf)
      : SimServer([&] {
          gz::sim::ServerConfig config;
          config.SetSdfString(sdf);
          return config;
        }()) {}
  explicit SimServer(const gz::sim::ServerConfig& config) {
    prepare();
    server_ = std::make_unique<gz::sim::Server>(config);
    if (!server_->AddSystem(hands).value_or(false)) throw std::runtime_error("the world does not load");
  }
  /// Call it before the process uses gz-transport.
  static void prepare() {
    setenv("GZ_PARTITION", ("canyon_test_" + std::to_string(getpid())).c_str(), 1);
    setenv("GZ_IP", "127.0.0.1", 1);
    setenv("GZ_SIM_SYSTEM_PLUGIN_PATH", (std::string(canyon_build_dir) + "/lib").c_str(), 1);
    gz::common::Console::SetVerbosity(2);
  }

  void step(unsigned iterations = 1) { server_->Run(true, iterations, false); }
  void step_paused() { server_->RunOnce(true); }
  gz::sim::Server& server() { return *server_; }
  const std::shared_ptr<Hands> hands = std::make_shared<Hands>();

 private:
  std::unique_ptr<gz::sim::Server> server_;
};

/// Stores the messages that a receiver publishes on Gazebo transport.
class GnssListener {
 public:
  explicit GnssListener(const std::string& topic) {
    // A call may still be in progress when the node has ended.
    std::function<void(const msgs::GnssReceiver&)> take = [log = log_](const msgs::GnssReceiver& message) {
      log->add(message);
    };
    if (!node_.Subscribe(topic, take)) throw std::runtime_error("no topic " + topic);
  }
  std::optional<msgs::GnssReceiver> at(double sim_time_s,
                                       std::chrono::seconds deadline = std::chrono::seconds(10)) {
    return log_->at(sim_time_s, deadline);
  }
  std::vector<msgs::GnssReceiver> all() { return log_->all(); }
  void clear() { log_->clear(); }

 private:
  std::shared_ptr<canyon::test::GnssLog> log_ = std::make_shared<canyon::test::GnssLog>();
  gz::transport::Node node_;
};

}  // namespace canyon::adapters::gz_sim::test
