#include <fmt/format.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <optional>
#include <system_error>

#include "canyon/base/input_error.hpp"
#include "canyon/base/transport/devices.hpp"

namespace canyon::transport {
namespace {

/// A terminal device: the common part that sends, buffers and receives.
class Terminal : public BufferedTransport {
 public:
  void send(std::string_view bytes) override {
    if (!device_.is_open()) return;
    if (line_ && backlog_.size() + bytes.size() > line_->buffer()) {
      if (!std::exchange(is_after_, true))
        notes_.push_back(fmt::format("{} baud are too slow: messages are dropped", line_->baud));
      return serve();
    }
    if (backlog_.size() + bytes.size() > kMaxBacklog) {
      if (!std::exchange(is_after_, true)) notes_.emplace_back("no program reads: bytes are dropped");
      backlog_.clear();
    }
    backlog_ += bytes;
    serve();
  }
  void serve() override {
    if (!device_.is_open()) return;
    if (listen(device_, 0, received_) != Line::Open || !drain()) {
      backlog_.clear();
      lost();
    }
    if (backlog_.empty()) is_after_ = false;
  }
  void add_handles(std::vector<int>& handles) const override {
    if (device_.is_open())
      handles.push_back(const_cast<asio::posix::stream_descriptor&>(device_).native_handle());
  }
  void finish(const std::optional<Correction>&) override {
    if (!device_.is_open()) return;
    const Clock::time_point end = Clock::now() + kPatience;
    while (!backlog_.empty() && Clock::now() < std::min(end, patience_ends(end))) {
      constexpr int kNap_ms = 10;
      pollfd wait{device_.native_handle(), POLLOUT, 0};
      if (line_ || poll(&wait, 1, kNap_ms) == 0) poll(nullptr, 0, kNap_ms);
      if (!drain()) break;
    }
    device_.close();
  }

 protected:
  using Clock = std::chrono::steady_clock;
  /// Ten bits per byte. Bytes that do not fit into its buffer are dropped, as in receivers.
  struct PacedLine {
    int baud;
    double due = 0;  ///< bytes that may be sent now
    Clock::time_point at = Clock::now();

    [[nodiscard]] std::size_t buffer() const { return static_cast<std::size_t>(std::max(4096, baud / 10)); }
    std::size_t take_due() {
      constexpr double kBurst_s = 0.1;
      const auto now = Clock::now();
      const double rate = baud / 10.0;
      due = std::min(due + rate * std::chrono::duration<double>(now - std::exchange(at, now)).count(),
                     std::max(1.0, rate * kBurst_s));
      return static_cast<std::size_t>(due);
    }
  };

  /// Called if the device has ended or failed.
  virtual void lost() {}
  /// The time until which the end of a run waits for a reader. @param latest upper limit
  [[nodiscard]] virtual Clock::time_point patience_ends(Clock::time_point latest) const { return latest; }

  std::optional<PacedLine> line_;             ///< empty: no limit
  Clock::time_point read_at_ = Clock::now();  ///< time of the last bytes read, or of an empty backlog
  asio::io_context io_;
  asio::posix::stream_descriptor device_{io_};
  std::string backlog_;

 private:
  /// Sends as much of the backlog as possible now; false if the device is gone.
  bool drain() {
    const std::size_t before = backlog_.size();
    std::string later;
    if (line_) later = backlog_.substr(std::min(before, line_->take_due()));
    backlog_.resize(before - later.size());
    const bool open = flush(device_, backlog_);
    backlog_ += later;
    if (line_) line_->due -= static_cast<double>(before - backlog_.size());
    if (backlog_.empty() || backlog_.size() < before) read_at_ = Clock::now();
    return open;
  }

  bool is_after_ = false;  ///< logged already
};

class PseudoTerminal final : public Terminal {
 public:
  PseudoTerminal(const std::string& link, std::optional<int> baud) {
    if (baud) line_ = PacedLine{*baud};
    const int master = posix_openpt(O_RDWR | O_NOCTTY);
    std::array<char, 256> name{};
    if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0 ||
        ptsname_r(master, name.data(), name.size()) != 0) {
      const error_code error(errno, asio::error::get_system_category());
      if (master >= 0) close(master);
      throw InputError("cannot open a pseudo-terminal: " + error.message());
    }
    device_.assign(master);
    claim_terminal(device_);
    // Both ends stay open, so that readers may come and go; raw mode, so that bytes pass unchanged.
    other_end_.assign(open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC));
    termios settings{};
    tcgetattr(other_end_.native_handle(), &settings);
    cfmakeraw(&settings);
    settings.c_oflag = kUnchangedOutput;
    tcsetattr(other_end_.native_handle(), TCSANOW, &settings);
    notes_.push_back(fmt::format("the pseudo-terminal is {}", name.data()));
    if (!link.empty()) make_link(link, name.data());
  }
  ~PseudoTerminal() override {
    std::error_code ignored;
    if (!link_.empty()) std::filesystem::remove(link_, ignored);
  }
  void set_baud(int baud) override {
    if (line_ && baud > 0) line_->baud = baud;
  }
  void serve() override {
    accept_settings();
    Terminal::serve();
  }
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;

 private:
  /// Output processing is on without any conversion: bytes pass unchanged.
  static constexpr tcflag_t kUnchangedOutput = OPOST;

  /// A pseudo-terminal has no receiver to switch off, 5 to 7 bits or parity. The C library reports a request
  /// for them as an error (EINVAL), unless another setting changes too. PX4's drivers clear the receiver flag
  /// (CREAD) and abandon the device on an error. They also clear output processing; this is therefore the
  /// setting that changes: it is set again whenever they reopen the device.
  void accept_settings() {
    termios settings{};
    const int end = other_end_.native_handle();
    if (tcgetattr(end, &settings) != 0 || settings.c_oflag == kUnchangedOutput) return;
    if ((settings.c_oflag & OPOST) != 0) return;  // a program that wants its output processed
    settings.c_oflag = kUnchangedOutput;
    tcsetattr(end, TCSANOW, &settings);
  }

  /// Replaces a link left by an earlier run; any other file stays.
  void make_link(const std::filesystem::path& link, const char* name) {
    std::error_code error;
    if (std::filesystem::is_symlink(link, error)) std::filesystem::remove(link, error);
    std::filesystem::create_symlink(name, link, error);
    if (error) {
      throw InputError(
          fmt::format("'{}' cannot be made a link to {}: {}", link.string(), name, error.message()),
          "give an unused name in a writable folder");
    }
    link_ = link;
  }

  /// A terminal without a reader stays full.
  [[nodiscard]] Clock::time_point patience_ends(Clock::time_point) const override {
    return read_at_ + std::chrono::milliseconds(500);
  }

  asio::posix::stream_descriptor other_end_{io_};
  std::filesystem::path link_;
};

class SerialPort final : public Terminal {
 public:
  SerialPort(std::string device, int baud) : name_(std::move(device)), baud_(baud) {
    const error_code error = open_port();
    if (error) {
      throw InputError(
          fmt::format("the serial port '{}' cannot be opened at {} baud: {}", name_, baud, error.message()),
          "check its name, your permissions (group dialout) and the baud rate");
    }
  }
  void serve() override {
    if (!device_.is_open() && Clock::now() >= next_try_) {
      next_try_ = Clock::now() + kRetry;
      if (!open_port()) notes_.push_back(fmt::format("'{}' is back", name_));
    }
    Terminal::serve();
  }
  void set_baud(int baud) override {
    if (baud < 1 || baud == baud_) return;
    if (device_.is_open()) tcdrain(device_.native_handle());
    const int before = std::exchange(baud_, baud);
    device_.close();
    if (!open_port()) return;
    notes_.push_back(fmt::format("'{}' does not support {} baud: it stays at {}", name_, baud, before));
    baud_ = before;
    (void)open_port();
  }

 private:
  error_code open_port() {
    asio::serial_port port(io_);
    error_code error;
    port.open(name_, error);
    if (!error) port.set_option(asio::serial_port::baud_rate(static_cast<unsigned>(baud_)), error);
    if (error) return error;
    // Asio's serial ports have only blocking calls.
    device_.assign(fcntl(port.native_handle(), F_DUPFD_CLOEXEC, 0));
    claim_terminal(device_);
    return error;
  }
  void lost() override {
    device_.close();
    next_try_ = Clock::now() + kRetry;
    notes_.push_back(fmt::format("'{}' is gone: retrying every second", name_));
  }

  std::string name_;
  int baud_;
  Clock::time_point next_try_;
};

/// Reads only available input: a non-blocking standard input would make the shell's terminal non-blocking.
class StandardInput final : public BufferedTransport {
 public:
  void send(std::string_view) override {}
  void serve() override {
    // The buffer is small: with stamps, all epochs of a piece are computed before other links are served.
    std::array<char, 4096> buffer;
    pollfd wait{STDIN_FILENO, POLLIN, 0};
    if (ended_ || poll(&wait, 1, 0) != 1) return;
    const ssize_t size = read(STDIN_FILENO, buffer.data(), buffer.size());
    if (size > 0) received_.add(0, {buffer.data(), static_cast<std::size_t>(size)});
    if (size == 0 || (size < 0 && errno != EINTR && errno != EAGAIN)) ended_ = true;
  }
  void add_handles(std::vector<int>& handles) const override {
    if (!ended_) handles.push_back(STDIN_FILENO);
  }
  [[nodiscard]] bool ended() const override { return ended_; }

 private:
  bool ended_ = false;
};

}  // namespace

std::unique_ptr<Transport> make_pseudo_terminal(const std::string& link, std::optional<int> baud) {
  return std::make_unique<PseudoTerminal>(link, baud);
}
std::unique_ptr<Transport> make_serial(const std::string& device, int baud) {
  return std::make_unique<SerialPort>(device, baud);
}
std::unique_ptr<Transport> make_standard_input() {
  return std::make_unique<StandardInput>();
}

}  // namespace canyon::transport
