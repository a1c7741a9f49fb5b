#include "canyon/outputs/encoding/sensor_arrays.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "canyon/base/input_error.hpp"
#include "canyon/base/payload.hpp"
#include "canyon/outputs/encoding/number.hpp"

namespace canyon::encoding {
namespace {

using Eigen::Vector3d;
using simulation::SensorBatch;

constexpr double kNoSample = std::numeric_limits<double>::quiet_NaN();

void append(std::vector<double>& values, double value) {
  values.push_back(value);
}
template <typename Several>
void append(std::vector<double>& values, const Several& several) {
  values.insert(values.end(), several.data(), several.data() + several.size());
}

// The arrays of a sample without its time: name, column headers in a CSV file, values.
template <typename Put>
void each_array(const simulation::InertialSample& sample, inertial::ImuAxes axes, const Put& put) {
  const simulation::SensorMotion motion(sample.truth.sensor, axes);
  const Vector3d none = Vector3d::Constant(kNoSample);
  const auto& reported = sample.sample;
  put("stated_s", "", reported ? reported->time_s : kNoSample);
  put("specific_force", "", reported ? reported->measured.specific_force_mps2 : none);
  put("angular_rate", "", reported ? reported->measured.angular_rate_radps : none);
  put("true_specific_force", "", sample.mean.specific_force_mps2);
  put("true_angular_rate", "", sample.mean.angular_rate_radps);
  put("place", "", motion.position_deg_m);
  put("velocity", "", motion.velocity_enu_mps);
  put("attitude", "", motion.attitude_deg);
  put("temperature", "", reported ? reported->temperature_k : kNoSample);
}
template <typename Put>
void each_array(const simulation::WheelsAtWork& sample, inertial::ImuAxes, const Put& put) {
  inertial::WheelPair ticks{kNoSample, kNoSample};
  if (const auto& counted = sample.sample.ticks) std::copy(counted->begin(), counted->end(), ticks.begin());
  put("speed", "speed_left_mps,speed_right_mps", sample.sample.speed_mps);
  put("ticks", "ticks_left,ticks_right", ticks);
  put("true_speed", "true_speed_left_mps,true_speed_right_mps", sample.true_mps);
}
template <typename Put>
void each_array(const simulation::BarometerSample& sample, inertial::ImuAxes, const Put& put) {
  const inertial::Pressure& p = sample.pressure;
  put("pressure", "pressure_pa", p.measured_pa);
  put("altitude", "pressure_altitude_m", inertial::pressure_altitude_m(p.measured_pa));
  put("temperature", "temperature_k", p.temperature_k);
  put("sensor_temperature", "sensor_temperature_k", p.sensor_temperature_k);
  put("true_pressure", "true_pressure_pa", p.true_pa);
  put("true_height", "true_height_msl_m", sample.height_m);
}
template <typename Put>
void each_array(const simulation::MagnetometerSample& sample, inertial::ImuAxes, const Put& put) {
  constexpr double kMicro = 1e6;
  put("field", "field_x_ut,field_y_ut,field_z_ut", Vector3d(kMicro * sample.measured_t));
  put("true_field", "true_field_x_ut,true_field_y_ut,true_field_z_ut", Vector3d(kMicro * sample.true_t));
}

static_assert(std::endian::native == std::endian::little, "arrays are written as they lie in memory");

constexpr std::size_t kVersion = 20, kStored = 0, kTime = 0,
                      kDate = 0x21;  // 1980-01-01: for deterministic bytes

/// Fields common to a local header and its entry in the list.
void describe(Payload& record, std::uint32_t crc, std::uint32_t size, std::size_t name_length) {
  record.u2(kVersion).u2(0).u2(kStored).u2(kTime).u2(kDate);
  record.u4(crc).u4(size).u4(size).u2(name_length).u2(0);
}

/// Magic, version, and the dictionary that describes the numbers, padded to 64 bytes.
std::string npy_header(std::size_t rows, std::size_t columns) {
  std::string text = fmt::format("{{'descr': '<f8', 'fortran_order': False, 'shape': ({},{}), }}", rows,
                                 columns == 1 ? "" : fmt::format(" {}", columns));
  constexpr std::size_t kBlock = 64, kBefore = 10;
  text.append(kBlock - (kBefore + text.size() + 1) % kBlock, ' ');
  text += '\n';
  return Payload().raw("\x93NUMPY").u2(1).u2(text.size()).bytes() + text;
}

}  // namespace

SensorArrays::SensorArrays(const inertial::SensorOptions& sensors, geodesy::GpsTime begin)
    : axes_(sensors.imu ? sensors.imu->axes : inertial::ImuAxes()), begin_(begin) {
  const auto declare = [&](const std::string& sensor, const auto& sample) {
    arrays_.push_back({sensor, "time_s", 1, "gps_week,gps_tow"});
    each_array(sample, axes_, [&](const char* name, const char* heads, const auto& value) {
      std::vector<double> values;
      append(values, value);
      arrays_.push_back({sensor, name, values.size(), heads});
    });
  };
  if (sensors.imu) declare("imu", simulation::InertialSample());
  if (sensors.wheels) declare("wheels", simulation::WheelsAtWork());
  if (sensors.barometer) declare("barometer", simulation::BarometerSample());
  if (sensors.magnetometer) declare("magnetometer", simulation::MagnetometerSample());
}

void SensorArrays::add(const SensorBatch& batch) {
  const auto add = [&](const char* sensor, const auto& samples) {
    const auto first = std::find_if(arrays_.begin(), arrays_.end(),
                                    [&](const SensorArray& array) { return array.sensor == sensor; });
    if (first == arrays_.end()) return;
    for (const auto& sample : samples) {
      auto at = first;
      (at++)->values.push_back(sample.time - begin_);
      each_array(sample, axes_,
                 [&](const char*, const char*, const auto& value) { append((at++)->values, value); });
    }
  };
  add("imu", batch.imu);
  add("wheels", batch.wheels);
  add("barometer", batch.barometer);
  add("magnetometer", batch.magnetometer);
}

const std::map<std::string, std::string>& sensor_files() {
  static const std::map<std::string, std::string> files = [] {
    const std::string input =
        "specific_force_x_mps2,specific_force_y_mps2,specific_force_z_mps2,angular_rate_x_radps,"
        "angular_rate_y_radps,angular_rate_z_radps";
    std::map<std::string, std::string> heads;
    heads["imu.csv"] = "gps_week,gps_tow," + input + ",temperature_k";
    heads["motion.csv"] =
        "gps_week,gps_tow,latitude_deg,longitude_deg,height_m,velocity_east_mps,velocity_north_mps,"
        "velocity_up_mps,roll_deg,pitch_deg,heading_deg," +
        input;
    inertial::SensorOptions all;
    all.wheels.emplace();
    all.barometer.emplace();
    all.magnetometer.emplace();
    SensorArrays tables(all, {});
    for (const SensorArray& array : tables.arrays()) {
      std::string& line = heads[array.sensor + ".csv"];
      line += (line.empty() ? "" : ",") + array.heads;
    }
    return heads;
  }();
  return files;
}

std::string SensorArrays::csv_lines(std::string_view sensor) const {
  std::vector<const SensorArray*> own;
  for (const SensorArray& array : arrays_)
    if (array.sensor == sensor) own.push_back(&array);
  std::string lines;
  for (std::size_t row = 0; row < own.at(0)->values.size(); ++row) {
    const geodesy::GpsTime time = begin_ + own[0]->values[row];
    lines += fmt::format("{},{}", time.week(), seconds_of_week(time, 9));
    for (std::size_t i = 1; i < own.size(); ++i) {
      for (std::size_t k = 0; k < own[i]->columns; ++k) {
        const double value = own[i]->values[row * own[i]->columns + k];
        lines += std::isnan(value) ? "," : fmt::format(",{}", value);
      }
    }
    lines += '\n';
  }
  return lines;
}

void NpzWriter::add(std::string_view name, const std::vector<double>& values, std::size_t columns) {
  const std::string header = npy_header(values.size() / columns, columns);
  const std::string_view data(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double));
  Member member{fmt::format("{}.npy", name)};
  constexpr std::uint64_t kMax = 4'200'000'000;  // leaves room for the list
  if (size_ + header.size() + data.size() > kMax) {
    throw InputError(fmt::format("array {} does not fit into a .npz file (limit 4 GiB)", name),
                     "simulate a shorter run or a lower rate, or write imu.csv");
  }
  const auto crc = [](std::uint32_t before, std::string_view bytes) {
    return static_cast<std::uint32_t>(
        crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
  };
  member.crc = crc(crc(0, header), data);
  member.size = static_cast<std::uint32_t>(header.size() + data.size());
  member.offset = static_cast<std::uint32_t>(size_);
  Payload local;
  local.u4(0x04034b50);
  describe(local, member.crc, member.size, member.name.size());
  local.raw(member.name);
  for (const std::string_view bytes : {std::string_view(local.bytes()), std::string_view(header), data}) {
    file_.write(bytes);
    size_ += bytes.size();
  }
  members_.push_back(std::move(member));
}

void NpzWriter::finish() {
  Payload list;
  for (const Member& member : members_) {
    list.u4(0x02014b50).u2(kVersion);
    describe(list, member.crc, member.size, member.name.size());
    list.u2(0).u2(0).u2(0).u4(0).u4(member.offset).raw(member.name);
  }
  const std::size_t length = list.bytes().size();
  list.u4(0x06054b50).u2(0).u2(0).u2(members_.size()).u2(members_.size());
  list.u4(length).u4(size_).u2(0);
  file_.write(list.bytes());
}

}  // namespace canyon::encoding
