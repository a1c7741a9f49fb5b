#include "adapters/gazebo_classic/local_server.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <optional>

#include "adapters/gazebo_classic/testing/local_connection.hpp"
#include "canyon/base/input_error.hpp"
#include "tests/support/free_port.hpp"

namespace canyon::gazebo_classic {
namespace {

using canyon::test::free_port;
using test::LocalConnection;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::chrono::steady_clock::time_point in_20_s() {
  return std::chrono::steady_clock::now() + std::chrono::seconds(20);
}

/// A server that knows of its `n` clients.
void serve_until(LocalServer& server, std::size_t n) {
  const auto deadline = in_20_s();
  while (server.clients() != n && std::chrono::steady_clock::now() < deadline) server.serve();
  ASSERT_EQ(server.clients(), n);
}

TEST(LocalServer, SendsTheSameToAllAndIgnoresWhatTheySay) {
  const int port = free_port();
  LocalServer server(port);
  LocalConnection a(port);
  serve_until(server, 1);
  server.send("one ");
  LocalConnection b(port);
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
  LocalConnection client(port);
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
    LocalConnection gone(port);
    LocalConnection killed(port);
    serve_until(server, 2);
    server.send("unread");
    killed.abort();
  }
  LocalConnection alive(port);
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
  LocalConnection lazy(port);
  LocalConnection eager(port);
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
  LocalConnection slow(port);
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
  std::vector<LocalConnection> clients;
  for (std::size_t i = 0; i < LocalServer::kMaxClients; ++i) clients.emplace_back(port);
  serve_until(server, LocalServer::kMaxClients);
  LocalConnection late(port);
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
  LocalConnection later(port);
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
  LocalConnection client(port);
  serve_until(*server, 1);
  server.reset();
  EXPECT_EQ(client.read_some(), "");
  EXPECT_NO_THROW(server.emplace(port));
}

}  // namespace
}  // namespace canyon::gazebo_classic
