#include "canyon/transport/byte_sink.hpp"

#include <fmt/format.h>
#include <zmq.h>

#include <algorithm>
#include <cerrno>
#include <string>

#include "canyon/base/output_file.hpp"
#include "canyon/transport/byte_stream.hpp"
#include "canyon/transport/devices.hpp"

namespace canyon::transport {
namespace {

constexpr std::string_view kZmq = "zmq://";

/// A publisher that drops no message: XPUB with ZMQ_XPUB_NODROP (zmq_setsockopt(3)).
class ZmqPublisher final : public ByteSink {
 public:
  ZmqPublisher(std::string_view address, std::chrono::milliseconds patience)
      : address_(address),
        patience_(patience),
        context_(zmq_ctx_new()),
        socket_(zmq_socket(context_, ZMQ_XPUB)) {
    const HostPort at = host_and_port(address.substr(kZmq.size()), address);
    set(ZMQ_XPUB_NODROP, 1);
    set(ZMQ_SNDTIMEO, static_cast<int>(patience.count()));
    set(ZMQ_LINGER, static_cast<int>(patience.count()));
    set(ZMQ_SNDHWM, kMostMessages);
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
    if (readers_ == 0) throw OutputError(address_, 0, "the reader is gone", "start both again");
    while (zmq_send(socket_, bytes.data(), bytes.size(), 0) < 0) {
      if (zmq_errno() == EINTR) continue;
      throw OutputError(address_, 0,
                        fmt::format("the reader has taken nothing for {} s", patience_.count() * 1e-3),
                        "make it read, and start both again");
    }
  }
  void finish() override { close(); }

 private:
  /// Of a millisecond of samples each.
  static constexpr int kMostMessages = 100;

  void set(int option, int value) {
    if (socket_ != nullptr) (void)zmq_setsockopt(socket_, option, &value, sizeof value);
  }
  /// Says who has come or gone. @param flags of zmq_recv()
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
  std::chrono::milliseconds patience_;
  void *context_, *socket_;
  int readers_ = 0;  // XPUB reports the first subscription of a topic, and the end of the last one
};

}  // namespace

bool is_byte_sink(std::string_view address) {
  return ByteStream::is_address(address) || address.substr(0, kZmq.size()) == kZmq;
}

std::unique_ptr<ByteSink> open_byte_sink(std::string_view address, std::chrono::milliseconds patience) {
  if (address.substr(0, kZmq.size()) == kZmq) return std::make_unique<ZmqPublisher>(address, patience);
  return std::make_unique<ByteStream>(address, patience);
}

}  // namespace canyon::transport
