#pragma once

#include <fcntl.h>
#include <linux/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace canyon::test {

/// A background program of the test, in its own folder, that ends with it.
class Companion {
 public:
  /// @param environment lines NAME=VALUE in addition to the test's own
  Companion(std::vector<std::string> command, const std::string& folder,
            const std::vector<std::string>& environment = {})
      : log_(folder + "/" + "companion.log"), process_(fork()) {
    if (process_ < 0) throw std::runtime_error("no process for " + command.front());
    if (process_ > 0) return;
    // NOLINTBEGIN(concurrency-mt-unsafe): nothing else runs in this copy of the test
    const int out = open(log_.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600), in = open("/dev/null", O_RDONLY);
    if (chdir(folder.c_str()) != 0 || out < 0 || in < 0) _exit(126);
    dup2(in, 0);
    dup2(out, 1);
    dup2(out, 2);
    for (const std::string& line : environment) {
      const std::size_t at = line.find('=');
      setenv(line.substr(0, at).c_str(), line.substr(at + 1).c_str(), 1);
    }
    // NOLINTEND(concurrency-mt-unsafe)
    std::vector<char*> words;
    for (std::string& word : command) words.push_back(word.data());
    words.push_back(nullptr);
    execvp(words.front(), words.data());
    _exit(127);
  }
  ~Companion() {
    kill(process_, SIGINT);
    for (int i = 0; i < 50 && running(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(100));
    if (!running()) return;
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
  }
  Companion(const Companion&) = delete;
  Companion& operator=(const Companion&) = delete;

  [[nodiscard]] bool running() {
    if (!ended_) ended_ = waitpid(process_, nullptr, WNOHANG) == process_;
    return !ended_;
  }
  /// The name of its output file.
  [[nodiscard]] const std::string& log() const { return log_; }

 private:
  std::string log_;
  pid_t process_;
  bool ended_ = false;
};

/// Moves this process and its children to a separate network, if permitted, so that ports do not collide with
/// other processes. Call it before starting threads. Returns whether it succeeded.
inline bool isolated_network() {
  if (unshare(CLONE_NEWNET) != 0 && unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  ifreq loopback{};
  std::snprintf(loopback.ifr_name, sizeof loopback.ifr_name, "lo");
  loopback.ifr_flags = IFF_UP | IFF_RUNNING;
  const bool up = fd >= 0 && ioctl(fd, SIOCSIFFLAGS, &loopback) == 0;
  if (fd >= 0) close(fd);
  return up;
}

}  // namespace canyon::test
