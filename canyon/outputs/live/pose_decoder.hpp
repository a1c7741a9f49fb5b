#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/transport/transport.hpp"
#include "canyon/simulation/scenario/live_options.hpp"

namespace canyon::live {

/// A received pose, rotated to ENU axes of its local frame and FLU axes of the body.
struct PoseReport {
  std::string id;                                   ///< the vehicle's; empty: not given
  std::optional<double> stamp_s;                    ///< on the sender's clock
  std::optional<Eigen::Vector3d> position_m;        ///< in a local frame; or
  std::optional<geodesy::Geodetic> position;        ///< latitude, longitude and height, as sent
  std::optional<Eigen::Quaterniond> attitude;       ///< local from body
  std::optional<Eigen::Vector3d> velocity_mps;      ///< local axes
  std::optional<Eigen::Vector3d> rates_body_radps;  ///< about the body's axes
};

/// Counts messages that are not poses, by reason.
class DecodeErrors {
 public:
  /// Number of distinct reasons that are reported; messages with further reasons are only counted.
  static constexpr std::size_t kMax = 8;

  void add(std::string why);
  /// "3 messages were not poses: 2 a wrong checksum; 1 an attitude without direction", in order of first
  /// occurrence; empty: none since the last call.
  [[nodiscard]] std::string take();

 private:
  std::vector<std::pair<std::string, std::size_t>> reasons_;
  std::size_t count_ = 0;
};

/// Finds poses in bytes that may be cut anywhere, mixed with other data, or hostile. Buffers a bounded number
/// of bytes, and none of a datagram: the parts of a datagram that are not poses are counted as errors.
class PoseDecoder {
 public:
  virtual ~PoseDecoder() = default;
  virtual void receive(const transport::Received& received,
                       const std::function<void(const PoseReport&)>& each) = 0;
  /// A request for poses to a silent sender; empty: none.
  [[nodiscard]] virtual std::string request() { return {}; }
  /// Complaints::take() for the messages since the last call.
  [[nodiscard]] std::string take_decode_errors() { return decode_errors_.take(); }
  /// Unused parts of poses, each reported once; empty: none since the last call.
  [[nodiscard]] virtual std::string take_unused() { return {}; }

 protected:
  DecodeErrors decode_errors_;
};

/// Makes the decoder for these options. Throws InputError for unknown messages.
[[nodiscard]] std::unique_ptr<PoseDecoder> make_decoder(const simulation::PoseSourceOptions& options);

/// One pose in binary format: kBinarySize bytes, little-endian (docs/live.md has the table).
///   0 char[4] "CNY1"   4 u16 flags (1 velocity, 2 rates, 4 latitude, longitude [deg] and height instead of
///   x, y, z, 8 no stamp, 16 no attitude)   6 u16 0   8 u32 id   12 f64 stamp [s]   20 f64[3] position [m]
///   44 f32[4] attitude w, x, y, z   60 f32[3] velocity [m/s]   72 f32[3] rates [rad/s]   84 u32 CRC-32 (that
///   of zlib) of the bytes before
inline constexpr std::size_t kBinarySize = 88;
/// Longest JSON line; longer ones are skipped.
inline constexpr std::size_t kMaxLine = 4096;

[[nodiscard]] bool is_on_earth(double latitude_deg, double longitude_deg);

/// Rotates vectors from `axes` to local ENU, or to FLU.
[[nodiscard]] Eigen::Matrix3d enu_from(simulation::WorldAxes axes);
[[nodiscard]] Eigen::Matrix3d flu_from(simulation::BodyAxes axes);

}  // namespace canyon::live
