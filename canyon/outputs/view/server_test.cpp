#include "canyon/outputs/view/server.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <thread>
#include <utility>  // which some of Boost.Asio's headers lack

#include <boost/asio.hpp>

#include "canyon/base/input_error.hpp"
#include "canyon/outputs/view/page.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/view_listener.hpp"

namespace canyon::view {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using test::Listener;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;
using Clock = std::chrono::steady_clock;

/// A client that writes given bytes.
class Client {
 public:
  explicit Client(const Server& server) : socket_(io_) {
    socket_.connect({asio::ip::address_v4::loopback(), static_cast<unsigned short>(server.port())});
  }
  void write(std::string_view bytes) {
    boost::system::error_code error;  // the server may have closed already
    asio::write(socket_, asio::buffer(bytes.data(), bytes.size()), error);
  }
  /// All bytes until the server closes; `closed`: whether it closed.
  std::string rest() {
    std::string text;
    boost::system::error_code error;
    asio::read(socket_, asio::dynamic_buffer(text), error);
    closed = error == asio::error::eof || error == asio::error::connection_reset;
    return text;
  }
  void close() { socket_.close(); }
  /// Waits for a byte.
  bool begins() {
    char first = 0;
    boost::system::error_code error;
    return asio::read(socket_, asio::buffer(&first, 1), error) == 1;
  }
  bool closed = false;

 private:
  asio::io_context io_;
  tcp::socket socket_;
};

std::string host(const Server& server) {
  return "Host: 127.0.0.1:" + std::to_string(server.port()) + "\r\n";
}

/// The response to a request with these lines and the server's own host.
std::string response(const Server& server, const std::string& first_line, const std::string& more = "") {
  Client client(server);
  client.write(first_line + " HTTP/1.1\r\n" + host(server) + "Connection: close\r\n" + more + "\r\n");
  return client.rest();
}

/// Waits until a condition holds, at most 20 s.
template <typename Holds>
bool comes_true(const Holds& holds) {
  const auto until = Clock::now() + std::chrono::seconds(20);
  while (!holds()) {
    if (Clock::now() > until) return false;
    std::this_thread::yield();
  }
  return true;
}

class ServerTest : public testing::Test {
 protected:
  ServerTest() {
    std::filesystem::create_directories(folder() / "below");
    put("view.json", R"({"format":"canyon view"})");
    put("below/deep.json", "secret");
    put("../outside.json", "secret");
    std::filesystem::create_symlink(folder() / "../outside.json", folder() / "link.json");
  }
  void put(const std::string& name, const std::string& text) const { std::ofstream(folder() / name) << text; }
  [[nodiscard]] std::filesystem::path folder() const { return parent_.path() / "view"; }
  [[nodiscard]] ServedSite site() const {
    return {"<!doctype html>a page", folder(), [](const std::string& message) { return "heard " + message; }};
  }

 private:
  test::TemporaryFolder parent_;
};

TEST(ServedName, LeadsNowhereElse) {
  // viewer/schema.json, "file": ^[a-z0-9-]+(\.[a-z0-9]+)+$
  for (const char* name : {"view.json", "city.glb.gz", "block-0-00064.bin.gz"})
    EXPECT_TRUE(is_served_name(name)) << name;
  for (const char* name : {"", ".", "..", "view", ".json", "view.", "a..b", "../view.json", "a/b.json",
                           "A.json", "%2e%2e.json", "a\\b.json", "view.js-on", "view .json", "view.json\n"}) {
    EXPECT_FALSE(is_served_name(name)) << name;
  }
}

TEST_F(ServerTest, GivesThePageAndTheFolderWithAPolicyThatLetsNothingIn) {
  const Server server(site());
  EXPECT_EQ(server.address(), "http://127.0.0.1:" + std::to_string(server.port()) + "/");
  const std::string page = response(server, "GET /");
  EXPECT_THAT(page, StartsWith("HTTP/1.1 200 OK\r\n"));
  EXPECT_THAT(page, HasSubstr("\r\n\r\n<!doctype html>a page"));
  EXPECT_THAT(page, HasSubstr("Content-Security-Policy: default-src 'none';"));
  EXPECT_THAT(page, HasSubstr("frame-ancestors 'none'"));
  EXPECT_THAT(page, HasSubstr("X-Content-Type-Options: nosniff"));
  EXPECT_THAT(page, Not(HasSubstr("http:")));  // no external source
  EXPECT_THAT(page, Not(HasSubstr("https:")));
  EXPECT_THAT(response(server, "GET /view/view.json"), HasSubstr("\r\n\r\n{\"format\":\"canyon view\"}"));
  EXPECT_THAT(response(server, "GET /view/view.json?again"), StartsWith("HTTP/1.1 200"));
  const std::string head = response(server, "HEAD /view/view.json");
  EXPECT_THAT(head, HasSubstr("Content-Length: 24"));
  EXPECT_THAT(head, testing::EndsWith("\r\n\r\n"));
}

TEST_F(ServerTest, RefusesWhatLiesOutsideItsFolder) {
  const Server server(site());
  for (const char* target :
       {"/view/../outside.json", "/view/%2e%2e/outside.json", "/view/..%2foutside.json", "/view/link.json",
        "/view/below/deep.json", "/view/below", "/view/", "/view//etc/passwd", "/etc/passwd", "//etc/passwd",
        "/view/absent.json", "http://127.0.0.1/outside.json"}) {
    const std::string text = response(server, std::string("GET ") + target);
    EXPECT_THAT(text, StartsWith("HTTP/1.1 404")) << target;
    EXPECT_THAT(text, Not(HasSubstr("secret"))) << target;
  }
}

TEST_F(ServerTest, RefusesOtherHostsAndOrigins) {
  const Server server(site());
  const auto request = [&](const std::string& headers) {
    Client client(server);
    client.write("GET / HTTP/1.1\r\nConnection: close\r\n" + headers + "\r\n");
    return client.rest();
  };
  const std::string port = std::to_string(server.port());
  EXPECT_THAT(request(host(server)), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(request("Host: localhost:" + port + "\r\n"), StartsWith("HTTP/1.1 200"));
  // A name resolved to 127.0.0.1 by an attacker's DNS; another port; none; two.
  for (const std::string& other :
       {std::string("Host: evil.example:") + port + "\r\n", std::string("Host: 127.0.0.1\r\n"),
        std::string("Host: 127.0.0.1:1\r\n"), std::string(), host(server) + host(server)}) {
    EXPECT_THAT(request(other), StartsWith("HTTP/1.1 403")) << other;
  }
  EXPECT_THAT(request(host(server) + "Origin: http://127.0.0.1:" + port + "\r\n"),
              StartsWith("HTTP/1.1 200"));
  for (const char* origin :
       {"http://evil.example", "https://127.0.0.1", "null", "http://127.0.0.1:1", "file://"}) {
    EXPECT_THAT(request(host(server) + "Origin: " + origin + "\r\n"), StartsWith("HTTP/1.1 403")) << origin;
  }
}

TEST_F(ServerTest, RefusesOtherMethodsBodiesLongHeadersAndGarbage) {
  const Server server(site());
  EXPECT_THAT(response(server, "POST /"), StartsWith("HTTP/1.1 405"));
  EXPECT_THAT(response(server, "DELETE /view/view.json"), StartsWith("HTTP/1.1 405"));
  for (const std::string& bytes :
       {"POST / HTTP/1.1\r\n" + host(server) + "Content-Length: 4\r\n\r\nbody",
        "GET / HTTP/1.1\r\n" + host(server) + "X-Long: " + std::string(9000, 'x') + "\r\n\r\n",
        std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03 hello\r\n\r\n", 21),
        std::string("\r\n\0\0\xff\xff\r\n\r\n", 10), std::string("GET  /  HTTP/9.9\r\n\r\n")}) {
    Client client(server);
    client.write(bytes);
    const std::string text = client.rest();
    EXPECT_TRUE(client.closed);
    EXPECT_THAT(text, Not(HasSubstr("200 OK")));
  }
  EXPECT_THAT(response(server, "GET /"), StartsWith("HTTP/1.1 200"));  // and continues
}

TEST_F(ServerTest, BoundsItsClients) {
  ServerOptions options;
  options.max_clients = 2;
  const Server server(site(), options);
  Client first(server);
  ASSERT_TRUE(comes_true([&] { return server.clients() == 1; }));
  Client second(server);
  ASSERT_TRUE(comes_true([&] { return server.clients() == 2; }));
  // Idle connections do not lock out others.
  EXPECT_THAT(response(server, "GET /"), StartsWith("HTTP/1.1 200"));
  EXPECT_EQ(first.rest(), "");
  EXPECT_TRUE(first.closed);
  ASSERT_TRUE(comes_true([&] { return server.clients() == 1; }));
  EXPECT_FALSE(second.closed);
}

TEST_F(ServerTest, TurnsAwayMoreThanItsClientsAtWork) {
  std::string large;
  large.resize(64'000'000, 'x');  // more than the system's buffers hold
  put("large.bin", large);
  ServerOptions options;
  options.max_clients = 1;
  const Server server(site(), options);
  Client at_work(server);
  at_work.write("GET /view/large.bin HTTP/1.1\r\n" + host(server) + "\r\n");
  ASSERT_TRUE(at_work.begins());
  Client more(server);
  EXPECT_EQ(more.rest(), "");
  EXPECT_TRUE(more.closed);
}

TEST_F(ServerTest, LetsStalledClientsGoAndServesOthersMeanwhile) {
  std::string large;
  large.resize(64'000'000, 'x');  // more than the system's buffers hold
  put("large.bin", large);
  ServerOptions options;
  options.timeout = std::chrono::milliseconds(300);
  const Server server(site(), options);
  Client silent(server), half(server), unread(server);
  half.write("GET / HTTP/1.1\r\nHo");
  unread.write("GET /view/large.bin HTTP/1.1\r\n" + host(server) + "\r\n");
  EXPECT_THAT(response(server, "GET /"), StartsWith("HTTP/1.1 200"));
  EXPECT_TRUE(comes_true([&] { return server.clients() == 0; }));
  EXPECT_EQ(silent.rest(), "");
  EXPECT_TRUE(silent.closed);
  EXPECT_EQ(half.rest(), "");
  EXPECT_LT(unread.rest().size(), 64'000'000U);
}

TEST_F(ServerTest, AnswersMessagesAndGreets) {
  Server server(site());
  server.greet({"welcome", "again"});
  Listener listener(server);
  ASSERT_FALSE(listener.error);
  EXPECT_EQ(listener.read(), "welcome");
  EXPECT_EQ(listener.read(), "again");
  listener.write("hello");
  EXPECT_EQ(listener.read(), "heard hello");
  Listener other(server);
  other.read();
  other.read();
  server.send("news");
  EXPECT_EQ(listener.read(), "news");
  EXPECT_EQ(other.read(), "news");
}

TEST_F(ServerTest, TakesNoWebSocketOfAnotherOrigin) {
  const Server server(site());
  EXPECT_TRUE(Listener(server, "http://evil.example").error);
  EXPECT_TRUE(Listener(server, "null").error);
  EXPECT_FALSE(Listener(server).error);
  EXPECT_THAT(response(server, "GET /view/view.json", "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"),
              StartsWith("HTTP/1.1 200"));  // no upgrade without Connection: upgrade
}

TEST_F(ServerTest, AsksNoMoreForAClientThatTakesNoAnswer) {
  std::atomic<int> requested{0};
  ServedSite large = site();
  large.handle_message = [&](const std::string&) {
    ++requested;
    return std::string(1 << 20, 'x');
  };
  const Server server(large);
  Listener listener(server);
  for (int i = 0; i < 200; ++i) listener.write("more");
  EXPECT_TRUE(comes_true([&] { return requested > 0; }));
  // Requests in the system's buffers may be answered; a second suffices for all 200.
  const auto until = Clock::now() + std::chrono::seconds(1);
  EXPECT_TRUE(comes_true([&] { return requested == 200 || Clock::now() > until; }));
  EXPECT_LT(requested, 60);
  for (int i = 0; i < 200; ++i) EXPECT_EQ(listener.read().size(), std::size_t{1} << 20);
  EXPECT_EQ(requested, 200);
}

TEST_F(ServerTest, EndsAClientWhoseMessageIsTooLong) {
  const Server server(site());
  Listener listener(server);
  listener.write(std::string(4097, 'x'));
  EXPECT_EQ(listener.read(), "");
  EXPECT_TRUE(listener.error);
  EXPECT_TRUE(comes_true([&] { return server.clients() == 0; }));
}

TEST_F(ServerTest, DropsTheOldestForAClientThatDoesNotReadAndNothingForOthers) {
  ServerOptions options;
  options.max_queued = 4;
  options.timeout = std::chrono::milliseconds(1000);
  Server server(site(), options);
  {
    Listener stalled(server), reader(server);
    stalled.write("there");  // the response shows that both are registered at the server
    reader.write("there");
    EXPECT_EQ(reader.read(), "heard there");
    EXPECT_EQ(stalled.read(), "heard there");
    // Until the system's buffers of the stalled client are full; the reader keeps up and loses none.
    const std::string filling(100'000, 'x');
    for (int i = 0; server.dropped() == 0 && i < 10'000; ++i) {
      server.send(std::to_string(i) + " " + filling);
      EXPECT_THAT(reader.read(), StartsWith(std::to_string(i) + " "));
    }
    EXPECT_GT(server.dropped(), 0U);
    // The stalled client does not answer pings either and is dropped. The reader answers them while reading.
    EXPECT_TRUE(comes_true([&] {
      server.send("still there");
      return reader.read() == "still there" && server.clients() == 1;
    }));
  }
  EXPECT_TRUE(comes_true([&] { return server.clients() == 0; }));
}

TEST_F(ServerTest, SaysWhatIsWrongWithAPort) {
  const Server server(site());
  ServerOptions options;
  options.port = server.port();
  try {
    const Server second(site(), options);
    FAIL() << "two servers at one port";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("port " + std::to_string(server.port()) + " of 127.0.0.1 cannot be opened"));
  }
  options.port = 65536;
  EXPECT_THROW(Server(site(), options), InputError);
}

}  // namespace
}  // namespace canyon::view
