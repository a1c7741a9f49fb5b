#pragma once

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include "adapters/gazebo_classic/ros_master.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::adapters::gazebo_classic::test {

/// Whether `condition` comes true within the time; asks every 10 ms.
template <class Condition>
bool eventually(const Condition& condition, std::chrono::seconds within = std::chrono::seconds(30)) {
  const auto deadline = std::chrono::steady_clock::now() + within;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    poll(nullptr, 0, 10);
  }
  return true;
}

/// A program of this test: interrupted and waited for when it goes out of scope, and when the test dies.
class ChildProgram {
 public:
  ChildProgram(const std::vector<std::string>& words, const std::filesystem::path& log) {
    std::vector<char*> arguments;
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    const int out = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    pid_ = fork();
    if (pid_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGINT);
      dup2(out, STDOUT_FILENO);
      dup2(out, STDERR_FILENO);
      execvp(arguments[0], arguments.data());
      _exit(127);
    }
    if (out >= 0) close(out);
    if (pid_ < 0) throw std::runtime_error("cannot start " + words.front());
  }
  ~ChildProgram() { interrupt(); }
  ChildProgram(const ChildProgram&) = delete;
  ChildProgram& operator=(const ChildProgram&) = delete;

  /// Once it ended: its exit status; -1 where a signal ended it.
  [[nodiscard]] int exit_status() const { return WIFEXITED(status_) ? WEXITSTATUS(status_) : -1; }
  [[nodiscard]] bool ended() {
    if (pid_ > 0 && waitpid(pid_, &status_, WNOHANG) == pid_) pid_ = -1;
    return pid_ <= 0;
  }
  void signal(int number) const {
    if (pid_ > 0) kill(pid_, number);
  }
  /// Ctrl-C, and by force after 20 s.
  void interrupt() {
    if (ended()) return;
    kill(pid_, SIGINT);
    if (eventually([this] { return ended(); }, std::chrono::seconds(20))) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, &status_, 0);
    pid_ = -1;
  }

 private:
  pid_t pid_ = -1;
  int status_ = 0;
};

/// Where this process finds ROS: a master's address where nothing runs yet, logs in a folder of its own, and
/// Canyon's messages for the tools. One per process, as roscpp knows one master.
class RosEnvironment {
 public:
  static RosEnvironment& get() {
    static RosEnvironment environment;
    return environment;
  }
  [[nodiscard]] const MasterAddress& master() const { return master_; }
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_.path(); }
  [[nodiscard]] bool has_master() const {
    return ask_master(master_, "/test", std::chrono::milliseconds(500)) != MasterAnswer::None;
  }

 private:
  RosEnvironment() : master_{"127.0.0.1", static_cast<std::uint16_t>(canyon::test::free_port())} {
    const std::string prefix = CANYON_ROS_PREFIX;
    setenv("ROS_MASTER_URI", master_.uri().c_str(), 1);
    setenv("ROS_IP", "127.0.0.1", 1);
    setenv("ROS_HOME", folder_.path().c_str(), 1);
    setenv("PYTHONPATH", (prefix + "/lib/python3/dist-packages").c_str(), 1);
    setenv("ROS_PACKAGE_PATH", (prefix + "/share:/usr/share").c_str(), 1);
    setenv("PYTHONWARNINGS", "ignore", 1);
  }
  canyon::test::TemporaryFolder folder_;
  MasterAddress master_;
};

/// A roscore on RosEnvironment's address, there when it is constructed.
class RosCore {
 public:
  RosCore()
      : program_({"roscore", "-p", std::to_string(RosEnvironment::get().master().port)},
                 RosEnvironment::get().folder() / "roscore.log") {
    if (!eventually([] { return RosEnvironment::get().has_master(); })) {
      throw std::runtime_error("no roscore: " +
                               canyon::test::read_bytes(RosEnvironment::get().folder() / "roscore.log"));
    }
  }

 private:
  ChildProgram program_;
};

}  // namespace canyon::adapters::gazebo_classic::test
