// Declared in canyon/transport/transport.hpp.
#include <fmt/format.h>

#include "canyon/base/input_error.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/transport/devices.hpp"
#include "canyon/transport/ntrip.hpp"

namespace canyon::transport {
namespace {

class File final : public Transport {
 public:
  explicit File(const std::string& path) : file_(path) {}
  void send(std::string_view bytes) override { file_.write(bytes); }
  void finish(const std::optional<Correction>& correction) override {
    if (correction) file_.overwrite(correction->offset, correction->bytes);
    file_.commit();
  }

 private:
  OutputFile file_;
};

/// The rest of a text that begins with `start`; empty for other texts.
std::optional<std::string_view> behind(std::string_view text, std::string_view start) {
  if (text.substr(0, start.size()) != start) return std::nullopt;
  return text.substr(start.size());
}

}  // namespace

HostPort host_and_port(std::string_view rest, std::string_view address) {
  const std::size_t colon = rest.rfind(':');
  const auto port = colon == std::string_view::npos ? std::nullopt : parse_integer(rest.substr(colon + 1));
  if (!port || *port < 1 || *port > 65535 || colon == 0) {
    throw InputError(fmt::format("'{}' has no host and port of 1 to 65535", address),
                     "write HOST:PORT, such as 127.0.0.1:10110");
  }
  return {std::string(rest.substr(0, colon)), static_cast<int>(*port)};
}

bool is_file_address(std::string_view address) {
  return behind(address, "file:").has_value();
}

bool is_input_address(std::string_view address) {
  return address == "stdin:" || behind(address, "ntrip://");
}

const char* address_forms() {
  return "tcp://127.0.0.1:PORT (a server), tcp-connect://HOST:PORT, udp://HOST:PORT, "
         "udp-listen://127.0.0.1:PORT, pty:, pty:LINK, 'pty:LINK@9600', 'serial:/dev/ttyUSB0@115200', "
         "ntrip-caster://[USER:PASSWORD@]127.0.0.1:PORT/MOUNT, ntrip-source://USER:PASSWORD@HOST:PORT/MOUNT, "
         "file:PATH";
}

std::unique_ptr<Transport> open_transport(std::string_view address) {
  if (const auto path = behind(address, "file:"); path && !path->empty()) {
    return std::make_unique<File>(std::string(*path));
  }
  using Maker = std::unique_ptr<Transport> (*)(const HostPort&);
  static constexpr std::pair<std::string_view, Maker> kHosts[]{{"tcp://", make_tcp_server},
                                                               {"tcp-connect://", make_tcp_client},
                                                               {"udp://", make_udp},
                                                               {"udp-listen://", make_udp_listener}};
  for (const auto& [start, make] : kHosts) {
    if (const auto rest = behind(address, start)) return make(host_and_port(*rest, address));
  }
  if (behind(address, "ntrip-caster://")) return make_ntrip_mount(ntrip_address(address));
  if (behind(address, "ntrip://") || behind(address, "ntrip-source://")) {
    return std::make_unique<NtripClient>(address);
  }
  const auto baud_behind = [](std::string_view text, std::size_t at) -> std::optional<int> {
    const auto baud = at == std::string_view::npos ? std::nullopt : parse_integer(text.substr(at + 1));
    if (!baud || *baud < 1 || *baud > 4'000'000) return std::nullopt;
    return static_cast<int>(*baud);
  };
  if (const auto rest = behind(address, "pty:")) {
    const std::size_t at = rest->rfind('@');
    const auto baud = baud_behind(*rest, at);
    return make_pseudo_terminal(std::string(baud ? rest->substr(0, at) : *rest), baud);
  }
  if (address == "stdin:") return make_standard_input();
  if (const auto rest = behind(address, "serial:")) {
    const std::size_t at = rest->rfind('@');
    const auto baud = baud_behind(*rest, at);
    if (!baud || at == 0) {
      throw InputError(fmt::format("'{}' has no device and baud rate", address),
                       "write such as serial:/dev/ttyUSB0@115200");
    }
    return make_serial(std::string(rest->substr(0, at)), *baud);
  }
  throw InputError(fmt::format("'{}' is not an address", address), fmt::format("write {}", address_forms()));
}

}  // namespace canyon::transport
