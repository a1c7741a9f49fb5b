#include "canyon/base/transport/transport.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <boost/asio.hpp>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <future>
#include <optional>

#include "canyon/base/input_error.hpp"
#include "canyon/base/transport/devices.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/local_connection.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::transport {
namespace {

using canyon::test::free_port;
using test::LocalConnection;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::chrono::steady_clock::time_point in_20_s() {
  return std::chrono::steady_clock::now() + std::chrono::seconds(20);
}

/// A server that has accepted its `n` clients.
void serve_until(TcpServer& server, std::size_t n) {
  const auto deadline = in_20_s();
  while (server.clients() != n && std::chrono::steady_clock::now() < deadline) server.serve();
  ASSERT_EQ(server.clients(), n);
}

TEST(TcpServer, SendsTheSameToAllAndIgnoresWhatTheySay) {
  const int port = free_port();
  TcpServer server(port);
  LocalConnection a(port);
  serve_until(server, 1);
  server.send("one ");
  LocalConnection b(port);
  b.send_text("$PMTK314,0*28\r\n");
  serve_until(server, 2);
  server.send("two");
  EXPECT_EQ(a.read(7), "one two");
  EXPECT_EQ(b.read(3), "two");
  EXPECT_THAT(server.take_notes(), IsEmpty());
}

TEST(TcpServer, GoesOnForClientsThatOnlyClosedTheirOwnSide) {
  const int port = free_port();
  TcpServer server(port);
  LocalConnection client(port);
  client.end_speech();
  serve_until(server, 1);
  server.serve();
  server.send("still here");
  EXPECT_EQ(client.read(10), "still here");
}

TEST(TcpServer, LetsDeadClientsGoWithoutASignal) {
  const int port = free_port();
  TcpServer server(port);
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

TEST(TcpServer, DropsAClientThatDoesNotReadAndServesTheOthers) {
  const int port = free_port();
  TcpServer server(port);
  LocalConnection lazy(port);
  LocalConnection eager(port);
  serve_until(server, 2);
  const std::string block(10'000, 'n');
  std::size_t sent = 0, read = 0;
  // The system's buffers hold some bytes before the server must keep any: some megabytes at most.
  while (server.clients() == 2 && sent < 100'000'000) {
    server.send(block);
    sent += block.size();
    read += eager.read(block.size()).size();
  }
  EXPECT_EQ(server.clients(), 1U);
  EXPECT_EQ(read, sent);
  EXPECT_GE(sent, kMaxBacklog);
  EXPECT_THAT(server.take_notes(), ElementsAre(HasSubstr("does not read is dropped")));
  EXPECT_THAT(server.take_notes(), IsEmpty());
}

TEST(TcpServer, KeepsWhatASlowClientHasNotReadYet) {
  const int port = free_port();
  TcpServer server(port);
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

TEST(TcpServer, OneClientMoreTakesThePlaceOfTheOneThatWaitsLongest) {
  const int port = free_port();
  TcpServer server(port);
  std::vector<LocalConnection> clients;
  for (std::size_t i = 0; i < kMaxClients; ++i) clients.emplace_back(port);
  serve_until(server, kMaxClients);
  server.send_to(1, "one ");
  LocalConnection late(port);
  // The system has connected it already; the server accepts it when it is served.
  const auto deadline = in_20_s();
  std::vector<std::string> notes;
  while (notes.empty() && std::chrono::steady_clock::now() < deadline) {
    server.serve();
    notes = server.take_notes();
  }
  EXPECT_THAT(notes, ElementsAre(HasSubstr("more than 16 clients")));
  EXPECT_EQ(clients[1].read_some(), "") << "the first of those that nobody answered";
  EXPECT_EQ(server.clients(), kMaxClients);
  server.send("x");
  EXPECT_EQ(late.read(1), "x");
  EXPECT_EQ(clients.front().read(5), "one x");
  EXPECT_EQ(clients.back().read(1), "x");

  // A client that has closed its side is replaced.
  clients.back().end_speech();
  LocalConnection later(port);
  auto reader = std::async(std::launch::async, [&] { return later.read(1); });
  while (reader.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) {
    server.serve();
    server.send("y");
  }
  EXPECT_EQ(reader.get().front(), 'y');
  EXPECT_EQ(server.clients(), kMaxClients);
}

// Silent visitors do not replace working clients, and one that sends a request gets a reply.
TEST(TcpServer, SilentVisitorsLockNobodyOut) {
  const int port = free_port();
  TcpServer server(port, "127.0.0.1", 8, true);
  LocalConnection works(port);
  serve_until(server, 1);
  server.send_to(1, "200 ");
  std::vector<LocalConnection> silent;
  for (int i = 0; i < 30; ++i) silent.emplace_back(port);
  LocalConnection requester(port);
  requester.send_text("GET /BASE\n");
  std::string heard;
  const auto deadline = in_20_s();
  while (heard.empty() && std::chrono::steady_clock::now() < deadline) {
    silent.emplace_back(port);
    server.serve();
    for (const Received& received : server.take_received()) heard += received.bytes;
  }
  EXPECT_EQ(heard, "GET /BASE\n");
  EXPECT_LT(silent.size(), 40U) << "it is heard at once";
  server.send("x");
  EXPECT_EQ(works.read(5), "200 x");
}

// A foreign web page can make the user's browser send any bytes in the body of a request.
TEST(TcpServer, DropsClientsThatSpeakHttp) {
  const int port = free_port();
  TcpServer server(port);
  std::vector<Received> received;
  const auto end_of = [&](LocalConnection& client) {
    auto reader = std::async(std::launch::async, [&] { return client.read_some(); });
    while (reader.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) {
      server.serve();
      for (Received& each : server.take_received()) received.push_back(std::move(each));
    }
    return reader.get();
  };
  const std::string body = "{\"command\": \"stop\"}\n";
  for (const char* request :
       {"POST / HTTP/1.1\r\nHost: x\r\n\r\n", "GET /?\r\n", "OPTIONS * HTTP/1.1\n\n",
        "PUT /x HTTP/1.0\r\n\r\n", "PROPFIND /x HTTP/1.1\r\n\r\n", "HEAD ", "PRI * HTTP/2.0\r\n\r\n"}) {
    LocalConnection client(port);
    client.send_text(request + body);
    EXPECT_EQ(end_of(client), "") << request;
  }
  LocalConnection slow(port);
  slow.send_text("PO");
  serve_until(server, 1);
  server.serve();
  slow.send_text("ST / HTTP/1.1\r\n\r\n" + body);
  EXPECT_EQ(end_of(slow), "");
  EXPECT_TRUE(received.empty());
  EXPECT_THAT(server.take_notes(), ElementsAre(HasSubstr("speaks HTTP")));
  // Others are accepted, whatever their first bytes.
  for (const std::string& first : {std::string("P"), std::string("{\"path\": \"/ HTTP/1.1\"}\n"),
                                   std::string("GETTER\n"), std::string(" / HTTP/1.1\n")}) {
    LocalConnection client(port);
    client.send_text(first);
    client.end_speech();
    std::string heard;
    for (const auto deadline = in_20_s(); heard.empty() && std::chrono::steady_clock::now() < deadline;) {
      server.serve();
      for (const Received& each : server.take_received()) heard += each.bytes;
    }
    EXPECT_EQ(heard, first);
  }
}

TEST(TcpServer, RefusesPortsThatCannotBeHad) {
  for (const int port : {-1, 0, 65536, 1'000'000}) {
    try {
      const TcpServer server(port);
      ADD_FAILURE() << port;
    } catch (const InputError& e) {
      EXPECT_THAT(e.problem(), HasSubstr("port " + std::to_string(port)));
      EXPECT_THAT(e.hint(), HasSubstr("1024 to 65535"));
    }
  }
}

TEST(TcpServer, GivesItsPortBack) {
  const int port = free_port();
  std::optional<TcpServer> server(std::in_place, port);
  LocalConnection client(port);
  serve_until(*server, 1);
  server.reset();
  EXPECT_EQ(client.read_some(), "");
  EXPECT_NO_THROW(server.emplace(port));
}

TEST(TcpServer, GivesLateClientsTheFirstBytesToo) {
  const int port = free_port();
  TcpServer server(port);
  server.begin("week,tow\n");
  LocalConnection early(port);
  serve_until(server, 1);
  server.send("2000,1\n");
  LocalConnection late(port);
  serve_until(server, 2);
  server.send("2000,2\n");
  EXPECT_EQ(early.read(23), "week,tow\n2000,1\n2000,2\n");
  EXPECT_EQ(late.read(16), "week,tow\n2000,2\n");
}

TEST(TcpServer, WaitsAtTheEndForAClientThatIsBehind) {
  const int port = free_port();
  std::optional<TcpServer> server(std::in_place, port);
  LocalConnection slow(port);
  serve_until(*server, 1);
  std::string expected;
  // More than the system's buffers of both ends hold at once, less than the backlog.
  for (int i = 0; i < 5000 && server->clients() == 1; ++i) {
    const std::string line = std::to_string(i) + std::string(50, '.') + "\r\n";
    server->send(line);
    expected += line;
  }
  auto reader = std::async(std::launch::async, [&] { return slow.read(expected.size() + 1); });
  server->finish({});
  server.reset();
  EXPECT_EQ(reader.get(), expected);
}

/// Bytes that arrive at a descriptor within 20 s, up to `size`.
std::string read_from(int descriptor, std::size_t size) {
  std::string text;
  std::array<char, 4096> buffer;
  pollfd wait{descriptor, POLLIN, 0};
  while (text.size() < size && poll(&wait, 1, 20'000) == 1) {
    const ssize_t n = read(descriptor, buffer.data(), buffer.size());
    if (n <= 0) break;
    text.append(buffer.data(), static_cast<std::size_t>(n));
  }
  return text;
}

TEST(Transport, DatagramsEndWithLines) {
  namespace asio = boost::asio;
  asio::io_context io;
  asio::ip::udp::socket receiver(io, {asio::ip::address_v4::loopback(), 0});
  const auto transport =
      open_transport("udp://127.0.0.1:" + std::to_string(receiver.local_endpoint().port()));
  std::string epoch;
  for (int i = 0; i < 40; ++i) epoch += std::string(60, static_cast<char>('A' + i % 26)) + "\r\n";
  transport->send(epoch);
  transport->send(std::string(3000, 'b'));  // no line end to cut after
  // 62 bytes a line: 22 lines are 1364 bytes, 23 would be 1426. Loopback keeps the order.
  for (const std::size_t size : {1364U, 1116U, 1400U, 1400U, 200U}) {
    pollfd wait{receiver.native_handle(), POLLIN, 0};
    ASSERT_EQ(poll(&wait, 1, 20'000), 1);
    std::array<char, 2000> buffer;
    EXPECT_EQ(receiver.receive(asio::buffer(buffer)), size);
    if (size == 1364U || size == 1116U) {
      EXPECT_EQ(std::string_view(buffer.data(), size), epoch.substr(size == 1364U ? 0 : 1364, size));
    }
  }
}

TEST(Transport, DatagramsToNobodyAreLost) {
  const auto transport = open_transport("udp://127.0.0.1:" + std::to_string(free_port()));
  for (int i = 0; i < 10; ++i) EXPECT_NO_THROW(transport->send("x"));
}

std::string pseudo_terminal_of(Transport& transport) {
  const auto notes = transport.take_notes();
  EXPECT_THAT(notes, ElementsAre(HasSubstr("the pseudo-terminal is /dev/pts/")));
  return notes.front().substr(notes.front().find("/dev"));
}

TEST(Transport, PseudoTerminalPassesBytesAsTheyAre) {
  const auto transport = open_transport("pty:");
  const std::string name = pseudo_terminal_of(*transport);
  const int reader = open(name.c_str(), O_RDONLY | O_NOCTTY);
  ASSERT_GE(reader, 0) << name;
  const std::string bytes = "$GPGGA*00\r\n\n\x03\x04\x11\x13\x7F\xFF";  // CR LF, Ctrl-C, Ctrl-D, XON, XOFF
  transport->send(bytes);
  EXPECT_EQ(read_from(reader, bytes.size()), bytes);
  close(reader);
}

// As PX4's drivers open a device, again after each failure to detect a receiver: raw, 8 bits, without CREAD.
TEST(Transport, PseudoTerminalIsConfiguredByPx4) {
  const auto transport = open_transport("pty:");
  const std::string device = pseudo_terminal_of(*transport);
  for (int attempt = 0; attempt < 3; ++attempt) {
    const int end = open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK);
    termios settings{};
    ASSERT_EQ(tcgetattr(end, &settings), 0);
    settings.c_iflag &=
        ~static_cast<tcflag_t>(IGNBRK | BRKINT | ICRNL | INLCR | PARMRK | INPCK | ISTRIP | IXON);
    settings.c_oflag = 0;
    settings.c_lflag &= ~static_cast<tcflag_t>(ECHO | ECHONL | ICANON | IEXTEN | ISIG);
    settings.c_cflag = CS8;
    cfsetispeed(&settings, B57600);
    cfsetospeed(&settings, B57600);
    EXPECT_EQ(tcsetattr(end, TCSANOW, &settings), 0) << attempt << ": " << std::strerror(errno);
    transport->serve();
    transport->send("\r\n\t\x1b");
    EXPECT_EQ(read_from(end, 4), "\r\n\t\x1b");
    ASSERT_EQ(write(end, "\r\n\t\n", 4), 4);
    std::string back;
    for (int i = 0; i < 1000 && back.size() < 4; ++i) {
      transport->serve();
      for (const Received& received : transport->take_received()) back += received.bytes;
      poll(nullptr, 0, 1);
    }
    EXPECT_EQ(back, "\r\n\t\n");
    close(end);
  }
}

TEST(Transport, PseudoTerminalGoesOnWithoutReaders) {
  const auto transport = open_transport("pty:");
  (void)transport->take_notes();
  for (int i = 0; i < 1000; ++i) transport->send(std::string(1000, 'x'));
  EXPECT_THAT(transport->take_notes(), ElementsAre(HasSubstr("no program reads")));
}

// Without a reader, the end of a run does not wait for one.
TEST(Transport, UnreadPseudoTerminalEndsAtOnce) {
  const auto transport = open_transport("pty:");
  for (int i = 0; i < 100; ++i) transport->send(std::string(1000, 'x'));
  const auto unread = std::chrono::steady_clock::now() + std::chrono::milliseconds(600);
  while (std::chrono::steady_clock::now() < unread) transport->serve();
  const auto begin = std::chrono::steady_clock::now();
  transport->finish({});
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(500));
}

// 9,600 baud are 960 bytes a second; then 115,200.
TEST(Transport, PseudoTerminalWithABaudRateIsPaced) {
  const test::TemporaryFolder folder;
  const std::string link = (folder / "gps").string();
  const auto transport = open_transport("pty:" + link + "@9600");
  const int reader = open(link.c_str(), O_RDONLY | O_NOCTTY | O_NONBLOCK);
  ASSERT_GE(reader, 0) << link;
  const auto bytes_of = [&](double seconds) {
    std::size_t size = 0;
    std::array<char, 4096> buffer;
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    while (std::chrono::steady_clock::now() < end) {
      transport->serve();
      if (const ssize_t n = read(reader, buffer.data(), buffer.size()); n > 0)
        size += static_cast<std::size_t>(n);
      pollfd wait{reader, POLLIN, 0};
      poll(&wait, 1, 2);
    }
    return size;
  };
  transport->send(std::string(4000, 'x'));
  EXPECT_NEAR(static_cast<double>(bytes_of(0.5)), 480, 150);
  EXPECT_THAT(transport->take_notes(), ElementsAre(HasSubstr("the pseudo-terminal is")));
  transport->send(std::string(4000, 'y'));  // the buffer is full
  EXPECT_THAT(transport->take_notes(), ElementsAre(HasSubstr("9600 baud are too slow")));
  transport->set_baud(115200);
  EXPECT_GT(bytes_of(0.5), 3000U);
  close(reader);
}

TEST(Transport, SerialPortSpeaksWithTheOtherEnd) {
  // A serial port without hardware: one end of a pseudo-terminal.
  const int other_end = posix_openpt(O_RDWR | O_NOCTTY);
  ASSERT_TRUE(other_end >= 0 && grantpt(other_end) == 0 && unlockpt(other_end) == 0);
  std::array<char, 256> name{};
  ASSERT_EQ(ptsname_r(other_end, name.data(), name.size()), 0);
  const auto transport = open_transport("serial:" + std::string(name.data()) + "@115200");
  const std::string bytes = "$GPGGA*00\r\n\x03\x11";
  transport->send(bytes);
  EXPECT_EQ(read_from(other_end, bytes.size()), bytes);
  transport->finish({});
  close(other_end);
}

/// The bytes that a transport receives within 20 s, at least `size`.
std::vector<Received> received_by(Transport& transport, std::size_t size) {
  std::vector<Received> all;
  std::size_t got = 0;
  const auto deadline = in_20_s();
  while (got < size && std::chrono::steady_clock::now() < deadline) {
    transport.serve();
    for (Received& received : transport.take_received()) {
      got += received.bytes.size();
      all.push_back(std::move(received));
    }
  }
  return all;
}

TEST(Transport, TcpServerHearsClientsApartAndAnswersTheOneThatAsked) {
  const int port = free_port();
  TcpServer server(port);
  LocalConnection a(port), b(port);
  serve_until(server, 2);
  a.send_text("ping");
  const std::vector<Received> from_a = received_by(server, 4);
  b.send_text("pong");
  const std::vector<Received> from_b = received_by(server, 4);
  ASSERT_FALSE(from_a.empty());
  ASSERT_FALSE(from_b.empty());
  EXPECT_EQ(from_a.front().bytes, "ping");
  EXPECT_NE(from_a.front().reader, from_b.front().reader);
  server.send_to(from_b.front().reader, "to b ");
  server.send("to all");
  EXPECT_EQ(a.read(6), "to all");
  EXPECT_EQ(b.read(11), "to b to all");
}

TEST(Transport, KeepsNoMoreOfWhatIsSaidThanItPromises) {
  const int port = free_port();
  TcpServer server(port);
  LocalConnection talker(port);
  serve_until(server, 1);
  std::size_t reported = 0;
  for (int i = 0; i < 200; ++i) {
    talker.send_text(std::string(1000, 'x'));
    reported += 1000;
    server.serve();
  }
  std::size_t kept = 0;
  for (const Received& received : server.take_received()) kept += received.bytes.size();
  EXPECT_GT(kept, 0U);
  EXPECT_LE(kept, kMaxReceived);
  EXPECT_LT(kept, reported);
}

TEST(Transport, TcpClientConnectsAgainWhenItsServerIsBack) {
  const int port = free_port();
  const auto client = open_transport("tcp-connect://127.0.0.1:" + std::to_string(port));
  client->send("nobody is there");
  std::vector<std::string> notes;
  const auto serve_until_note = [&](const char* text) {
    notes.clear();
    const auto deadline = in_20_s();
    while (std::chrono::steady_clock::now() < deadline) {
      client->serve();
      for (std::string& note : client->take_notes()) notes.push_back(std::move(note));
      if (!notes.empty() && notes.back().find(text) != std::string::npos) return true;
    }
    return false;
  };
  EXPECT_TRUE(serve_until_note("does not respond")) << ::testing::PrintToString(notes);
  std::optional<TcpServer> server(std::in_place, port);
  EXPECT_TRUE(serve_until_note("connected to")) << ::testing::PrintToString(notes);
  serve_until(*server, 1);
  client->send("hello");
  const auto received = received_by(*server, 5);
  ASSERT_FALSE(received.empty());
  EXPECT_EQ(received.front().bytes, "hello");
  server->send_to(received.front().reader, "welcome");
  EXPECT_EQ(received_by(*client, 7).front().bytes, "welcome");
  server.reset();
  EXPECT_TRUE(serve_until_note("is gone")) << ::testing::PrintToString(notes);
  server.emplace(port);
  EXPECT_TRUE(serve_until_note("connected to")) << ::testing::PrintToString(notes);
}

TEST(Transport, UdpListenerSendsToThoseItReceivedFrom) {
  const int port = free_port();
  const auto listener = open_transport("udp-listen://127.0.0.1:" + std::to_string(port));
  listener->send("to nobody");
  const auto a = open_transport("udp://127.0.0.1:" + std::to_string(port));
  const auto b = open_transport("udp://127.0.0.1:" + std::to_string(port));
  a->send("from a");
  const auto first = received_by(*listener, 6);
  b->send("one");
  b->send("two");
  const auto more = received_by(*listener, 6);
  ASSERT_EQ(first.size(), 1U);
  ASSERT_EQ(more.size(), 2U);  // datagrams stay separate
  EXPECT_EQ(more[1].bytes, "two");
  listener->send_to(first.front().reader, "answer");
  listener->send("all");
  EXPECT_EQ(received_by(*a, 9).back().bytes, "all");
  EXPECT_EQ(received_by(*b, 3).front().bytes, "all");
}

// A bridge may open a socket for each pose.
TEST(Transport, UdpListenerHearsAnyNumberOfSenders) {
  const int port = free_port();
  const auto listener = open_transport("udp-listen://127.0.0.1:" + std::to_string(port));
  std::vector<std::unique_ptr<Transport>> senders;
  for (int i = 0; i < 40; ++i) {
    senders.push_back(open_transport("udp://127.0.0.1:" + std::to_string(port)));
    senders.back()->send("pose");
    ASSERT_EQ(received_by(*listener, 4).size(), 1U) << i;
  }
  listener->send("x");
  EXPECT_EQ(received_by(*senders.back(), 1).front().bytes, "x");
}

TEST(Transport, PseudoTerminalHearsAndHasALink) {
  const test::TemporaryFolder folder;
  const std::string link = (folder / "gps").string();
  {
    const auto transport = open_transport("pty:" + link);
    const int driver = open(link.c_str(), O_RDWR | O_NOCTTY);
    ASSERT_GE(driver, 0) << link;
    const std::string requested = "\xB5\x62\x0A\x04\n\r\x03";
    ASSERT_EQ(write(driver, requested.data(), requested.size()), static_cast<ssize_t>(requested.size()));
    const auto received = received_by(*transport, requested.size());
    ASSERT_FALSE(received.empty());
    EXPECT_EQ(received.front().bytes, requested);
    close(driver);
    // Readers may come and go.
    transport->serve();
    transport->send("x");
    const int next = open(link.c_str(), O_RDWR | O_NOCTTY);
    EXPECT_EQ(read_from(next, 1), "x");
    close(next);
    // A link left by an earlier run is replaced; another file is not.
    EXPECT_NO_THROW((void)open_transport("pty:" + link));
  }
  EXPECT_FALSE(std::filesystem::is_symlink(link));
  std::ofstream(link) << "mine";
  EXPECT_THROW((void)open_transport("pty:" + link), InputError);
}

TEST(Transport, SerialPortIsTakenUpAgainAfterItWasUnplugged) {
  const test::TemporaryFolder folder;
  const std::string link = (folder / "ttyUSB0").string();
  std::optional<std::unique_ptr<Transport>> other(open_transport("pty:" + link));
  const auto serial = open_transport("serial:" + link + "@115200");
  other->reset();
  const auto note = [&](const char* text) {
    const auto deadline = in_20_s();
    while (std::chrono::steady_clock::now() < deadline) {
      serial->serve();
      serial->send("x");
      for (const std::string& line : serial->take_notes()) {
        if (line.find(text) != std::string::npos) return true;
      }
    }
    return false;
  };
  EXPECT_TRUE(note("is gone"));
  other.emplace(open_transport("pty:" + link));
  EXPECT_TRUE(note("is back"));
  EXPECT_EQ(received_by(**other, 1).front().bytes.front(), 'x');
  serial->set_baud(9600);
  serial->set_baud(123456);  // whatever the machine supports, the port keeps working
  serial->send("y");
  EXPECT_FALSE(received_by(**other, 1).empty());
}

TEST(Transport, FileAppearsWholeAndCorrected) {
  const test::TemporaryFolder folder;
  const auto path = folder / "epochs.csv";
  const auto transport = open_transport("file:" + path.string());
  transport->begin("time of last: ?\n");
  transport->send("one\n");
  EXPECT_FALSE(std::filesystem::exists(path));
  transport->finish(Correction{14, "1"});
  EXPECT_EQ(test::read_bytes(path), "time of last: 1\none\n");
}

// The data sent by a killed process are kept by the next one.
TEST(Transport, FileOutlivesAKilledProcess) {
  const test::TemporaryFolder folder;
  const std::filesystem::path path = folder / "rover.nmea";
  const pid_t child = fork();
  if (child == 0) {
    const auto log = open_transport("file:" + path.string());
    log->send("one ");
    log->send("two ");
    raise(SIGKILL);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  for (const bool first : {true, false}) {
    (void)open_result(folder / "other");  // also removes leftovers of killed processes
    const auto log = open_transport("file:" + path.string());
    const std::string kept = path.string() + ".killed";
    EXPECT_EQ(test::read_bytes(kept), "one two ");
    const std::vector<std::string> notes = log->take_notes();
    EXPECT_EQ(notes.size(), first ? 1U : 0U) << "told once";
    EXPECT_THAT(notes, testing::Each(HasSubstr(kept)));
    log->send("three");
    EXPECT_EQ(std::filesystem::exists(path), !first) << "whole at the end";
    log->finish({});
    EXPECT_EQ(test::read_bytes(path), "three");
  }
}

TEST(Transport, RefusesWhatIsNoAddress) {
  const auto problem_of = [](const std::string& address) -> std::string {
    try {
      (void)open_transport(address);
    } catch (const InputError& e) {
      EXPECT_NE(e.hint(), "") << address;
      return e.problem();
    }
    ADD_FAILURE() << address;
    return {};
  };
  for (const char* address : {"", "nonsense", "file:", "tcp:/127.0.0.1:2947", "http://127.0.0.1:80"}) {
    EXPECT_THAT(problem_of(address), HasSubstr("is not an address"));
  }
  for (const char* address : {"tcp://", "tcp://127.0.0.1", "tcp://:2947", "tcp://127.0.0.1:0",
                              "udp://127.0.0.1:65536", "udp://127.0.0.1:x"}) {
    EXPECT_THAT(problem_of(address), HasSubstr("no host and port"));
  }
  EXPECT_THAT(problem_of("tcp://here:2947"), HasSubstr("'here' is not an address to listen at"));
  EXPECT_THAT(problem_of("tcp-connect://nowhere.invalid:1"), HasSubstr("is not a known host"));
  EXPECT_THAT(problem_of("serial:/dev/ttyUSB0"), HasSubstr("no device and baud rate"));
  EXPECT_THAT(problem_of("serial:/dev/null/none@9600"), HasSubstr("cannot be opened at 9600 baud"));
  EXPECT_THAT(problem_of("file:/nowhere/at/all"), HasSubstr("cannot be written"));
}

}  // namespace
}  // namespace canyon::transport
