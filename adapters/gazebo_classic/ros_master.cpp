#include "adapters/gazebo_classic/ros_master.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <memory>
#include <string_view>
#include <utility>

#include "canyon/base/text.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using Clock = std::chrono::steady_clock;

class Socket {
 public:
  explicit Socket(const addrinfo& address)
      : fd_(socket(address.ai_family, address.ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC,
                   address.ai_protocol)) {}
  ~Socket() {
    if (fd_ >= 0) close(fd_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  [[nodiscard]] int fd() const { return fd_; }

 private:
  int fd_;
};

/// Waits until the socket is ready for `events`; false at the deadline or where the caller shall stop.
bool wait_for(int fd, short events, Clock::time_point deadline, int stop_fd) {
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0) return false;
    std::array<pollfd, 2> polled{{{fd, events, 0}, {stop_fd, POLLIN, 0}}};
    const int ready = poll(polled.data(), polled.size(), static_cast<int>(left));
    if (ready < 0 && errno != EINTR) return false;
    if (ready > 0 && polled[1].revents != 0) return false;
    if (ready > 0 && polled[0].revents != 0) return true;
  }
}

std::string exchange(int fd, const addrinfo& address, std::string_view request, Clock::time_point deadline,
                     int stop_fd) {
  if (connect(fd, address.ai_addr, address.ai_addrlen) != 0) {
    if (errno != EINPROGRESS || !wait_for(fd, POLLOUT, deadline, stop_fd)) return {};
    int error = 0;
    socklen_t size = sizeof error;
    if (getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size) != 0 || error != 0) return {};
  }
  while (!request.empty()) {
    const ssize_t sent = send(fd, request.data(), request.size(), MSG_NOSIGNAL);
    if (sent > 0) {
      request.remove_prefix(static_cast<std::size_t>(sent));
    } else if (errno != EAGAIN || !wait_for(fd, POLLOUT, deadline, stop_fd)) {
      return {};
    }
  }
  constexpr std::size_t kLongest = 1 << 16;  // a master's answer has some hundred bytes
  std::string answer;
  while (answer.size() < kLongest && wait_for(fd, POLLIN, deadline, stop_fd)) {
    std::array<char, 2048> buffer{};
    const ssize_t count = recv(fd, buffer.data(), buffer.size(), 0);
    if (count > 0) {
      answer.append(buffer.data(), static_cast<std::size_t>(count));
      if (answer.find("</methodResponse>") != std::string::npos) return answer;
    } else if (count == 0 || errno != EAGAIN) {
      return {};
    }
  }
  return {};
}

/// The answer is [code, message, value]; code 1 is success, 0 and -1 are not.
MasterAnswer parse_answer(const std::string& answer) {
  if (answer.empty()) return MasterAnswer::None;
  for (const std::string_view tag : {"<int>", "<i4>"}) {
    const std::size_t begin = answer.find(tag);
    if (begin == std::string::npos) continue;
    const std::string_view rest = std::string_view(answer).substr(begin + tag.size());
    return trim(rest.substr(0, rest.find('<'))) == "1" ? MasterAnswer::Known : MasterAnswer::Unknown;
  }
  return MasterAnswer::None;
}

MasterAnswer ask(const MasterAddress& master, const std::string& node, std::chrono::milliseconds timeout,
                 int stop_fd) {
  const std::string body =
      "<?xml version=\"1.0\"?><methodCall><methodName>lookupNode</methodName><params><param><value><string>" +
      node + "</string></value></param><param><value><string>" + node +
      "</string></value></param></params></methodCall>";
  const std::string request = "POST / HTTP/1.0\r\nHost: " + master.host +
                              "\r\nContent-Type: text/xml\r\nContent-Length: " + std::to_string(body.size()) +
                              "\r\n\r\n" + body;
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(master.host.c_str(), std::to_string(master.port).c_str(), &hints, &found) != 0)
    return MasterAnswer::None;
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> addresses(found, freeaddrinfo);
  const Clock::time_point deadline = Clock::now() + timeout;
  for (const addrinfo* address = found; address != nullptr; address = address->ai_next) {
    const Socket socket(*address);
    if (socket.fd() < 0) continue;
    const MasterAnswer answer = parse_answer(exchange(socket.fd(), *address, request, deadline, stop_fd));
    if (answer != MasterAnswer::None) return answer;
  }
  return MasterAnswer::None;
}

}  // namespace

std::string MasterAddress::uri() const {
  return "http://" + host + ':' + std::to_string(port) + '/';
}

std::optional<MasterAddress> parse_master_uri(const std::string& uri) {
  constexpr std::string_view kScheme = "http://";
  std::string_view rest = uri;
  if (rest.substr(0, kScheme.size()) != kScheme) return std::nullopt;
  rest.remove_prefix(kScheme.size());
  if (!rest.empty() && rest.back() == '/') rest.remove_suffix(1);
  const std::size_t colon = rest.find(':');
  if (colon == 0 || colon == std::string_view::npos) return std::nullopt;
  const std::string_view host = rest.substr(0, colon);
  if (host.find_first_of("/ \t\r\n<>") != std::string_view::npos) return std::nullopt;
  const auto port = parse_integer(rest.substr(colon + 1));
  if (!port || *port < 1 || *port > 65535) return std::nullopt;
  return MasterAddress{std::string(host), static_cast<std::uint16_t>(*port)};
}

MasterAnswer ask_master(const MasterAddress& master, const std::string& node,
                        std::chrono::milliseconds timeout, int stop_fd) noexcept {
  try {
    return ask(master, node, timeout, stop_fd);
  } catch (...) {  // out of memory
    return MasterAnswer::None;
  }
}

}  // namespace canyon::adapters::gazebo_classic
