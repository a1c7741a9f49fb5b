#pragma once

#include <chrono>

#include "canyon/base/transport/transport.hpp"

namespace canyon::transport {

/// A client of an NTRIP caster (RTCM 10410.1): receives a mount point's bytes, or sends a stream there. It
/// asks by revision 2, and by revision 1 where the caster does not understand that. It connects again after
/// a loss, after pauses that double.
///
/// It keeps at most kMostReceived bytes of a stream, 16 KiB of an answer and 1,000 mount points.
class NtripClient final : public Transport {
 public:
  enum class State {
    Connecting,  ///< no answer so far
    Streaming,   ///< the caster has agreed
    Refused,     ///< it has not: see reason; asked again
    Stalled,     ///< no byte for Options::patience; connected anew
    Closed,      ///< nobody answers, or the caster has ended the connection; tried again
  };
  /// The last answer; it stays until there is another one.
  struct Status {
    State state = State::Connecting;
    std::string reason;               ///< "wrong user or password"; empty while connecting and streaming
    std::vector<std::string> mounts;  ///< that the caster has, where it was asked for one that it has not
  };
  struct Options {
    std::chrono::milliseconds first_pause{1000}, longest_pause{60'000};
    std::chrono::milliseconds patience{10'000};
  };

  /// @param address ntrip://[USER:PASSWORD@]HOST:PORT/MOUNT to receive, ntrip-source://... to send; revision
  /// 1
  ///                leaves the user of a source out
  /// Looks the host up, which waits for the system's resolver; the rest is done by serve().
  /// Throws InputError for an address without these parts, and for an unknown host.
  explicit NtripClient(std::string_view address) : NtripClient(address, Options()) {}
  NtripClient(std::string_view address, const Options& options);
  ~NtripClient() override;

  /// A client: a GGA sentence, as mount points with a virtual reference station want one, at once and at the
  /// beginning of later connections. The caller bounds the rate. A source: the stream; lost while the caster
  /// is not there.
  void send(std::string_view bytes) override;
  void serve() override;
  /// The stream, without what HTTP puts around it. Received::reader counts the connections.
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
