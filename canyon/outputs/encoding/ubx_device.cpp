#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/device.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/outputs/encoding/nmea.hpp"
#include "canyon/outputs/encoding/observations/raw_observations.hpp"
#include "canyon/outputs/encoding/rtcm.hpp"
#include "canyon/outputs/encoding/ubx/commands.hpp"
#include "canyon/outputs/encoding/ubx/messages.hpp"
#include "canyon/simulation/sensor_run.hpp"

namespace canyon::encoding {
namespace {

using geodesy::GpsTime;

constexpr std::int64_t kMillisecond = 1'000'000;

/// A receiver at the other end of a line: configuration, responses, and the messages of each epoch.
class UbxDevice final : public Encoder, public Device, private ubx::Outputs {
 public:
  explicit UbxDevice(const ReceiverDescription& receiver)
      : epochs_(receiver.glonass_channels, receiver.begin, Tags::ClockReading),
        all_{ubx::UbxCommands(
                 receiver.ubx_generation,
                 ubx::Configuration(receiver.ubx_generation,
                                    static_cast<int>(std::floor(receiver.interval_s * 1e3 + 1e-6)),
                                    receiver.rtk, receiver.dead_reckoning, receiver.station_ecef.has_value()),
                 receiver.systems, *this),
             {rtcm::Observations(receiver.glonass_channels)}},
        receiver_(receiver) {}

  std::string encode(const simulation::Epoch& epoch) override {
    last_ = epoch;
    last_->arrival = nullptr;
    last_->navigation = nullptr;
    last_->environment = nullptr;
    last_->options = nullptr;
    last_->sensors = nullptr;
    described_.emplace(epochs_.next(*last_));
    security_log_.take(
        {*described_, receiver_.ubx_generation, jamming_monitor(all_.commands.configuration()), nullptr});
    messages_ = epochs_.received_messages(epoch);
    sensors_ = receiver_.station_ecef ? nullptr : epoch.sensors;
    samples_.reset();
    return encode(all_);
  }
  Device* device() override { return this; }
  std::optional<std::string> encode_for_reader(std::uint64_t reader) override {
    Port* const own = ports_.find(reader);
    if (own == nullptr || own->commands.first().empty()) return std::nullopt;
    return encode(*own);
  }

  std::string receive(std::uint64_t reader, std::string_view bytes) override {
    const canyon::rtcm::DecoderStatus before = epochs_.corrections_status(reader);
    epochs_.receive(reader, bytes);
    Port& port = reader == 0 ? all_ : ports_.of(reader, fresh_);
    const bool new_one = port.commands.first().empty();
    std::string answers = port.commands.receive(bytes);
    answers += received_rtcm(port.commands, before, epochs_.corrections_status(reader));
    if (new_one) port.rounds = all_.rounds;
    note(port.commands, new_one);
    return answers;
  }
  std::vector<std::shared_ptr<const rtk::Corrections>> take_corrections() override {
    return epochs_.take_corrections();
  }

 private:
  static constexpr ubx::MessageId kSubframes = 0x0213, kReceivedRtcm = 0x0232, kCorrection = 0x0234;

  /// Settings and pending output of one connection.
  struct Rounds {
    rtcm::Observations observations;
    std::int64_t interval = -1, navigations = 0;
  };
  struct Port {
    ubx::UbxCommands commands;
    Rounds rounds;
  };

  std::string encode(Port& port) {
    const ubx::Configuration& settings = port.commands.configuration();
    const bool speaks = settings.value(ubx::kOutputUbx).value_or(0) != 0 && port.commands.running();
    std::string text;
    for (const broadcast::SentMessage& message : messages_) {
      if (!speaks || settings.rate(kSubframes) == 0 || !ubx::satellite_name(message.id)) continue;
      text += ubx::frame(
          kSubframes, ubx::subframe_payload(message, receiver_.ubx_generation, epochs_.glonass_channels()));
    }
    if (speaks && sensors_ != nullptr) {
      if (settings.rate(ubx::kSensorSamples) > 0) {
        if (!samples_) samples_ = sensor_samples(*sensors_);
        text += *samples_;
      }
      if (settings.rate(ubx::kRawSamples) > 0) text += raw_sensor_samples(*sensors_);
    }
    if (!due(port)) return text;
    ++port.rounds.navigations;
    const auto rotation = [&](ubx::MessageId id) {
      const int rate = settings.rate(id);
      return rate > 0 && port.rounds.navigations % rate == 0;
    };
    const bool nmea = settings.value(ubx::kOutputNmea).value_or(0) != 0 && port.commands.running();
    if (nmea) text += sentences(rotation);
    for (const ubx::MessageInfo& info : ubx::messages())
      if (speaks && is_periodic(info) && rotation(info.id))
        text += ubx::frame(info.id, *output(info.id, settings));
    const bool corrects = settings.value(ubx::kOutputRtcm).value_or(0) != 0 && port.commands.running();
    return corrects ? text + corrections(port, rotation) : text;
  }

  static bool is_periodic(const ubx::MessageInfo& info) {
    constexpr ubx::MessageId kNmea = 0xF000;
    return info.sent == ubx::Sent::Epochs && info.id < kNmea;
  }

  [[nodiscard]] static bool jamming_monitor(const ubx::Configuration& settings) {
    return settings.value(ubx::kJammingMonitor).value_or(0) != 0;
  }

  /// RXM-RTCM and RXM-COR of each message decoded since the last call.
  [[nodiscard]] static std::string received_rtcm(const ubx::UbxCommands& commands,
                                                 const canyon::rtcm::DecoderStatus& before,
                                                 const canyon::rtcm::DecoderStatus& now) {
    const ubx::Configuration& settings = commands.configuration();
    if (settings.value(ubx::kOutputUbx).value_or(0) == 0 || !commands.running()) return {};
    std::string text;
    const auto report = [&](const ubx::ReceivedRtcm& received) {
      if (settings.rate(kReceivedRtcm) > 0) text += ubx::frame(kReceivedRtcm, ubx::rtcm_payload(received));
      if (settings.rate(kCorrection) > 0) text += ubx::frame(kCorrection, ubx::correction_payload(received));
    };
    for (const auto& [type, count] : now.messages) {
      const auto had = before.messages.find(type);
      const auto unread = now.messages_unread.find(type);
      for (std::uint64_t k = had == before.messages.end() ? 0 : had->second; k < count; ++k)
        report({type, false, unread == now.messages_unread.end(), now.station});
    }
    for (std::uint64_t k = before.checksum_errors; k < now.checksum_errors; ++k)
      report({0, true, false, std::nullopt});
    return text;
  }

  /// Payload of a message; empty before the first epoch, and for messages not sent with epochs.
  [[nodiscard]] std::optional<std::string> output(ubx::MessageId id,
                                                  const ubx::Configuration& settings) const override {
    const auto known = ubx::messages();
    const bool is_there = std::any_of(known.begin(), known.end(), [&](const ubx::MessageInfo& info) {
      return info.id == id && is_periodic(info);
    });
    if (!described_ || !is_there) return std::nullopt;
    return ubx::payload(
        id, {*described_, receiver_.ubx_generation, jamming_monitor(settings), &security_log_.events()});
  }

  /// ESF-MEAS of each sample since the previous epoch, in order of time. Time tags count from the start.
  std::string sensor_samples(const simulation::SensorBatch& batch) {
    std::string text;
    auto wheels = batch.wheels.begin();
    const auto put_wheels = [&](const GpsTime* until) {
      for (; wheels != batch.wheels.end() && (until == nullptr || wheels->time <= *until); ++wheels) {
        if (!wheels->sample.ticks) continue;
        std::array<bool, 2> backwards{};
        for (std::size_t i = 0; i < 2; ++i) {
          const std::int64_t step = (*wheels->sample.ticks)[i] - wheel_ticks_[i];
          wheel_ticks_[i] += step;
          counted_ticks_[i] += static_cast<std::uint32_t>(std::abs(step));
          backwards[i] = step < 0;
        }
        text += ubx::frame(ubx::kSensorSamples,
                           ubx::wheels_payload(time_tag(wheels->time), counted_ticks_, backwards));
      }
    };
    for (const simulation::InertialSample& sample : batch.imu) {
      put_wheels(&sample.time);
      if (!sample.sample) continue;
      const inertial::ImuInput& measured = sample.sample->measured;
      text += ubx::frame(ubx::kSensorSamples,
                         ubx::inertial_payload(time_tag(sample.time), measured.specific_force_mps2,
                                               measured.angular_rate_radps));
    }
    put_wheels(nullptr);
    return text;
  }

  /// ESF-RAW of the inertial samples since the previous epoch, ten per message, as in receivers at 100 Hz.
  std::string raw_sensor_samples(const simulation::SensorBatch& batch) {
    constexpr std::size_t kSamples = 10;
    std::vector<ubx::RawInertialSample> samples;
    for (const simulation::InertialSample& sample : batch.imu) {
      if (!sample.sample) continue;
      const inertial::ImuInput& measured = sample.sample->measured;
      samples.push_back({time_tag(sample.time), measured.specific_force_mps2, measured.angular_rate_radps});
    }
    std::string text;
    for (std::size_t k = 0; k < samples.size(); k += kSamples) {
      const std::span<const ubx::RawInertialSample> rest = std::span(samples).subspan(k);
      text += ubx::frame(ubx::kRawSamples,
                         ubx::raw_inertial_payload(rest.first(std::min(kSamples, rest.size()))));
    }
    return text;
  }
  /// Milliseconds since the start.
  [[nodiscard]] std::uint32_t time_tag(GpsTime time) const {
    return static_cast<std::uint32_t>(
        std::max<std::int64_t>(0, std::llround((time - epochs_.start()) * 1e3)));
  }

  /// Whether an epoch is the first at or after the next multiple of the requested interval of GPS time.
  [[nodiscard]] bool due(Port& port) const {
    const std::int64_t now = round_to(last_->observed.time, kMillisecond).nanoseconds() / kMillisecond /
                             port.commands.interval_ms();
    return std::exchange(port.rounds.interval, now) != now;
  }

  template <typename Round>
  std::string sentences(const Round& rotation) {
    constexpr std::pair<std::string_view, ubx::MessageId> kSentences[]{
        {"RMC", 0xF004}, {"GGA", 0xF000}, {"GSA", 0xF002}, {"GST", 0xF007}, {"GSV", 0xF003}};
    if (std::none_of(std::begin(kSentences), std::end(kSentences),
                     [&](const auto& s) { return rotation(s.second); }))
      return {};
    std::string text;
    const std::string epoch = nmea_epoch(*last_);  // split() only points into it
    for (const std::string_view line : split(epoch, '\n')) {
      for (const auto& [name, id] : kSentences)
        if (line.size() > 6 && line.substr(3, 3) == name && rotation(id)) text.append(line).append("\n");
    }
    return text;
  }

  /// RTCM 3 of a base: the messages due.
  template <typename Round>
  std::string corrections(Port& port, const Round& rotation) {
    const auto is_due = [&](int number) {
      return rotation(static_cast<ubx::MessageId>(0xF500 + number - 1000));
    };
    std::vector<int> numbers;
    for (const int number : {1074, 1077, 1084, 1087, 1094, 1097, 1124, 1127})
      if (is_due(number)) numbers.push_back(number);
    ReceiverDescription reported = receiver_;
    if (const auto position = port.commands.configuration().configured_position_ecef())
      reported.station_ecef = position;
    std::string text;
    for (const broadcast::Bits& message : rtcm::station_messages(reported))
      if (is_due(static_cast<int>(message.number(0, 12)))) text += rtcm::frame(message);
    for (const broadcast::Bits& message : port.rounds.observations.messages(last_->observed, numbers))
      text += rtcm::frame(message);
    return text;
  }

  DeviceEpochs epochs_;
  Port all_;
  const Port fresh_ = all_;
  transport::Readers<Port> ports_;  ///< of each connection
  ReceiverDescription receiver_;
  std::optional<simulation::Epoch> last_;
  std::optional<DeviceEpoch> described_;          ///< of last_ (refers to it)
  std::array<std::int64_t, 2> wheel_ticks_{};     // of the last sample
  std::array<std::uint32_t, 2> counted_ticks_{};  // in either direction
  ubx::SecurityLog security_log_;
  std::vector<broadcast::SentMessage> messages_;  ///< that ended with last_
  const simulation::SensorBatch* sensors_ =
      nullptr;                          ///< of the epoch of encode(), valid as long as the epoch
  std::optional<std::string> samples_;  ///< sensor_samples() of sensors_
};

}  // namespace

std::unique_ptr<Encoder> encode_ubx(const ReceiverDescription& receiver) {
  return std::make_unique<UbxDevice>(receiver);
}

}  // namespace canyon::encoding
