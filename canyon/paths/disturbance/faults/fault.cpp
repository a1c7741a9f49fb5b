#include "canyon/paths/disturbance/faults/fault.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/node.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/text.hpp"
#include "canyon/paths/disturbance/faults/receiver_faults.hpp"
#include "canyon/paths/disturbance/faults/satellite_faults.hpp"
#include "canyon/paths/disturbance/faults/spoofing.hpp"
#include "canyon/paths/disturbance/faults/transmitter.hpp"

namespace canyon::disturbance {

Eigen::Vector3d PositionOptions::enu(const geodesy::LocalFrame& frame) const {
  if (east_m) return {*east_m, *north_m, *up_m};
  return frame.local_from_geodetic(geodesy::Geodetic::from_degrees(*latitude_deg, *longitude_deg, *height_m));
}

void PositionOptions::validate() const {
  const int global = latitude_deg.has_value() + longitude_deg.has_value() + height_m.has_value();
  const int local = east_m.has_value() + north_m.has_value() + up_m.has_value();
  if ((global == 3 && local == 0) || (global == 0 && local == 3)) return;
  throw InputError("a position is incomplete",
                   "give latitude_deg, longitude_deg and height_m, or east_m, north_m and up_m");
}

void visit(options::Visitor& v, PositionOptions& o) {
  if (v.wants(v.reads() || o.latitude_deg)) {
    v.number({"latitude_deg", "deg", "geodetic latitude (WGS 84)", "by east_m"}, o.latitude_deg, {-90, 90});
    v.number({"longitude_deg", "deg", "longitude, east positive", "by east_m"}, o.longitude_deg, {-180, 360});
    v.number({"height_m", "m", "ellipsoidal height", "by up_m"}, o.height_m, {-1000, 1e5});
  }
  if (v.wants(v.reads() || o.east_m)) {
    v.number(
        {"east_m", "m", "east of the city's origin, instead of latitude and longitude", "by latitude_deg"},
        o.east_m, {-1e6, 1e6});
    v.number({"north_m", "m", "north of the city's origin", "by latitude_deg"}, o.north_m, {-1e6, 1e6});
    v.number({"up_m", "m", "above the city's origin", "by latitude_deg"}, o.up_m, {-1e5, 1e5});
  }
}

void CourseOptions::validate() const {
  options::check(*this, "course");
  if (position.given() && !waypoints.empty())
    throw InputError("position and waypoints are both given", "give one of them");
  if (position.given()) position.validate();
  for (const PositionOptions& each : waypoints) each.validate();
}

void visit(options::Visitor& v, CourseOptions& o) {
  v.one_of({"position", "waypoints"});
  if (v.wants(v.reads() || o.position.given())) v.part("position", o.position);
  if (!v.wants(v.reads() || !o.waypoints.empty())) return;
  v.list("waypoints", o.waypoints, [&](PositionOptions& each) {
    visit(v, each);
    v.validate(each);
  });
  v.number({"speed_mps", "m/s", "speed between waypoints"}, o.speed_mps, {0, 1e4, true});
}

Course::Course(const CourseOptions& options, const geodesy::LocalFrame& frame, geodesy::GpsTime begin)
    : speed_mps_(options.speed_mps), begin_(begin) {
  options.validate();
  if (!options.given()) throw InputError("a position is missing", "give position or waypoints");
  if (options.position.given()) points_.push_back(options.position.enu(frame));
  for (const PositionOptions& each : options.waypoints) points_.push_back(each.enu(frame));
}

Eigen::Vector3d Course::at(geodesy::GpsTime time) const {
  double left_m = std::max(0.0, time - begin_) * speed_mps_;
  for (std::size_t i = 1; i < points_.size(); ++i) {
    const double leg_m = (points_[i] - points_[i - 1]).norm();
    if (left_m < leg_m) return points_[i - 1] + left_m / leg_m * (points_[i] - points_[i - 1]);
    left_m -= leg_m;
  }
  return points_.back();
}

namespace {

template <typename Options, typename Effect>
class SettingsOf final : public FaultSettings {
 public:
  static std::unique_ptr<FaultSettings> fresh() { return std::make_unique<SettingsOf>(); }
  void fields(options::Visitor& v) override { visit(v, options_); }
  void validate() const override {
    if constexpr (requires { options_.validate(); })
      options_.validate();
    else
      options::check(options_);
  }
  [[nodiscard]] std::unique_ptr<Disturbance> make(const FaultContext& context) const override {
    return std::make_unique<Effect>(options_, context);
  }
  [[nodiscard]] SatelliteSet satellites() const override {
    if constexpr (requires { options_.satellites; })
      return options_.satellites;
    else
      return {};
  }
  [[nodiscard]] std::optional<double> duration_s() const override {
    if constexpr (requires { options_.duration_s(); })
      return options_.duration_s();
    else
      return std::nullopt;
  }
  [[nodiscard]] double late_s() const override {
    if constexpr (requires { options_.late_s; })
      return options_.late_s;
    else
      return 0;
  }
  [[nodiscard]] const CourseOptions* course() const override {
    if constexpr (requires { options_.transmitter; })
      return &options_.transmitter.course;
    else
      return nullptr;
  }

 private:
  Options options_;
};

constexpr FaultKind kKinds[]{
    {"jamming", "a transmitter that jams the bands with noise, chirps or tones",
     "{from_s: 10, jamming: {position: {east_m: 100, north_m: 0, up_m: 2}, preset: privacy_l1}}",
     &SettingsOf<JammingOptions, Jamming>::fresh},
    {"spoofing", "a transmitter of counterfeit satellite signals: another position or time, or a delay",
     "{from_s: 10, spoofing: {position: {east_m: 100, north_m: 0, up_m: 30}, pull_off: {east_m: 200}}}",
     &SettingsOf<SpoofingOptions, Spoofing>::fresh},
    {"outage", "satellites without signals, or flagged as unusable",
     "{from_s: 10, until_s: 40, outage: {satellites: [G05, Galileo], mode: silent}}",
     &SettingsOf<OutageOptions, Outage>::fresh},
    {"ephemeris", "satellites whose messages have the wrong orbit or clock",
     "{from_s: 10, ephemeris: {satellites: G05, radial_m: 100}}",
     &SettingsOf<EphemerisOptions, EphemerisFault>::fresh},
    {"clock", "the receiver's oscillator jumps, or has a frequency offset",
     "{from_s: 10, duration_s: 20, clock: {jump_s: 1e-3, drift: 1e-7}}",
     &SettingsOf<OscillatorOptions, OscillatorFault>::fresh},
    {"time", "firmware that misreads the date: week rollover, leap second",
     "{from_s: 10, time: {weeks: -1024}}", &SettingsOf<DateOptions, DateFault>::fresh},
    {"antenna", "a shaded sector of the antenna, a lossy cable, a loose contact",
     "{from_s: 10, antenna: {azimuth_from_deg: 315, azimuth_to_deg: 45, loss_db: 15}}",
     &SettingsOf<AntennaFaultOptions, AntennaFault>::fresh},
    {"restart", "the receiver restarts: hot, warm or cold", "{from_s: 10, restart: {kind: cold}}",
     &SettingsOf<RestartOptions, RestartFault>::fresh},
    {"force", "the receiver reports a forced kind of fix, for tests",
     "{from_s: 10, until_s: 20, force: {fix: float}}", &SettingsOf<ForceOptions, ForceFault>::fresh},
    {"fix", "a wrongly reported fix: stuck, late, offset, dropped, overconfident",
     "{from_s: 10, until_s: 20, fix: {east_m: 20, accuracy_m: 0.01, state: fixed}}",
     &SettingsOf<FixFaultOptions, FixFault>::fresh},
    {"scintillation", "a stormy ionosphere: amplitude and phase scintillate",
     "{from_s: 10, scintillation: {s4: 0.8, sigma_phi_rad: 0.5}}",
     &SettingsOf<ScintillationOptions, Scintillation>::fresh},
};

template <std::size_t... I>
void one_kind(options::Visitor& v, std::index_sequence<I...> /*all*/) {
  v.one_of({kKinds[I].name...}, "give the section of its kind, such as 'outage: {}'");
}

/// A name is shown in tables and pictures, between other text.
void check_name(const options::Visitor& v, const std::string& name) {
  const bool fits = name.size() <= 60 && std::none_of(name.begin(), name.end(), [](char c) {
                      return c == ';' || static_cast<unsigned char>(c) < 0x20;
                    });
  if (!fits) throw v.fault("name", "cannot be used in tables", "give at most 60 letters, without ';'");
}

void visit_times(options::Visitor& v, Fault& fault) {
  constexpr options::Range kTimes{0, 1e8};
  v.number({"from_s", "s", "begin, since the scenario's start"}, fault.from_s, kTimes);
  v.one_of({"until_s", "duration_s"});
  v.number({"until_s", "s", "end, since the scenario's start", "none; for restart the time to the first fix"},
           fault.until_s, kTimes);
  if (v.wants(v.has("duration_s"))) {
    std::optional<double> duration_s;
    v.number({"duration_s", "s", "duration instead of an end"}, duration_s, {0, 1e8, true});
    if (duration_s) fault.until_s = fault.from_s + *duration_s;
  }
  if (v.reads() && fault.until_s && *fault.until_s <= fault.from_s) {
    throw v.fault(v.has("until_s") ? "until_s" : "from_s",
                  fmt::format("the end at {} s is not after the start at {} s", *fault.until_s, fault.from_s),
                  "give an until_s above from_s, or duration_s");
  }
}

void visit_kind(options::Visitor& v, Fault& fault) {
  one_kind(v, std::make_index_sequence<std::size(kKinds)>());
  for (const FaultKind& kind : kKinds) {
    if (v.reads() && v.has(kind.name)) {
      fault.kind = &kind;
      fault.settings = kind.settings();
      const InputError here = v.fault(kind.name, {});
      fault.file = here.file();
      fault.line = here.line();
    }
    if (v.describes())
      v.part(kind.name, *kind.settings());
    else if (fault.kind == &kind)
      v.part(kind.name, *fault.settings);
  }
}

}  // namespace

void visit(options::Visitor& v, FaultSettings& settings) {
  settings.fields(v);
}

std::span<const FaultKind> fault_kinds() {
  return kKinds;
}

const FaultKind& fault_kind_named(std::string_view name) {
  std::vector<std::string> names;
  for (const FaultKind& kind : kKinds) {
    if (kind.name == name) return kind;
    names.emplace_back(kind.name);
  }
  throw InputError(fmt::format("there is no fault '{}'", name),
                   did_you_mean(closest(name, names), fmt::format("use one of {}", fmt::join(names, ", "))));
}

options::Description description(const FaultKind& kind) {
  options::Describer describer;
  kind.settings()->fields(describer);
  return std::move(describer).take();
}

bool Fault::concerns(std::string_view receiver) const {
  return receivers.empty() || std::find(receivers.begin(), receivers.end(), receiver) != receivers.end();
}

void Fault::check(const orbit::Sky& sky) const {
  const std::vector<gnss::SatelliteId> known = sky.satellites();
  for (const std::string& word : settings->satellites()) {
    const auto named = [&](gnss::SatelliteId id) { return holds({word}, id); };
    if (std::any_of(known.begin(), known.end(), named)) continue;
    std::set<std::string_view> systems;
    for (const gnss::SatelliteId id : known) systems.insert(gnss::name(id.system));
    throw InputError(
        file, line, fmt::format("fault '{}': the sky has no {}", name, word),
        fmt::format("leave it out, or name others; there are satellites of {}", fmt::join(systems, ", ")));
  }
}

void visit(options::Visitor& v, Fault& fault) {
  v.text({"name", "", "name in tables and pictures", "kind and number in the list"}, fault.name);
  if (v.reads()) check_name(v, fault.name);
  visit_times(v, fault);
  v.texts({"receivers", "", "names of the receivers that it affects", "all"}, fault.receivers);
  visit_kind(v, fault);
  if (v.reads() && !fault.until_s) {
    if (const auto duration_s = fault.settings->duration_s()) fault.until_s = fault.from_s + *duration_s;
  }
}

void visit_faults(options::Visitor& v, std::vector<Fault>& faults, std::span<const std::string> receivers) {
  std::vector<std::string> names;
  v.list("faults", faults, [&](Fault& fault) {
    visit(v, fault);
    if (!v.reads()) return;
    if (fault.name.empty()) fault.name = fmt::format("{} {}", fault.kind->name, names.size() + 1);
    if (std::find(names.begin(), names.end(), fault.name) != names.end())
      throw v.fault("name", fmt::format("two faults have the name '{}'", fault.name),
                    "give each fault another name");
    names.push_back(fault.name);
    for (const std::string& receiver : fault.receivers) {
      if (std::find(receivers.begin(), receivers.end(), receiver) != receivers.end()) continue;
      throw v.fault("receivers", fmt::format("there is no receiver '{}'", receiver),
                    fmt::format("use one of {}", fmt::join(receivers, ", ")));
    }
  });
}

Fault parse_fault(const std::string& text, const std::string& source, double now_s, int number) {
  options::Document document;
  document.file = source;
  document.kind = "fault";
  document.page = "docs/faults.md";
  Fault fault;
  fault.from_s = now_s;
  options::read_yaml(text, document, "it needs the section of its kind, such as 'outage: {}'", fault);
  if (fault.name.empty()) fault.name = fmt::format("{} {}", fault.kind->name, number);
  return fault;
}

namespace {

/// The largest number that RINEX 3.05 has for a satellite of each system (5.2, table 1).
constexpr std::array<int, gnss::kAllSystems.size()> kLast{32, 28, 36, 63, 10, 58};

bool is_system(std::string_view name) {
  return std::any_of(gnss::kAllSystems.begin(), gnss::kAllSystems.end(), [&](gnss::System system) {
    return lower_case(std::string(name)) == lower_case(std::string(gnss::name(system)));
  });
}

}  // namespace

bool holds(const SatelliteSet& set, gnss::SatelliteId id) {
  return set.empty() || std::any_of(set.begin(), set.end(), [&](const std::string& name) {
           return is_system(name) ? gnss::system_from_name(name) == id.system
                                  : gnss::parse_satellite(name) == id;
         });
}

void check_satellites(const SatelliteSet& set) {
  for (const std::string& name : set) {
    const auto id = gnss::parse_satellite(name);
    const int last = id ? kLast[static_cast<std::size_t>(id->system)] : 0;
    if (is_system(name) || (id && id->number >= 1 && id->number <= last)) continue;
    throw InputError(
        fmt::format("'{}' is not a satellite", name),
        "write names such as G05, R12, E11, C30, J02, S23, or systems: GPS, GLONASS, Galileo, BeiDou, QZSS, "
        "SBAS");
  }
}

void visit_satellites(options::Visitor& v, SatelliteSet& set) {
  v.texts({"satellites", "", "names (G05) or systems (GPS), one or a list", "all"}, set);
  if (!v.reads()) return;
  try {
    check_satellites(set);
  } catch (const InputError& error) {
    throw v.fault("satellites", error.problem(), error.hint());
  }
}

}  // namespace canyon::disturbance
