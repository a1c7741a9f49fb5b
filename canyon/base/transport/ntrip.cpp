#include "canyon/base/transport/ntrip.hpp"

#include <fmt/format.h>

#include <boost/beast/http.hpp>
#include <limits>

#include "canyon/base/input_error.hpp"
#include "canyon/base/payload.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/transport/devices.hpp"
#include "canyon/base/transport/link.hpp"

namespace canyon::transport {

namespace http = boost::beast::http;

std::string NtripAddress::credentials() const {
  return user.empty() && password.empty() ? "" : base64(user + ":" + password);
}

NtripAddress ntrip_address(std::string_view address) {
  const std::size_t begin = address.find("://") + 3, at = address.rfind('@');
  const std::size_t slash = address.rfind('/');
  const std::string form = fmt::format("write {}[USER:PASSWORD@]HOST:PORT/MOUNT", address.substr(0, begin));
  NtripAddress parts;
  const bool secret = at != std::string_view::npos && slash < at;  // a password may have one
  if (slash >= begin && !secret) parts.mount = address.substr(slash + 1);
  if (parts.mount.empty()) throw InputError(fmt::format("'{}' has no mount point", address), form);
  constexpr std::size_t kMax = 100;
  if (parts.mount.size() > kMax || !std::all_of(parts.mount.begin(), parts.mount.end(), [](char c) {
        return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
               std::string_view("._-+").find(c) != std::string_view::npos;
      })) {
    throw InputError(fmt::format("'{}' is not a mount point", parts.mount),
                     fmt::format("{}; MOUNT has up to {} letters, digits, and . _ - +", form, kMax));
  }
  if (at != std::string_view::npos) {
    const std::string_view who = address.substr(begin, at - begin);
    const std::size_t colon = who.find(':');
    parts.user = who.substr(0, colon);
    if (colon != std::string_view::npos) parts.password = who.substr(colon + 1);
  }
  const std::size_t host = at == std::string_view::npos ? begin : at + 1;
  parts.at = host_and_port(address.substr(host, slash - host), address);
  return parts;
}

std::optional<std::pair<std::string, std::size_t>> http_head(std::string_view bytes) {
  std::string lines;
  for (std::size_t at = 0, end = 0; (end = bytes.find('\n', at)) != std::string_view::npos; at = end + 1) {
    std::string_view line = bytes.substr(at, end - at);
    if (line.ends_with('\r')) line.remove_suffix(1);
    lines += fmt::format("{}\r\n", line);
    if (line.empty()) return {{std::move(lines), end + 1}};
  }
  return std::nullopt;
}

std::string http_chunk(std::string_view bytes) {
  return fmt::format("{:x}\r\n{}\r\n", bytes.size(), bytes);
}

struct NtripClient::Impl {
  using Clock = TcpClient::Clock;
  enum class Phase { Over, Head, Raw, Http, Table };
  static constexpr std::size_t kMaxResponseBytes = std::size_t{16} * 1024;
  static constexpr std::size_t kMaxLine = 4096, kMaxMounts = 1000;

  Impl(std::string_view address, const Options& o)
      : to(ntrip_address(address)),
        source(address.substr(0, 12) == "ntrip-source"),
        options(o),
        tcp(to.at, o.first_pause, o.longest_pause) {}

  [[nodiscard]] std::string request() const {
    const std::string secret = to.credentials();
    const std::string authorization =
        secret.empty() ? "" : fmt::format("Authorization: Basic {}\r\n", secret);
    constexpr const char* kAgent = "NTRIP Canyon";
    const std::string mount = requests_table ? "" : to.mount;
    if (revision == 1 && source)
      return fmt::format("SOURCE {} /{}\r\nSource-Agent: {}\r\n\r\n", to.password, mount, kAgent);
    if (revision == 1)
      return fmt::format("GET /{} HTTP/1.0\r\nUser-Agent: {}\r\n{}\r\n", mount, kAgent, authorization);
    const std::string_view more = source ? "Content-Type: gnss/data\r\nTransfer-Encoding: chunked\r\n" : "";
    const std::string position =
        gga.empty() ? "" : fmt::format("Ntrip-GGA: {}\r\n", trim(gga.substr(0, gga.find('\n'))));
    return fmt::format(
        "{} /{} HTTP/1.1\r\nHost: {}:{}\r\nNtrip-Version: Ntrip/2.0\r\nUser-Agent: {}\r\n{}{}{}"
        "Connection: close\r\n\r\n",
        source ? "POST" : "GET", mount, to.at.host, to.at.port, kAgent, authorization, position, more);
  }

  void serve() {
    if (tcp.away()) tcp.begin(request());
    const std::uint64_t connections = tcp.connections(), failures = tcp.failures();
    tcp.serve();
    (void)tcp.take_notes();  // its own notes repeat these
    if (tcp.connections() != connections) {
      phase = Phase::Head;
      response.clear();
      lines = LineCutter(kMaxLine);
      last_byte = Clock::now();
    }
    for (const Received& piece : tcp.take_received()) take(piece.bytes);
    if (phase == Phase::Over) {
      if (tcp.failures() != failures) end(State::Closed, "no response");
    } else if (tcp.away()) {
      disconnect();
    } else if (!(source && status.state == State::Streaming) && Clock::now() - last_byte > options.patience) {
      end(State::Stalled, fmt::format("no byte for {} s", options.patience.count() / 1000.0));
    }
  }

  void take(std::string_view bytes) {
    switch (phase) {
      case Phase::Over:
        break;
      case Phase::Raw:
        stream(bytes);
        break;
      case Phase::Table:
        take_table(bytes);
        break;
      case Phase::Head:
        response += bytes;
        read_answer();
        break;
      case Phase::Http:
        response += bytes;
        read_http();
        break;
    }
  }

  void read_answer() {
    const std::size_t end_of_line = response.find('\n');
    if (end_of_line == std::string::npos) {
      if (response.size() > kMaxResponseBytes) misunderstood("the response is not that of an NTRIP caster");
      return;
    }
    const std::string line(trim(std::string_view(response).substr(0, end_of_line)));
    if (line.starts_with("HTTP/1.")) {
      read_code(line);
    } else if (line.starts_with("ICY 200") || (source && line == "OK")) {
      response.erase(0, end_of_line + 1);
      // Skips an empty line that some casters add.
      if (const auto head = http_head(response.substr(0, 2)); head && head->first == "\r\n")
        response.erase(0, head->second);
      begin_stream(Phase::Raw);
    } else if (line.starts_with("SOURCETABLE 200")) {
      phase = Phase::Table;
      take_table(response);
    } else if (lower_case(line).find("password") != std::string::npos) {
      end(State::Refused, kWrongPassword);
    } else if (line.starts_with("ERROR")) {
      misunderstood(fmt::format("the caster responds '{}'", printable(line)));
    } else {
      misunderstood("the response is not that of an NTRIP caster");
    }
  }

  void read_code(std::string_view line) {
    const auto code = parse_integer(column(line, 9, 3)).value_or(0);
    if (code == 200 && source) {
      begin_stream(Phase::Raw);
    } else if (code == 200) {
      parser.emplace();
      parser->body_limit(std::numeric_limits<std::uint64_t>::max());
      phase = Phase::Http;
      read_http();
    } else if (code == 401 || code == 403) {
      end(State::Refused, kWrongPassword);
    } else if (code == 404) {
      end(State::Refused, no_such_mount());
      requests_table = !source && status.mounts.empty();
    } else {
      misunderstood(fmt::format("the caster responds '{}'", printable(line)));
    }
  }

  void read_http() {
    if (!parser->is_header_done()) {
      const auto head = http_head(response);
      if (!head && response.size() > kMaxResponseBytes)
        misunderstood("the caster's HTTP is broken: endless lines");
      if (!head) return;
      response.replace(0, head->second, head->first);
    }
    std::array<char, 4096> room;
    while (!response.empty() && phase == Phase::Http) {
      auto& body = parser->get().body();
      body.data = room.data();
      body.size = room.size();
      const bool began = parser->is_header_done();
      error_code error;
      response.erase(0, parser->put(asio::buffer(response), error));
      if (!began && parser->is_header_done()) {
        is_table = requests_table || parser->get()[http::field::content_type].find("gnss/sourcetable") !=
                                         boost::beast::string_view::npos;
        if (!is_table) begin_stream(Phase::Http);
      }
      const std::string_view bytes(room.data(), room.size() - body.size);
      if (is_table)
        take_table(bytes);
      else
        stream(bytes);
      if (phase != Phase::Http) return;
      if (error && error != http::error::need_buffer && error != http::error::need_more) {
        misunderstood(fmt::format("the caster's HTTP is broken: {}", error.message()));
      } else if (parser->is_done()) {
        disconnect();
      } else if (error == http::error::need_more) {
        if (response.size() > kMaxResponseBytes) misunderstood("the caster's HTTP is broken: endless lines");
        return;
      }
    }
  }

  void begin_stream(Phase next) {
    phase = next;
    if (status.state != State::Streaming && status.state != State::Connecting)
      notes.push_back("the caster streams");
    status = {State::Streaming, {}, {}};
    requests_table = false;
    if (source) tcp.reset_pause();
    if (!source && !gga.empty()) tcp.send(gga);
    if (next == Phase::Raw) stream(std::exchange(response, {}));
  }

  void stream(std::string_view bytes) {
    if (bytes.empty() || source) return;
    tcp.reset_pause();
    last_byte = Clock::now();
    received.add(tcp.connections(), bytes);
  }

  void take_table(std::string_view bytes) {
    bool complete = false;
    lines.receive(bytes, [&](std::optional<std::string_view> line) {
      if (!line) return;
      const auto fields = split(trim(*line), ';');
      if (fields.front() == "ENDSOURCETABLE") complete = true;
      if (fields.front() == "STR" && fields.size() > 1 && table.size() < kMaxMounts) {
        has_mount = has_mount || fields[1] == to.mount;
        table.emplace_back(printable(fields[1]));
      }
    });
    if (complete) end_table();
  }

  void end_table() {
    status.mounts = std::exchange(table, {});
    requests_table = false;
    if (std::exchange(has_mount, false))
      end(State::Refused, fmt::format("the mount point {} has no stream now", to.mount));
    else
      end(State::Refused, no_such_mount());
  }

  /// Adds the caster's mount points, as many as fit in a line.
  [[nodiscard]] std::string no_such_mount() const {
    constexpr std::size_t kShown = 20;
    const std::size_t shown = std::min(kShown, status.mounts.size());
    std::string text = fmt::format("no mount point {}", to.mount);
    if (shown > 0) {
      text += fmt::format(
          "; the caster has {}",
          fmt::join(status.mounts.begin(), status.mounts.begin() + static_cast<std::ptrdiff_t>(shown), ", "));
    }
    if (shown < status.mounts.size()) text += fmt::format(" and {} more", status.mounts.size() - shown);
    return text;
  }

  /// Handles the end of the connection, or of its stream.
  void disconnect() {
    if (phase == Phase::Table || is_table)
      end_table();
    else if (status.state == State::Streaming && phase != Phase::Head)
      end(State::Closed, "the caster ended the stream");
    else
      misunderstood("the caster closed the connection without a response", State::Closed);
  }

  /// Tries the other revision, which the caster may support.
  void misunderstood(const std::string& reason, State state = State::Refused) {
    revision = 3 - revision;
    end(state, reason);
  }

  void end(State state, const std::string& reason) {
    if (status.state != state || status.reason != reason) notes.push_back(reason + ": retrying");
    status.state = state;
    status.reason = reason;
    phase = Phase::Over;
    parser.reset();
    table.clear();
    is_table = has_mount = false;
    if (!tcp.away()) tcp.leave();
  }

  /// Text from the caster, for messages; removes this client's secrets, which the caster may repeat.
  [[nodiscard]] std::string printable(std::string_view text) const {
    std::string shown(text);
    for (const std::string& secret : {to.credentials(), to.password})
      for (std::size_t at = 0; !secret.empty() && (at = shown.find(secret, at)) != std::string::npos; at += 3)
        shown.replace(at, secret.size(), "...");
    shown.resize(std::min<std::size_t>(shown.size(), 100));
    std::replace_if(
        shown.begin(), shown.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return shown;
  }

  static constexpr const char* kWrongPassword = "wrong user or password";

  NtripAddress to;
  bool source;
  Options options;
  TcpClient tcp;
  int revision = 2;
  bool requests_table = false;  ///< requests the source table instead of the mount point, after a 404
  bool is_table = false;        ///< the HTTP body is a source table
  bool has_mount = false;       ///< the source table has the mount point
  Phase phase = Phase::Over;
  std::string response;  ///< received and not parsed yet
  std::optional<http::response_parser<http::buffer_body>> parser;
  LineCutter lines{kMaxLine};
  std::vector<std::string> table;
  std::string gga;
  Clock::time_point last_byte;
  Inbox received;
  Status status;
  std::vector<std::string> notes;
};

NtripClient::NtripClient(std::string_view address, const Options& options)
    : impl_(std::make_unique<Impl>(address, options)) {}
NtripClient::~NtripClient() = default;

void NtripClient::send(std::string_view bytes) {
  const bool streaming = impl_->phase != Impl::Phase::Over && impl_->status.state == State::Streaming;
  if (!impl_->source) {
    impl_->gga = std::string(trim(bytes)) + "\r\n";
    bytes = impl_->gga;
  }
  if (!streaming || bytes.empty()) return;
  impl_->tcp.send(impl_->source && impl_->revision == 2 ? http_chunk(bytes) : std::string(bytes));
}

void NtripClient::serve() {
  impl_->serve();
}

std::vector<Received> NtripClient::take_received() {
  return impl_->received.take();
}

void NtripClient::add_handles(std::vector<int>& handles) const {
  impl_->tcp.add_handles(handles);
}

void NtripClient::finish(const std::optional<Correction>& correction) {
  if (impl_->source) {
    if (impl_->revision == 2 && impl_->status.state == State::Streaming) impl_->tcp.send(http_chunk({}));
    impl_->tcp.finish(correction);
  }
  impl_->end(State::Closed, "ended");
  impl_->notes.clear();
}

std::vector<std::string> NtripClient::take_notes() {
  return std::exchange(impl_->notes, {});
}

const NtripClient::Status& NtripClient::status() const {
  return impl_->status;
}

}  // namespace canyon::transport
