#include "canyon/outputs/encoding/mavlink.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/mavlink/frames.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"
#include "canyon/outputs/encoding/observations/fix_codes.hpp"
#include "canyon/outputs/encoding/ubx/messages.hpp"
#include "canyon/simulation/inertial/imu_options.hpp"

namespace canyon::encoding {
namespace {

using geodesy::degrees;
constexpr positioning::FixKind kNoFix = positioning::FixKind::None;

std::uint8_t fix_type(positioning::FixKind kind) {
  return codes_of(kind).mavlink_type;
}

std::uint64_t unix_us(geodesy::GpsTime t) {
  return static_cast<std::uint64_t>(geodesy::unix_from_gps(t) / 1000);
}

double horizontal_sigma_m(const positioning::Fix& fix) {
  return std::sqrt(fix.covariance_enu(0, 0) + fix.covariance_enu(1, 1));
}
double vertical_sigma_m(const positioning::Fix& fix) {
  return std::sqrt(fix.covariance_enu(2, 2));
}
double speed_sigma_mps(const positioning::Fix& fix) {
  return std::sqrt(fix.velocity_covariance_enu->trace());
}

Eigen::Vector3d ned(const Eigen::Vector3d& enu) {
  return {enu.y(), enu.x(), -enu.z()};
}

/// [0, 360), also in hundredths.
double course_deg(const Eigen::Vector3d& velocity_enu) {
  return wrapped_azimuth_deg(std::atan2(velocity_enu.x(), velocity_enu.y()), 2);
}

/// (0, 360], since 0 means "not known".
double yaw_deg(const positioning::Fix& fix) {
  const double yaw = heading_deg(fix, 2).value_or(mavlink::kUnknown);
  return yaw < 0.005 ? 360 : yaw;
}

std::uint8_t eight_bits(double value) {
  return static_cast<std::uint8_t>(std::clamp(std::round(value), 0.0, 255.0));
}

std::uint8_t satellites(const positioning::Fix& fix) {
  return eight_bits(static_cast<double>(used_count(fix)));
}

/// A heartbeat and other messages of each second, then the messages of each epoch.
class MavlinkStream final : public Encoder {
 public:
  using Messages = std::vector<mavlink::Message>;
  using Make = std::function<Messages(const simulation::Epoch&)>;
  using Samples = std::function<Messages(const simulation::SensorBatch&)>;

  explicit MavlinkStream(Make each_epoch, Make each_second = {}, Samples samples = {})
      : each_epoch_(std::move(each_epoch)),
        each_second_(std::move(each_second)),
        samples_(std::move(samples)) {}

  std::string encode(const simulation::Epoch& epoch) override {
    constexpr double kSecond = 1;
    const geodesy::GpsTime now = epoch.observed.time;
    std::string bytes;
    const auto put = [&](const Messages& messages) { bytes += encode(messages); };
    if (!last_second_ || now - *last_second_ >= kSecond) {
      // Epochs 1.0000001 s apart are all sent; of epochs 0.4 s apart one per 1 s on average.
      const bool goes_on = last_second_ && now - *last_second_ < 2 * kSecond;
      last_second_ = goes_on ? *last_second_ + kSecond : now;
      put({mavlink::Heartbeat{}});
      if (each_second_) put(each_second_(epoch));
    }
    if (each_epoch_) put(each_epoch_(epoch));
    if (samples_ && epoch.sensors != nullptr && !samples_first_) put(samples_(*epoch.sensors));
    return bytes;
  }
  std::string encode_samples(const simulation::SensorBatch& samples) override {
    samples_first_ = true;
    return samples_ ? encode(samples_(samples)) : std::string();
  }

  /// A datagram holds one frame.
  [[nodiscard]] std::size_t datagram(std::string_view bytes) const override {
    return mavlink::frame_bytes(bytes);
  }
  [[nodiscard]] bool uses_sensors() const override { return samples_ != nullptr; }

 private:
  std::string encode(const Messages& messages) {
    std::string bytes;
    for (const mavlink::Message& message : messages) bytes += mavlink::encode(message, sequence_++);
    return bytes;
  }

  Make each_epoch_, each_second_;
  Samples samples_;
  bool samples_first_ = false;  ///< samples are sent before their epoch
  std::optional<geodesy::GpsTime> last_second_;
  std::uint8_t sequence_ = 0;
};

/// A fix's position and accuracy, common to all messages.
template <typename Message>
void put_position(const simulation::Epoch& epoch, Message& m) {
  const positioning::Fix& fix = epoch.observed.fix;
  m.latitude_deg = degrees(fix.position.latitude_rad);
  m.longitude_deg = degrees(fix.position.longitude_rad);
  m.altitude_m = epoch.altitude_m();
  m.horizontal_accuracy_m = horizontal_sigma_m(fix);
  m.vertical_accuracy_m = vertical_sigma_m(fix);
}

/// Length of the RTCM 3 message at the start of `bytes`: header and checksum have three bytes each.
std::size_t rtcm_bytes(std::string_view bytes) {
  const auto byte = [&](std::size_t i) { return unsigned{static_cast<unsigned char>(bytes[i])}; };
  return 6 + ((byte(1) & 3U) << 8U | byte(2));
}

}  // namespace

mavlink::GpsInput gps_input(const simulation::Epoch& epoch) {
  using mavlink::GpsInput;
  const receiver::ReceiverEpoch& seen = epoch.observed;
  const positioning::Fix& fix = seen.fix;
  const bool solved = fix.measured() && fix.velocity_enu_mps;
  GpsInput m;
  m.time_us = unix_us(seen.reported_utc());
  m.week = static_cast<std::uint16_t>(seen.reported_time().week());
  const std::int64_t ms = seen.reported_time().nanosecond_of_week() / 1'000'000;
  m.time_of_week_s = static_cast<double>(ms) / 1e3;
  m.satellites = satellites(fix);
  m.fix_type = fix_type(solved ? fix.kind() : kNoFix);
  if (!solved) {
    m.ignore = GpsInput::kAltitude | GpsInput::kHdop | GpsInput::kVdop | GpsInput::kHorizontalVelocity |
               GpsInput::kVerticalVelocity | GpsInput::kSpeedAccuracy | GpsInput::kHorizontalAccuracy |
               GpsInput::kVerticalAccuracy;
    return m;
  }
  put_position(epoch, m);
  m.yaw_deg = yaw_deg(fix);
  m.velocity_ned_mps = ned(*fix.velocity_enu_mps);
  if (fix.dop) {
    m.hdop = fix.dop->hdop;
    m.vdop = fix.dop->vdop;
  } else {
    m.ignore |= GpsInput::kHdop | GpsInput::kVdop;
  }
  if (fix.velocity_covariance_enu)
    m.speed_accuracy_mps = speed_sigma_mps(fix);
  else
    m.ignore |= GpsInput::kSpeedAccuracy;
  return m;
}

mavlink::HilGps hil_gps(const simulation::Epoch& epoch) {
  const positioning::Fix& fix = epoch.observed.fix;
  mavlink::HilGps m;
  m.time_us = unix_us(epoch.observed.reported_utc());
  m.satellites = satellites(fix);
  m.fix_type = fix_type(kNoFix);
  if (!fix.measured() || !fix.velocity_enu_mps) return m;
  m.fix_type = fix_type(fix.kind());
  put_position(epoch, m);
  m.yaw_deg = yaw_deg(fix);
  m.velocity_ned_mps = ned(*fix.velocity_enu_mps);
  m.speed_mps = fix.velocity_enu_mps->head<2>().norm();
  m.course_deg = course_deg(*fix.velocity_enu_mps);
  return m;
}

mavlink::GpsRawInt gps_raw_int(const simulation::Epoch& epoch) {
  const positioning::Fix& fix = epoch.observed.fix;
  mavlink::GpsRawInt m;
  m.time_us = unix_us(epoch.observed.reported_utc());
  m.satellites = satellites(fix);
  m.fix_type = fix_type(kNoFix);
  if (!fix.measured()) return m;
  m.fix_type = fix_type(fix.kind());
  put_position(epoch, m);
  m.yaw_deg = yaw_deg(fix);
  m.ellipsoidal_height_m = fix.position.height_m;
  if (fix.dop) {
    m.hdop = fix.dop->hdop;
    m.vdop = fix.dop->vdop;
  }
  if (!fix.velocity_enu_mps) return m;
  m.speed_mps = fix.velocity_enu_mps->head<2>().norm();
  m.course_deg = course_deg(*fix.velocity_enu_mps);
  if (fix.velocity_covariance_enu) {
    m.speed_accuracy_mps = speed_sigma_mps(fix);
    // Deviation across the track, for small angles; the course of a vehicle at rest is arbitrary.
    const Eigen::Vector2d direction = fix.velocity_enu_mps->head<2>().normalized(),
                          across(-direction.y(), direction.x());
    const double across_mps =
        std::sqrt(across.dot(fix.velocity_covariance_enu->topLeftCorner<2, 2>() * across));
    m.course_accuracy_deg = std::min(180.0, degrees(across_mps / m.speed_mps));
  }
  return m;
}

std::optional<mavlink::GpsRtk> gps_rtk(const simulation::Epoch& epoch, geodesy::GpsTime begin) {
  const receiver::ReceiverEpoch& seen = epoch.observed;
  const auto& baseline = seen.fix.baseline;
  if (!seen.fix.solved() || !baseline) return std::nullopt;
  mavlink::GpsRtk m;
  m.boot_s = std::max(0.0, seen.time - begin - seen.fix.correction_age_s.value_or(0));
  m.week = static_cast<std::uint16_t>(seen.reported_time().week());
  m.time_of_week_s = seen.reported_time().seconds_of_week();
  m.satellites = eight_bits(static_cast<double>(baseline->used.size()));
  m.baseline_m = ned(baseline->vector_enu);
  m.accuracy_m = std::sqrt(baseline->covariance_enu.trace());
  m.hypotheses_count = baseline->kind == positioning::FixKind::Fixed ? 1 : 0;
  return m;
}

mavlink::GpsStatus gps_status(const simulation::Epoch& epoch) {
  std::vector<const receiver::SatelliteObservation*> tracked;
  for (const auto& satellite : epoch.observed.satellites)
    if (satellite.measurement && ubx::single_number(satellite.id) != 0) tracked.push_back(&satellite);
  std::stable_sort(tracked.begin(), tracked.end(),
                   [](const auto* a, const auto* b) { return a->used > b->used; });
  mavlink::GpsStatus m;
  m.visible = eight_bits(epoch.observed.visible);
  for (std::size_t i = 0; i < std::min(tracked.size(), m.number.size()); ++i) {
    const receiver::SatelliteObservation& satellite = *tracked[i];
    m.number[i] = static_cast<std::uint8_t>(ubx::single_number(satellite.id));
    m.used[i] = satellite.used ? 1 : 0;
    m.zenith_deg[i] = eight_bits(90 - degrees(satellite.elevation_rad));
    m.azimuth[i] = eight_bits(wrapped_azimuth_deg(satellite.azimuth_rad, 2) * 255 / 360);
    m.snr_db[i] = eight_bits(satellite.measurement->cn0_dbhz.value_or(0));
  }
  return m;
}

mavlink::GnssIntegrity gnss_integrity(const simulation::Epoch& epoch) {
  const receiver::ReceiverEpoch& seen = epoch.observed;
  mavlink::GnssIntegrity m;
  for (const receiver::BandState& band : seen.bands)
    m.jamming_state = std::max(m.jamming_state, jamming_state(band.interference_ratio, seen.fix));
  if (seen.spoofing != receiver::SpoofingState::Unknown)
    m.spoofing_state = seen.spoofing == receiver::SpoofingState::None ? 1 : 3;
  return m;
}

std::vector<mavlink::HighresImu> highres_imu(const simulation::SensorBatch& batch,
                                             mavlink::HighresImu& last) {
  using mavlink::HighresImu;
  const auto frd = [](const Eigen::Vector3d& v, inertial::ImuAxes axes) -> Eigen::Vector3d {
    return inertial::in_axes(v, axes, inertial::ImuAxes::Frd);
  };
  // Present values, by instant.
  struct Samples {
    const simulation::InertialSample* imu = nullptr;
    const simulation::MagnetometerSample* magnetometer = nullptr;
    const simulation::BarometerSample* barometer = nullptr;
  };
  std::map<geodesy::GpsTime, Samples> instants;
  for (const auto& sample : batch.imu)
    if (sample.sample) instants[sample.time].imu = &sample;
  for (const auto& sample : batch.magnetometer) instants[sample.time].magnetometer = &sample;
  for (const auto& sample : batch.barometer) instants[sample.time].barometer = &sample;
  std::vector<HighresImu> messages;
  for (const auto& [time, samples] : instants) {
    last.updated = 0;
    last.time_us = unix_us(samples.imu != nullptr ? samples.imu->reported : time);
    if (samples.imu != nullptr) {
      const inertial::ImuInput& measured = samples.imu->sample->measured;
      last.acceleration_frd_mps2 = frd(measured.specific_force_mps2, batch.imu_axes);
      last.rates_frd_radps = frd(measured.angular_rate_radps, batch.imu_axes);
      last.updated |= HighresImu::kAcceleration | HighresImu::kRates;
    }
    if (samples.magnetometer != nullptr) {
      last.field_frd_tesla = frd(samples.magnetometer->measured_t, batch.magnetometer_axes);
      last.updated |= HighresImu::kField;
    }
    if (samples.barometer != nullptr) {
      const inertial::Pressure& pressure = samples.barometer->pressure;
      last.pressure_pa = pressure.measured_pa;
      last.pressure_altitude_m = inertial::pressure_altitude_m(pressure.measured_pa);
      last.temperature_c = pressure.sensor_temperature_k - inertial::kZeroCelsius_k;
      last.updated |= HighresImu::kPressure | HighresImu::kAltitude | HighresImu::kTemperature;
    }
    messages.push_back(last);
  }
  return messages;
}

std::unique_ptr<Encoder> encode_gps_input(const ReceiverDescription& /*receiver*/) {
  return std::make_unique<MavlinkStream>(
      [](const simulation::Epoch& epoch) -> MavlinkStream::Messages { return {gps_input(epoch)}; });
}
std::unique_ptr<Encoder> encode_hil_gps(const ReceiverDescription& /*receiver*/) {
  return std::make_unique<MavlinkStream>(
      [](const simulation::Epoch& epoch) -> MavlinkStream::Messages { return {hil_gps(epoch)}; });
}
std::unique_ptr<Encoder> encode_gps_raw_int(const ReceiverDescription& receiver) {
  return std::make_unique<MavlinkStream>(
      [begin = receiver.begin](const simulation::Epoch& epoch) {
        MavlinkStream::Messages messages{gps_raw_int(epoch)};
        if (const auto rtk = gps_rtk(epoch, begin)) messages.emplace_back(*rtk);
        return messages;
      },
      [begin = receiver.begin](const simulation::Epoch& epoch) -> MavlinkStream::Messages {
        return {mavlink::SystemTime{unix_us(epoch.observed.reported_utc()), epoch.observed.time - begin},
                gps_status(epoch), gnss_integrity(epoch)};
      });
}
std::unique_ptr<Encoder> encode_highres_imu(const ReceiverDescription& receiver) {
  if (!receiver.sensors.any())
    throw InputError(
        "highres_imu has no sensor samples to send",
        "use canyon simulate or canyon live with sensors: {imu: {profile: consumer}}; hosts and fixed "
        "receivers have none");
  return std::make_unique<MavlinkStream>(
      nullptr, nullptr,
      [last =
           mavlink::HighresImu()](const simulation::SensorBatch& batch) mutable -> MavlinkStream::Messages {
        const std::vector<mavlink::HighresImu> samples = highres_imu(batch, last);
        return {samples.begin(), samples.end()};
      });
}
std::unique_ptr<Encoder> encode_gps_rtcm_data(const ReceiverDescription& receiver) {
  return std::make_unique<MavlinkStream>([rtcm = std::shared_ptr<Encoder>(encode_rtcm(receiver)),
                                          number = std::uint8_t{0}](const simulation::Epoch& epoch) mutable {
    MavlinkStream::Messages messages;
    const std::string bytes = rtcm->encode(epoch);
    for (std::string_view rest = bytes; !rest.empty();) {
      const std::size_t size = rtcm_bytes(rest);
      for (const mavlink::GpsRtcmData& part : mavlink::rtcm_data(rest.substr(0, size), number++))
        messages.emplace_back(part);
      rest.remove_prefix(size);
    }
    return messages;
  });
}

}  // namespace canyon::encoding
