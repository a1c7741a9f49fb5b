// Declared in canyon/output/formats.hpp.
#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/base/text.hpp"
#include "canyon/output/formats.hpp"
#include "canyon/output/nmea.hpp"
#include "canyon/output/number.hpp"
#include "canyon/output/raw_observations.hpp"
#include "canyon/output/received_messages.hpp"
#include "canyon/output/ubx/commands.hpp"
#include "canyon/output/ubx/messages.hpp"
#include "canyon/output/ubx/satellite_names.hpp"
#include "canyon/rtcm/rtcm_decoder.hpp"
#include "canyon/simulation/sensor_run.hpp"

namespace canyon::output {
namespace {

using geodesy::GpsTime;

constexpr std::int64_t kMillisecond = 1'000'000;

/// A receiver at the other end of a line: configuration, answers, and the messages of each epoch.
class UbxDevice final : public Encoder, private ubx::Outputs {
 public:
  UbxDevice(const ReceiverDescription& receiver, ubx::Generation generation)
      : channels_(receiver.glonass_channels),
        decoder_([this](gnss::SatelliteId id) -> std::optional<int> {
          const auto found = channels_.find(id);
          return found == channels_.end() ? std::nullopt : std::optional(found->second);
        }),
        begin_(receiver.begin),
        commands_(
            generation,
            ubx::Configuration(generation, static_cast<int>(std::floor(receiver.interval_s * 1e3 + 1e-6)),
                               receiver.rtk, receiver.dead_reckoning),
            receiver.systems, *this),
        generation_(generation) {}

  std::string encode(const simulation::Epoch& epoch) override {
    last_ = epoch;
    last_->arrival = nullptr;
    last_->navigation = nullptr;
    last_->environment = nullptr;
    last_->sensors = nullptr;
    const receiver::ReceiverEpoch& seen = epoch.observed;
    begin_anew(seen.events.restart);
    if (seen.fix.solved() && !first_fix_) first_fix_ = seen.time;
    raw_ = observations_.next(last_->observed);
    const ubx::Configuration& settings = commands_.configuration();
    const bool speaks = settings.value(ubx::kOutputUbx).value_or(0) != 0 && commands_.running();
    std::string text;
    for (const broadcast::SentMessage& message : messages_.received(epoch)) {
      if (!speaks || settings.rate(kSubframes) == 0 || !ubx::satellite_name(message.id)) continue;
      text += ubx::frame(kSubframes, ubx::subframe_payload(message, generation_, channels_));
    }
    if (speaks && settings.rate(ubx::kSensorSamples) > 0 && epoch.sensors != nullptr)
      text += sensor_samples(*epoch.sensors);
    if (!due(seen.time)) return text;
    ++navigations_;
    const auto turn = [&](ubx::MessageId id) {
      const int rate = settings.rate(id);
      return rate > 0 && navigations_ % rate == 0;
    };
    const bool nmea = settings.value(ubx::kOutputNmea).value_or(0) != 0 && commands_.running();
    if (nmea) text += sentences(turn);
    for (const ubx::MessageInfo& info : ubx::messages()) {
      if (speaks && of_epochs(info) && turn(info.id)) text += ubx::frame(info.id, *output(info.id));
    }
    return text;
  }

  std::string receive(std::uint64_t reader, std::string_view bytes) override {
    const canyon::rtcm::DecoderStatus before = decoder_.status();
    for (auto& epoch : decoder_.feed(bytes, last_ ? last_->observed.receiver_time : begin_)) {
      corrections_.push_back(std::move(epoch));
    }
    return commands_.receive(reader, bytes) + received_rtcm(before);
  }
  std::vector<std::shared_ptr<const relative::Corrections>> take_corrections() override {
    return std::exchange(corrections_, {});
  }
  std::optional<int> take_baud() override { return commands_.take_baud(); }
  std::optional<disturbance::RestartKind> take_restart() override { return commands_.take_restart(); }

 private:
  static constexpr ubx::MessageId kSubframes = 0x0213, kReceivedRtcm = 0x0232;

  static bool of_epochs(const ubx::MessageInfo& info) {
    constexpr ubx::MessageId kNmea = 0xF000;
    return info.sent == ubx::Sent::Epochs && info.id < kNmea;
  }

  /// RXM-RTCM of each message that the decoder has found since.
  [[nodiscard]] std::string received_rtcm(const canyon::rtcm::DecoderStatus& before) const {
    const ubx::Configuration& settings = commands_.configuration();
    const bool wanted = settings.rate(kReceivedRtcm) > 0 && settings.value(ubx::kOutputUbx).value_or(0) != 0;
    if (!wanted || !commands_.running()) return {};
    const canyon::rtcm::DecoderStatus& now = decoder_.status();
    std::string text;
    for (const auto& [type, count] : now.messages) {
      const auto had = before.messages.find(type);
      const auto unread = now.messages_unread.find(type);
      for (std::uint64_t k = had == before.messages.end() ? 0 : had->second; k < count; ++k) {
        text +=
            ubx::frame(kReceivedRtcm,
                       ubx::rtcm_payload({type, false, unread == now.messages_unread.end(), now.station}));
      }
    }
    for (std::uint64_t k = before.checksum_errors; k < now.checksum_errors; ++k) {
      text += ubx::frame(kReceivedRtcm, ubx::rtcm_payload({0, true, false, std::nullopt}));
    }
    return text;
  }

  /// The time to the first fix counts from a restart, whatever caused it.
  void begin_anew(const std::optional<disturbance::Restart>& restart) {
    if (!restart || restart->at == begin_) return;
    begin_ = restart->at;
    first_fix_.reset();
  }

  /// Payload of a message; empty before the first epoch, and for messages that do not come with epochs.
  [[nodiscard]] std::optional<std::string> output(ubx::MessageId id) const override {
    const auto known = ubx::messages();
    const bool is_there = std::any_of(known.begin(), known.end(), [&](const ubx::MessageInfo& info) {
      return info.id == id && of_epochs(info);
    });
    if (!last_ || !is_there) return std::nullopt;
    const receiver::ReceiverEpoch& seen = last_->observed;
    std::vector<ubx::RawMeasurement> raw;
    for (const RawObservation& o : raw_.observations) {
      raw.push_back({o.id, o.signal, o.measurement, o.pseudorange_m, o.carrier_phase_cycles, o.locked_s});
    }
    return ubx::payload(
        id, {seen, round_to(seen.stated_time(), kMillisecond), generation_, first_fix_.has_value(),
             first_fix_ ? *first_fix_ - begin_ : 0, seen.time - begin_,
             commands_.configuration().value(ubx::kJammingMonitor).value_or(0) != 0, raw_.tag, raw, channels_,
             last_->geoid_undulation_m});
  }

  /// ESF-MEAS of each sample since the epoch before, in the order of their times. Time tags count from the
  /// start.
  std::string sensor_samples(const simulation::SensorBatch& batch) {
    std::string text;
    const auto tag = [this](GpsTime time) {
      return static_cast<std::uint32_t>(std::max<std::int64_t>(0, std::llround((time - begin_) * 1e3)));
    };
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
                           ubx::wheels_payload(tag(wheels->time), counted_ticks_, backwards));
      }
    };
    for (const simulation::InertialSample& sample : batch.imu) {
      put_wheels(&sample.time);
      if (!sample.sample) continue;
      const inertial::ImuInput& measured = sample.sample->measured;
      text += ubx::frame(
          ubx::kSensorSamples,
          ubx::inertial_payload(tag(sample.time), measured.specific_force_mps2, measured.angular_rate_radps));
    }
    put_wheels(nullptr);
    return text;
  }

  /// Whether an epoch is the first at or behind the next multiple of the asked interval of GPS time.
  bool due(GpsTime time) {
    const std::int64_t now =
        round_to(time, kMillisecond).nanoseconds() / kMillisecond / commands_.interval_ms();
    const bool is_due = now != interval_;
    interval_ = now;
    return is_due;
  }

  template <typename Turn>
  std::string sentences(const Turn& turn) {
    constexpr std::pair<std::string_view, ubx::MessageId> kSentences[]{
        {"RMC", 0xF004}, {"GGA", 0xF000}, {"GSA", 0xF002}, {"GST", 0xF007}, {"GSV", 0xF003}};
    if (std::none_of(std::begin(kSentences), std::end(kSentences),
                     [&](const auto& s) { return turn(s.second); })) {
      return {};
    }
    std::string text;
    const std::string epoch = nmea_epoch(*last_);  // split() only points into it
    for (const std::string_view line : split(epoch, '\n')) {
      for (const auto& [name, id] : kSentences) {
        if (line.size() > 6 && line.substr(3, 3) == name && turn(id)) text.append(line).append("\n");
      }
    }
    return text;
  }

  std::map<gnss::SatelliteId, int> channels_;
  canyon::rtcm::CorrectionsDecoder decoder_;
  std::vector<std::shared_ptr<const relative::Corrections>> corrections_;
  GpsTime begin_;
  ubx::Commands commands_;
  ubx::Generation generation_;
  ReceivedMessages messages_;
  RawObservations observations_{Tags::ClockReading};
  std::optional<simulation::Epoch> last_;
  RawEpoch raw_;  ///< of last_, whose measurements it points to
  std::optional<GpsTime> first_fix_;
  std::array<std::int64_t, 2> wheel_ticks_{};     // of the last sample
  std::array<std::uint32_t, 2> counted_ticks_{};  // in either direction
  std::int64_t interval_ = -1;
  std::int64_t navigations_ = 0;
};

}  // namespace

std::unique_ptr<Encoder> encode_ubx(const ReceiverDescription& receiver) {
  return std::make_unique<UbxDevice>(receiver, ubx::Generation::F9);
}

std::unique_ptr<Encoder> encode_ubx_m8(const ReceiverDescription& receiver) {
  return std::make_unique<UbxDevice>(receiver, ubx::Generation::M8);
}

}  // namespace canyon::output
