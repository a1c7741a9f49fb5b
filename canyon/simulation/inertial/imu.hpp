#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/random.hpp"
#include "canyon/simulation/inertial/imu_options.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::inertial {

using BodyState = simulation::EcefPose;
/// A function of seconds with continuous acceleration. Differences of a smoother attitude are more exact.
using BodyMotion = std::function<BodyState(double)>;

/// The true input of an inertial sensor, in its axes.
struct ImuInput {
  Eigen::Vector3d specific_force_mps2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_rate_radps = Eigen::Vector3d::Zero();  ///< against inertial space
};

/// Position and attitude of the sensor at an instant.
struct ImuState {
  BodyState sensor;  ///< ecef_from_body: from the sensor's axes
  ImuInput input;
};

/// Error-free sensors on a moving vehicle, at instants in even steps: f = C (a + 2 w x v - g), with Earth's
/// rotation w and normal gravity g (Groves, Principles of GNSS, Inertial, and Multisensor Integrated
/// Navigation Systems, 2nd ed., 5.2). Rates include Earth's rotation. Rates and the sensor's motion about the
/// vehicle's reference point are derivatives of the attitude by differences of fourth order.
class IdealImu {
 public:
  /// Instants are rounded to nanoseconds. @param motion is called from -2 step_s on @param step_s above 0
  IdealImu(const ImuOptions& options, BodyMotion motion, double step_s);

  /// The state at the time `index` step_s, `index` at least 0.
  [[nodiscard]] ImuState at(std::int64_t index);
  /// Means over an interval, as of integrating sensors. Specific force: by Simpson's rule, with an error of
  /// the fourth order of the step. Rate: by the rotations between attitudes, so that they add up to it.
  /// @param to an even number of steps after `from`
  [[nodiscard]] ImuInput mean(std::int64_t from, std::int64_t to);

 private:
  [[nodiscard]] const BodyState& body(std::int64_t index);
  /// The rotation vector from body(index) to body(index + 1), in the axes of either.
  [[nodiscard]] const Eigen::Vector3d& rotation_vector(std::int64_t index);

  /// Normal gravity at a position on the path, by its gradient within a metre of the last computed position.
  [[nodiscard]] Eigen::Vector3d gravity(const Eigen::Vector3d& lever_arm_m);

  static constexpr std::int64_t kKept = 8;
  BodyMotion motion_;
  double step_s_;
  Eigen::Vector3d position_m_;
  Eigen::Matrix3d body_from_sensor_;
  Eigen::Vector3d gravity_position_m_ = Eigen::Vector3d::Zero(), gravity_mps2_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d gravity_gradient_ = Eigen::Matrix3d::Zero();
  // Latest requested states, by index modulo kKept.
  std::array<std::optional<std::pair<std::int64_t, BodyState>>, kKept> bodies_;
  std::array<std::optional<std::pair<std::int64_t, ImuState>>, kKept> states_;
  std::array<std::optional<std::pair<std::int64_t, Eigen::Vector3d>>, kKept> rotations_;
};

/// Vibrations of an inertial sensor. Samples are means over an interval. A frequency f above half the sample
/// rate is aliased to its distance from the next multiple of the rate, times |sin(pi f dt) / (pi f dt)|.
class Vibrations {
 public:
  Vibrations(const std::vector<VibrationOptions>& lines, RandomStream& random);
  /// Mean over the `dt_s` until `time_s`: specific force and rate in the sensor's axes.
  [[nodiscard]] ImuInput mean(double time_s, double dt_s, RandomStream& random);

 private:
  /// Amplitudes and phases of three axes [m/s^2], then of three [rad/s].
  using Phasors = std::array<std::complex<double>, 6>;
  struct Line {
    double frequency_hz, decay_per_s;  ///< of the correlation of its amplitude
    std::array<double, 2> amplitude;   ///< [m/s^2], [rad/s]
    Phasors phasors;
  };
  std::vector<Line> lines_;
};

[[nodiscard]] Eigen::Vector3d three_normals(RandomStream& random);

/// The 1/f noise of three axes: a sum of Gauss-Markov processes with equal deviations, whose time constants
/// are 1, 10, ..., 10,000 s. Its Allan deviation is flat within 4 % from averages over 6 s to those over
/// 5,000 s. Slow ones change in steps of at most 1 / 500 of their time constants, 6 % of their deviation.
class FlickerNoise {
 public:
  /// @param floor its Allan deviation
  FlickerNoise(double floor, RandomStream& random);
  [[nodiscard]] Eigen::Vector3d next(double dt_s, RandomStream& random);

 private:
  static constexpr std::size_t kProcesses = 5;
  double sigma_;
  double dt_s_ = 0;  // interval of keep_, drive_ and every_
  std::uint64_t samples_ = 0;
  std::array<std::uint64_t, kProcesses> every_{};  // samples from step to step
  std::array<double, kProcesses> keep_{}, drive_{};
  std::array<Eigen::Vector3d, kProcesses> values_;
};

/// Errors of three equal sensors: y = (I + M) x + biases + noise, rounded and limited.
class Triad {
 public:
  Triad(const TriadNumbers& numbers, RandomStream& random);
  /// @param mean of the true values over `dt_s` @param force mean specific force [m/s^2] @param more a bias
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
  double time_s = 0;  ///< time stamp
  ImuInput measured;
  double temperature_k = 0;  ///< of the sensor
};

/// An inertial measurement unit with its errors, on a vibrating vehicle. Seed and name determine the errors.
class Imu {
 public:
  Imu(const ImuOptions& options, std::uint64_t seed, std::string_view name = "imu");
  /// The next sample; empty: it is lost. @param mean over `dt_s`, which ends at `time_s` since the run began
  [[nodiscard]] std::optional<ImuSample> measure(const ImuInput& mean, double time_s, double dt_s);

 private:
  ImuInput last_;  // measured, before it froze
  ImuOptions options_;
  RandomStream random_;
  Triad gyroscope_, accelerometer_;
  RandomStream surroundings_;               // of temperature and vibration
  ImuInput per_kelvin_, scale_per_kelvin_;  // biases; relative
  Vibrations vibrations_;
};

}  // namespace canyon::inertial
