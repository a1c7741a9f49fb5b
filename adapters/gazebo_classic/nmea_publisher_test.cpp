#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <array>
#include <chrono>
#include <future>
#include <optional>

#include "adapters/gazebo_classic/local_server.hpp"
#include "adapters/gazebo_classic/publishers.hpp"
#include "adapters/gazebo_classic/testing/child_process.hpp"
#include "adapters/gazebo_classic/testing/sample_report.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/output/nmea.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/program.hpp"

namespace canyon::gazebo_classic {
namespace {

using canyon::test::free_port;
using test::sample_identity;
using test::SampleReport;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::chrono::steady_clock::time_point in_20_s() {
  return std::chrono::steady_clock::now() + std::chrono::seconds(20);
}

/// A connection to a port of 127.0.0.1 that waits for at most 20 s.
class Connection {
 public:
  explicit Connection(int port) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    if (connect(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      throw std::runtime_error("no connection");
    }
  }
  /// At least one byte; empty at the end of the stream or after 20 s.
  std::string read_some() {
    pollfd wait{socket_.get(), POLLIN, 0};
    if (poll(&wait, 1, 20'000) != 1) return {};
    std::array<char, 65536> buffer;
    const ssize_t n = recv(socket_.get(), buffer.data(), buffer.size(), 0);
    return n > 0 ? std::string(buffer.data(), static_cast<std::size_t>(n)) : std::string();
  }
  std::string read(std::size_t bytes) {
    std::string text;
    while (text.size() < bytes) {
      const std::string more = read_some();
      if (more.empty()) break;
      text += more;
    }
    return text;
  }
  void say(const std::string& text) const { ::send(socket_.get(), text.data(), text.size(), MSG_NOSIGNAL); }
  void end_speech() const { shutdown(socket_.get(), SHUT_WR); }
  /// As a process that is killed with data unread: the peer gets a reset.
  void abort() {
    const linger now{1, 0};
    setsockopt(socket_.get(), SOL_SOCKET, SO_LINGER, &now, sizeof now);
    socket_ = FileDescriptor();
  }

 private:
  FileDescriptor socket_;
};

/// A server that knows of its `n` clients.
void serve_until(LocalServer& server, std::size_t n) {
  const auto deadline = in_20_s();
  while (server.clients() != n && std::chrono::steady_clock::now() < deadline) server.serve();
  ASSERT_EQ(server.clients(), n);
}

TEST(LocalServer, SendsTheSameToAllAndIgnoresWhatTheySay) {
  const int port = free_port();
  LocalServer server(port);
  Connection a(port);
  serve_until(server, 1);
  server.send("one ");
  Connection b(port);
  b.say("$PMTK314,0*28\r\n");
  serve_until(server, 2);
  server.send("two");
  EXPECT_EQ(a.read(7), "one two");
  EXPECT_EQ(b.read(3), "two");
  EXPECT_THAT(server.take_notes(), IsEmpty());
}

TEST(LocalServer, GoesOnForClientsThatOnlyClosedTheirOwnSide) {
  const int port = free_port();
  LocalServer server(port);
  Connection client(port);
  client.end_speech();
  serve_until(server, 1);
  server.serve();
  server.send("still here");
  EXPECT_EQ(client.read(10), "still here");
}

TEST(LocalServer, LetsDeadClientsGoWithoutASignal) {
  const int port = free_port();
  LocalServer server(port);
  {
    Connection gone(port);
    Connection killed(port);
    serve_until(server, 2);
    server.send("unread");
    killed.abort();
  }
  Connection alive(port);
  const auto deadline = in_20_s();
  // SIGPIPE would end this process.
  while (server.clients() != 1 && std::chrono::steady_clock::now() < deadline) {
    server.serve();
    server.send("x");
  }
  EXPECT_EQ(server.clients(), 1U);
  EXPECT_EQ(alive.read(1).front(), 'x');
}

TEST(LocalServer, DropsAClientThatDoesNotReadAndServesTheOthers) {
  const int port = free_port();
  LocalServer server(port);
  Connection lazy(port);
  Connection eager(port);
  serve_until(server, 2);
  const std::string block(10'000, 'n');
  std::size_t sent = 0, read = 0;
  // The system's buffers take some before the server has to keep anything: some megabytes at most.
  while (server.clients() == 2 && sent < 100'000'000) {
    server.send(block);
    sent += block.size();
    read += eager.read(block.size()).size();
  }
  EXPECT_EQ(server.clients(), 1U);
  EXPECT_EQ(read, sent);
  EXPECT_GE(sent, LocalServer::kMaxBacklog);
  EXPECT_THAT(server.take_notes(), ElementsAre(HasSubstr("does not read is dropped")));
  EXPECT_THAT(server.take_notes(), IsEmpty());
}

TEST(LocalServer, KeepsWhatASlowClientHasNotReadYet) {
  const int port = free_port();
  LocalServer server(port);
  Connection slow(port);
  serve_until(server, 1);
  std::string expected;
  for (int i = 0; i < 400; ++i) {
    const std::string line = std::to_string(i) + std::string(500, '.') + "\r\n";
    server.send(line);
    expected += line;
  }
  std::string got;
  const auto deadline = in_20_s();
  while (got.size() < expected.size() && std::chrono::steady_clock::now() < deadline) {
    server.serve();
    got += slow.read_some();
  }
  EXPECT_EQ(got, expected);
}

TEST(LocalServer, TurnsAwayMoreThanItHolds) {
  const int port = free_port();
  LocalServer server(port);
  std::vector<Connection> clients;
  for (std::size_t i = 0; i < LocalServer::kMaxClients; ++i) clients.emplace_back(port);
  serve_until(server, LocalServer::kMaxClients);
  Connection late(port);
  // The system has connected it already; the server lets go of it when it looks.
  const auto deadline = in_20_s();
  std::vector<std::string> notes;
  while (notes.empty() && std::chrono::steady_clock::now() < deadline) {
    server.serve();
    notes = server.take_notes();
  }
  EXPECT_THAT(notes, ElementsAre(HasSubstr("more than 16 clients")));
  EXPECT_EQ(late.read_some(), "");
  EXPECT_EQ(server.clients(), LocalServer::kMaxClients);
  server.send("x");
  EXPECT_EQ(clients.front().read(1), "x");

  // One that said goodbye makes room.
  clients.back().end_speech();
  Connection later(port);
  auto reader = std::async(std::launch::async, [&] { return later.read(1); });
  while (reader.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) {
    server.serve();
    server.send("y");
  }
  EXPECT_EQ(reader.get().front(), 'y');
  EXPECT_EQ(server.clients(), LocalServer::kMaxClients);
}

TEST(LocalServer, RefusesPortsThatCannotBeHad) {
  for (const int port : {-1, 0, 65536, 1'000'000}) {
    try {
      const LocalServer server(port);
      ADD_FAILURE() << port;
    } catch (const InputError& e) {
      EXPECT_THAT(e.problem(), HasSubstr("port " + std::to_string(port)));
      EXPECT_THAT(e.cure(), HasSubstr("1024 to 65535"));
    }
  }
}

TEST(LocalServer, GivesItsPortBack) {
  const int port = free_port();
  std::optional<LocalServer> server(std::in_place, port);
  Connection client(port);
  serve_until(*server, 1);
  server.reset();
  EXPECT_EQ(client.read_some(), "");
  EXPECT_NO_THROW(server.emplace(port));
}

class NmeaPublisher : public ::testing::Test {
 protected:
  NmeaPublisher() { settings.nmea_port = free_port(); }
  SampleReport sample;
  PluginSettings settings;
};

TEST_F(NmeaPublisher, SendsEachEpochAsNmea) {
  const auto publisher = make_nmea_publisher(sample_identity(), settings);
  publisher->publish(sample.report);  // nobody there
  Connection client(settings.nmea_port);
  ReceiverReport no_truth = sample.report;
  no_truth.step = nullptr;
  publisher->publish(no_truth);
  const SampleReport no_fix(false);
  publisher->publish(no_fix.report);
  publisher->reset();
  publisher->publish(sample.report);
  const std::string expected = output::nmea_epoch(no_fix.step.epoch) + output::nmea_epoch(sample.step.epoch);
  EXPECT_EQ(client.read(expected.size()), expected);
}

TEST_F(NmeaPublisher, SaysWhichPortIsTaken) {
  const auto first = make_nmea_publisher(sample_identity(), settings);
  try {
    const auto second = make_nmea_publisher(sample_identity(), settings);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.problem(), HasSubstr("nmea_port: port " + std::to_string(settings.nmea_port)));
    EXPECT_THAT(e.problem(), HasSubstr("in use"));
    EXPECT_THAT(e.cure(), HasSubstr("a port of its own"));
  }
}

TEST_F(NmeaPublisher, FeedsGpsd) {
  CANYON_NEEDS_PROGRAM("gpsd");
  CANYON_NEEDS_PROGRAM("gpspipe");
  const auto publisher = make_nmea_publisher(sample_identity(), settings);
  const std::string gpsd_port = std::to_string(free_port());
  const test::ChildProcess gpsd(
      {"gpsd", "-N", "-n", "-S", gpsd_port, "tcp://127.0.0.1:" + std::to_string(settings.nmea_port)});
  // gpspipe says reports of positions until it has one with a height.
  auto judge = std::async(std::launch::async, [&] {
    return canyon::test::run_program("timeout 60 sh -c 'until gpspipe -w -n 40 127.0.0.1:" + gpsd_port +
                                     " 2>/dev/null | grep -m 1 \"TPV.*\\\"mode\\\":3\"; do :; done'");
  });
  auto& epoch = sample.step.epoch;
  while (judge.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) {
    publisher->publish(sample.report);
    epoch.truth.time = epoch.observed.time = epoch.observed.time + 0.1;
    epoch.observed.receiver_time = epoch.observed.receiver_time + 0.1;
  }
  const std::string report = judge.get().output;
  // The fix of SampleReport: 1.25 m east and 2.5 m south of 22.298251, 114.178761, at 12.345 + 3.75 m.
  EXPECT_THAT(report, HasSubstr("\"device\":\"tcp://127.0.0.1:" + std::to_string(settings.nmea_port)));
  EXPECT_THAT(report, HasSubstr("\"time\":\"2019-04-28T12:5"));
  EXPECT_THAT(report, HasSubstr("\"lat\":22.29822"));
  EXPECT_THAT(report, HasSubstr("\"lon\":114.17877"));
}

}  // namespace
}  // namespace canyon::gazebo_classic
