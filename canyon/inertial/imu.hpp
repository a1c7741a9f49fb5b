#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "canyon/base/random.hpp"
#include "canyon/inertial/ideal_imu.hpp"
#include "canyon/inertial/imu_options.hpp"
#include "canyon/inertial/vibration.hpp"

namespace canyon::inertial {

/// Three independent standard normal numbers.
[[nodiscard]] Eigen::Vector3d three_normals(RandomStream& random);

/// The 1/f noise of three axes: a sum of Gauss-Markov processes with equal deviations, whose time constants
/// are 1, 10, ..., 10,000 s. Its Allan deviation is flat within 4 % from averages over 6 s to those over
/// 5,000 s. Slow ones change in steps of at most 1 / 500 of their time constants, 6 % of their deviation.
class FlickerNoise {
 public:
  /// @param floor its Allan deviation
  FlickerNoise(double floor, RandomStream& random);
  /// The value `dt_s` later.
  [[nodiscard]] Eigen::Vector3d next(double dt_s, RandomStream& random);

 private:
  static constexpr std::size_t kProcesses = 5;
  double sigma_;
  double dt_s_ = 0;  // that keep_, drive_ and every_ belong to
  std::uint64_t samples_ = 0;
  std::array<std::uint64_t, kProcesses> every_{};  // samples from step to step
  std::array<double, kProcesses> keep_{}, drive_{};
  std::array<Eigen::Vector3d, kProcesses> values_;
};

/// Errors of three equal sensors: y = (I + M) x + biases + noise, rounded and cut off.
class Triad {
 public:
  Triad(const TriadNumbers& numbers, RandomStream& random);
  /// @param mean of the true values over `dt_s`; @param force the mean specific force [m/s^2]; @param more a
  /// bias beside those of the run
  [[nodiscard]] Eigen::Vector3d measure(const Eigen::Vector3d& mean, const Eigen::Vector3d& force,
                                        double dt_s, RandomStream& random,
                                        const Eigen::Vector3d& more = Eigen::Vector3d::Zero());

 private:
  TriadNumbers numbers_;
  Eigen::Matrix3d matrix_;  // I + M
  Eigen::Vector3d bias_;    // of the run, with its walk
  Eigen::Vector3d per_force_;
  FlickerNoise flicker_;
};

struct ImuSample {
  double time_s = 0;  ///< as stated
  ImuInput measured;
  double temperature_k = 0;  ///< of the sensor
};

/// An inertial measurement unit with the errors of its numbers, on a vehicle that vibrates. The same seed and
/// name give the same errors.
class Imu {
 public:
  Imu(const ImuOptions& options, std::uint64_t seed, std::string_view name = "imu");
  /// The next sample; empty: it is lost. @param mean over `dt_s`, which ends at `time_s` since the run began
  [[nodiscard]] std::optional<ImuSample> measure(const ImuInput& mean, double time_s, double dt_s);

 private:
  ImuOptions options_;
  RandomStream random_;
  Triad gyroscope_, accelerometer_;
  RandomStream surroundings_;               // of temperature and vibration
  ImuInput per_kelvin_, scale_per_kelvin_;  // biases; relative
  Vibrations vibrations_;
};

}  // namespace canyon::inertial
