#include "canyon/output/sensor_arrays.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <limits>

#include "canyon/base/input_error.hpp"
#include "canyon/base/payload.hpp"

namespace canyon::output {
namespace {

using Eigen::Vector3d;
using simulation::SensorBatch;

constexpr double kNoSample = std::numeric_limits<double>::quiet_NaN();

/// Appends the values of a sample to consecutive arrays.
class SampleWriter {
 public:
  SampleWriter(std::vector<SensorArray>& arrays, const std::string& sensor)
      : at_(std::find_if(arrays.begin(), arrays.end(),
                         [&](const SensorArray& array) { return array.sensor == sensor; })) {}
  SampleWriter& operator<<(double value) {
    (at_++)->values.push_back(value);
    return *this;
  }
  SampleWriter& operator<<(const Vector3d& value) {
    at_->values.insert(at_->values.end(), value.data(), value.data() + 3);
    ++at_;
    return *this;
  }
  SampleWriter& operator<<(const inertial::WheelPair& value) {
    at_->values.insert(at_->values.end(), value.begin(), value.end());
    ++at_;
    return *this;
  }

 private:
  std::vector<SensorArray>::iterator at_;
};

}  // namespace

SensorArrays::SensorArrays(const inertial::SensorOptions& sensors, geodesy::GpsTime begin)
    : sensors_(sensors), begin_(begin) {
  if (sensors.imu) {
    arrays_.insert(arrays_.end(), {{"imu", "time_s"},
                                   {"imu", "stated_s"},
                                   {"imu", "specific_force", 3},
                                   {"imu", "angular_rate", 3},
                                   {"imu", "true_specific_force", 3},
                                   {"imu", "true_angular_rate", 3},
                                   {"imu", "place", 3},
                                   {"imu", "velocity", 3},
                                   {"imu", "attitude", 3},
                                   {"imu", "temperature"}});
  }
  if (sensors.wheels) {
    arrays_.insert(
        arrays_.end(),
        {{"wheels", "time_s"}, {"wheels", "speed", 2}, {"wheels", "ticks", 2}, {"wheels", "true_speed", 2}});
  }
  if (sensors.barometer) {
    arrays_.insert(arrays_.end(), {{"barometer", "time_s"},
                                   {"barometer", "pressure"},
                                   {"barometer", "altitude"},
                                   {"barometer", "temperature"},
                                   {"barometer", "sensor_temperature"},
                                   {"barometer", "true_pressure"},
                                   {"barometer", "true_height"}});
  }
  if (sensors.magnetometer) {
    arrays_.insert(
        arrays_.end(),
        {{"magnetometer", "time_s"}, {"magnetometer", "field", 3}, {"magnetometer", "true_field", 3}});
  }
}

void SensorArrays::add(const SensorBatch& batch) {
  for (const simulation::InertialSample& sample : batch.imu) {
    const simulation::SensorMotion motion(sample.truth.sensor, sensors_.imu->axes);
    const Vector3d none = Vector3d::Constant(kNoSample);
    const auto& stated = sample.sample;
    SampleWriter(arrays_, "imu") << sample.time - begin_ << (stated ? stated->time_s : kNoSample)
                                 << (stated ? stated->measured.specific_force_mps2 : none)
                                 << (stated ? stated->measured.angular_rate_radps : none)
                                 << sample.mean.specific_force_mps2 << sample.mean.angular_rate_radps
                                 << motion.place_deg_m << motion.velocity_enu_mps << motion.attitude_deg
                                 << (stated ? stated->temperature_k : kNoSample);
  }
  for (const simulation::WheelsAtWork& sample : batch.wheels) {
    inertial::WheelPair ticks{kNoSample, kNoSample};
    if (const auto& counted = sample.sample.ticks)
      ticks = {static_cast<double>((*counted)[0]), static_cast<double>((*counted)[1])};
    SampleWriter(arrays_, "wheels") << sample.time - begin_ << sample.sample.speed_mps << ticks
                                    << sample.true_mps;
  }
  for (const simulation::BarometerSample& sample : batch.barometer) {
    const inertial::Pressure& p = sample.pressure;
    SampleWriter(arrays_, "barometer")
        << sample.time - begin_ << p.measured_pa << inertial::pressure_altitude_m(p.measured_pa)
        << p.temperature_k << p.sensor_temperature_k << p.true_pa << sample.height_m;
  }
  for (const simulation::MagnetometerSample& sample : batch.magnetometer) {
    constexpr double kMicro = 1e6;
    SampleWriter(arrays_, "magnetometer")
        << sample.time - begin_ << kMicro * sample.measured_t << kMicro * sample.true_t;
  }
}

namespace {

static_assert(std::endian::native == std::endian::little, "arrays are written as they lie in memory");

constexpr std::size_t kVersion = 20, kStored = 0, kTime = 0,
                      kDate = 0x21;  // 1980-01-01: the same bytes always

/// What a local header and its entry in the list share.
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

void NpzWriter::add(std::string_view name, const std::vector<double>& values, std::size_t columns) {
  const std::string header = npy_header(values.size() / columns, columns);
  const std::string_view data(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double));
  Member member{fmt::format("{}.npy", name)};
  constexpr std::uint64_t kMost = 4'200'000'000;  // leaves room for the list
  if (size_ + header.size() + data.size() > kMost) {
    throw InputError(fmt::format("array {} does not fit into a .npz file, whose limit is 4 GiB", name),
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

}  // namespace canyon::output
