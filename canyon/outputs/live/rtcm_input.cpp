#include "canyon/outputs/live/rtcm_input.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::live {
namespace {

using geodesy::GpsTime;

/// "3.2 h": a duration in a suitable unit.
std::string long_time(double seconds) {
  if (seconds < 600) return fmt::format("{:.0f} s", seconds);
  if (seconds < 48 * 3600) return fmt::format("{:.1f} h", seconds / 3600);
  return fmt::format("{:.1f} days", seconds / 86400);
}

}  // namespace

RtcmInput::RtcmInput(const receiver::ReceiverOptions& options, std::uint64_t seed)
    : options_(options.corrections),
      seed_(seed),
      receiver_(options.name),
      source_(options_.from.starts_with(rtk::kTopicAddress)
                  ? "the topic " + options_.from.substr(rtk::kTopicAddress.size())
                  : hide_passwords(options_.from)),
      link_(options_, seed, receiver_) {}

void RtcmInput::reset_state() {
  decoder_ = rtcm::CorrectionsDecoder();
  link_ = rtk::CorrectionLink(options_, seed_, receiver_);
  held_back_since_.reset();
  station_.reset();
}

void RtcmInput::receive(std::string_view bytes, GpsTime now) {
  if (bytes.empty()) return warn("empty", fmt::format("a message from {} has no bytes", source_));
  if (bytes.size() > kMaxMessage) {
    return warn("long", fmt::format("a message from {} has {} bytes and is not read; an epoch in RTCM "
                                    "3 has about 1,000, and the maximum is {}",
                                    source_, bytes.size(), kMaxMessage));
  }
  const rtcm::DecoderStatus before = decoder_.status();
  for (auto& epoch : decoder_.feed(bytes, now)) {
    look_for_other_station(*epoch);
    if (!is_of_now(*epoch, now)) continue;
    const GpsTime measured = epoch->receiver_time;
    link_.send(measured, std::move(epoch), antenna_position_ecef_);
  }
  look_at(before, now);
}

void RtcmInput::look_for_other_station(const rtk::Corrections& epoch) {
  constexpr double kSamePosition_m = 1;
  const auto before = std::exchange(station_, Station{epoch.station, epoch.station_ecef});
  if (!before) return;
  const double apart_m = (epoch.station_ecef - before->antenna_position_ecef).norm();
  if (epoch.station == before->number && apart_m <= kSamePosition_m) return;
  warn("station", fmt::format("from {} station {} follows station {}, {:.0f} m apart: the ambiguities "
                              "restart at each change; let only one base send there",
                              source_, epoch.station, before->number, apart_m));
}

void RtcmInput::look_at(const rtcm::DecoderStatus& before, GpsTime now) {
  // The station's position is sent every 5 to 30 s.
  constexpr double kPositionInterval_s = 60;
  const rtcm::DecoderStatus& status = decoder_.status();
  const std::uint64_t strange = status.bytes_passed_over - before.bytes_passed_over;
  if (strange > 0) {
    warn("strange", fmt::format("{} bytes of a message from {} are not a valid RTCM 3 frame and are ignored; "
                                "this is the first such message",
                                strange, source_));
  }
  if (status.epochs > before.epochs) held_back_since_.reset();
  if (status.epochs_held_back == before.epochs_held_back) return;
  if (!held_back_since_) held_back_since_ = now;
  if (now - *held_back_since_ > kPositionInterval_s) {
    warn(
        "place",
        fmt::format("{} has observations without message 1005 or 1006 (station position): no corrections are "
                    "applied",
                    source_));
  }
}

bool RtcmInput::is_of_now(const rtk::Corrections& epoch, GpsTime now) {
  constexpr double kAhead_s = 1;  // as receiver::CodeCorrections::age_s()
  const double age_s = now - epoch.receiver_time;
  if (age_s <= options_.max_age_s && age_s >= -kAhead_s) return true;
  warn("time",
       fmt::format("corrections from {} are for {}, but the receiver's time is {}, {} {}: they "
                   "are not used; give both the same time: no `start`, or one /clock and one `start`",
                   source_, geodesy::format_gpst(epoch.receiver_time, 0), geodesy::format_gpst(now, 0),
                   long_time(std::abs(age_s)), age_s > 0 ? "later" : "earlier"));
  return false;
}

void RtcmInput::warn(const std::string& fault, const std::string& text) {
  if (logged_.insert(fault).second) warnings_.push_back(text);
}

std::vector<std::string> RtcmInput::take_warnings() {
  return std::exchange(warnings_, {});
}

}  // namespace canyon::live
