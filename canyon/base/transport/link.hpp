#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/transport/transport.hpp"

namespace canyon::transport {

/// A transport that several modules share to send and receive: messages to an autopilot and its poses use one
/// port. Every listener gets all received bytes.
class Link {
 public:
  using Listener = std::function<void(const Received& received)>;

  /// Opens it. Throws as open_transport() does.
  explicit Link(std::string_view address) : Link(open_transport(address)) {}
  explicit Link(std::unique_ptr<Transport> transport) : transport_(std::move(transport)) {}

  [[nodiscard]] Transport& transport() { return *transport_; }
  /// Returns the id for forget().
  [[nodiscard]] int listen(Listener listener) {
    listeners_.emplace(++last_, std::move(listener));
    return last_;
  }
  void forget(int listener) { listeners_.erase(listener); }
  /// Serves the transport and passes its received bytes on. Listeners may send; serve() is not reentered.
  void serve() {
    if (std::exchange(serving_, true)) return;
    transport_->serve();
    for (const Received& received : transport_->take_received())
      for (const auto& [number, listener] : listeners_) listener(received);
    serving_ = false;
  }
  /// Removes a listener; the last one also ends the transport.
  void finish(int listener, const std::optional<Correction>& correction) {
    if (listeners_.erase(listener) > 0 && listeners_.empty()) transport_->finish(correction);
  }
  /// Adds a line to take_notes().
  void note(std::string line) { notes_.push_back(std::move(line)); }
  [[nodiscard]] std::vector<std::string> take_notes() {
    std::vector<std::string> notes = transport_->take_notes();
    for (std::string& line : std::exchange(notes_, {})) notes.push_back(std::move(line));
    return notes;
  }

 private:
  std::unique_ptr<Transport> transport_;
  std::vector<std::string> notes_;
  std::map<int, Listener> listeners_;
  int last_ = 0;
  bool serving_ = false;
};

/// Links by address, each opened once.
using Links = std::map<std::string, std::shared_ptr<Link>>;
/// Throws as Link() does.
[[nodiscard]] inline std::shared_ptr<Link> link_of(Links& links, const std::string& address) {
  std::shared_ptr<Link>& link = links[address];
  if (!link) link = std::make_shared<Link>(address);
  return link;
}

/// Keeps a value for each sender (Received::reader), at most kMax; then removes the least recently used.
template <typename StoredEpoch>
class Readers {
 public:
  static constexpr std::size_t kMax = 64;

  /// @param fresh arguments of a new reader's value
  template <typename... Fresh>
  [[nodiscard]] StoredEpoch& of(std::uint64_t reader, Fresh&&... fresh) {
    if (kept_.count(reader) == 0 && kept_.size() >= kMax) {
      const auto first = std::min_element(requested_.begin(), requested_.end(),
                                          [](const auto& a, const auto& b) { return a.second < b.second; });
      kept_.erase(first->first);
      requested_.erase(first);
    }
    requested_[reader] = ++count_;
    return kept_.try_emplace(reader, std::forward<Fresh>(fresh)...).first->second;
  }
  /// Null: there is none.
  [[nodiscard]] StoredEpoch* find(std::uint64_t reader) {
    const auto found = kept_.find(reader);
    if (found == kept_.end()) return nullptr;
    requested_[reader] = ++count_;
    return &found->second;
  }

 private:
  std::map<std::uint64_t, StoredEpoch> kept_;
  std::map<std::uint64_t, std::uint64_t> requested_;  // counter at the last use
  std::uint64_t count_ = 0;
};

/// Joins bytes that are split anywhere into lines.
class LineCutter {
 public:
  /// @param longest maximum bytes of a line; longer ones are skipped
  explicit LineCutter(std::size_t longest) : longest_(longest) {}

  /// @param take gets every line that ends here, without its end; empty optional: the line was too long
  template <typename BlockHandler>
  void receive(std::string_view bytes, const BlockHandler& take) {
    for (std::size_t end = bytes.find('\n'); end != std::string_view::npos; end = bytes.find('\n')) {
      add(bytes.substr(0, end));
      finish(take);
      bytes.remove_prefix(end + 1);
    }
    add(bytes);
  }
  /// The same for received bytes: the end of a datagram ends its last line.
  template <typename BlockHandler>
  void receive(const Received& received, const BlockHandler& take) {
    receive(std::string_view(received.bytes), take);
    if (received.whole && (too_long_ || !line_.empty())) finish(take);
  }
  /// The unfinished line so far; empty if it is too long.
  [[nodiscard]] const std::string& rest() const { return line_; }
  /// Treats the rest as a line.
  template <typename BlockHandler>
  void finish(const BlockHandler& take) {
    const std::string line = std::exchange(line_, {});
    const bool too_long = std::exchange(too_long_, false);
    take(too_long ? std::nullopt : std::optional<std::string_view>(line));
  }

 private:
  void add(std::string_view bytes) {
    too_long_ = too_long_ || line_.size() + bytes.size() > longest_;
    if (too_long_)
      line_.clear();
    else
      line_ += bytes;
  }

  std::size_t longest_;
  std::string line_;
  bool too_long_ = false;
};

}  // namespace canyon::transport
