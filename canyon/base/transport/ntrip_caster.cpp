#include <fmt/format.h>

#include <boost/beast/http.hpp>
#include <map>
#include <mutex>

#include "canyon/base/input_error.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/transport/devices.hpp"
#include "canyon/base/transport/ntrip.hpp"

namespace canyon::transport {
namespace {

namespace http = boost::beast::http;

/// A mount point of a caster: one address.
struct Mount {
  NtripAddress address;
  StreamDescription about;
  std::string first;  ///< sent first to every client
  Inbox received;
};

/// A caster with the mount points of all addresses of its host and port. Several threads may use it.
class NtripCaster {
 public:
  explicit NtripCaster(const HostPort& at) : at_(at), server_(at.port, at.host, kMaxVisitors, true) {}

  /// The caster at this host and port; it listens as long as it is used.
  static std::shared_ptr<NtripCaster> at(const HostPort& at) {
    static std::mutex mutex;
    static std::map<std::pair<std::string, int>, std::weak_ptr<NtripCaster>> all;
    const std::lock_guard lock(mutex);
    std::weak_ptr<NtripCaster>& known = all[{at.host, at.port}];
    std::shared_ptr<NtripCaster> caster = known.lock();
    if (!caster) known = caster = std::make_shared<NtripCaster>(at);
    return caster;
  }

  void add(Mount& mount) {
    const std::lock_guard lock(mutex_);
    if (!mounts_.emplace(mount.address.mount, &mount).second) {
      throw InputError(fmt::format("port {} has a mount point {} already", at_.port, mount.address.mount),
                       "give each stream a different mount point");
    }
  }

  void remove(const Mount& mount) {
    const std::lock_guard lock(mutex_);
    const auto known = mounts_.find(mount.address.mount);
    if (known == mounts_.end() || known->second != &mount) return;
    for (auto& [reader, visitor] : visitors_)
      if (visitor.mount == &mount) dismiss(reader, visitor, visitor.chunked ? http_chunk({}) : "");
    mounts_.erase(known);
    if (mounts_.empty()) server_.finish({});
  }

  template <typename Change>
  void change(const Change& change) {
    const std::lock_guard lock(mutex_);
    change();
  }

  /// @param reader the only client that gets it; empty: all of the mount point
  void send(const Mount& mount, std::string_view bytes, std::optional<std::uint64_t> reader) {
    if (bytes.empty()) return;
    const std::lock_guard lock(mutex_);
    for (const auto& [number, visitor] : visitors_)
      if (visitor.mount == &mount && reader.value_or(number) == number) send(number, visitor, bytes);
  }

  void serve() {
    const std::lock_guard lock(mutex_);
    server_.serve();
    const std::vector<std::uint64_t> readers = server_.readers();
    std::erase_if(visitors_, [&](const auto& each) {
      return !std::binary_search(readers.begin(), readers.end(), each.first);
    });
    for (const std::uint64_t reader : readers) visitors_[reader];
    for (const Received& received : server_.take_received()) {
      const auto visitor = visitors_.find(received.reader);
      if (visitor != visitors_.end()) take(received.reader, visitor->second, received.bytes);
    }
    for (auto& [reader, visitor] : visitors_)
      if (visitor.mount == nullptr && !visitor.over && Clock::now() - visitor.since > kMaxRequest)
        dismiss(reader, visitor, "");
  }

  [[nodiscard]] std::vector<std::uint64_t> readers(const Mount& mount) {
    const std::lock_guard lock(mutex_);
    std::vector<std::uint64_t> numbers;
    for (const auto& [reader, visitor] : visitors_)
      if (visitor.mount == &mount) numbers.push_back(reader);
    return numbers;
  }
  [[nodiscard]] std::vector<Received> take_received(Mount& mount) {
    const std::lock_guard lock(mutex_);
    return mount.received.take();
  }
  void add_handles(std::vector<int>& handles) {
    const std::lock_guard lock(mutex_);
    server_.add_handles(handles);
  }
  [[nodiscard]] std::vector<std::string> take_notes() {
    const std::lock_guard lock(mutex_);
    return server_.take_notes();
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMaxVisitors = 100;
  static constexpr std::size_t kMaxHead = 8192;
  static constexpr auto kMaxRequest = std::chrono::seconds(10);

  struct Visitor {
    Clock::time_point since = Clock::now();
    std::string head;        ///< of its request
    Mount* mount = nullptr;  ///< the mount point it receives; null: none yet
    bool chunked = false;
    bool over = false;  ///< its last response is sent
  };

  void send(std::uint64_t reader, const Visitor& visitor, std::string_view bytes) {
    if (!bytes.empty()) server_.send_to(reader, visitor.chunked ? http_chunk(bytes) : std::string(bytes));
  }

  /// Sends the last response of a client.
  void dismiss(std::uint64_t reader, Visitor& visitor, std::string_view bytes) {
    server_.send_to(reader, bytes);
    server_.close(reader);
    visitor.mount = nullptr;
    visitor.over = true;
  }

  void take(std::uint64_t reader, Visitor& visitor, std::string_view bytes) {
    // A client that fills half of the common inbox would block the others' requests.
    if (bytes.size() > kMaxReceived / 2) dismiss(reader, visitor, "");
    if (visitor.over) return;
    if (visitor.mount != nullptr) {
      visitor.mount->received.add(reader, bytes);
      return;
    }
    visitor.head += bytes;
    const auto head = http_head(visitor.head);
    if (!head && visitor.head.size() <= kMaxHead) return;
    http::request_parser<http::empty_body> parser;
    parser.header_limit(kMaxHead);
    error_code error;
    if (head) parser.put(asio::buffer(head->first), error);
    if (error || !parser.is_header_done() || parser.get().method() != http::verb::get) {
      dismiss(reader, visitor, "HTTP/1.1 400 Bad Request\r\nConnection: close\r\n\r\n");
      return;
    }
    send_to(reader, visitor, parser.get());
    if (visitor.mount != nullptr) visitor.mount->received.add(reader, visitor.head.substr(head->second));
    visitor.head.clear();
  }

  void send_to(std::uint64_t reader, Visitor& visitor, const http::request<http::empty_body>& request) {
    constexpr const char* kVersion = "Ntrip-Version";
    const bool second = lower_case(text_of(request[kVersion])).find("ntrip/2.0") != std::string::npos;
    // Adds the header lines after the status line, for both revisions.
    const auto head_of = [&](std::string_view status, std::string_view more) {
      return fmt::format("{}\r\n{}Server: NTRIP Canyon\r\nConnection: close\r\n{}\r\n", status,
                         second ? "Ntrip-Version: Ntrip/2.0\r\n" : "", more);
    };
    const std::string target(text_of(request.target()));
    const auto found = mounts_.find(target.substr(std::min<std::size_t>(1, target.size())));
    if (found == mounts_.end() && second && target != "/") {
      dismiss(reader, visitor, head_of("HTTP/1.1 404 Not Found", "Content-Length: 0\r\n"));
      return;
    }
    if (found == mounts_.end()) {
      const std::string table = source_table();
      dismiss(reader, visitor,
              head_of(second ? "HTTP/1.1 200 OK" : "SOURCETABLE 200 OK",
                      fmt::format("Content-Type: {}\r\nContent-Length: {}\r\n",
                                  second ? "gnss/sourcetable" : "text/plain", table.size())) +
                  table);
      return;
    }
    Mount& mount = *found->second;
    const std::string wanted = mount.address.credentials();
    // The scheme is case-insensitive (RFC 7235, section 2.1).
    const auto given = split_blanks(text_of(request[http::field::authorization]));
    if (!wanted.empty() && (given.size() != 2 || lower_case(given[0]) != "basic" || given[1] != wanted)) {
      const std::string more =
          fmt::format("WWW-Authenticate: Basic realm=\"/{}\"\r\nContent-Length: 0\r\n", mount.address.mount);
      dismiss(reader, visitor,
              second ? head_of("HTTP/1.1 401 Unauthorized", more) : "ERROR - Bad Password\r\n");
      return;
    }
    server_.send_to(reader, second ? head_of("HTTP/1.1 200 OK",
                                             "Cache-Control: no-store\r\nContent-Type: gnss/data\r\n"
                                             "Transfer-Encoding: chunked\r\n")
                                   : "ICY 200 OK\r\n");
    visitor.mount = &mount;
    visitor.chunked = second;
    send(reader, visitor, mount.first);
    if (const auto position = text_of(request["Ntrip-GGA"]); !position.empty())
      mount.received.add(reader, fmt::format("{}\r\n", position));
  }

  /// RTCM 10410.1, section 7.3; unknown fields are empty.
  [[nodiscard]] std::string source_table() const {
    std::string text;
    for (const auto& [name, mount] : mounts_) {
      const StreamDescription& about = mount->about;
      std::string identifier = about.name;
      std::replace_if(
          identifier.begin(), identifier.end(),
          [](char c) { return c == ';' || static_cast<unsigned char>(c) < ' '; }, ' ');
      text += fmt::format("STR;{};{};{};;;{};;;{:.2f};{:.2f};{};Canyon;none;{};N;;\r\n", name, identifier,
                          about.format, about.systems, about.latitude_deg.value_or(0),
                          about.longitude_deg.value_or(0), about.wants_position ? "1;1" : "0;0",
                          mount->address.credentials().empty() ? "N" : "B");
    }
    return text + "ENDSOURCETABLE\r\n";
  }

  [[nodiscard]] static std::string_view text_of(boost::beast::string_view text) {
    return {text.data(), text.size()};
  }

  HostPort at_;
  std::mutex mutex_;
  TcpServer server_;
  std::map<std::string, Mount*> mounts_;
  std::map<std::uint64_t, Visitor> visitors_;
};

class NtripMount final : public Transport {
 public:
  explicit NtripMount(const NtripAddress& address)
      : caster_(NtripCaster::at(address.at)), mount_{address, {}, {}, {}} {
    caster_->add(mount_);
  }
  ~NtripMount() override { caster_->remove(mount_); }

  void describe(const StreamDescription& stream) override {
    caster_->change([&] { mount_.about = stream; });
  }
  void begin(std::string_view bytes) override {
    caster_->change([&] { mount_.first = bytes; });
  }
  void send(std::string_view bytes) override { caster_->send(mount_, bytes, {}); }
  [[nodiscard]] std::vector<std::uint64_t> readers() const override { return caster_->readers(mount_); }
  void send_to(std::uint64_t reader, std::string_view bytes) override {
    caster_->send(mount_, bytes, reader);
  }
  void serve() override { caster_->serve(); }
  [[nodiscard]] std::vector<Received> take_received() override { return caster_->take_received(mount_); }
  void add_handles(std::vector<int>& handles) const override { caster_->add_handles(handles); }
  void finish(const std::optional<Correction>&) override { caster_->remove(mount_); }
  [[nodiscard]] std::vector<std::string> take_notes() override { return caster_->take_notes(); }

 private:
  std::shared_ptr<NtripCaster> caster_;
  Mount mount_;
};

}  // namespace

std::unique_ptr<Transport> make_ntrip_mount(const NtripAddress& at) {
  return std::make_unique<NtripMount>(at);
}

}  // namespace canyon::transport
