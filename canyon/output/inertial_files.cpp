#include "canyon/output/inertial_files.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/output_file.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/inertial/imu_axes.hpp"
#include "canyon/output/npz.hpp"
#include "canyon/output/number.hpp"
#include "canyon/output/sensor_arrays.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/sensors/sensor_run.hpp"

namespace canyon::output {
namespace {

using Eigen::Vector3d;
using simulation::BarometerSample;
using simulation::InertialSample;
using simulation::MagnetometerSample;
using simulation::WheelsAtWork;

/// A layout of files.
class Layout {
 public:
  virtual ~Layout() = default;
  virtual void add(const InertialSample& /*sample*/) {}
  virtual void add_wheels(const WheelsAtWork& /*sample*/) {}
  virtual void add_pressure(const BarometerSample& /*sample*/) {}
  virtual void add_field(const MagnetometerSample& /*sample*/) {}
  virtual void add_fix(const simulation::Epoch& /*epoch*/) {}
  virtual void commit() = 0;
};

class CsvLayout final : public Layout {
 public:
  CsvLayout(const std::filesystem::path& folder, inertial::ImuAxes axes, geodesy::GpsTime begin)
      : axes_(axes), begin_(begin), imu_(folder / "imu.csv"), motion_(folder / "motion.csv") {
    const std::string input =
        "specific_force_x_mps2,specific_force_y_mps2,specific_force_z_mps2,angular_rate_x_radps,"
        "angular_rate_y_radps,angular_rate_z_radps";
    imu_.write("gps_week,gps_tow," + input + ",temperature_k\n");
    motion_.write(
        "gps_week,gps_tow,latitude_deg,longitude_deg,height_m,velocity_east_mps,velocity_north_mps,"
        "velocity_up_mps,roll_deg,pitch_deg,heading_deg," +
        input + "\n");
  }

  void add(const InertialSample& sample) override {
    if (sample.sample) {
      begin_line(begin_ + sample.sample->time_s);
      append(sample.sample->measured);
      append(sample.sample->temperature_k, 6);
      end_line(imu_);
    }
    begin_line(sample.time);
    const simulation::SensorMotion motion(sample.truth.sensor, axes_);
    append(motion.place_deg_m.x(), 13);
    append(motion.place_deg_m.y(), 13);
    append(motion.place_deg_m.z(), 9);
    append(motion.velocity_enu_mps, 12);
    append(motion.attitude_deg, 12);
    append(sample.truth.input);
    end_line(motion_);
  }
  void commit() override {
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

/// Increments with forward-right-down axes, fixes and truth; times are seconds of the week.
class KfGinsLayout final : public Layout {
 public:
  KfGinsLayout(const std::filesystem::path& folder, const inertial::ImuOptions& options,
               geodesy::GpsTime begin)
      : axes_(options.axes),
        interval_s_(1 / options.rate_hz),
        begin_(begin),
        imu_(folder / "kf_gins_imu.txt"),
        gnss_(folder / "kf_gins_gnss.txt"),
        truth_(folder / "kf_gins_truth.nav") {}

  void add(const InertialSample& sample) override {
    if (sample.sample) {
      const inertial::ImuInput& measured = sample.sample->measured;
      const auto increment = [this](const Vector3d& v) -> Vector3d {
        return interval_s_ * inertial::in_axes(v, axes_, inertial::ImuAxes::Frd);
      };
      const Vector3d turn = increment(measured.angular_rate_radps);
      const Vector3d push = increment(measured.specific_force_mps2);
      imu_.write(fmt::format("{} {:.15e} {:.15e} {:.15e} {:.15e} {:.15e} {:.15e}\n",
                             seconds_of_week(begin_ + sample.sample->time_s, 9), turn.x(), turn.y(), turn.z(),
                             push.x(), push.y(), push.z()));
    }
    const simulation::SensorMotion motion(sample.truth.sensor, axes_);
    truth_.write(fmt::format("{} {} {:.12f} {:.12f} {:.6f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                             sample.time.week(), seconds_of_week(sample.time, 9), motion.place_deg_m.x(),
                             motion.place_deg_m.y(), motion.place_deg_m.z(), motion.velocity_enu_mps.y(),
                             motion.velocity_enu_mps.x(), -motion.velocity_enu_mps.z(),
                             motion.attitude_deg.x(), motion.attitude_deg.y(), motion.attitude_deg.z()));
  }
  void add_fix(const simulation::Epoch& epoch) override {
    const positioning::Fix& fix = epoch.observed.fix;
    if (epoch.receiver != 0 || !fix.solved()) return;
    const auto sigma_m = [&fix](int axis) { return std::sqrt(fix.covariance_enu(axis, axis)); };
    gnss_.write(fmt::format("{} {:.12f} {:.12f} {:.6f} {:.6f} {:.6f} {:.6f}\n",
                            seconds_of_week(epoch.truth.time, 9), geodesy::degrees(fix.position.latitude_rad),
                            geodesy::degrees(fix.position.longitude_rad), fix.position.height_m, sigma_m(1),
                            sigma_m(0), sigma_m(2)));
  }
  void commit() override {
    imu_.commit();
    gnss_.commit();
    truth_.commit();
  }

 private:
  inertial::ImuAxes axes_;
  double interval_s_;
  geodesy::GpsTime begin_;
  OutputFile imu_, gnss_, truth_;
};

/// A file of one sensor.
class OneFile : public Layout {
 public:
  OneFile(const std::filesystem::path& path, std::string_view head) : file_(path) { file_.write(head); }
  void commit() override { file_.commit(); }

 protected:
  OutputFile file_;
};

/// Samples forward, left, up at their stated Unix times [s].
class GiciLayout final : public OneFile {
 public:
  GiciLayout(const std::filesystem::path& folder, inertial::ImuAxes axes)
      : OneFile(folder / "gici_imu.txt", "Timestamp\tAcc-X\tAcc-Y\tAcc-Z\tGyro-X\tGyro-Y\tGyro-Z\n"),
        axes_(axes) {}

  void add(const InertialSample& sample) override {
    if (!sample.sample) return;
    constexpr std::int64_t kPerSecond = geodesy::GpsTime::kNanosecondsPerSecond;
    const std::int64_t unix_ns = geodesy::unix_from_gps(sample.stated);
    const auto flu = [this](const Vector3d& v) -> Vector3d {
      return inertial::in_axes(v, axes_, inertial::ImuAxes::Flu);
    };
    const Vector3d force = flu(sample.sample->measured.specific_force_mps2);
    const Vector3d rate = flu(sample.sample->measured.angular_rate_radps);
    file_.write(fmt::format("{}.{:09}\t{:.9f}\t{:.9f}\t{:.9f}\t{:.12f}\t{:.12f}\t{:.12f}\n",
                            unix_ns / kPerSecond, unix_ns % kPerSecond, force.x(), force.y(), force.z(),
                            rate.x(), rate.y(), rate.z()));
  }

 private:
  inertial::ImuAxes axes_;
};

class WheelLayout final : public OneFile {
 public:
  explicit WheelLayout(const std::filesystem::path& folder)
      : OneFile(folder / "wheels.csv",
                "gps_week,gps_tow,speed_left_mps,speed_right_mps,ticks_left,ticks_right,true_speed_left_mps,"
                "true_speed_right_mps\n") {}

  void add_wheels(const WheelsAtWork& sample) override {
    const auto& [left, right] = sample.sample.speed_mps;
    const auto& ticks = sample.sample.ticks;
    file_.write(fmt::format("{},{},{},{},{},{},{},{}\n", sample.time.week(), seconds_of_week(sample.time, 9),
                            left, right, ticks ? std::to_string((*ticks)[0]) : "",
                            ticks ? std::to_string((*ticks)[1]) : "", sample.true_mps[0],
                            sample.true_mps[1]));
  }
};

class BarometerLayout final : public OneFile {
 public:
  explicit BarometerLayout(const std::filesystem::path& folder)
      : OneFile(folder / "barometer.csv",
                "gps_week,gps_tow,pressure_pa,pressure_altitude_m,temperature_k,sensor_temperature_k,"
                "true_pressure_pa,true_height_msl_m\n") {}

  void add_pressure(const BarometerSample& sample) override {
    const inertial::Pressure& p = sample.pressure;
    file_.write(fmt::format("{},{},{},{},{},{},{},{}\n", sample.time.week(), seconds_of_week(sample.time, 9),
                            p.measured_pa, inertial::pressure_altitude_m(p.measured_pa), p.temperature_k,
                            p.sensor_temperature_k, p.true_pa, sample.height_m));
  }
};

class MagnetometerLayout final : public OneFile {
 public:
  explicit MagnetometerLayout(const std::filesystem::path& folder)
      : OneFile(
            folder / "magnetometer.csv",
            "gps_week,gps_tow,field_x_ut,field_y_ut,field_z_ut,true_field_x_ut,true_field_y_ut,true_field_z_"
            "ut\n") {}

  void add_field(const MagnetometerSample& sample) override {
    constexpr double kMicro = 1e6;
    const Vector3d measured = kMicro * sample.measured_t, truth = kMicro * sample.true_t;
    file_.write(fmt::format("{},{},{},{},{},{},{},{}\n", sample.time.week(), seconds_of_week(sample.time, 9),
                            measured.x(), measured.y(), measured.z(), truth.x(), truth.y(), truth.z()));
  }
};

/// sensors.npz: every number of every sensor.
class NpzLayout {
 public:
  NpzLayout(const std::filesystem::path& folder, const inertial::SensorOptions& sensors,
            geodesy::GpsTime begin)
      : begin_(begin), arrays_(sensors, begin), file_(folder / "sensors.npz") {}

  void add(const simulation::SensorBatch& batch) { arrays_.add(batch); }
  void commit() {
    NpzWriter npz(file_);
    npz.add("begin", {static_cast<double>(begin_.week()), begin_.seconds_of_week()}, 1);
    for (const SensorArray& array : arrays_.arrays())
      npz.add(array.sensor + "_" + array.name, array.values, array.columns);
    npz.finish();
    file_.commit();
  }

 private:
  geodesy::GpsTime begin_;
  SensorArrays arrays_;
  OutputFile file_;
};

class InertialFiles final : public simulation::EpochSink {
 public:
  InertialFiles(const simulation::Simulation& simulation, const std::filesystem::path& folder) {
    const inertial::SensorOptions& sensors = simulation.scenario().sensors;
    const simulation::OutputConfig& wanted = simulation.scenario().outputs;
    const geodesy::GpsTime begin = simulation.begin();
    if (sensors.imu && wanted.has("imu"))
      layouts_.push_back(std::make_unique<CsvLayout>(folder, sensors.imu->axes, begin));
    if (sensors.imu && wanted.has("kf_gins"))
      layouts_.push_back(std::make_unique<KfGinsLayout>(folder, *sensors.imu, begin));
    if (sensors.imu && wanted.has("gici"))
      layouts_.push_back(std::make_unique<GiciLayout>(folder, sensors.imu->axes));
    if (sensors.wheels && wanted.has("wheels")) layouts_.push_back(std::make_unique<WheelLayout>(folder));
    if (sensors.barometer && wanted.has("barometer"))
      layouts_.push_back(std::make_unique<BarometerLayout>(folder));
    if (sensors.magnetometer && wanted.has("magnetometer"))
      layouts_.push_back(std::make_unique<MagnetometerLayout>(folder));
    if (wanted.has("sensors_npz")) npz_.emplace(folder, sensors, begin);
  }

  void write(const simulation::Epoch& epoch) override {
    if (epoch.receiver == 0 && epoch.sensors != nullptr) {
      if (npz_) npz_->add(*epoch.sensors);
      for (const auto& layout : layouts_) {
        for (const InertialSample& sample : epoch.sensors->imu) layout->add(sample);
        for (const WheelsAtWork& sample : epoch.sensors->wheels) layout->add_wheels(sample);
        for (const BarometerSample& sample : epoch.sensors->barometer) layout->add_pressure(sample);
        for (const MagnetometerSample& sample : epoch.sensors->magnetometer) layout->add_field(sample);
      }
    }
    for (const auto& layout : layouts_) layout->add_fix(epoch);
  }
  void finish() override {
    for (const auto& layout : layouts_) layout->commit();
    if (npz_) npz_->commit();
  }
  [[nodiscard]] bool uses_sensors() const override { return npz_ || !layouts_.empty(); }

 private:
  std::vector<std::unique_ptr<Layout>> layouts_;
  std::optional<NpzLayout> npz_;
};

}  // namespace

std::unique_ptr<simulation::EpochSink> make_inertial_files(const simulation::Simulation& simulation,
                                                           const std::filesystem::path& folder) {
  return std::make_unique<InertialFiles>(simulation, folder);
}

}  // namespace canyon::output
