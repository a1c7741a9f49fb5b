#include "canyon/outputs/live/controls.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <exception>
#include <optional>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/named.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::live {
namespace {

using Receivers = std::vector<ReceiverHandle>;

constexpr std::string_view kRefused = "refused: ";

struct Line {
  std::string key;
  std::string value;
};

std::vector<Line> lines_of(const simulation::RunnerConfig& config) {
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
  return request.receiver.empty() ? receivers
                                  : Receivers{entry_named(receivers, request.receiver, "receiver")};
}

std::string get(const OptionsRequest& request, const Receivers& receivers) {
  const std::string wanted =
      options::description_of<simulation::RunnerConfig>().current(std::string(trim(request.text)));
  const auto holds = [&](const Line& line) {
    return wanted.empty() || line.key == wanted || line.key.starts_with(fmt::format("{}.", wanted));
  };
  const bool one = !request.receiver.empty();
  std::string text;
  std::vector<std::string> keys;
  bool found = false;
  for (const ReceiverHandle& each : receivers) {
    if (!one) text += fmt::format("{}:\n", each.name);
    for (const Line& line : lines_of(each.receiver->config())) {
      keys.push_back(line.key);
      if (!holds(line)) continue;
      text += fmt::format("{}{}: {}\n", one ? "" : "  ", line.key, line.value);
      found = true;
    }
  }
  if (!found) {
    throw InputError(
        fmt::format("'{}' is not a key or section that has a value", wanted),
        did_you_mean(closest(wanted, keys), "send an empty request to list all changeable keys"));
  }
  text.pop_back();
  return text;
}

/// A line for each change, in the order of the keys.
std::vector<std::string> differences(const std::string& name, const simulation::RunnerConfig& before,
                                     const simulation::RunnerConfig& after) {
  const std::vector<Line> old_lines = lines_of(before);
  const std::vector<Line> new_lines = lines_of(after);
  const auto value_in = [](const std::vector<Line>& lines, const std::string& key) -> std::string {
    const auto at =
        std::find_if(lines.begin(), lines.end(), [&](const Line& line) { return line.key == key; });
    return at == lines.end() ? "(none)" : at->value;
  };
  std::vector<std::string> logged;
  const auto log = [&](const std::string& key, const std::string& from, const std::string& to) {
    if (from != to) logged.push_back(fmt::format("set {}: {}: {} -> {}", name, key, from, to));
  };
  for (const Line& line : new_lines) log(line.key, value_in(old_lines, line.key), line.value);
  for (const Line& line : old_lines) {
    const std::string now = value_in(new_lines, line.key);
    if (now == "(none)") log(line.key, line.value, now);
  }
  return logged;
}

std::string set(const OptionsRequest& request, const Receivers& receivers) {
  struct Change {
    const ReceiverHandle* of;
    simulation::RunnerConfig config;
    bool rate_alone;
  };
  std::vector<Change> changes;
  std::vector<std::string> logged;
  for (const ReceiverHandle& each : receivers) {
    const simulation::RunnerConfig& now = each.receiver->config();
    simulation::RunnerConfig config = simulation::changed_live_config(now, request.text, request.source);
    if (!each.changes_rate && config.rate_hz != now.rate_hz) {
      throw InputError("rate_hz: cannot change while the session runs",
                       "write it in the scenario, and start again");
    }
    each.receiver->check(config);
    const std::vector<std::string> lines = differences(each.name, now, config);
    if (lines.empty()) continue;
    logged.insert(logged.end(), lines.begin(), lines.end());
    simulation::RunnerConfig at_old_rate = config;
    at_old_rate.rate_hz = now.rate_hz;
    const bool rate_alone = config.rate_hz && differences(each.name, now, at_old_rate).empty();
    changes.push_back({&each, std::move(config), rate_alone});
  }
  if (changes.empty()) return "unchanged: all values were already set";
  for (Change& change : changes) {
    if (change.rate_alone)
      change.of->receiver->set_rate(*change.config.rate_hz);
    else
      change.of->receiver->set_config(std::move(change.config));
    if (change.of->changed) change.of->changed();
  }
  return fmt::format("{}", fmt::join(logged, "\n"));
}

std::string faults(const Receivers& receivers) {
  std::string text;
  for (const ReceiverHandle& each : receivers) {
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

/// Adds a fault to the timelines of receivers; returns its name in each.
std::vector<std::string> add_to_timelines(const Receivers& receivers, const std::string& text,
                                          const std::string& source) {
  std::vector<std::string> names;
  for (const ReceiverHandle& each : receivers) {
    names.push_back(each.receiver->add_fault(text, source));
    if (each.base != nullptr) (void)each.base->add_fault(text, source);
  }
  return names;
}

std::string add_fault(const OptionsRequest& request, const Receivers& receivers) {
  const std::vector<std::string> names = add_to_timelines(receivers, request.text, request.source.string());
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += fmt::format("added {}: {}\n", receivers[i].name, names[i]);
  text.pop_back();
  return text;
}

/// Ends a fault on all timelines that have it; returns the names of their receivers.
std::vector<std::string> end_on_timelines(const Receivers& receivers, const std::string& name) {
  std::vector<simulation::ReceiverRunner*> all;
  for (const ReceiverHandle& each : receivers) {
    all.push_back(each.receiver);
    if (each.base != nullptr) all.push_back(each.base);
  }
  const auto ended = simulation::end_fault(all, name);
  const auto has = [&](const simulation::ReceiverRunner* one) {
    return std::find(ended.begin(), ended.end(), one) != ended.end();
  };
  std::vector<std::string> names;
  for (const ReceiverHandle& each : receivers)
    if (has(each.receiver) || has(each.base)) names.push_back(each.name);
  return names;
}

std::string end_fault(const OptionsRequest& request, const Receivers& receivers) {
  const std::string name(trim(request.text));
  std::string text;
  for (const std::string& each : end_on_timelines(receivers, name))
    text += fmt::format("ended {}: {}\n", each, name);
  text.pop_back();
  return text;
}

}  // namespace

std::string perform(const OptionsRequest& request, const Receivers& receivers) {
  const Receivers requested = meant_by(request, receivers);
  switch (request.kind) {
    case OptionsRequest::Kind::Get:
      return get(request, requested);
    case OptionsRequest::Kind::Set:
      return set(request, requested);
    case OptionsRequest::Kind::Faults:
      return faults(requested);
    case OptionsRequest::Kind::AddFault:
      return add_fault(request, requested);
    case OptionsRequest::Kind::EndFault:
      return end_fault(request, requested);
  }
  return {};
}

std::string handle_request(const OptionsRequest& request, const Receivers& receivers) {
  try {
    return perform(request, receivers);
  } catch (const InputError& error) {
    return fmt::format("{}{}", kRefused, error.what());
  }
}

std::string RequestQueue::submit(OptionsRequest request, std::chrono::milliseconds patience) {
  const auto mine = std::make_shared<Waiting>();
  mine->request = std::move(request);
  std::unique_lock lock(mutex_);
  if (!closed_) {
    waiting_.push_back(mine);
    has_requests_ = true;
    answered_.wait_for(lock, patience, [&] { return mine->done || closed_; });
    const auto at = std::find(waiting_.begin(), waiting_.end(), mine);
    if (at == waiting_.end()) {
      // The host's thread has started the request and will respond, even if late.
      answered_.wait(lock, [&] { return mine->done; });
      return mine->response;
    }
    waiting_.erase(at);
  }
  return closed_ ? "refused: the world has ended"
                 : fmt::format("refused: the simulation made no update within {} ms; nothing has changed",
                               patience.count());
}

void RequestQueue::serve(const std::function<std::vector<ReceiverHandle>()>& receivers) {
  if (!has_requests_) return;
  std::deque<std::shared_ptr<Waiting>> taken;
  {
    const std::lock_guard lock(mutex_);
    taken.swap(waiting_);
    has_requests_ = false;
  }
  for (const std::shared_ptr<Waiting>& each : taken) {
    std::string text;
    try {
      text = handle_request(each->request, receivers());
    } catch (const std::exception& error) {  // the caller must not wait for ever
      text = fmt::format("refused: {}", error.what());
    }
    const std::lock_guard lock(mutex_);
    each->response = std::move(text);
    each->done = true;
    answered_.notify_all();
  }
}

void RequestQueue::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  answered_.notify_all();
}

ServiceReply FaultRequestHandler::call(OptionsRequest::Kind kind, const std::string& text) const {
  if (!changes && kind != OptionsRequest::Kind::Faults)
    return {false, fmt::format("{}services may not change this simulation; {}", kRefused, allow_by)};
  std::string logged = handle({kind, {}, text});
  const bool done = !logged.starts_with(kRefused);
  return {done, std::move(logged)};
}

namespace {

std::string one_line(const Json& json) {
  return json.dump() + '\n';
}
std::string name_in(const Json& command, const char* key) {
  const Json* found = command.find(key);
  return found != nullptr ? found->text() : std::string();
}

Json refusal(std::string_view problem, std::string_view hint) {
  Json json{{"ok", false}, {"error", problem}};
  if (!hint.empty()) json["cure"] = hint;
  return json;
}

/// A value: YAML if a string, else JSON text; empty: neither.
std::optional<std::string> text_of(const Json& command, const char* key) {
  const Json& value = command[key];
  if (value.is_string()) return value.text();
  if (!value.is_object()) return std::nullopt;
  return value.dump(-1, Json::Order::ByKey);
}

class SessionCommands final : public Commands {
 public:
  SessionCommands(CommandContext of, std::shared_ptr<transport::Link> by)
      : context(std::move(of)), link(std::move(by)), latest(context.receivers.size()) {
    listener = link->listen([this](const transport::Received& received) { receive(received); });
  }
  ~SessionCommands() override { link->forget(listener); }
  SessionCommands(const SessionCommands&) = delete;
  SessionCommands& operator=(const SessionCommands&) = delete;

  void keep(const simulation::Epoch& epoch) override {
    latest.at(epoch.receiver) = {epoch.observed.time, epoch.observed.fix, epoch.error_enu_m,
                                 epoch.observed.visible,
                                 encoding::no_fix_reason(epoch.observed.fix, epoch.containment)};
  }
  [[nodiscard]] bool stopped() const override { return stop; }
  [[nodiscard]] std::string handle_request(std::string_view line) override {
    constexpr std::string_view kHint = R"(write {"command": "help"})";
    const std::optional<Json> parsed = Json::try_parse(line);
    if (!parsed) return one_line(refusal("the line is not JSON", kHint));
    const Json& command = *parsed;
    if (!command.is_object()) return one_line(refusal("the line is not a JSON object", kHint));
    if (!command.contains("command")) return one_line(refusal("the object has no key 'command'", kHint));
    if (!command["command"].is_string()) return one_line(refusal("'command' is not a string", kHint));
    const std::string& name = command["command"].text();
    for (const Entry& entry : entries()) {
      if (entry.name != name) continue;
      if (entry.changes && !context.changes) {
        return one_line(refusal(fmt::format("'{}' changes the simulation, and changes are disabled", name),
                                "set live.changes: true in the scenario"));
      }
      try {
        return one_line((this->*entry.run)(command));
      } catch (const Error& e) {
        return one_line(refusal(e.problem(), e.hint()));
      } catch (const std::exception& e) {
        return one_line(refusal(e.what(), ""));
      }
    }
    std::vector<std::string> known;
    for (const Entry& entry : entries()) known.emplace_back(entry.name);
    return one_line(refusal(fmt::format("no command '{}'", name), known_names(name, known)));
  }

 private:
  struct Entry {
    const char* name;
    bool changes;
    const char* help;
    Json (SessionCommands::*run)(const Json&);
  };
  static const std::vector<Entry>& entries() {
    static const std::vector<Entry> kEntries{
        {"help", false, "this list", &SessionCommands::help},
        {"status", false, "time, counts, and the latest fix of every receiver", &SessionCommands::status},
        {"options", false, "the present options of a receiver: {\"receiver\": NAME}",
         &SessionCommands::options},
        {"set", true,
         "changes options; the receiver restarts: {\"receiver\": NAME, \"options\": {KEY: VALUE}}",
         &SessionCommands::set},
        {"faults", false, "the fault timelines of all receivers", &SessionCommands::faults},
        {"add_fault", true,
         "adds a fault to the timeline, from now on without 'from_s': {\"fault\": {\"duration_s\": 10, KIND: "
         "{...}}}; 'canyon faults list' lists the kinds",
         &SessionCommands::add_fault},
        {"end_fault", true, "ends a fault: {\"name\": NAME}", &SessionCommands::end_fault},
        {"stop", true, "ends the run", &SessionCommands::end}};
    return kEntries;
  }

  void receive(const transport::Received& received) {
    constexpr std::size_t kMaxCommand = 65536;
    readers.of(received.reader, kMaxCommand).receive(received, [&](std::optional<std::string_view> line) {
      if (line && trim(*line).empty()) return;
      link->transport().send_to(
          received.reader,
          line ? handle_request(*line)
               : one_line(refusal("a line is too long", "end each command with a line break")));
    });
  }

  /// The receiver named in a command; without a name the first.
  [[nodiscard]] const ReceiverHandle& receiver(const Json& command) const {
    const std::string name = name_in(command, "receiver");
    return name.empty() ? context.receivers.front() : entry_named(context.receivers, name, "receiver");
  }

  Json help(const Json&) {
    Json json{{"ok", true}};
    for (const Entry& entry : entries()) json["commands"][entry.name] = entry.help;
    json["changes"] = context.changes;
    return json;
  }
  Json status(const Json&) {
    const SessionMetrics& f = context.metrics;
    Json json{{"ok", true},
              {"time_s", context.now_s()},
              {"epochs", f.epochs},
              {"fixes", f.fixes},
              {"no_truth", f.no_truth},
              {"missed", f.missed},
              {"poses", f.poses},
              {"latency_p99_ms", f.latency.quantile(0.99).value_or(0) * 1e3}};
    for (std::size_t r = 0; r < latest.size(); ++r) {
      Json each{{"name", context.receivers[r].name}};
      if (latest[r]) {
        const Latest& now = *latest[r];
        each["gpst"] = geodesy::format_gpst(now.time, 3);
        each["fix"] = now.fix.solved();
        each["kind"] = gnss::name(now.fix.kind());
        each["tracked"] = now.visible;
        if (!now.fix.solved()) each["reason"] = now.no_fix;
        if (now.fix.solved()) {
          each["latitude_deg"] = geodesy::degrees(now.fix.position.latitude_rad);
          each["longitude_deg"] = geodesy::degrees(now.fix.position.longitude_rad);
          each["height_m"] = now.fix.position.height_m;
          each["used"] = now.fix.used.size();
          each["horizontal_error_m"] = now.error_enu_m.head<2>().norm();
        }
      }
      json["receivers"].push_back(std::move(each));
    }
    return json;
  }
  Json options(const Json& command) {
    return {{"ok", true}, {"options", simulation::running_options(receiver(command).receiver->config())}};
  }
  Json set(const Json& command) {
    const auto text = text_of(command, "options");
    if (!text) {
      throw InputError("'set' has no options",
                       R"(write {"command": "set", "receiver": "rover", "options": {"clock.bias_s": 1}})");
    }
    (void)perform({OptionsRequest::Kind::Set, receiver(command).name, *text, context.source},
                  context.receivers);
    return {{"ok", true}};
  }
  /// The receivers of a command: the named one, or all.
  [[nodiscard]] Receivers meant(const Json& command) const {
    return command.contains("receiver") ? Receivers{receiver(command)} : context.receivers;
  }

  Json faults(const Json& command) {
    Json json{{"ok", true}, {"faults", Json::object()}};
    for (const ReceiverHandle& one : meant(command)) {
      Json list = Json::array();
      for (const disturbance::FaultState& state : one.receiver->faults()) {
        Json each{
            {"name", state.name}, {"kind", state.kind}, {"from_s", state.from_s}, {"active", state.active}};
        if (state.until_s) each["until_s"] = *state.until_s;
        list.push_back(std::move(each));
      }
      json["faults"][one.name] = std::move(list);
    }
    return json;
  }
  Json add_fault(const Json& command) {
    const auto text = text_of(command, "fault");
    if (!text) {
      throw InputError("'add_fault' has no fault",
                       R"(write {"command": "add_fault", "fault": {"duration_s": 10, "outage": {}}})");
    }
    return {{"ok", true}, {"name", add_to_timelines(meant(command), *text, "fault").back()}};
  }
  Json end_fault(const Json& command) {
    (void)end_on_timelines(meant(command), name_in(command, "name"));
    return {{"ok", true}};
  }

  Json end(const Json&) {
    stop = true;
    return {{"ok", true}};
  }

  struct Latest {
    geodesy::GpsTime time;
    positioning::Fix fix;
    Eigen::Vector3d error_enu_m;
    int visible = 0;
    std::string_view no_fix;
  };
  CommandContext context;
  std::shared_ptr<transport::Link> link;
  int listener = 0;
  transport::Readers<transport::LineCutter> readers;
  std::vector<std::optional<Latest>> latest;
  bool stop = false;
};

}  // namespace

std::unique_ptr<Commands> make_commands(CommandContext context, std::shared_ptr<transport::Link> link) {
  return std::make_unique<SessionCommands>(std::move(context), std::move(link));
}

}  // namespace canyon::live
