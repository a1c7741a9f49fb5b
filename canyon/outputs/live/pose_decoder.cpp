#include "canyon/outputs/live/pose_decoder.hpp"

#include <fmt/format.h>

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/transport/link.hpp"
#include "canyon/outputs/live/mavlink_poses.hpp"

namespace canyon::live {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using simulation::BodyAxes;
using simulation::WorldAxes;

Matrix3d enu_from(WorldAxes axes) {
  Matrix3d rotation = Matrix3d::Identity();
  if (axes == WorldAxes::NED) rotation << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  return rotation;
}

Matrix3d flu_from(BodyAxes axes) {
  return axes == BodyAxes::FRD ? Matrix3d(Vector3d(1, -1, -1).asDiagonal()) : Matrix3d::Identity();
}

bool is_on_earth(double latitude_deg, double longitude_deg) {
  return std::abs(latitude_deg) <= 90 && std::abs(longitude_deg) <= 360;
}

void DecodeErrors::add(std::string why) {
  ++count_;
  const auto at =
      std::find_if(reasons_.begin(), reasons_.end(), [&](const auto& r) { return r.first == why; });
  if (at != reasons_.end())
    ++at->second;
  else if (reasons_.size() < kMax)
    reasons_.emplace_back(std::move(why), 1);
}

std::string DecodeErrors::take() {
  if (count_ == 0) return {};
  std::string text =
      fmt::format("{} {}: ", count_, count_ == 1 ? "message was not a pose" : "messages were not poses");
  std::size_t others = count_;
  for (const auto& [why, count] : reasons_) {
    text += count == count_ ? why : fmt::format("{}{} {}", others == count_ ? "" : "; ", count, why);
    others -= count;
  }
  if (others > 0) text += fmt::format("; {} for other reasons", others);
  reasons_.clear();
  count_ = 0;
  return text;
}

namespace {

/// Rotates vectors from the sender's axes to Canyon's.
class Axes {
 public:
  explicit Axes(const simulation::PoseSourceOptions& options)
      : ned_(options.axes == WorldAxes::NED), world_(enu_from(options.axes)), body_(flu_from(options.body)) {}
  [[nodiscard]] Vector3d local(const Vector3d& given) const { return world_ * given; }
  [[nodiscard]] Vector3d body(const Vector3d& given) const { return body_ * given; }
  [[nodiscard]] Quaterniond attitude(const Quaterniond& given) const {
    return Quaterniond(world_ * given.normalized().toRotationMatrix() * body_.transpose());
  }
  /// @param yaw_rad from the first axis: counter-clockwise in ENU, clockwise in NED
  [[nodiscard]] Quaterniond level(double yaw_rad) const {
    const double enu_rad = ned_ ? geodesy::radians(90) - yaw_rad : yaw_rad;
    return Quaterniond(Eigen::AngleAxisd(enu_rad, Vector3d::UnitZ()));
  }

 private:
  bool ned_;
  Matrix3d world_, body_;
};

class JsonPoses final : public PoseDecoder {
 public:
  explicit JsonPoses(const simulation::PoseSourceOptions& options) : axes_(options) {}

  void receive(const transport::Received& received,
               const std::function<void(const PoseReport&)>& each) override {
    transport::LineCutter& lines = lines_.of(received.reader, kMaxLine);
    const auto take = [&](std::optional<std::string_view> line) {
      if (line && trim(*line).empty()) return;
      const std::string why =
          line ? read(*line, each) : fmt::format("a line of more than {} bytes", kMaxLine);
      if (!why.empty()) decode_errors_.add(why);
    };
    lines.receive(received, take);
    // The line break at the end may be missing.
    const std::string& rest = lines.rest();
    if (!rest.empty() && rest.back() == '}' && Json::try_parse(rest)) lines.finish(take);
  }
  [[nodiscard]] std::string take_unused() override { return std::exchange(unused_, {}); }

 private:
  static std::optional<double> number(const Json& object, const char* key, std::string& why) {
    const Json& found = object[key];
    if (found.is_number() && std::isfinite(found.get<double>())) return found.get<double>();
    if (object.contains(key))
      why = found.is_number() || found.is_null() ? not_finite(key) : fmt::format("'{}' is not a number", key);
    return std::nullopt;
  }
  template <int N>
  static std::optional<Eigen::Matrix<double, N, 1>> numbers(const Json& object, const char* key,
                                                            std::string& why) {
    const Json& found = object[key];
    if (found.is_null()) return std::nullopt;
    Eigen::Matrix<double, N, 1> values;
    bool good = found.is_array() && found.size() == N;
    for (int i = 0; good && i < N; ++i) {
      const Json& each = found[static_cast<std::size_t>(i)];
      good = each.is_number() || each.is_null();
      values[i] = each.is_number() ? each.get<double>() : std::nan("");
    }
    if (good && values.allFinite()) return values;
    why = good ? not_finite(key) : fmt::format("'{}' is not a list of {} numbers", key, N);
    return std::nullopt;
  }

  /// JSON has no NaN and Infinity: senders write null, or a text that Json::parse() reads as null.
  static std::string not_finite(std::string_view key) {
    return fmt::format("'{}' has a value that is not finite", key);
  }

  /// The error; empty: none.
  [[nodiscard]] std::string read(std::string_view line, const std::function<void(const PoseReport&)>& each) {
    const Json object = Json::try_parse(line).value_or(Json());
    if (!object.is_object()) return "not a JSON object";
    std::string why;
    PoseReport report;
    if (const Json* id = object.find("id"))
      report.id = id->is_string() ? id->text() : id->dump(-1, Json::Order::ByKey);
    report.stamp_s = number(object, "time_s", why);
    if (const auto p = numbers<3>(object, "position_m", why)) report.position_m = axes_.local(*p);
    const auto latitude = number(object, "latitude_deg", why),
               longitude = number(object, "longitude_deg", why), height = number(object, "height_m", why);
    if (latitude && longitude && height) {
      if (!is_on_earth(*latitude, *longitude)) return "latitude or longitude out of range";
      report.position = geodesy::Geodetic::from_degrees(*latitude, *longitude, *height);
    }
    if (const auto q = numbers<4>(object, "attitude", why)) {
      if (!(q->norm() > 1e-6)) return "'attitude' has no direction";
      report.attitude = axes_.attitude({(*q)[0], (*q)[1], (*q)[2], (*q)[3]});
    } else if (const auto yaw = number(object, "yaw_deg", why)) {
      report.attitude = axes_.level(geodesy::radians(*yaw));
    }
    if (const auto v = numbers<3>(object, "velocity_mps", why)) report.velocity_mps = axes_.local(*v);
    if (const auto w = numbers<3>(object, "rates_radps", why)) report.rates_body_radps = axes_.body(*w);
    if (!why.empty()) return why;
    for (const char* key : {"latitude_deg", "longitude_deg", "height_m"})
      if (!report.position_m && !report.position && object.contains(key) && object[key].is_null())
        return not_finite(key);
    if (!report.position_m && !report.position)
      return "neither 'position_m' nor 'latitude_deg', 'longitude_deg', 'height_m'";
    look_for_unused(object);
    each(report);
    return {};
  }

  void look_for_unused(const Json& object) {
    static const std::vector<std::string> kKnown{
        "time_s",        "id",       "position_m", "latitude_deg", "height_m",
        "longitude_deg", "attitude", "yaw_deg",    "velocity_mps", "rates_radps"};
    const auto given = [&](const char* key) { return !object[key].is_null(); };
    for (const Json::Member& member : object.members()) {
      if (std::find(kKnown.begin(), kKnown.end(), member.key) != kKnown.end()) continue;
      leave_out(printable(member.key), [&] { return hint_for(member.key, kKnown); });
    }
    const bool geodetic = given("latitude_deg") && given("longitude_deg") && given("height_m");
    if (geodetic && given("position_m"))
      leave_out("position_m", [] { return " together with 'latitude_deg', 'longitude_deg' and 'height_m'"; });
    for (const char* key : {"latitude_deg", "longitude_deg", "height_m"})
      if (!geodetic && given(key)) leave_out(key, [] { return ": it needs latitude, longitude and height"; });
    if (given("attitude") && given("yaw_deg"))
      leave_out("yaw_deg", [] { return " together with 'attitude'"; });
  }

  /// Reports each part once, since a sender may add its own keys. @param why reason and hint
  template <typename Why>
  void leave_out(const std::string& part, const Why& why) {
    constexpr std::size_t kMax = 16;
    if (reported_.size() == kMax || !reported_.insert(part).second) return;
    unused_ += fmt::format("{}'{}' is not used{}", unused_.empty() ? "" : "; ", part, why());
  }

  /// A sender's text for a message: short, without control characters.
  static std::string printable(const std::string& text) {
    const std::string quoted = Json(text.substr(0, 40)).dump();
    return quoted.substr(1, quoted.size() - 2);
  }

  /// A hint with a known key similar to the given one or beginning with it: velocity for velocity_mps.
  static std::string hint_for(const std::string& key, const std::vector<std::string>& known) {
    const std::string low = lower_case(key);
    auto similar = closest(low, known);
    for (const std::string& each : known)
      if (low.size() > 2 && each.compare(0, low.size(), low) == 0) similar = each;
    return ": " + did_you_mean(similar, fmt::format("a pose has {}", fmt::join(known, ", ")));
  }

  Axes axes_;
  transport::Readers<transport::LineCutter> lines_;
  std::set<std::string> reported_;  // unused parts
  std::string unused_;
};

class BinaryPoses final : public PoseDecoder {
 public:
  explicit BinaryPoses(const simulation::PoseSourceOptions& options) : axes_(options) {}

  void receive(const transport::Received& received,
               const std::function<void(const PoseReport&)>& each) override {
    std::string& held = held_.of(received.reader);
    held += received.bytes;
    std::string_view rest = held;
    while (true) {
      const std::size_t start = rest.find(kMagic);
      if (start == std::string_view::npos) {
        // The beginning of the next pose may be there.
        if (rest.size() > kMagic.size() - 1) {
          decode_errors_.add("bytes without \"CNY1\"");
          rest.remove_prefix(rest.size() - (kMagic.size() - 1));
        }
        break;
      }
      if (start > 0) decode_errors_.add("bytes before \"CNY1\"");
      rest.remove_prefix(start);
      if (rest.size() < kBinarySize) break;
      if (crc(rest.substr(0, kBinarySize - 4)) != value<std::uint32_t>(rest, kBinarySize - 4)) {
        decode_errors_.add("a wrong checksum");
        rest.remove_prefix(1);
        continue;
      }
      read(rest, each);
      rest.remove_prefix(kBinarySize);
    }
    held = std::string(rest);
    if (!received.whole || held.empty()) return;
    decode_errors_.add("a datagram that ends within a pose");
    held.clear();
  }

 private:
  static constexpr std::string_view kMagic = "CNY1";
  enum Flag : std::uint16_t { kVelocity = 1, kRates = 2, kGeodetic = 4, kNoStamp = 8, kNoAttitude = 16 };

  static std::uint32_t crc(std::string_view bytes) {
    return static_cast<std::uint32_t>(
        crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
  }
  template <typename T>
  static T value(std::string_view bytes, std::size_t offset) {
    T result;
    std::memcpy(&result, bytes.data() + offset, sizeof result);
    return result;
  }
  template <typename T>
  static Vector3d vector(std::string_view bytes, std::size_t offset) {
    Vector3d result;
    for (std::size_t i = 0; i < 3; ++i)
      result[static_cast<int>(i)] = static_cast<double>(value<T>(bytes, offset + i * sizeof(T)));
    return result;
  }
  void read(std::string_view bytes, const std::function<void(const PoseReport&)>& each) {
    const auto flags = value<std::uint16_t>(bytes, 4);
    PoseReport report;
    report.id = std::to_string(value<std::uint32_t>(bytes, 8));
    if (!(flags & kNoStamp)) report.stamp_s = value<double>(bytes, 12);
    const auto position = vector<double>(bytes, 20);
    if (flags & kGeodetic) {
      if (!is_on_earth(position.x(), position.y())) {
        decode_errors_.add("latitude or longitude out of range");
        return;
      }
      report.position = geodesy::Geodetic::from_degrees(position.x(), position.y(), position.z());
    } else {
      report.position_m = axes_.local(position);
    }
    if (!(flags & kNoAttitude)) {
      const auto xyz = vector<float>(bytes, 48);
      const Quaterniond q(static_cast<double>(value<float>(bytes, 44)), xyz.x(), xyz.y(), xyz.z());
      if (!(q.norm() > 1e-6)) {
        decode_errors_.add("an attitude without direction");
        return;
      }
      report.attitude = axes_.attitude(q);
    }
    if (flags & kVelocity) report.velocity_mps = axes_.local(vector<float>(bytes, 60));
    if (flags & kRates) report.rates_body_radps = axes_.body(vector<float>(bytes, 72));
    each(report);
  }

  Axes axes_;
  transport::Readers<std::string> held_;
};

}  // namespace

std::unique_ptr<PoseDecoder> make_decoder(const simulation::PoseSourceOptions& options) {
  switch (options.format) {
    case simulation::PoseFormat::Json:
      return std::make_unique<JsonPoses>(options);
    case simulation::PoseFormat::Binary:
      return std::make_unique<BinaryPoses>(options);
    case simulation::PoseFormat::MAVLink:
      return make_mavlink_poses(options.messages);
  }
  return nullptr;
}

}  // namespace canyon::live
