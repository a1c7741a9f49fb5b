#include "canyon/analysis/bench/drives.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"
#include "canyon/outputs/encoding/number.hpp"
#include "canyon/outputs/encoding/sensor_arrays.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::bench {

/// Texts of examples/bench; CMakeLists.txt makes them.
extern const char *const drives_yaml, *const drives_1_yaml;

namespace {

/// Definition of a lasting error of the fix.
constexpr double kLasting_m = 5, kLasting_s = 2;

void visit_parts(options::Visitor& v, const char* name, std::vector<ScenarioPart>& parts) {
  v.list(name, parts, [&](ScenarioPart& each) {
    v.text({"name", "", "name in names of drives"}, each.name);
    v.text({"scenario", "", "YAML"}, each.scenario);
  });
}

const std::string& part_named(const std::vector<ScenarioPart>& parts, const std::string& name) {
  const auto at = std::find_if(parts.begin(), parts.end(), [&](const auto& p) { return p.name == name; });
  if (at == parts.end()) throw InputError(fmt::format("the bench has no '{}'", name));
  return at->scenario;
}

class DriveSink final : public simulation::EpochSink {
 public:
  DriveSink(const simulation::Simulation& simulation, std::filesystem::path folder)
      : simulation_(simulation),
        folder_(std::move(folder)),
        sensors_(simulation.scenario().sensors, simulation.begin()) {}

  [[nodiscard]] bool uses_sensors() const override { return true; }

  void write(const simulation::Epoch& epoch) override {
    if (epoch.receiver != 0) return;
    if (epoch.sensors != nullptr) sensors_.add(*epoch.sensors);
    const double t = epoch.truth.time - simulation_.begin();
    const Eigen::Vector3d& v = epoch.truth.velocity_enu_mps;
    truth_ += fmt::format("{:.3f},{:.9f},{:.9f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f}\n", t,
                          geodesy::degrees(epoch.truth.position.latitude_rad),
                          geodesy::degrees(epoch.truth.position.longitude_rad), epoch.truth.position.height_m,
                          v.x(), v.y(), v.z(),
                          encoding::wrapped_azimuth_deg(geodesy::kPi / 2 - epoch.truth.yaw_rad, 4));
    write_fix(t, epoch.observed.fix);
    write_single(t, epoch.observed.single_epoch);
    follow_events(t, epoch);
  }

  void finish() override {
    end_event();
    write_file(
        folder_ / "truth.csv",
        "time_s,latitude_deg,longitude_deg,height_m,velocity_east_mps,velocity_north_mps,velocity_up_mps,"
        "heading_deg\n" +
            truth_);
    write_file(
        folder_ / "fixes.csv",
        "time_s,kind,latitude_deg,longitude_deg,height_m,velocity_east_mps,velocity_north_mps,velocity_up_"
        "mps,cov_ee_m2,cov_en_m2,cov_eu_m2,cov_nn_m2,cov_nu_m2,cov_uu_m2,vcov_ee_m2ps2,vcov_en_m2ps2,vcov_"
        "eu_m2ps2,vcov_nn_m2ps2,vcov_nu_m2ps2,vcov_uu_m2ps2,satellites,hdop,pdop\n" +
            fixes_);
    write_file(folder_ / "single.csv",
               "time_s,latitude_deg,longitude_deg,height_m,cov_ee_m2,cov_en_m2,cov_nn_m2\n" + single_);
    write_file(folder_ / "events.csv",
               "start_s,end_s,kind,bias_east_m,bias_north_m,bias_up_m,nlos,inputs\n" + events_);
    write_sensor(
        "imu", {"specific_force", "angular_rate"},
        "time_s,specific_force_x_mps2,specific_force_y_mps2,specific_force_z_mps2,angular_rate_x_radps,"
        "angular_rate_y_radps,angular_rate_z_radps\n");
    write_sensor("wheels", {"speed"}, "time_s,speed_left_mps,speed_right_mps\n");
  }

 private:
  struct Event {
    double start_s = 0, end_s = 0;
    std::string kind, inputs;
    Eigen::Vector3d bias = Eigen::Vector3d::Zero();
    int fixes = 0, epochs = 0;
    std::set<std::string> nlos;
  };

  void write_fix(double t, const positioning::Fix& fix) {
    fixes_ += fmt::format("{:.3f},{}", t, static_cast<int>(fix.kind()));
    if (!fix.solved()) {
      fixes_ += std::string(18, ',') + ",0,,\n";
      return;
    }
    fixes_ += fmt::format(",{:.9f},{:.9f},{:.4f}", geodesy::degrees(fix.position.latitude_rad),
                          geodesy::degrees(fix.position.longitude_rad), fix.position.height_m);
    const double none = std::numeric_limits<double>::quiet_NaN();
    const Eigen::Vector3d v = fix.velocity_enu_mps.value_or(Eigen::Vector3d::Constant(none));
    for (const double each : v) fixes_ += "," + encoding::fixed(each, 4);
    const bool reported = !fix.covariance_enu.isZero(0);
    const auto covariance = [&](const Eigen::Matrix3d& c, bool known, int decimals) {
      for (int i = 0; i < 3; ++i)
        for (int j = i; j < 3; ++j) fixes_ += "," + (known ? encoding::fixed(c(i, j), decimals) : "");
    };
    covariance(fix.covariance_enu, reported, 6);
    covariance(fix.velocity_covariance_enu.value_or(Eigen::Matrix3d::Zero()),
               reported && fix.velocity_covariance_enu.has_value(), 8);
    fixes_ += fmt::format(",{},{},{}\n", fix.used.size(), fix.dop ? encoding::fixed(fix.dop->hdop, 2) : "",
                          fix.dop ? encoding::fixed(fix.dop->pdop, 2) : "");
  }

  /// The baseline: the position of each epoch alone, as an estimate.
  void write_single(double t, const positioning::Fix& fix) {
    if (!fix.solved()) return;
    single_ += fmt::format("{:.3f},{:.9f},{:.9f},{:.4f}", t, geodesy::degrees(fix.position.latitude_rad),
                           geodesy::degrees(fix.position.longitude_rad), fix.position.height_m);
    const Eigen::Matrix3d& c = fix.covariance_enu;
    for (const double each : {c(0, 0), c(0, 1), c(1, 1)})
      single_ += "," + (c.isZero(0) ? "" : encoding::fixed(each, 6));
    single_ += '\n';
  }

  /// An event is the interval of a fault, or of errors above 5 m without a fault.
  void follow_events(double t, const simulation::Epoch& epoch) {
    const bool off = epoch.error_enu_m.head<2>().norm() > kLasting_m;
    std::string kind = encoding::fault_names(epoch.faults), inputs = inputs_of(epoch.faults);
    for (const auto& [name, input] : sensor_faults(t)) {
      kind += (kind.empty() ? "" : "; ") + name;
      inputs += (inputs.empty() ? "" : " ") + input;
    }
    if (kind.empty() && off) kind = "street", inputs = "fixes raw";
    if (kind != event_.kind) {
      end_event();
      event_.start_s = t;
      event_.kind = kind;
      event_.inputs = inputs;
    }
    event_.end_s = t;
    ++event_.epochs;
    if (kind.empty() || !epoch.error_enu_m.allFinite()) return;
    event_.bias += epoch.error_enu_m;
    ++event_.fixes;
    for (const receiver::SatelliteObservation& satellite : epoch.observed.satellites)
      if (satellite.used && satellite.visibility == propagation::Visibility::NLOS)
        event_.nlos.insert(gnss::to_string(satellite.id));
  }

  /// Data that contain faults of the receiver: those of the reported fix are not in raw data.
  [[nodiscard]] std::string inputs_of(const std::vector<std::string>& names) const {
    std::string inputs;
    for (const disturbance::Fault& fault : simulation_.scenario().faults)
      if (std::count(names.begin(), names.end(), fault.name) > 0 && inputs != "fixes raw")
        inputs = fault.kind->name == "fix" ? "fixes" : "fixes raw";
    return inputs;
  }

  [[nodiscard]] std::vector<std::pair<std::string, std::string>> sensor_faults(double t) const {
    const inertial::SensorOptions& sensors = simulation_.scenario().sensors;
    const auto any = [t](const std::vector<inertial::SensorFault>& faults) {
      return std::any_of(faults.begin(), faults.end(), [t](const auto& each) { return each.holds(t); });
    };
    std::vector<std::pair<std::string, std::string>> found;
    if (sensors.imu && any(sensors.imu->frozen)) found.emplace_back("frozen IMU", "imu");
    if (sensors.wheels && any(sensors.wheels->slips)) found.emplace_back("slip of wheels", "wheels");
    return found;
  }

  void end_event() {
    const bool lasting = event_.kind != "street" || event_.end_s - event_.start_s >= kLasting_s;
    if (!event_.kind.empty() && lasting) {
      const Eigen::Vector3d bias = 2 * event_.fixes > event_.epochs
                                       ? Eigen::Vector3d(event_.bias / event_.fixes)
                                       : Eigen::Vector3d::Constant(std::nan(""));
      events_ += fmt::format("{:.3f},{:.3f},{},{},{},{},{},{}\n", event_.start_s, event_.end_s, event_.kind,
                             encoding::fixed(bias.x(), 3), encoding::fixed(bias.y(), 3),
                             encoding::fixed(bias.z(), 3), fmt::join(event_.nlos, " "), event_.inputs);
    }
    event_ = {};
  }

  /// Samples of a sensor as a table; empty if lost.
  void write_sensor(const std::string& sensor, const std::vector<std::string>& names, std::string text) {
    std::vector<const encoding::SensorArray*> columns;
    for (const encoding::SensorArray& array : sensors_.arrays()) {
      const bool wanted = array.name == "time_s" || std::count(names.begin(), names.end(), array.name) > 0;
      if (array.sensor == sensor && wanted) columns.push_back(&array);
    }
    if (columns.empty()) return;
    for (std::size_t row = 0; row < columns[0]->values.size(); ++row) {
      for (const encoding::SensorArray* array : columns)
        for (std::size_t k = 0; k < array->columns; ++k)
          text +=
              (array == columns[0] ? "" : ",") + encoding::fixed(array->values[row * array->columns + k], 6);
      text += '\n';
    }
    write_file(folder_ / (sensor + ".csv"), text);
  }

  const simulation::Simulation& simulation_;
  std::filesystem::path folder_;
  encoding::SensorArrays sensors_;
  std::string truth_, fixes_, single_, events_;
  Event event_;
};

}  // namespace

void visit(options::Visitor& v, Catalogue& o) {
  v.integer({"bench", "", "edition"}, o.bench, 1, 1000);
  v.text({"common", "", "YAML of all scenarios"}, o.common);
  v.text({"sensors", "", "YAML of sensors"}, o.sensors);
  visit_parts(v, "towns", o.towns);
  visit_parts(v, "routes", o.routes);
  v.list("drives", o.drives, [&](BenchDrive& each) {
    v.text({"name", "", "of its folder"}, each.name);
    v.text({"about", "", "the failure"}, each.about);
    v.text({"town", "", "where"}, each.town);
    v.text({"route", "", "name of its route"}, each.route);
    v.texts({"needs", "", "what estimators need"}, each.needs);
    v.text({"faults", "", "YAML of faults"}, each.faults);
    v.text({"sensors", "", "YAML of sensors", "those of all"}, each.sensors);
  });
}

const Catalogue& catalogue(int edition) {
  static const auto read = [](const char* yaml) {
    Catalogue catalogue;
    options::Document document;
    document.file = "drives.yaml";
    document.kind = "bench";
    document.page = "docs/bench.md";
    options::read_yaml(yaml, document, "it needs drives", catalogue);
    return catalogue;
  };
  static const std::array<Catalogue, kEdition> all{read(drives_1_yaml), read(drives_yaml)};
  if (edition < 1 || edition > kEdition)
    throw InputError(fmt::format("there is no edition {} of the bench", edition), "give 1 or 2");
  return all[static_cast<std::size_t>(edition - 1)];
}

std::string scenario_of(const Catalogue& all, const BenchDrive& drive, const BenchReceiver& receiver,
                        std::uint64_t seed, const std::string& own) {
  std::string text = all.common + (drive.sensors.empty() ? all.sensors : drive.sensors);
  text += own.empty() ? part_named(all.towns, drive.town) + part_named(all.routes, drive.route) : own;
  const bool rtk = !receiver.base.empty();
  text += fmt::format("receivers:\n  - {{name: rover, profile: {}{}}}\n", receiver.profile,
                      rtk ? ", rtk: true, corrections: {from: base, rate_hz: 1, latency_s: 0.3}" : "");
  if (rtk)
    text += fmt::format("  - {{name: base, profile: {}, signal: {{antenna: survey}}, fixed: {}}}\n",
                        receiver.profile, receiver.base);
  if (!drive.faults.empty()) text += "faults: " + drive.faults + "\n";
  return text + fmt::format("seed: {}\n", seed);
}

std::optional<double> first_fault_s(const simulation::Scenario& scenario) {
  std::vector<double> times;
  for (const disturbance::Fault& fault : scenario.faults) times.push_back(fault.from_s);
  if (scenario.sensors.imu)
    for (const auto& each : scenario.sensors.imu->frozen) times.push_back(each.from_s);
  if (scenario.sensors.wheels)
    for (const auto& each : scenario.sensors.wheels->slips) times.push_back(each.from_s);
  if (times.empty()) return std::nullopt;
  return *std::min_element(times.begin(), times.end());
}

std::unique_ptr<simulation::EpochSink> make_drive_sink(const simulation::Simulation& simulation,
                                                       const std::filesystem::path& folder) {
  return std::make_unique<DriveSink>(simulation, folder);
}

void write_card(const simulation::Simulation& simulation, const DriveCard& card,
                const std::filesystem::path& folder) {
  const std::int64_t unix_ns = geodesy::unix_from_gps(simulation.begin());
  const std::string without = card.without_fault.empty() ? "" : "without_fault: " + card.without_fault + "\n";
  write_file(
      folder / "card.yaml",
      fmt::format("bench: {}\nname: {}\nabout: \"{}\"\nneeds: [{}]\n{}receiver: {}\nseed: {}\n"
                  "begin_unix_s: {}.{:09}\nduration_s: {:.3f}\nimu_axes: forward, left, up\n",
                  card.edition, card.drive.name, card.drive.about, fmt::join(card.drive.needs, ", "), without,
                  card.receiver, simulation.scenario().seed, unix_ns / 1'000'000'000, unix_ns % 1'000'000'000,
                  simulation.interval_s() * static_cast<double>(simulation.epoch_count() - 1)));
}

}  // namespace canyon::bench
