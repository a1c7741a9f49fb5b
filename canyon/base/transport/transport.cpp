#include "canyon/base/transport/transport.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "canyon/base/input_error.hpp"
#include "canyon/base/input_files.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/transport/devices.hpp"
#include "canyon/base/transport/ntrip.hpp"

namespace canyon::transport {
namespace {

namespace fs = std::filesystem;

class File final : public Transport {
 public:
  explicit File(const fs::path& path) : file_(path) {}
  void send(std::string_view bytes) override { file_.write(bytes); }
  void finish(const std::optional<Correction>& correction) override {
    if (correction) file_.overwrite(correction->offset, correction->bytes);
    file_.commit();
  }

 private:
  OutputFile file_;
};

/// A log. Its bytes are written at once to PATH.live.part-..., and survive if the process is killed.
class Log final : public BufferedTransport {
 public:
  explicit Log(fs::path path)
      : path_(std::move(path)),
        temporary_(path_.string() + kMark, Temporary::Kind::File),
        handle_(temporary_.hold(-1)) {
    (void)temporary_.hold(handle_);
    if (fs::is_directory(path_)) throw InputError(path_, 0, "is a folder", "give the name of a file");
    ResultFiles::refuse(path_);
    keep_killed();
    noted_ = files_.add_output(path_);
  }
  ~Log() override {
    if (noted_) files_.remove_output(*noted_);
  }
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  void send(std::string_view bytes) override {
    write(bytes, sent_);
    if (failure_ != 0) fail();
    sent_ += bytes.size();
  }
  void finish(const std::optional<Correction>& correction) override {
    if (correction) write(correction->bytes, correction->offset);
    if (failure_ == 0 && ::rename(temporary_.temporary_path().c_str(), path_.c_str()) != 0) failure_ = errno;
    if (failure_ != 0) fail();
    ResultFiles::note(path_);
    files_.remove_output(*std::exchange(noted_, std::nullopt));
  }

 private:
  static constexpr const char* kMark = ".live";

  void write(std::string_view bytes, std::size_t offset) {
    while (!bytes.empty() && failure_ == 0) {
      const ssize_t size = ::pwrite(handle_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
      if (size <= 0) failure_ = size < 0 ? errno : EIO;
      if (size <= 0) return;
      bytes.remove_prefix(static_cast<std::size_t>(size));
      offset += static_cast<std::size_t>(size);
    }
  }
  [[noreturn]] void fail() const {
    throw OutputError(path_, 0, fmt::format("cannot be written: {}", std::strerror(failure_)),
                      failure_ == ENOSPC ? "free disk space and run again" : "");
  }
  /// Renames the leftovers of killed processes to names that are never removed.
  void keep_killed() {
    const fs::path folder = path_.has_parent_path() ? path_.parent_path() : fs::path(".");
    const std::string mark = path_.filename().string() + kMark + ".part-";
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
      const std::string name = entry.path().filename().string();
      if (!name.starts_with(mark) || !is_temporary_name(name)) continue;
      const int left = ::open(entry.path().c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
      if (left < 0) continue;
      const bool killed = ::flock(left, LOCK_EX | LOCK_NB) == 0;  // else a process has locked it
      if (killed && entry.file_size(error) == 0) fs::remove(entry.path(), error);
      for (int i = 1; killed && fs::exists(entry.path(), error); ++i) {
        const std::string kept = path_.string() + (i == 1 ? ".killed" : fmt::format(".killed-{}", i));
        if (::renameat2(AT_FDCWD, entry.path().c_str(), AT_FDCWD, kept.c_str(), RENAME_NOREPLACE) == 0)
          notes_.push_back(fmt::format("the output of a killed run is kept as {}", kept));
        else if (errno != EEXIST)
          break;
      }
      ::close(left);
    }
  }

  fs::path path_;
  Temporary temporary_;
  int handle_;
  InputFiles& files_ = InputFiles::current();
  std::optional<fs::path> noted_;
  std::size_t sent_ = 0;
  int failure_ = 0;  ///< errno of the first one
};

/// The rest of a text that begins with `start`; empty for other texts.
std::optional<std::string_view> text_after(std::string_view text, std::string_view start) {
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
  return text_after(address, "file:").has_value();
}

bool is_input_address(std::string_view address) {
  return address == "stdin:" || text_after(address, "ntrip://");
}

const char* address_forms() {
  return "tcp://127.0.0.1:PORT (a server), tcp-connect://HOST:PORT, udp://HOST:PORT, "
         "udp-listen://127.0.0.1:PORT, pty:, pty:LINK, 'pty:LINK@9600', 'serial:/dev/ttyUSB0@115200', "
         "ntrip-caster://[USER:PASSWORD@]127.0.0.1:PORT/MOUNT, ntrip-source://USER:PASSWORD@HOST:PORT/MOUNT, "
         "file:PATH";
}

std::unique_ptr<Transport> open_result(const std::filesystem::path& path) {
  return std::make_unique<File>(path);
}

std::unique_ptr<Transport> open_transport(std::string_view address) {
  if (const auto path = text_after(address, "file:"); path && !path->empty())
    return std::make_unique<Log>(*path);
  using Maker = std::unique_ptr<Transport> (*)(const HostPort&);
  static constexpr std::pair<std::string_view, Maker> kHosts[]{{"tcp://", make_tcp_server},
                                                               {"tcp-connect://", make_tcp_client},
                                                               {"udp://", make_udp},
                                                               {"udp-listen://", make_udp_listener}};
  for (const auto& [start, make] : kHosts)
    if (const auto rest = text_after(address, start)) return make(host_and_port(*rest, address));
  if (text_after(address, "ntrip-caster://")) return make_ntrip_mount(ntrip_address(address));
  if (text_after(address, "ntrip://") || text_after(address, "ntrip-source://"))
    return std::make_unique<NtripClient>(address);
  const auto baud_after = [](std::string_view text, std::size_t at) -> std::optional<int> {
    const auto baud = at == std::string_view::npos ? std::nullopt : parse_integer(text.substr(at + 1));
    if (!baud || *baud < 1 || *baud > 4'000'000) return std::nullopt;
    return static_cast<int>(*baud);
  };
  if (const auto rest = text_after(address, "pty:")) {
    const std::size_t at = rest->rfind('@');
    const auto baud = baud_after(*rest, at);
    return make_pseudo_terminal(std::string(baud ? rest->substr(0, at) : *rest), baud);
  }
  if (address == "stdin:") return make_standard_input();
  if (const auto rest = text_after(address, "serial:")) {
    const std::size_t at = rest->rfind('@');
    const auto baud = baud_after(*rest, at);
    if (!baud || at == 0) {
      throw InputError(fmt::format("'{}' has no device and baud rate", address),
                       "write it like serial:/dev/ttyUSB0@115200");
    }
    return make_serial(std::string(rest->substr(0, at)), *baud);
  }
  throw InputError(fmt::format("'{}' is not an address", address), fmt::format("write {}", address_forms()));
}

}  // namespace canyon::transport
