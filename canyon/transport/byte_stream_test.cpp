#include "canyon/transport/byte_stream.hpp"

#include <gtest/gtest.h>
#include <poll.h>

#include <chrono>
#include <future>

#include "canyon/base/output_file.hpp"
#include "canyon/transport/tcp.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/local_connection.hpp"

namespace canyon::transport::byte_stream_test {
namespace {

using namespace std::chrono_literals;

std::string many_bytes() {
  std::string bytes(20'000'000, ' ');
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * i % 251);
  return bytes;
}

TEST(ByteStream, WaitsForAReaderAndForItsReading) {
  const int port = test::free_port();
  const std::string bytes = many_bytes();
  ByteStream stream("tcp://127.0.0.1:" + std::to_string(port));
  auto reader = std::async(std::launch::async, [&] {
    test::LocalConnection connection(port);
    connection.say("what a reader says is thrown away");
    std::string all = connection.read(bytes.size());
    EXPECT_EQ(connection.read_some(), "");  // the end
    return all;
  });
  for (std::size_t at = 0; at < bytes.size(); at += 1'000'000)
    stream.write(std::string_view(bytes).substr(at, 1'000'000));
  stream.finish();
  EXPECT_TRUE(reader.get() == bytes);
}

TEST(ByteStream, ConnectsToAReader) {
  const int port = test::free_port();
  TcpServer server(port);
  ByteStream stream("tcp-connect://127.0.0.1:" + std::to_string(port), 200ms);
  stream.write("samples");
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

std::string problem_of(ByteStream& stream) {
  try {
    for (int i = 0; i < 100; ++i) stream.write(std::string(1'000'000, 'x'));
  } catch (const OutputError& error) {
    return error.what();
  }
  return "none";
}

TEST(ByteStream, EndsWithOneLineWhereTheReaderStallsOrHangsUp) {
  const int port = test::free_port();
  const std::string address = "tcp://127.0.0.1:" + std::to_string(port);
  {
    ByteStream stream(address, 100ms);
    test::LocalConnection connection(port);
    EXPECT_NE(problem_of(stream).find("has taken nothing for 0.1 s"), std::string::npos);
    EXPECT_THROW(ByteStream("tcp-connect://127.0.0.1:" + std::to_string(port)),
                 OutputError);  // taken already
  }
  ByteStream stream(address, 100ms);
  test::LocalConnection connection(port);
  stream.write("begin");
  EXPECT_EQ(connection.read(5), "begin");
  connection.abort();
  EXPECT_NE(problem_of(stream).find("the reader is gone"), std::string::npos);
}

TEST(ByteStream, RefusesWhatIsNoAddress) {
  EXPECT_TRUE(ByteStream::is_address("tcp://127.0.0.1:5000"));
  EXPECT_FALSE(ByteStream::is_address("drive.iq"));
  EXPECT_THROW(ByteStream("udp://127.0.0.1:5000"), InputError);
  EXPECT_THROW(ByteStream("tcp://127.0.0.1"), InputError);
  EXPECT_THROW(ByteStream("tcp://127.0.0.1:70000"), InputError);
  EXPECT_THROW(ByteStream("tcp://nowhere.example:5000"), InputError);
}

}  // namespace
}  // namespace canyon::transport::byte_stream_test
