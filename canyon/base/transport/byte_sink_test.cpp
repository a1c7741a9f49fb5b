#include "canyon/base/transport/byte_sink.hpp"

#include <gtest/gtest.h>
#include <poll.h>
#include <zmq.h>

#include <chrono>
#include <functional>
#include <future>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/transport/devices.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/local_connection.hpp"

namespace canyon::transport::byte_sink_test {
namespace {

using namespace std::chrono_literals;

/// A subscriber of everything, like GNU Radio's ZMQ SUB Source.
class Subscriber {
 public:
  explicit Subscriber(int port) : context_(zmq_ctx_new()), socket_(zmq_socket(context_, ZMQ_SUB)) {
    const int patience_ms = 5000;
    zmq_setsockopt(socket_, ZMQ_SUBSCRIBE, "", 0);
    zmq_setsockopt(socket_, ZMQ_RCVTIMEO, &patience_ms, sizeof patience_ms);
    zmq_connect(socket_, ("tcp://127.0.0.1:" + std::to_string(port)).c_str());
  }
  ~Subscriber() {
    zmq_close(socket_);
    zmq_ctx_term(context_);
  }
  Subscriber(const Subscriber&) = delete;
  Subscriber& operator=(const Subscriber&) = delete;
  /// Empty after five seconds without any.
  std::string message() {
    std::string bytes(1 << 16, ' ');
    bytes.resize(static_cast<std::size_t>(std::max(0, zmq_recv(socket_, bytes.data(), bytes.size(), 0))));
    return bytes;
  }

 private:
  void *context_, *socket_;
};

std::string problem_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.problem();
  }
  return {};
}

TEST(ByteSink, ASubscriberGetsEveryMessage) {
  const int port = test::free_port();
  const auto sink = open_byte_sink("zmq://127.0.0.1:" + std::to_string(port), 5s);
  auto reader = std::async(std::launch::async, [port] {
    Subscriber subscriber(port);
    std::vector<std::string> messages;
    messages.reserve(2000);
    for (int i = 0; i < 2000; ++i) {
      messages.push_back(subscriber.message());
    }
    return messages;
  });
  std::vector<std::string> sent;
  for (int i = 0; i < 2000; ++i) {
    sent.push_back(std::string(8000, static_cast<char>(i)) + std::to_string(i));
    sink->write(sent.back());
  }
  sink->finish();
  EXPECT_TRUE(reader.get() == sent);
}

TEST(ByteSink, ASubscriberThatLeavesOrSleepsIsAnError) {
  const int port = test::free_port();
  const auto sink = open_byte_sink("zmq://127.0.0.1:" + std::to_string(port), 200ms);
  {
    Subscriber subscriber(port);
    sink->write("one");
    EXPECT_EQ(subscriber.message(), "one");
  }
  EXPECT_EQ(problem_of([&] {
              const auto end = std::chrono::steady_clock::now() + 5s;
              while (std::chrono::steady_clock::now() < end) sink->write("two");
            }),
            "the reader is gone");
  Subscriber asleep(port);
  EXPECT_EQ(problem_of([&] {
              for (int i = 0; i < 10'000; ++i) sink->write(std::string(100'000, 'x'));
            }),
            "the reader has read nothing for 0.2 s");
}

TEST(ByteSink, RefusesAddressesThatItCannotHave) {
  const int port = test::free_port();
  const auto sink = open_byte_sink("zmq://127.0.0.1:" + std::to_string(port));
  EXPECT_NE(problem_of([&] {
              (void)open_byte_sink("zmq://127.0.0.1:" + std::to_string(port));
            }).find("cannot be opened: Address already in use"),
            std::string::npos);
  EXPECT_NE(problem_of([] { (void)open_byte_sink("zmq://127.0.0.1"); }), "");
  EXPECT_NE(problem_of([] { (void)open_byte_sink("udp://127.0.0.1:1"); }), "");
  for (const char* address :
       {"tcp://127.0.0.1", "tcp://127.0.0.1:70000", "tcp-connect://nowhere.example:5000"}) {
    EXPECT_THROW((void)open_byte_sink(address), InputError) << address;
  }
  EXPECT_TRUE(is_byte_sink("zmq://127.0.0.1:5"));
  EXPECT_TRUE(is_byte_sink("tcp://127.0.0.1:5000"));
  EXPECT_TRUE(is_byte_sink("tcp-connect://127.0.0.1:5"));
  EXPECT_FALSE(is_byte_sink("drive.iq"));
}

/// Sends more than the system's buffers hold.
void flood(ByteSink& sink) {
  for (int i = 0; i < 100; ++i) sink.write(std::string(1'000'000, 'x'));
}

std::string many_bytes() {
  std::string bytes(20'000'000, ' ');
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * i % 251);
  return bytes;
}

TEST(ByteSink, WaitsForAReaderAndForItsReading) {
  const int port = test::free_port();
  const std::string bytes = many_bytes();
  const auto stream = open_byte_sink("tcp://127.0.0.1:" + std::to_string(port));
  auto reader = std::async(std::launch::async, [&] {
    test::LocalConnection connection(port);
    connection.send_text("what a reader says is thrown away");
    std::string all = connection.read(bytes.size());
    EXPECT_EQ(connection.read_some(), "");  // the end
    return all;
  });
  for (std::size_t at = 0; at < bytes.size(); at += 1'000'000)
    stream->write(std::string_view(bytes).substr(at, 1'000'000));
  stream->finish();
  EXPECT_TRUE(reader.get() == bytes);
}

TEST(ByteSink, ConnectsToAReader) {
  const int port = test::free_port();
  TcpServer server(port);
  const auto stream = open_byte_sink("tcp-connect://127.0.0.1:" + std::to_string(port), 200ms);
  stream->write("samples");
  std::string got;
  for (int i = 0; i < 20 && got.size() < 7; ++i) {
    std::vector<int> handles;
    server.add_handles(handles);
    std::vector<pollfd> waits;
    for (const int handle : handles) waits.push_back({handle, POLLIN, 0});
    poll(waits.data(), waits.size(), 5'000);
    server.serve();
    for (const Received& received : server.take_received()) got += received.bytes;
  }
  EXPECT_EQ(got, "samples");
}

TEST(ByteSink, EndsWithOneLineWhereTheReaderStallsOrHangsUp) {
  const int port = test::free_port();
  const std::string address = "tcp://127.0.0.1:" + std::to_string(port);
  {
    const auto stream = open_byte_sink(address, 100ms);
    test::LocalConnection connection(port);
    EXPECT_NE(problem_of([&] { flood(*stream); }).find("has read nothing for 0.1 s"), std::string::npos);
    EXPECT_THROW((void)open_byte_sink("tcp-connect://127.0.0.1:" + std::to_string(port)),
                 OutputError);  // taken by another sink
  }
  const auto stream = open_byte_sink(address, 100ms);
  test::LocalConnection connection(port);
  stream->write("begin");
  EXPECT_EQ(connection.read(5), "begin");
  connection.abort();
  EXPECT_NE(problem_of([&] { flood(*stream); }).find("the reader is gone"), std::string::npos);
}

}  // namespace
}  // namespace canyon::transport::byte_sink_test
