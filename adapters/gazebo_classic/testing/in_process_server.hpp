#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gazebo/gazebo.hh>
#include <gazebo/physics/physics.hh>
#include <gazebo/sensors/sensors.hh>
#include <map>
#include <regex>
#include <stdexcept>
#include <string>

#include "tests/support/free_port.hpp"
#include "tests/support/source_dir.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::adapters::gazebo_classic::test {

/// gzserver inside the test's own process, stepped manually: worlds are paused until step(). One per process.
class InProcessServer {
 public:
  static InProcessServer& get() {
    static InProcessServer server;
    return server;
  }
  InProcessServer(const InProcessServer&) = delete;
  InProcessServer& operator=(const InProcessServer&) = delete;

  /// Replaces the world by one from SDF text. If the previous world had the same name, it gets another one:
  /// messages of a world's end may arrive late with names of models of the new world.
  gazebo::physics::WorldPtr load(std::string sdf) {
    const std::regex named("(<world name=['\"])([^'\"]*)");
    if (std::smatch name; std::regex_search(sdf, name, named) && used_[name[2]]++ > 0) {
      const std::string another = name[2].str() + "_" + std::to_string(used_[name[2]]);
      sdf = name.prefix().str() + name[1].str() + another + name.suffix().str();
    }
    const std::filesystem::path file = folder_ / "test.world";
    std::ofstream(file) << sdf;
    return load_file(file);
  }
  gazebo::physics::WorldPtr load_file(const std::filesystem::path& file) {
    unload();
    world_ = gazebo::loadWorld(file.string());
    if (!world_) throw std::runtime_error("the world does not load");
    world_->SetPaused(true);
    gazebo::sensors::run_once(true);  // makes the world's sensors
    gazebo::physics::run_world(world_);
    return world_;
  }
  /// Ends the world: plugins are unloaded.
  void unload() {
    if (!world_) return;
    // It holds the world, and handles sensors of its first world only, so restart it.
    gazebo::sensors::SensorManager::Instance()->Fini();
    gazebo::physics::stop_world(world_);
    world_.reset();
    gazebo::physics::remove_worlds();
    gazebo::sensors::SensorManager::Instance()->Init();
  }
  /// Runs `iterations` of physics and all dependent work before it returns. Sensors are updated
  /// once afterwards.
  void step(unsigned iterations = 1) {
    world_->Step(iterations);
    gazebo::sensors::run_once();
  }

 private:
  InProcessServer() {
    const std::string master = "http://127.0.0.1:" + std::to_string(canyon::test::free_port());
    setenv("GAZEBO_MASTER_URI", master.c_str(), 1);
    setenv("GAZEBO_IP", "127.0.0.1", 1);
    setenv("GAZEBO_MODEL_DATABASE_URI", "", 1);
    setenv("GAZEBO_PLUGIN_PATH", (std::string(canyon_build_dir) + "/lib").c_str(), 1);
    gazebo::common::Console::SetQuiet(false);
    if (!gazebo::setupServer(std::vector<std::string>{})) throw std::runtime_error("no Gazebo server");
    // A stopping world signals all to stop, including the thread that delivers messages, which later worlds
    // need.
    for (int listener = 0; listener < 100; ++listener) gazebo::event::Events::stop.Disconnect(listener);
    is_up_ = true;
  }
  ~InProcessServer() = default;

  /// Ends the last world while the objects used by plugins still exist; destructors of statics are too late.
  /// Gazebo itself is not shut down: its shutdown destroys connections that a thread still reads, and
  /// sometimes crashes.
  struct End : testing::Environment {
    void TearDown() override {
      if (!is_up_) return;
      get().unload();
      on_exit(
          [](int status, void*) {
            std::fflush(nullptr);
            std::_Exit(status);
          },
          nullptr);
    }
  };
  static inline bool is_up_ = false;
  static inline testing::Environment* const end_ = testing::AddGlobalTestEnvironment(new End);

  canyon::test::TemporaryFolder folder_;
  std::map<std::string, int> used_;  // names of worlds
  gazebo::physics::WorldPtr world_;
};

}  // namespace canyon::adapters::gazebo_classic::test
