#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/transport/transport.hpp"

namespace canyon::transport {

/// A transport that several use, to send and to receive: messages to an autopilot and its poses go over one
/// port. Whatever comes is handed to every listener.
class Link {
 public:
  using Listener = std::function<void(const Heard& heard)>;

  /// Opens it. Throws as open_transport() does.
  explicit Link(std::string_view address) : Link(open_transport(address)) {}
  explicit Link(std::unique_ptr<Transport> transport) : transport_(std::move(transport)) {}

  [[nodiscard]] Transport& transport() { return *transport_; }
  /// Returns what forget() takes.
  [[nodiscard]] int listen(Listener listener) {
    listeners_.emplace(++last_, std::move(listener));
    return last_;
  }
  void forget(int listener) { listeners_.erase(listener); }
  /// Serves the transport, and hands on what it received.
  /// Listeners may send; what they call does not come here again.
  void serve() {
    if (std::exchange(serving_, true)) return;
    transport_->serve();
    for (const Heard& heard : transport_->take_heard()) {
      for (const auto& [number, listener] : listeners_) listener(heard);
    }
    serving_ = false;
  }
  /// Forgets a listener, and with the last one ends the transport.
  void finish(int listener, const std::optional<Correction>& correction) {
    if (listeners_.erase(listener) > 0 && listeners_.empty()) transport_->finish(correction);
  }
  [[nodiscard]] std::vector<std::string> take_notes() { return transport_->take_notes(); }

 private:
  std::unique_ptr<Transport> transport_;
  std::map<int, Listener> listeners_;
  int last_ = 0;
  bool serving_ = false;
};

}  // namespace canyon::transport
