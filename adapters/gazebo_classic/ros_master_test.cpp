#include "adapters/gazebo_classic/ros_master.hpp"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <thread>

#include "adapters/gazebo_classic/testing/ros_core.hpp"
#include "tests/support/program.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// Listens on its own port, accepts one connection and responds `text`; keeps it open if that is empty.
class Listener {
 public:
  explicit Listener(std::string text) {
    fd_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    if (bind(fd_, reinterpret_cast<sockaddr*>(&address), size) != 0 || listen(fd_, 4) != 0 ||
        getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
      throw std::runtime_error("cannot listen");
    }
    port_ = ntohs(address.sin_port);
    if (text.empty()) return;
    thread_ = std::thread([this, text = std::move(text)] {
      const int connection = accept(fd_, nullptr, nullptr);
      if (connection < 0) return;
      char request[2048];
      // Read the request first: closing a socket with unread bytes discards the response.
      if (recv(connection, request, sizeof request, 0) > 0) {
        send(connection, text.data(), text.size(), MSG_NOSIGNAL);
      }
      close(connection);
    });
  }
  ~Listener() {
    shutdown(fd_, SHUT_RDWR);
    if (thread_.joinable()) thread_.join();
    close(fd_);
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  [[nodiscard]] MasterAddress address() const { return {"127.0.0.1", port_}; }

 private:
  int fd_ = -1;
  std::uint16_t port_ = 0;
  std::thread thread_;
};

TEST(MasterAddress, IsReadAsRosWritesIt) {
  const auto address = parse_master_uri("http://robot-1.local:11311/");
  ASSERT_TRUE(address);
  EXPECT_EQ(address->host, "robot-1.local");
  EXPECT_EQ(address->port, 11311);
  EXPECT_EQ(address->uri(), "http://robot-1.local:11311/");
  EXPECT_EQ(parse_master_uri("http://10.0.0.7:1")->port, 1);
}

TEST(MasterAddress, RefusesEverythingElse) {
  for (const char* bad :
       {"", "localhost:11311", "https://localhost:11311", "http://localhost", "http://:11311",
        "http://localhost:0", "http://localhost:65536", "http://localhost:abc", "http://local host:11311",
        "http://a/b:11311", "http://localhost:11311/x", "http://[::1]:11311"}) {
    EXPECT_FALSE(parse_master_uri(bad)) << bad;
  }
}

TEST(AskMaster, IsAnsweredByNobodyAtOnce) {
  const auto begin = Clock::now();
  const MasterAddress unused{"127.0.0.1", static_cast<std::uint16_t>(canyon::test::free_port())};
  EXPECT_EQ(query_master(unused, "/node", 10s), MasterReply::None);
  EXPECT_LT(Clock::now() - begin, 5s);  // refused, not timed out
}

TEST(AskMaster, WaitsNoLongerThanItMay) {
  const Listener silent("");
  const auto begin = Clock::now();
  EXPECT_EQ(query_master(silent.address(), "/node", 300ms), MasterReply::None);
  EXPECT_GE(Clock::now() - begin, 290ms);
  EXPECT_LT(Clock::now() - begin, 5s);
}

TEST(AskMaster, EndsWhenItIsToldTo) {
  const Listener silent("");
  const int stop = eventfd(1, EFD_CLOEXEC);
  const auto begin = Clock::now();
  EXPECT_EQ(query_master(silent.address(), "/node", 30s, stop), MasterReply::None);
  EXPECT_LT(Clock::now() - begin, 10s);
  close(stop);
}

TEST(AskMaster, TakesOtherServersForNone) {
  EXPECT_EQ(query_master(Listener("HTTP/1.0 404 Not Found\r\n\r\n").address(), "/node", 5s),
            MasterReply::None);
  EXPECT_EQ(query_master(Listener("\x01\x02</methodResponse>").address(), "/node", 5s), MasterReply::None);
}

// Responses as in the ROS Master API: [code, message, value], code 1 for success and -1 for an error of
// the caller.
TEST(AskMaster, ReadsTheCode) {
  const auto response = [](const std::string& code) {
    return "HTTP/1.1 200 OK\r\n\r\n<methodResponse><params><param><value><array><data><value>" + code +
           "</value><value><string>1</string></value></data></array></value></param></params></"
           "methodResponse>";
  };
  EXPECT_EQ(query_master(Listener(response("<int>1</int>")).address(), "/node", 5s), MasterReply::Registered);
  EXPECT_EQ(query_master(Listener(response("<i4>1</i4>")).address(), "/node", 5s), MasterReply::Registered);
  EXPECT_EQ(query_master(Listener(response("<int>-1</int>")).address(), "/node", 5s), MasterReply::Unknown);
  EXPECT_EQ(query_master(Listener(response("<int>11</int>")).address(), "/node", 5s), MasterReply::Unknown);
}

TEST(AskMaster, FindsARoscore) {
  CANYON_NEEDS_PROGRAM("roscore");
  const test::RosCore core;
  const MasterAddress& master = test::RosEnvironment::get().master();
  EXPECT_EQ(query_master(master, "/nobody", 5s), MasterReply::Unknown);
  // roscore starts this node itself.
  EXPECT_TRUE(
      test::eventually([&] { return query_master(master, "/rosout", 5s) == MasterReply::Registered; }));
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic
