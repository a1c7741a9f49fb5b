#include "canyon/base/transport/byte_sink.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <zmq.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string>

#include "canyon/base/input_error.hpp"
#include "canyon/base/transport/devices.hpp"

namespace canyon::transport {
namespace {

using asio::ip::tcp;
using std::chrono::milliseconds;
constexpr std::string_view kListen = "tcp://", kConnect = "tcp-connect://", kZmq = "zmq://";

OutputError reader_gone(const std::string& address, std::string_view why) {
  return {address, 0, fmt::format("the reader is gone{}", why), "restart both"};
}
OutputError reader_stalls(const std::string& address, milliseconds patience) {
  return {address, 0, fmt::format("the reader has read nothing for {} s", patience.count() * 1e-3),
          "start both again, and check that the reader reads"};
}

/// Whether a descriptor is ready for `events` in time. @param patience empty: without end
bool ready(int handle, short events, std::optional<milliseconds> patience) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point end = Clock::now() + patience.value_or(milliseconds(0));
  while (true) {
    const auto left = std::chrono::duration_cast<milliseconds>(end - Clock::now()).count();
    pollfd wait{handle, events, 0};
    const int found = poll(&wait, 1, patience ? static_cast<int>(std::max<std::int64_t>(left, 0)) : -1);
    if (found != -1 || errno != EINTR) return found > 0;
  }
}

/// One reader over TCP; later ones are rejected.
class TcpSink final : public ByteSink {
 public:
  TcpSink(std::string_view address, milliseconds patience) : address_(address), patience_(patience) {
    if (address.starts_with(kListen)) {
      acceptor_ = listen_on(io_, host_and_port(address.substr(kListen.size()), address));
      return;
    }
    error_code error;
    socket_.connect(tcp_endpoint(host_and_port(address.substr(kConnect.size()), address)), error);
    if (error) {
      throw OutputError(address_, 0, fmt::format("cannot be reached: {}", error.message()),
                        "start the reader first");
    }
    claim_terminal(socket_);
  }

  void wait_for_reader() override {
    while (acceptor_) {
      if (!ready(acceptor_->native_handle(), POLLIN, std::nullopt)) continue;
      error_code error;
      acceptor_->accept(socket_, error);
      if (error) continue;  // disconnected again
      claim_terminal(socket_);
      acceptor_.reset();
    }
  }
  void write(std::string_view bytes) override {
    wait_for_reader();
    while (!bytes.empty()) {
      error_code error;
      bytes.remove_prefix(socket_.write_some(asio::buffer(bytes.data(), bytes.size()), error));
      if (!error) continue;
      if (!would_block(error)) throw reader_gone(address_, ": " + error.message());
      if (!ready(socket_.native_handle(), POLLOUT, patience_)) throw reader_stalls(address_, patience_);
    }
  }
  void finish() override {
    if (!socket_.is_open()) return;
    // Closing a socket with unread input drops bytes that the other end has not read yet.
    error_code error;
    socket_.shutdown(tcp::socket::shutdown_send, error);
    std::array<char, 4096> buffer;
    while (!error && ready(socket_.native_handle(), POLLIN, patience_)) {
      (void)socket_.read_some(asio::buffer(buffer), error);
      if (would_block(error)) error.clear();
    }
    socket_.close(error);
  }

 private:
  std::string address_;
  milliseconds patience_;
  asio::io_context io_;
  std::optional<tcp::acceptor> acceptor_;
  tcp::socket socket_{io_};
};

/// A publisher that drops no message: XPUB with ZMQ_XPUB_NODROP (zmq_setsockopt(3)).
class ZmqPublisher final : public ByteSink {
 public:
  ZmqPublisher(std::string_view address, milliseconds patience)
      : address_(address),
        patience_(patience),
        context_(zmq_ctx_new()),
        socket_(zmq_socket(context_, ZMQ_XPUB)) {
    const HostPort at = host_and_port(address.substr(kZmq.size()), address);
    set(ZMQ_XPUB_NODROP, 1);
    set(ZMQ_SNDTIMEO, static_cast<int>(patience.count()));
    set(ZMQ_LINGER, static_cast<int>(patience.count()));
    set(ZMQ_SNDHWM, kMaxMessages);
    if (zmq_bind(socket_, fmt::format("tcp://{}:{}", at.host, at.port).c_str()) != 0) {
      const std::string reason = zmq_strerror(zmq_errno());
      close();
      throw InputError(fmt::format("'{}' cannot be opened: {}", address_, reason), "choose another port");
    }
  }
  ~ZmqPublisher() override {
    set(ZMQ_LINGER, 0);
    close();
  }
  ZmqPublisher(const ZmqPublisher&) = delete;
  ZmqPublisher& operator=(const ZmqPublisher&) = delete;

  void wait_for_reader() override {
    while (readers_ == 0) take_subscription(0);
  }
  void write(std::string_view bytes) override {
    wait_for_reader();
    while (take_subscription(ZMQ_DONTWAIT)) {
    }
    if (readers_ == 0) throw reader_gone(address_, "");
    while (zmq_send(socket_, bytes.data(), bytes.size(), 0) < 0)
      if (zmq_errno() != EINTR) throw reader_stalls(address_, patience_);
  }
  void finish() override { close(); }

 private:
  static constexpr int kMaxMessages = 100;  ///< of a millisecond of samples each

  void set(int option, int value) {
    if (socket_ != nullptr) (void)zmq_setsockopt(socket_, option, &value, sizeof value);
  }
  /// Counts connecting and disconnecting readers. @param flags of zmq_recv()
  bool take_subscription(int flags) {
    unsigned char message[256];
    const int size = zmq_recv(socket_, message, sizeof message, flags);
    if (size <= 0) return size == 0;
    readers_ = std::max(0, readers_ + (message[0] == 1 ? 1 : -1));
    return true;
  }
  void close() {
    if (socket_ != nullptr) zmq_close(socket_);
    if (context_ != nullptr) zmq_ctx_term(context_);
    socket_ = context_ = nullptr;
  }

  std::string address_;
  milliseconds patience_;
  void *context_, *socket_;
  int readers_ = 0;  // XPUB reports the first subscription of a topic, and the end of the last one
};

}  // namespace

bool is_byte_sink(std::string_view address) {
  return address.starts_with(kListen) || address.starts_with(kConnect) || address.starts_with(kZmq);
}

std::unique_ptr<ByteSink> open_byte_sink(std::string_view address, milliseconds patience) {
  if (!is_byte_sink(address)) {
    throw InputError(fmt::format("'{}' is not the address of a stream", address),
                     "write tcp://127.0.0.1:PORT or zmq://127.0.0.1:PORT to listen, or "
                     "tcp-connect://HOST:PORT");
  }
  if (address.starts_with(kZmq)) return std::make_unique<ZmqPublisher>(address, patience);
  return std::make_unique<TcpSink>(address, patience);
}

}  // namespace canyon::transport
