#include "canyon/outputs/encoding/sinks.hpp"

#include <map>
#include <optional>
#include <set>
#include <utility>

#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/number.hpp"
#include "canyon/outputs/encoding/sensor_arrays.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/simulation/inertial/imu_options.hpp"
#include "canyon/simulation/samples/sample_file.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/sensor_run.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "canyon/sky/rinex/navigation_writer.hpp"

namespace canyon::encoding {
namespace {

using Eigen::Vector3d;
using simulation::InertialSample;

/// imu.csv and motion.csv.
class ImuFiles {
 public:
  ImuFiles(const std::filesystem::path& folder, inertial::ImuAxes axes, geodesy::GpsTime begin)
      : axes_(axes), begin_(begin), imu_(folder / "imu.csv"), motion_(folder / "motion.csv") {
    imu_.write(sensor_files().at("imu.csv") + '\n');
    motion_.write(sensor_files().at("motion.csv") + '\n');
  }

  void add(const InertialSample& sample) {
    if (sample.sample) {
      begin_line(begin_ + sample.sample->time_s);
      append(sample.sample->measured);
      append(sample.sample->temperature_k, 6);
      end_line(imu_);
    }
    begin_line(sample.time);
    const simulation::SensorMotion motion(sample.truth.sensor, axes_);
    append(motion.position_deg_m.x(), 13);
    append(motion.position_deg_m.y(), 13);
    append(motion.position_deg_m.z(), 9);
    append(motion.velocity_enu_mps, 12);
    append(motion.attitude_deg, 12);
    append(sample.truth.input);
    end_line(motion_);
  }
  void commit() {
    imu_.commit();
    motion_.commit();
  }

 private:
  void begin_line(geodesy::GpsTime time) {
    if (!(time == time_)) {
      time_ = time;
      time_text_ = std::to_string(time.week());
      time_text_.append(1, ',').append(seconds_of_week(time, 9));
    }
    line_ = time_text_;
  }
  void append(double value, int decimals) {
    line_.push_back(',');
    append_fixed(line_, value, decimals);
  }
  void append(const Vector3d& v, int decimals) {
    for (Eigen::Index i = 0; i < 3; ++i) append(v[i], decimals);
  }
  void append(const inertial::ImuInput& input) {
    append(input.specific_force_mps2, 12);
    append(input.angular_rate_radps, 14);
  }
  void end_line(OutputFile& file) {
    line_.push_back('\n');
    file.write(line_);
  }

  inertial::ImuAxes axes_;
  geodesy::GpsTime begin_;
  OutputFile imu_, motion_;
  geodesy::GpsTime time_;  // of time_text_
  std::string line_, time_text_;
};

/// Files of the scenario's sensors in `folder` (columns: sensor_files()), as requested in `outputs:`. `imu`:
/// imu.csv, its samples, and motion.csv, the true motion of the sensor at their instants, with all digits;
/// `wheels`: wheels.csv; `barometer`: barometer.csv; `magnetometer`: magnetometer.csv; `sensors_npz`:
/// sensors.npz, all of these for NumPy.
class InertialFiles final : public simulation::EpochSink {
 public:
  InertialFiles(const simulation::Simulation& simulation, const std::filesystem::path& folder)
      : begin_(simulation.begin()), in_tables_(simulation.scenario().sensors) {
    const simulation::OutputConfig& wanted = simulation.scenario().outputs;
    if (in_tables_.imu && wanted.has("imu")) imu_.emplace(folder, in_tables_.imu->axes, begin_);
    if (wanted.has("sensors_npz")) npz_.emplace(folder / "sensors.npz"), all_.emplace(in_tables_, begin_);
    in_tables_.imu.reset();
    if (!wanted.has("wheels")) in_tables_.wheels.reset();
    if (!wanted.has("barometer")) in_tables_.barometer.reset();
    if (!wanted.has("magnetometer")) in_tables_.magnetometer.reset();
    SensorArrays empty(in_tables_, begin_);
    for (const SensorArray& array : empty.arrays()) {
      const std::string name = array.sensor + ".csv";
      const auto [file, first] = tables_.try_emplace(array.sensor, folder / name);
      if (first) file->second.write(sensor_files().at(name) + '\n');
    }
  }

  void write(const simulation::Epoch& epoch) override {
    if (epoch.receiver != 0 || epoch.sensors == nullptr) return;
    if (all_) all_->add(*epoch.sensors);
    if (imu_)
      for (const InertialSample& sample : epoch.sensors->imu) imu_->add(sample);
    SensorArrays batch(in_tables_, begin_);
    batch.add(*epoch.sensors);
    for (auto& [sensor, file] : tables_) file.write(batch.csv_lines(sensor));
  }
  void finish() override {
    if (imu_) imu_->commit();
    for (auto& [sensor, file] : tables_) file.commit();
    if (!npz_) return;
    NpzWriter npz(*npz_);
    npz.add("begin", {static_cast<double>(begin_.week()), begin_.seconds_of_week()}, 1);
    for (const SensorArray& array : all_->arrays())
      npz.add(array.sensor + "_" + array.name, array.values, array.columns);
    npz.finish();
    npz_->commit();
  }
  [[nodiscard]] bool uses_sensors() const override { return imu_ || !tables_.empty() || npz_; }

 private:
  geodesy::GpsTime begin_;
  inertial::SensorOptions in_tables_;  // sensors of tables_
  std::optional<ImuFiles> imu_;
  std::map<std::string, OutputFile> tables_;
  std::optional<OutputFile> npz_;
  std::optional<SensorArrays> all_;  // of npz_
};

/// The simulated sky, written once at the end.
class NavigationFile final : public simulation::EpochSink {
 public:
  NavigationFile(std::filesystem::path path, const gnss::NavigationData& data)
      : file_(std::move(path)), data_(data) {}
  void write(const simulation::Epoch&) override {}
  void finish() override {
    if (std::exchange(finished_, true)) return;
    file_.write(rinex::format_rinex_navigation(data_));
    file_.commit();
  }

 private:
  OutputFile file_;
  const gnss::NavigationData& data_;
  bool finished_ = false;
};

std::string safe_name(const std::string& name) {
  std::string safe;
  for (const char c : name.substr(0, 64)) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '-' || c == '_' || (c == '.' && !safe.empty());
    safe += plain ? c : '_';
  }
  return safe.empty() ? "receiver" : safe;
}

}  // namespace

std::vector<std::string> receiver_folder_names(const std::vector<std::string>& receiver_names) {
  // Names that differ only in case count as equal, since some file systems ignore case.
  std::set<std::string> taken{"sky.nav", "sensors.npz", "view", "report.txt"};
  for (const auto& [file, heads] : sensor_files()) taken.insert(file);
  std::vector<std::string> folders;
  for (const std::string& name : receiver_names) {
    const std::string safe = safe_name(name);
    std::string folder = safe;
    for (int i = 2; !taken.insert(lower_case(folder)).second; ++i) folder = safe + '-' + std::to_string(i);
    folders.push_back(std::move(folder));
  }
  return folders;
}

std::filesystem::path receiver_folder(const simulation::Simulation& simulation,
                                      const std::filesystem::path& folder, std::size_t receiver) {
  const auto names = simulation::receiver_names(simulation.scenario().receivers);
  return names.size() == 1 ? folder : folder / receiver_folder_names(names).at(receiver);
}

std::vector<std::unique_ptr<simulation::EpochSink>> make_file_sinks(const simulation::Simulation& simulation,
                                                                    const std::filesystem::path& folder) {
  const simulation::OutputConfig& wanted = simulation.scenario().outputs;
  wanted.validate();
  std::vector<std::unique_ptr<simulation::EpochSink>> sinks;
  make_output_folder(folder);
  for (std::size_t i = 0; i < simulation.scenario().receivers.size(); ++i) {
    const std::filesystem::path at = receiver_folder(simulation, folder, i);
    if (at != folder) make_output_folder(at);
    ReceiverDescription description = describe_receiver(simulation, i);
    description.sensors = simulation::sensors_of(simulation.scenario(), i);
    for (const Format& format : formats())
      if (wanted.has(format.name) && (description.sensors.any() || format.name != "highres_imu"))
        sinks.push_back(open_file(format.name, at / format.file, i, description));
    if (!wanted.has("samples")) continue;
    for (auto& file : samples::make_sample_files(simulation, i, at / "samples.iq"))
      sinks.push_back(std::move(file));
  }
  if (wanted.has("rinex_navigation") && !simulation.navigation().empty())
    sinks.push_back(std::make_unique<NavigationFile>(folder / "sky.nav", simulation.navigation()));
  if (simulation.scenario().sensors.any())
    sinks.push_back(std::make_unique<InertialFiles>(simulation, folder));
  return sinks;
}

}  // namespace canyon::encoding
