// MCAP (https://mcap.dev/spec) with messages of ROS 2 as CDR (OMG DDS-RTPS 2.3, 10.2: plain CDR,
// little-endian).
#include <zlib.h>
#include <Eigen/Geometry>

#include <array>
#include <map>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/payload.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/simulation/sensor_run.hpp"

namespace canyon::encoding {
namespace {

using Nanoseconds = std::uint64_t;

/// A message as CDR: numbers are aligned to their size after the header.
class Cdr {
 public:
  Cdr& number(double value) {
    align(8);
    body_.r8(value);
    return *this;
  }
  template <std::size_t N>
  Cdr& numbers(const std::array<double, N>& values) {
    for (const double each : values) number(each);
    return *this;
  }
  Cdr& vector(const Eigen::Vector3d& v) { return number(v.x()).number(v.y()).number(v.z()); }
  Cdr& u1(std::uint8_t value) {
    body_.u1(value);
    return *this;
  }
  Cdr& u2(std::uint16_t value) {
    align(2);
    body_.u2(value);
    return *this;
  }
  Cdr& u4(std::uint32_t value) {
    align(4);
    body_.u4(value);
    return *this;
  }
  Cdr& text(const std::string& value) {
    u4(static_cast<std::uint32_t>(value.size() + 1));
    body_.raw(value).u1(0);
    return *this;
  }
  Cdr& header(Nanoseconds stamp, const std::string& frame) {
    constexpr Nanoseconds kSecond = 1'000'000'000;
    return u4(static_cast<std::uint32_t>(stamp / kSecond))
        .u4(static_cast<std::uint32_t>(stamp % kSecond))
        .text(frame);
  }
  [[nodiscard]] std::string bytes() const { return std::string("\0\1\0\0", 4) + body_.bytes(); }

 private:
  void align(std::size_t size) { body_.zeros((size - body_.bytes().size() % size) % size); }
  Payload body_;
};

// Definitions of messages, as schemas of "ros2msg": the fields in order, then the types they use.
constexpr std::string_view kRule =
    "\n================================================================================\nMSG: ";
constexpr std::string_view kHeader = "std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id",
                           kTime = "builtin_interfaces/Time\nint32 sec\nuint32 nanosec",
                           kVector = "geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z",
                           kPoint = "geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z",
                           kQuaternion =
                               "geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w";
struct Schema {
  std::string_view name, fields;
  std::vector<std::string_view> types;
};
const std::array<Schema, 3> kSchemas{
    {{"sensor_msgs/msg/NavSatFix",
      "std_msgs/Header header\nsensor_msgs/NavSatStatus status\nfloat64 latitude\nfloat64 longitude\nfloat64 "
      "altitude\n"
      "float64[9] position_covariance\nuint8 position_covariance_type",
      {kHeader, kTime, "sensor_msgs/NavSatStatus\nint8 status\nuint16 service"}},
     {"sensor_msgs/msg/Imu",
      "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
      "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
      "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance",
      {kHeader, kTime, kQuaternion, kVector}},
     {"nav_msgs/msg/Odometry",
      "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
      "geometry_msgs/TwistWithCovariance twist",
      {kHeader, kTime, "geometry_msgs/PoseWithCovariance\ngeometry_msgs/Pose pose\nfloat64[36] covariance",
       "geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation", kPoint,
       kQuaternion, "geometry_msgs/TwistWithCovariance\ngeometry_msgs/Twist twist\nfloat64[36] covariance",
       "geometry_msgs/Twist\ngeometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular", kVector}}}};

struct Channel {
  std::string_view topic;
  std::uint16_t schema;  // from 1
};
enum Topic : std::uint16_t { kFix, kVelocity, kImu, kWheels, kTruth };
constexpr std::array<Channel, 5> kChannels{
    {{"/fix", 1}, {"/fix_odometry", 3}, {"/imu/data_raw", 2}, {"/wheels/odometry", 3}, {"/truth", 3}}};

/// A string of MCAP: its length, then its bytes.
void put_text(Payload& p, std::string_view text) {
  p.u4(text.size()).raw(text);
}
void put_u8(Payload& p, std::uint64_t value) {
  p.u4(value & 0xFFFFFFFFU).u4(value >> 32U);
}
std::uint32_t crc_of(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}
std::string record(std::uint8_t opcode, const Payload& content) {
  Payload head;
  head.u1(opcode);
  put_u8(head, content.bytes().size());
  return head.bytes() + content.bytes();
}

/// The records of an MCAP file, in chunks of about a megabyte, with indexes.
class McapWriter {
 public:
  [[nodiscard]] std::string begin() {
    Payload header;
    put_text(header, "ros2");
    put_text(header, "canyon");
    return count(kMagic + record(0x01, header));
  }

  void add(Topic topic, Nanoseconds time, const std::string& data) {
    if (counts_[topic]++ == 0) describe(topic);
    Payload message;
    message.u2(topic + 1).u4(counts_[topic] - 1);
    put_u8(message, time);
    put_u8(message, time);
    message.raw(data);
    index_[topic].emplace_back(time, chunk_.size());
    chunk_ += record(0x05, message);
    from_ = messages_in_chunk_++ == 0 ? time : std::min(from_, time);
    to_ = std::max(to_, time);
  }

  /// Writes the chunk if it is large enough.
  [[nodiscard]] std::string take(bool all) {
    if (messages_in_chunk_ == 0 || (!all && chunk_.size() < kChunkBytes)) return {};
    Payload chunk;
    put_u8(chunk, from_);
    put_u8(chunk, to_);
    put_u8(chunk, chunk_.size());
    chunk.u4(crc_of(chunk_));
    put_text(chunk, "");
    put_u8(chunk, chunk_.size());
    chunk.raw(chunk_);
    const std::string bytes = record(0x06, chunk);
    std::string indexes;
    Payload offsets;
    for (const auto& [topic, entries] : index_) {
      offsets.u2(topic + 1);
      put_u8(offsets, written_ + bytes.size() + indexes.size());
      Payload index;
      index.u2(topic + 1).u4(entries.size() * 16);
      for (const auto& [time, offset] : entries) {
        put_u8(index, time);
        put_u8(index, offset);
      }
      indexes += record(0x07, index);
    }
    Payload summary;
    put_u8(summary, from_);
    put_u8(summary, to_);
    put_u8(summary, written_);
    put_u8(summary, bytes.size());
    put_text(summary, offsets.bytes());
    put_u8(summary, indexes.size());
    put_text(summary, "");
    put_u8(summary, chunk_.size());
    put_u8(summary, chunk_.size());
    chunk_indexes_ += record(0x08, summary);
    begin_ = chunks_++ == 0 ? from_ : std::min(begin_, from_);
    end_ = std::max(end_, to_);
    chunk_.clear();
    index_.clear();
    messages_in_chunk_ = 0;
    to_ = 0;
    return count(bytes + indexes);
  }

  [[nodiscard]] std::string end() {
    std::string tail = count(record(0x0F, Payload().u4(0)));
    const std::uint64_t summary_start = written_;
    Payload statistics, counts;
    std::uint64_t messages = 0;
    for (const auto& [topic, number] : counts_) {
      counts.u2(topic + 1);
      put_u8(counts, number);
      messages += number;
    }
    put_u8(statistics, messages);
    statistics.u2(schemas_).u4(counts_.size()).u4(0).u4(0).u4(chunks_);
    put_u8(statistics, begin_);
    put_u8(statistics, end_);
    put_text(statistics, counts.bytes());
    std::string summary = descriptions_ + record(0x0B, statistics) + chunk_indexes_;
    Payload footer;
    put_u8(footer, summary_start);
    put_u8(footer, 0);
    // The checksum covers the summary and the footer up to it.
    const std::string head = record(0x02, Payload(footer).u4(0));
    const std::uint32_t crc = crc_of(summary + head.substr(0, head.size() - 4));
    return tail + summary + record(0x02, footer.u4(crc)) + kMagic;
  }

 private:
  static constexpr std::size_t kChunkBytes = std::size_t{1} << 20;
  inline static const std::string kMagic{"\x89MCAP0\r\n"};

  std::string count(std::string bytes) {
    written_ += bytes.size();
    return bytes;
  }

  /// The schema and channel of a topic, before its first message.
  void describe(Topic topic) {
    const Channel& channel = kChannels.at(topic);
    const Schema& schema = kSchemas.at(channel.schema - 1U);
    std::string text;
    if (!described_[channel.schema]) {
      described_[channel.schema] = true;
      ++schemas_;
      std::string definition(schema.fields);
      for (const std::string_view type : schema.types) definition += std::string(kRule) + std::string(type);
      Payload p;
      p.u2(channel.schema);
      for (const std::string_view each :
           {schema.name, std::string_view("ros2msg"), std::string_view(definition)})
        put_text(p, each);
      text += record(0x03, p);
    }
    Payload p;
    p.u2(topic + 1).u2(channel.schema);
    put_text(p, channel.topic);
    put_text(p, "cdr");
    p.u4(0);
    text += record(0x04, p);
    chunk_ += text;
    descriptions_ += text;
  }

  std::uint64_t written_ = 0;
  std::string chunk_, chunk_indexes_, descriptions_;
  std::map<Topic, std::vector<std::pair<Nanoseconds, std::uint64_t>>> index_;
  std::map<Topic, std::uint32_t> counts_;
  std::map<std::uint16_t, bool> described_;
  std::uint16_t schemas_ = 0;
  std::uint32_t chunks_ = 0;
  std::size_t messages_in_chunk_ = 0;
  Nanoseconds from_ = 0, to_ = 0, begin_ = 0, end_ = 0;
};

Nanoseconds unix_of(geodesy::GpsTime time) {
  return static_cast<Nanoseconds>(geodesy::unix_from_gps(time));
}

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

using simulation::kUnknownVariance;
using Covariance = std::array<double, 36>;

/// Covariance of a position or velocity, if known, and of angles or their rates about x, y and z.
Covariance covariance36(const std::optional<Eigen::Matrix3d>& known, const Eigen::Vector3d& angular) {
  Eigen::Matrix<double, 6, 6> all = Eigen::Matrix<double, 6, 6>::Zero();
  all.topLeftCorner<3, 3>() = known.value_or(kUnknownVariance * Eigen::Matrix3d::Identity());
  all.diagonal().tail<3>() = angular;
  Covariance numbers{};
  Eigen::Map<Eigen::Matrix<double, 6, 6>>(numbers.data()) = all;  // symmetric, so row-major is the same
  return numbers;
}
const Eigen::Vector3d kUnknownAngles = Eigen::Vector3d::Constant(kUnknownVariance);

class McapEncoder final : public Encoder {
 public:
  explicit McapEncoder(const ReceiverDescription& receiver) : sensors_(receiver.sensors) {}

  [[nodiscard]] std::string begin() override { return writer_.begin(); }
  [[nodiscard]] bool uses_sensors() const override { return sensors_.any(); }
  [[nodiscard]] std::string encode(const simulation::Epoch& epoch) override {
    const Nanoseconds now = unix_of(epoch.truth.time);
    if (!frame_) frame_.emplace(epoch.truth.position);
    if (sensors_.any() && epoch.sensors != nullptr) put_samples(*epoch.sensors);
    put_fix(now, epoch.observed.fix);
    const Eigen::Vector3d& v = epoch.truth.velocity_enu_mps;
    const Eigen::Matrix3d rotation = simulation::enu_from_body(epoch.truth);
    put_odometry(kTruth, now, frame_->local_from_ecef(epoch.truth_ecef), Eigen::Quaterniond(rotation), {},
                 rotation.transpose() * v, epoch.truth.yaw_rate_radps,
                 covariance36(Eigen::Matrix3d::Zero(), {kUnknownVariance, kUnknownVariance, 0}));
    return writer_.take(false);
  }
  void end(const Put& put) override {
    put(writer_.take(true));
    put(writer_.end());
  }

 private:
  void put_fix(Nanoseconds now, const positioning::Fix& fix) {
    const bool solved = fix.solved(), reported = solved && !fix.covariance_enu.isZero(0);
    std::array<double, 9> covariance{};
    covariance.fill(reported || !solved ? kUnknown : 0);
    for (std::size_t i = 0; reported && i < 9; ++i)
      covariance.at(i) =
          fix.covariance_enu(static_cast<Eigen::Index>(i / 3), static_cast<Eigen::Index>(i % 3));
    const bool corrected = fix.kind() > positioning::FixKind::Single;
    Cdr m;
    m.header(now, "gnss").u1(static_cast<std::uint8_t>(!solved ? -1 : corrected ? 2 : 0)).u2(solved ? 1 : 0);
    m.number(solved ? geodesy::degrees(fix.position.latitude_rad) : kUnknown);
    m.number(solved ? geodesy::degrees(fix.position.longitude_rad) : kUnknown);
    m.number(solved ? fix.position.height_m : kUnknown);
    writer_.add(kFix, now, m.numbers(covariance).u1(reported ? 3 : 0).bytes());
    if (!solved || !fix.velocity_enu_mps) return;
    // Axes of the twist are those of the child frame, which is stationary: "gnss_enu".
    Cdr v;
    v.header(now, "map").text("gnss_enu").vector(frame_->local_from_ecef(fix.position_ecef));
    v.number(0).number(0).number(0).number(1);
    v.numbers(covariance36(reported ? std::optional(fix.covariance_enu) : std::nullopt, kUnknownAngles));
    v.vector(*fix.velocity_enu_mps).vector(Eigen::Vector3d::Zero());
    v.numbers(covariance36(fix.velocity_covariance_enu, kUnknownAngles));
    writer_.add(kVelocity, now, v.bytes());
  }

  void put_odometry(Topic topic, Nanoseconds now, const Eigen::Vector3d& point, const Eigen::Quaterniond& q,
                    const Covariance& write_covariance, const Eigen::Vector3d& velocity, double yaw_rate,
                    const Covariance& velocity_covariance) {
    Cdr m;
    m.header(now, topic == kTruth ? "map" : "odom")
        .text(topic == kTruth ? "gnss" : "base_link")
        .vector(point);
    m.number(q.x()).number(q.y()).number(q.z()).number(q.w()).numbers(write_covariance);
    m.vector(velocity).vector({0, 0, yaw_rate}).numbers(velocity_covariance);
    writer_.add(topic, now, m.bytes());
  }

  void put_samples(const simulation::SensorBatch& batch) {
    // ROS uses forward, left, up.
    const Eigen::Vector3d axes(1, batch.imu_axes == inertial::ImuAxes::Flu ? 1 : -1,
                               batch.imu_axes == inertial::ImuAxes::Flu ? 1 : -1);
    for (const simulation::InertialSample& each : batch.imu) {
      if (!each.sample) continue;
      const Nanoseconds time = unix_of(each.reported);
      std::array<double, 9> none{}, unknown{};
      none[0] = -1;  // no orientation
      Cdr m;
      m.header(time, "imu").number(0).number(0).number(0).number(1).numbers(none);
      m.vector(axes.cwiseProduct(each.sample->measured.angular_rate_radps)).numbers(unknown);
      m.vector(axes.cwiseProduct(each.sample->measured.specific_force_mps2)).numbers(unknown);
      writer_.add(kImu, time, m.bytes());
    }
    for (const simulation::WheelsAtWork& each : batch.wheels) {
      const simulation::WheelTwist twist = simulation::wheel_twist(each, *sensors_.wheels);
      put_odometry(kWheels, unix_of(each.time), Eigen::Vector3d::Zero(), Eigen::Quaterniond::Identity(),
                   covariance36({}, kUnknownAngles), {twist.forward_mps, 0, 0}, twist.yaw_rate_radps,
                   twist.covariance);
    }
  }

  inertial::SensorOptions sensors_;
  std::optional<geodesy::LocalFrame> frame_;
  McapWriter writer_;
};

}  // namespace

std::unique_ptr<Encoder> encode_mcap(const ReceiverDescription& receiver) {
  return std::make_unique<McapEncoder>(receiver);
}

}  // namespace canyon::encoding
