#include "canyon/transport/byte_stream.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <array>
#include <cerrno>
#include <optional>

#include "canyon/base/output_file.hpp"
#include "canyon/transport/devices.hpp"

namespace canyon::transport {
namespace {

using asio::ip::tcp;
using Clock = std::chrono::steady_clock;
constexpr std::string_view kListen = "tcp://", kConnect = "tcp-connect://";

/// Whether a descriptor is ready for `events` in time. @param patience empty: without end
bool ready(int handle, short events, std::optional<std::chrono::milliseconds> patience) {
  const Clock::time_point end = Clock::now() + patience.value_or(std::chrono::milliseconds(0));
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    pollfd wait{handle, events, 0};
    const int found = poll(&wait, 1, patience ? static_cast<int>(std::max<std::int64_t>(left, 0)) : -1);
    if (found != -1 || errno != EINTR) return found > 0;
  }
}

}  // namespace

struct ByteStream::Impl {
  std::string address;
  std::chrono::milliseconds patience;
  asio::io_context io;
  std::optional<tcp::acceptor> acceptor;
  tcp::socket socket{io};
};

bool ByteStream::is_address(std::string_view text) {
  return text.substr(0, kListen.size()) == kListen || text.substr(0, kConnect.size()) == kConnect;
}

ByteStream::ByteStream(std::string_view address, std::chrono::milliseconds patience)
    : impl_(std::make_unique<Impl>()) {
  impl_->address = address;
  impl_->patience = patience;
  if (!is_address(address)) {
    throw InputError(fmt::format("'{}' is no address of a stream", address),
                     "write tcp://127.0.0.1:PORT to listen, or tcp-connect://HOST:PORT");
  }
  const bool listens = address.substr(0, kListen.size()) == kListen;
  const HostPort at = host_and_port(address.substr((listens ? kListen : kConnect).size()), address);
  if (listens) {
    impl_->acceptor = listen_on(impl_->io, at);
    return;
  }
  error_code error;
  const auto found = tcp::resolver(impl_->io).resolve(tcp::v4(), at.host, std::to_string(at.port), error);
  if (!error) asio::connect(impl_->socket, found, error);
  if (error) {
    throw OutputError(impl_->address, 0, fmt::format("cannot be reached: {}", error.message()),
                      "start the reader first");
  }
  make_our_own(impl_->socket);
}
ByteStream::~ByteStream() = default;
ByteStream::ByteStream(ByteStream&&) noexcept = default;
ByteStream& ByteStream::operator=(ByteStream&&) noexcept = default;

void ByteStream::wait_for_reader() {
  while (impl_->acceptor) {
    if (!ready(impl_->acceptor->native_handle(), POLLIN, std::nullopt)) continue;
    error_code error;
    impl_->acceptor->accept(impl_->socket, error);
    if (error) continue;  // gone again
    make_our_own(impl_->socket);
    impl_->acceptor.reset();
  }
}

void ByteStream::write(std::string_view bytes) {
  wait_for_reader();
  while (!bytes.empty()) {
    error_code error;
    bytes.remove_prefix(impl_->socket.write_some(asio::buffer(bytes.data(), bytes.size()), error));
    if (!error) continue;
    if (!would_block(error)) {
      throw OutputError(impl_->address, 0, fmt::format("the reader is gone: {}", error.message()),
                        "start both again");
    }
    if (ready(impl_->socket.native_handle(), POLLOUT, impl_->patience)) continue;
    throw OutputError(impl_->address, 0,
                      fmt::format("the reader has taken nothing for {} s", impl_->patience.count() * 1e-3),
                      "make it read, and start both again");
  }
}

void ByteStream::finish() {
  if (!impl_->socket.is_open()) return;
  // A socket that is closed with bytes unread takes back what the other end has not read yet.
  error_code error;
  impl_->socket.shutdown(tcp::socket::shutdown_send, error);
  std::array<char, 4096> buffer;
  while (!error && ready(impl_->socket.native_handle(), POLLIN, impl_->patience)) {
    (void)impl_->socket.read_some(asio::buffer(buffer), error);
    if (would_block(error)) error.clear();
  }
  impl_->socket.close(error);
}

}  // namespace canyon::transport
