#include <fmt/format.h>

#include "canyon/base/input_error.hpp"
#include "canyon/base/transport/devices.hpp"

namespace canyon::transport {
namespace {

using asio::ip::udp;

/// Sends datagrams of up to kMaxDatagram bytes, split after line ends if one is too small.
template <class Send>
void cut(std::string_view bytes, const Send& send) {
  while (!bytes.empty()) {
    std::size_t size = std::min(bytes.size(), kMaxDatagram);
    if (size < bytes.size()) {
      const std::size_t line = bytes.rfind('\n', size - 1);
      if (line != std::string_view::npos) size = line + 1;
    }
    send(asio::buffer(bytes.data(), size));
    bytes.remove_prefix(size);
  }
}

/// Receives the available datagrams, up to the limit per call.
template <class BlockHandler>
void receive(udp::socket& socket, const BlockHandler& take) {
  std::array<char, 65536> buffer;
  for (int i = 0; i < 256; ++i) {
    error_code error;
    udp::endpoint from;
    const std::size_t size = socket.receive_from(asio::buffer(buffer), from, 0, error);
    if (would_block(error)) return;
    if (!error) take(from, std::string_view(buffer.data(), size));
  }
}

class Udp final : public BufferedTransport {
 public:
  explicit Udp(const HostPort& to) {
    received_.keep_datagrams();
    error_code error;
    const auto found = udp::resolver(io_).resolve(udp::v4(), to.host, std::to_string(to.port), error);
    if (!error) socket_.connect(*found.begin(), error);
    if (error) {
      throw InputError(fmt::format("nothing can be sent to '{}': {}", to.host, error.message()),
                       "write udp://HOST:PORT with a host that this machine can resolve");
    }
    claim_terminal(socket_);
  }
  /// Datagrams that the system rejects are lost.
  void send(std::string_view bytes) override {
    cut(bytes, [this](const asio::const_buffer& datagram) {
      error_code lost;
      socket_.send(datagram, 0, lost);
    });
  }
  void serve() override {
    receive(socket_, [this](const udp::endpoint&, std::string_view bytes) { received_.add(0, bytes); });
  }
  void add_handles(std::vector<int>& handles) const override {
    handles.push_back(const_cast<udp::socket&>(socket_).native_handle());
  }

 private:
  asio::io_context io_;
  udp::socket socket_{io_};
};

class UdpListener final : public BufferedTransport {
 public:
  explicit UdpListener(const HostPort& at) {
    received_.keep_datagrams();
    const asio::ip::address_v4 address = listening_address(at);
    error_code error;
    socket_.open(udp::v4(), error);
    if (!error) socket_.bind({address, static_cast<unsigned short>(at.port)}, error);
    if (error) refuse_port(at, error);
    claim_terminal(socket_);
    if (!address.is_loopback()) notes_.push_back(fmt::format("port {} is open to other machines", at.port));
  }
  void send(std::string_view bytes) override {
    const auto now = Clock::now();
    std::erase_if(peers_, [now](const Peer& peer) { return now - peer.received > kFaithful; });
    for (const Peer& peer : peers_) send_to(peer, bytes);
  }
  [[nodiscard]] std::vector<std::uint64_t> readers() const override {
    std::vector<std::uint64_t> numbers;
    for (const Peer& peer : peers_)
      if (Clock::now() - peer.received <= kFaithful) numbers.push_back(peer.number);
    return numbers;
  }
  void send_to(std::uint64_t reader, std::string_view bytes) override {
    for (const Peer& peer : peers_)
      if (peer.number == reader) send_to(peer, bytes);
  }
  void serve() override {
    receive(socket_, [this](const udp::endpoint& from, std::string_view bytes) {
      received_.add(number_of(from), bytes);
    });
  }
  void add_handles(std::vector<int>& handles) const override {
    handles.push_back(const_cast<udp::socket&>(socket_).native_handle());
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr auto kFaithful = std::chrono::seconds(10);
  struct Peer {
    udp::endpoint at;
    std::uint64_t number;
    Clock::time_point received;
  };

  void send_to(const Peer& peer, std::string_view bytes) {
    cut(bytes, [&](const asio::const_buffer& datagram) {
      error_code lost;
      socket_.send_to(datagram, peer.at, 0, lost);
    });
  }
  /// The number of the peer at an address. A new peer in excess replaces the longest silent one.
  std::uint64_t number_of(const udp::endpoint& from) {
    const auto now = Clock::now();
    const auto found =
        std::find_if(peers_.begin(), peers_.end(), [&](const Peer& peer) { return peer.at == from; });
    if (found != peers_.end()) {
      found->received = now;
      return found->number;
    }
    if (peers_.size() == kMaxClients) {
      peers_.erase(std::min_element(peers_.begin(), peers_.end(),
                                    [](const Peer& a, const Peer& b) { return a.received < b.received; }));
    }
    return peers_.emplace_back(Peer{from, ++met_, now}).number;
  }

  asio::io_context io_;
  udp::socket socket_{io_};
  std::vector<Peer> peers_;
  std::uint64_t met_ = 0;
};

}  // namespace

std::unique_ptr<Transport> make_udp(const HostPort& to) {
  return std::make_unique<Udp>(to);
}
std::unique_ptr<Transport> make_udp_listener(const HostPort& at) {
  return std::make_unique<UdpListener>(at);
}

}  // namespace canyon::transport
