#include "canyon/outputs/live/commands.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/named.hpp"
#include "canyon/outputs/output/epoch_values.hpp"

namespace canyon::live {
namespace {

std::string one_line(const Json& json) {
  return json.dump() + '\n';
}
std::string name_in(const Json& command, const char* key) {
  const Json* found = command.find(key);
  return found != nullptr ? found->text() : std::string();
}

Json refusal(std::string_view problem, std::string_view cure) {
  Json json{{"ok", false}, {"error", problem}};
  if (!cure.empty()) json["cure"] = cure;
  return json;
}

/// A value that is YAML as a string, or JSON as it stands; empty: neither.
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
                                 output::no_fix_reason(epoch.observed.fix, epoch.placement)};
  }
  [[nodiscard]] bool stopped() const override { return stop; }
  [[nodiscard]] std::string answer(std::string_view line) override {
    constexpr std::string_view kCure = R"(write {"command": "help"})";
    const std::optional<Json> parsed = Json::try_parse(line);
    if (!parsed) return one_line(refusal("the line is not JSON", kCure));
    const Json& command = *parsed;
    if (!command.is_object()) return one_line(refusal("the line is not a JSON object", kCure));
    if (!command.contains("command")) return one_line(refusal("the object has no key 'command'", kCure));
    if (!command["command"].is_string()) return one_line(refusal("'command' is not a text", kCure));
    const std::string& name = command["command"].text();
    for (const Entry& entry : entries()) {
      if (entry.name != name) continue;
      if (entry.changes && !context.changes) {
        return one_line(refusal(fmt::format("'{}' changes the simulation, which is switched off", name),
                                "set live.changes: true in the scenario"));
      }
      try {
        return one_line((this->*entry.run)(command));
      } catch (const InputError& e) {
        return one_line(refusal(e.problem(), e.cure()));
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
        {"options", false, "a receiver's options as they are: {\"receiver\": NAME}",
         &SessionCommands::options},
        {"set", true, "changes them; the receiver restarts: {\"receiver\": NAME, \"options\": {KEY: VALUE}}",
         &SessionCommands::set},
        {"faults", false, "every receiver's timeline", &SessionCommands::faults},
        {"add_fault", true,
         "puts a fault on the timeline, from now on without 'from_s': {\"fault\": {\"duration_s\": 10, KIND: "
         "{...}}}; 'canyon faults list' has the kinds",
         &SessionCommands::add_fault},
        {"end_fault", true, "ends one: {\"name\": NAME}", &SessionCommands::end_fault},
        {"stop", true, "ends the run", &SessionCommands::end}};
    return kEntries;
  }

  void receive(const transport::Received& received) {
    constexpr std::size_t kLongestCommand = 65536;
    readers.of(received.reader, kLongestCommand).receive(received, [&](std::optional<std::string_view> line) {
      if (line && trim(*line).empty()) return;
      link->transport().answer(
          received.reader,
          line ? answer(*line)
               : one_line(refusal("a line is too long", "end each command with a line break")));
    });
  }

  [[nodiscard]] simulation::LiveReceiver& receiver(const Json& command) {
    return context.receivers[simulation::find_receiver(context.scenario, name_in(command, "receiver"))];
  }

  Json help(const Json&) {
    Json json{{"ok", true}};
    for (const Entry& entry : entries()) json["commands"][entry.name] = entry.help;
    json["changes"] = context.changes;
    return json;
  }
  Json status(const Json&) {
    const Figures& f = context.figures;
    Json json{{"ok", true},
              {"time_s", context.now_s()},
              {"epochs", f.epochs},
              {"fixes", f.fixes},
              {"no_truth", f.no_truth},
              {"missed", f.missed},
              {"poses", f.poses},
              {"latency_p99_ms", f.latency.quantile(0.99).value_or(0) * 1e3}};
    for (std::size_t r = 0; r < latest.size(); ++r) {
      Json each{{"name", context.scenario.receivers[r].options.name}};
      if (latest[r]) {
        const Latest& now = *latest[r];
        each["gpst"] = geodesy::format_gpst(now.time, 3);
        each["fix"] = now.fix.solved();
        each["kind"] = positioning::name(now.fix.kind());
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
    return {{"ok", true}, {"options", simulation::running_options(receiver(command).config())}};
  }
  Json set(const Json& command) {
    const auto text = text_of(command, "options");
    if (!text) {
      throw InputError("'set' has no options",
                       R"(write {"command": "set", "receiver": "rover", "options": {"clock.bias_s": 1}})");
    }
    simulation::LiveReceiver& changed = receiver(command);
    simulation::LiveConfig config = simulation::changed_live_config(
        changed.config(), *text, std::filesystem::absolute(context.scenario.file));
    if (config.rate_hz != changed.config().rate_hz) {
      throw InputError("rate_hz: cannot change while the session runs",
                       "write it in the scenario, and start again");
    }
    changed.set_config(std::move(config));
    return {{"ok", true}};
  }
  /// The receivers that a command is for: the one that it names, or all.
  std::vector<simulation::LiveReceiver*> meant_by(const Json& command) {
    if (command.contains("receiver")) return {&receiver(command)};
    std::vector<simulation::LiveReceiver*> all;
    for (simulation::LiveReceiver& one : context.receivers) all.push_back(&one);
    return all;
  }

  Json faults(const Json& command) {
    Json json{{"ok", true}, {"faults", Json::object()}};
    for (const simulation::LiveReceiver* one : meant_by(command)) {
      Json list = Json::array();
      for (const disturbance::FaultState& state : one->faults()) {
        Json each{
            {"name", state.name}, {"kind", state.kind}, {"from_s", state.from_s}, {"active", state.active}};
        if (state.until_s) each["until_s"] = *state.until_s;
        list.push_back(std::move(each));
      }
      json["faults"][one->config().receiver().options.name] = std::move(list);
    }
    return json;
  }
  Json add_fault(const Json& command) {
    const auto text = text_of(command, "fault");
    if (!text) {
      throw InputError("'add_fault' has no fault",
                       R"(write {"command": "add_fault", "fault": {"duration_s": 10, "outage": {}}})");
    }
    return {{"ok", true}, {"name", simulation::add_fault(meant_by(command), *text).back()}};
  }
  Json end_fault(const Json& command) {
    (void)simulation::end_fault(meant_by(command), name_in(command, "name"));
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
