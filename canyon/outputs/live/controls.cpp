#include "canyon/outputs/live/controls.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/named.hpp"
#include "canyon/base/text.hpp"

namespace canyon::live {
namespace {

using Receivers = std::vector<AdjustableReceiver>;

constexpr std::string_view kRefused = "refused: ";

struct Line {
  std::string key;
  std::string value;
};

std::vector<Line> lines_of(const simulation::LiveConfig& config) {
  std::vector<Line> lines;
  const std::string text = simulation::running_options(config);
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at);
    const std::size_t colon = text.find(": ", at);
    lines.push_back({text.substr(at, colon - at), text.substr(colon + 2, end - colon - 2)});
    at = end + 1;
  }
  return lines;
}

/// The receivers of a request.
Receivers meant_by(const OptionsRequest& request, const Receivers& receivers) {
  if (receivers.empty()) throw InputError("there is no receiver in this world");
  if (request.receiver.empty()) return receivers;
  std::vector<std::string> names;
  for (const AdjustableReceiver& each : receivers) {
    if (each.name == request.receiver) return {each};
    names.push_back(each.name);
  }
  throw unknown_name("receiver", request.receiver, names);
}

std::string get(const OptionsRequest& request, const Receivers& receivers) {
  const std::string_view wanted = trim(request.text);
  const auto holds = [&](const Line& line) {
    return wanted.empty() || line.key == wanted || line.key.starts_with(fmt::format("{}.", wanted));
  };
  const bool one = !request.receiver.empty();
  std::string text;
  std::vector<std::string> keys;
  bool found = false;
  for (const AdjustableReceiver& each : receivers) {
    if (!one) text += fmt::format("{}:\n", each.name);
    for (const Line& line : lines_of(each.receiver->config())) {
      keys.push_back(line.key);
      if (!holds(line)) continue;
      text += fmt::format("{}{}: {}\n", one ? "" : "  ", line.key, line.value);
      found = true;
    }
  }
  if (!found) {
    const auto similar = closest(wanted, keys);
    throw InputError(
        fmt::format("'{}' is not a key or section that has a value", wanted),
        similar ? fmt::format("did you mean '{}'?", *similar) : "an empty request lists all that may change");
  }
  text.pop_back();
  return text;
}

/// A line for each change, in the order of the keys.
std::vector<std::string> differences(const std::string& name, const simulation::LiveConfig& before,
                                     const simulation::LiveConfig& after) {
  const std::vector<Line> old_lines = lines_of(before);
  const std::vector<Line> new_lines = lines_of(after);
  const auto value_in = [](const std::vector<Line>& lines, const std::string& key) -> std::string {
    const auto at =
        std::find_if(lines.begin(), lines.end(), [&](const Line& line) { return line.key == key; });
    return at == lines.end() ? "(none)" : at->value;
  };
  std::vector<std::string> said;
  const auto say = [&](const std::string& key, const std::string& from, const std::string& to) {
    if (from != to) said.push_back(fmt::format("set {}: {}: {} -> {}", name, key, from, to));
  };
  for (const Line& line : new_lines) say(line.key, value_in(old_lines, line.key), line.value);
  for (const Line& line : old_lines) {
    const std::string now = value_in(new_lines, line.key);
    if (now == "(none)") say(line.key, line.value, now);
  }
  return said;
}

std::string set(const OptionsRequest& request, const Receivers& receivers) {
  struct Change {
    const AdjustableReceiver* of;
    simulation::LiveConfig config;
    bool rate_alone;
  };
  std::vector<Change> changes;
  std::vector<std::string> said;
  for (const AdjustableReceiver& each : receivers) {
    const simulation::LiveConfig& now = each.receiver->config();
    simulation::LiveConfig config = simulation::changed_live_config(now, request.text, "request");
    each.receiver->check(config);
    const std::vector<std::string> lines = differences(each.name, now, config);
    if (lines.empty()) continue;
    said.insert(said.end(), lines.begin(), lines.end());
    simulation::LiveConfig at_old_rate = config;
    at_old_rate.rate_hz = now.rate_hz;
    const bool rate_alone = config.rate_hz && differences(each.name, now, at_old_rate).empty();
    changes.push_back({&each, std::move(config), rate_alone});
  }
  if (changes.empty()) return "unchanged: every value is what it was";
  for (Change& change : changes) {
    if (change.rate_alone) {
      change.of->receiver->set_rate(*change.config.rate_hz);
    } else {
      change.of->receiver->set_config(std::move(change.config));
    }
    if (change.of->changed) change.of->changed();
  }
  return fmt::format("{}", fmt::join(said, "\n"));
}

std::string faults(const Receivers& receivers) {
  std::string text;
  for (const AdjustableReceiver& each : receivers) {
    for (const disturbance::FaultState& fault : each.receiver->faults()) {
      text += fmt::format("{}: {} ({}) from {:.10g} s", each.name, fault.name, fault.kind, fault.from_s);
      if (fault.until_s) text += fmt::format(" until {:.10g} s", *fault.until_s);
      text += fault.active ? ", at work\n" : "\n";
    }
  }
  if (text.empty()) return "none";
  text.pop_back();
  return text;
}

std::vector<simulation::LiveReceiver*> driven(const Receivers& receivers) {
  std::vector<simulation::LiveReceiver*> all;
  for (const AdjustableReceiver& each : receivers) all.push_back(each.receiver);
  return all;
}

std::string add_fault(const OptionsRequest& request, const Receivers& receivers) {
  const std::vector<std::string> names = simulation::add_fault(driven(receivers), request.text, "request");
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += fmt::format("added {}: {}\n", receivers[i].name, names[i]);
  }
  text.pop_back();
  return text;
}

std::string end_fault(const OptionsRequest& request, const Receivers& receivers) {
  const std::string name(trim(request.text));
  const auto ended = simulation::end_fault(driven(receivers), name);
  std::string text;
  for (const AdjustableReceiver& each : receivers) {
    if (std::find(ended.begin(), ended.end(), each.receiver) == ended.end()) continue;
    text += fmt::format("ended {}: {}\n", each.name, name);
  }
  text.pop_back();
  return text;
}

}  // namespace

std::string answer(const OptionsRequest& request, const Receivers& receivers) {
  try {
    const Receivers asked = meant_by(request, receivers);
    switch (request.kind) {
      case OptionsRequest::Kind::Get:
        return get(request, asked);
      case OptionsRequest::Kind::Set:
        return set(request, asked);
      case OptionsRequest::Kind::Faults:
        return faults(asked);
      case OptionsRequest::Kind::AddFault:
        return add_fault(request, asked);
      case OptionsRequest::Kind::EndFault:
        return end_fault(request, asked);
    }
    return {};
  } catch (const InputError& error) {
    return fmt::format("{}{}", kRefused, error.what());
  }
}

std::string OptionsDesk::ask(OptionsRequest request, std::chrono::milliseconds patience) {
  const auto mine = std::make_shared<Waiting>();
  mine->request = std::move(request);
  std::unique_lock lock(mutex_);
  if (!closed_) {
    waiting_.push_back(mine);
    somebody_ = true;
    answered_.wait_for(lock, patience, [&] { return mine->done || closed_; });
    const auto at = std::find(waiting_.begin(), waiting_.end(), mine);
    if (at == waiting_.end()) {
      // The host's thread has taken it and will answer, even if late.
      answered_.wait(lock, [&] { return mine->done; });
      return mine->answer;
    }
    waiting_.erase(at);
  }
  return closed_ ? "refused: the world has ended"
                 : fmt::format("refused: the simulation made no update within {} ms; nothing has changed",
                               patience.count());
}

void OptionsDesk::serve(const std::function<std::vector<AdjustableReceiver>()>& receivers) {
  if (!somebody_) return;
  std::deque<std::shared_ptr<Waiting>> taken;
  {
    const std::lock_guard lock(mutex_);
    taken.swap(waiting_);
    somebody_ = false;
  }
  for (const std::shared_ptr<Waiting>& each : taken) {
    std::string text;
    try {
      text = answer(each->request, receivers());
    } catch (const std::exception& error) {  // whoever waits must not wait for ever
      text = fmt::format("refused: {}", error.what());
    }
    const std::lock_guard lock(mutex_);
    each->answer = std::move(text);
    each->done = true;
    answered_.notify_all();
  }
}

void OptionsDesk::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  answered_.notify_all();
}

ServiceReply FaultAnswerer::call(OptionsRequest::Kind kind, const std::string& text) const {
  if (!changes && kind != OptionsRequest::Kind::Faults) {
    return {false, fmt::format("{}services may not change this simulation; {}", kRefused, allow_by)};
  }
  std::string said = answer({kind, {}, text});
  const bool done = !said.starts_with(kRefused);
  return {done, std::move(said)};
}

}  // namespace canyon::live
