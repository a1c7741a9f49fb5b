#pragma once

#include <chrono>

#include "canyon/base/transport/transport.hpp"

namespace canyon::transport {

/// A client of an NTRIP caster (RTCM 10410.1): receives the bytes of a mount point, or sends a stream to it.
/// It requests revision 2, or 1 if the caster lacks 2. After a loss it reconnects with doubling pauses. It
/// keeps at most kMaxReceived bytes of a stream, 16 KiB of a response and 1,000 mount points.
class NtripClient final : public Transport {
 public:
  enum class State {
    Connecting,  ///< no response so far
    Streaming,   ///< the caster has accepted
    Refused,     ///< the caster has refused: see reason; retried
    Stalled,     ///< no byte for Options::patience; reconnects
    Closed,      ///< the caster is not reachable or has closed the connection; retried
  };
  /// The last status; kept until it changes.
  struct Status {
    State state = State::Connecting;
    std::string reason;               ///< "wrong user or password"; empty while connecting and streaming
    std::vector<std::string> mounts;  ///< available mount points, if the requested one does not exist
  };
  struct Options {
    std::chrono::milliseconds first_pause{1000}, longest_pause{60'000};
    std::chrono::milliseconds patience{10'000};
  };

  /// @param address ntrip://[USER:PASSWORD@]HOST:PORT/MOUNT to receive, ntrip-source://... to send;
  ///                revision 1 sends no user name for a source
  /// Resolves the host, which blocks on the system's resolver; serve() does the rest.
  /// Throws InputError for an address without these parts and for an unknown host.
  explicit NtripClient(std::string_view address) : NtripClient(address, Options()) {}
  NtripClient(std::string_view address, const Options& options);
  ~NtripClient() override;

  /// As a client: sends a GGA sentence, which mount points with a virtual reference station require, at once
  /// and at the start of later connections. The caller limits the rate. As a source: sends the stream; bytes
  /// are lost while the caster is not connected.
  void send(std::string_view bytes) override;
  void serve() override;
  /// The stream without HTTP framing. Received::reader counts the connections.
  [[nodiscard]] std::vector<Received> take_received() override;
  void add_handles(std::vector<int>& handles) const override;
  void finish(const std::optional<Correction>& correction) override;
  [[nodiscard]] std::vector<std::string> take_notes() override;
  [[nodiscard]] const Status& status() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::transport
