#pragma once

#include <sys/resource.h>

#include <csignal>
#include <stdexcept>

namespace canyon::test {

/// During its lifetime no file of this process grows beyond `bytes`. Simulates a full disk: both fail in
/// write(2).
class SmallDisk {
 public:
  explicit SmallDisk(std::size_t bytes) {
    if (getrlimit(RLIMIT_FSIZE, &before_) != 0) throw std::runtime_error("no limit of file sizes here");
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
    rlimit small = before_;
    small.rlim_cur = bytes;
    if (setrlimit(RLIMIT_FSIZE, &small) != 0) throw std::runtime_error("file sizes cannot be limited");
  }
  ~SmallDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int) = nullptr;
};

}  // namespace canyon::test
