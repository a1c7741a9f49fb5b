#include "canyon/receiver/positioning/fusion/dead_reckoning.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/receiver/positioning/fusion/inertial_errors.hpp"
#include "canyon/receiver/positioning/fusion/vehicle_constraints.hpp"

namespace canyon::positioning {

void visit(options::Visitor& v, DeadReckoningOptions& o) {
  v.boolean({"enabled", "", "fusion of fixes with the vehicle's inertial sensor and wheels (sensors)"},
            o.enabled);
  v.boolean(
      {"non_holonomic", "", "the vehicle moves along its own axis, like a car: no speed sideways or upwards"},
      o.non_holonomic);
  v.number({"sideways_mps", "m/s", "standard deviation of the speed sideways"}, o.sideways_mps,
           {0, 10, true});
  v.number({"upwards_mps", "m/s", "standard deviation of the speed along the vehicle's up axis"},
           o.upwards_mps, {0, 10, true});
  v.number({"alignment_speed_mps", "m/s", "speed from which the course determines the heading"},
           o.alignment_speed_mps, {0, 100, true});
  v.number(
      {"gate_sigmas", "",
       "fixes and velocities beyond this number of standard deviations are rejected; none: all are used"},
      o.gate_sigmas, options::or_none({0, std::numeric_limits<double>::infinity(), true}));
  v.number({"error_distance_m", "m", "correlation distance of horizontal errors of fixes, in antenna motion"},
           o.error_distance_m, {0, 1e5, true});
  v.number({"error_height_distance_m", "m", "the same, of heights"}, o.error_height_distance_m,
           {0, 1e5, true});
  v.number({"error_time_s", "s", "correlation time of errors of fixes at rest"}, o.error_time_s,
           {0, 3600, true});
  v.number(
      {"range_error_sigma_m", "m",
       "errors in space, which do not average out: standard deviation of a range, in the reported accuracy"},
      o.space_sigma_m, {0, 100});
  v.former_name("space_sigma_m", "range_error_sigma_m");
  v.number({"divergence_timeout_s", "s",
            "after this time with only rejected fixes the filter increases its position's covariance"},
           o.astray_s, {0, 3600, true});
  v.former_name("astray_s", "divergence_timeout_s");
  v.number({"max_sigma_m", "m", "largest standard deviation of a valid position"}, o.max_sigma_m,
           options::or_none({0, std::numeric_limits<double>::infinity(), true}));
}

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using geodesy::GpsTime;

/// Largest step of the covariance propagation [s].
constexpr double kPredict_s = 0.05;
/// Interval of constraints and rest updates [s].
constexpr double kConstraint_s = 0.1;
/// After a gap of readings longer than this the filter restarts [s].
constexpr double kGap_s = 1;
/// Mean ratio of squared innovations to their variances that indicates a wrong estimate.
constexpr double kSurprise = 2;
/// Errors of heights exceed their residuals, since all reflections make ranges longer (docs/imu.md).
constexpr double kHeightFactor = 2;
/// Correlation time of errors of velocities [s].
constexpr double kVelocityError_s = 1;

/// The variance of the mean of errors with the correlation a^|k| over that of white ones (Bartlett 1946).
double lasting(double ages) {
  const double a = std::exp(-ages);
  return (1 + a) / (1 - a);
}

/// State of the fix updates along some axes.
struct UpdateState {
  std::optional<GpsTime> last;          ///< last accepted fix
  std::optional<GpsTime> astray_since;  ///< rejected since then
  double moved_m = 0;                   ///< since `last`
  double surprise = 1;                  ///< mean of squared innovations over their variances
};

}  // namespace

struct DeadReckoning::State {
  State(const DeadReckoningOptions& dead_reckoning, const SensorMounting& sensors)
      : options(dead_reckoning),
        mounting(sensors),
        standstill(sensors),
        initial_attitude(sensors),
        constraints(dead_reckoning, sensors) {}

  void reset_state() {
    estimate.reset();
    last_reading.reset();
    navigating = false;
    horizontal = vertical = {};
    has_space_variance = false;
    last_velocity.reset();
  }

  /// Propagates by a reading of the inertial sensor.
  void go_on(const ImuReading& reading) {
    standstill.add(reading);
    const std::optional<GpsTime> before = std::exchange(last_reading, reading.time);
    if (!estimate) return;
    const double elapsed_s = before ? reading.time - *before : mounting.imu_interval_s;
    if (elapsed_s > kGap_s) return reset_state();
    // Jitter of timestamps does not change the interval's length.
    const bool whole = std::abs(elapsed_s - mounting.imu_interval_s) < 0.5 * mounting.imu_interval_s;
    const double dt_s = whole ? mounting.imu_interval_s : std::max(0.0, elapsed_s);
    const ImuReading motion = estimate->sensors.corrected(reading);
    if (!gravity_at || (estimate->state.position_m - *gravity_at).squaredNorm() > 100) {
      gravity_at = estimate->state.position_m;
      gravity_mps2 = geodesy::normal_gravity(*gravity_at);
    }
    carry(estimate->state, motion, dt_s, gravity_mps2);
    estimate->state.time = reading.time;
    for (double& moved : moved_m) moved += estimate->state.velocity_mps.norm() * dt_s;
    constraints.move(*estimate, motion, dt_s);
    // Sums of the measured motion since the last prediction.
    force += motion.specific_force_mps2 * dt_s;
    rate += motion.angular_rate_radps * dt_s;
    unpredicted_s += dt_s;
    if (unpredicted_s > kPredict_s - 1e-6) predict();
  }

  void predict() {
    if (unpredicted_s <= 0) return;
    estimate->predict({estimate->state.time, force / unpredicted_s, rate / unpredicted_s}, unpredicted_s,
                      gravity_mps2, mounting);
    force.setZero();
    rate.setZero();
    unpredicted_s = 0;
  }

  [[nodiscard]] std::optional<double> known_speed() const {
    if (estimate) return estimate->state.velocity_mps.norm();
    return fix_speed_mps;
  }

  /// Applies the constraints of the vehicle, some times a second.
  void constrain(const WheelReading* wheels, GpsTime now) {
    if (wheels != nullptr) standstill.add(*wheels);
    const bool stationary = standstill.is_stationary(known_speed());
    if (stationary && !estimate) initial_attitude.set_stationary(standstill.mean());
    if (!estimate) return;
    predict();
    if (wheels != nullptr) constraints.take_wheels(*estimate, *wheels);
    if (last_constraint && now - *last_constraint < kConstraint_s - 1e-6) return;
    const double since_s = last_constraint ? now - *last_constraint : kConstraint_s;
    last_constraint = now;
    if (stationary)
      constraints.take_rest(*estimate, standstill.mean(), since_s);
    else if (options.non_holonomic)
      constraints.apply_non_holonomic(*estimate, since_s);
    is_stationary = stationary;
  }

  void take_readings(const SensorReadings& readings) {
    auto wheel = readings.wheels.begin();
    for (const ImuReading& reading : readings.imu) {
      go_on(reading);
      const WheelReading* due = nullptr;
      while (wheel != readings.wheels.end() && wheel->time - reading.time < 0.5 * mounting.imu_interval_s)
        due = &*wheel++;
      if (due != nullptr || !mounting.wheels) constrain(due, reading.time);
    }
  }

  /// The innovation of a fix's position, and its velocity's: of the antenna, `ahead_s` after the state.
  [[nodiscard]] Innovation<3> position_innovation(const Fix& fix, double ahead_s) const {
    const Matrix3d c = estimate->state.rotation();
    const Vector3d arm = c * mounting.antenna_m;
    const Matrix3d enu = geodesy::enu_from_ecef_rotation(fix.position);
    Innovation<3> z;
    z.value =
        enu * (fix.position_ecef - estimate->state.position_m - arm - ahead_s * estimate->state.velocity_mps);
    z.gradient.block<3, 3>(0, kPositionError) = enu;
    z.gradient.block<3, 3>(0, kAttitudeError) = -enu * skew(arm);
    z.noise = fix.covariance_enu;
    z.noise.row(2) *= kHeightFactor;
    z.noise.col(2) *= kHeightFactor;
    return z;
  }
  [[nodiscard]] Innovation<3> velocity_innovation(const Fix& fix) const {
    const Matrix3d c = estimate->state.rotation();
    const Matrix3d enu = geodesy::enu_from_ecef_rotation(fix.position);
    const Vector3d arm_mps = c * constraints.rate(*estimate).cross(mounting.antenna_m);
    Innovation<3> z;
    z.value = *fix.velocity_enu_mps - enu * (estimate->state.velocity_mps + arm_mps);
    z.gradient.block<3, 3>(0, kVelocityError) = enu;
    z.gradient.block<3, 3>(0, kAttitudeError) = -enu * skew(arm_mps);
    z.gradient.block<3, 3>(0, kGyroscopeBias) = enu * c * skew(mounting.antenna_m);
    z.noise = *fix.velocity_covariance_enu;
    return z;
  }

  /// Whether an innovation is within the gate.
  template <int M>
  [[nodiscard]] bool passes(const Innovation<M>& z) const {
    return estimate->distance2(z) < options.gate_sigmas * options.gate_sigmas;
  }

  /// Applies axes of a fix's position, `first` to `first` + M of east, north, up, if they pass the gate.
  template <int M>
  bool take_axes(const Innovation<3>& all, int first, double distance_m, GpsTime time,
                 UpdateState& followed) {
    Innovation<M> z;
    z.value = all.value.segment<M>(first);
    z.gradient = all.gradient.middleRows<M>(first);
    z.noise = all.noise.block<M, M>(first, first);
    followed.moved_m += std::exchange(moved_m[first == 2], 0);
    if (!passes(z)) {
      doubt(z.value.squaredNorm(), time, followed);
      return false;
    }
    const double since_s = followed.last ? time - *followed.last : options.error_time_s;
    const double ages = since_s / options.error_time_s + followed.moved_m / distance_m;
    const double distance2 = estimate->distance2(z) / M;
    wonder(distance2, z.value.squaredNorm(), since_s, followed);
    // A less likely fix gets less weight.
    z.noise *= lasting(ages) * std::max(1.0, distance2);
    estimate->take(z);
    followed = {time, std::nullopt, 0, followed.surprise};
    return true;
  }

  /// If accepted fixes have large innovations for the correlation time of their errors, the filter is wrong.
  /// A single one is no evidence.
  void wonder(double distance2, double innovation2, double since_s, UpdateState& followed) {
    constexpr double kMaxNews = 0.1, kMaxDistance2 = 8;
    const double ages = since_s / options.error_time_s + followed.moved_m / options.error_distance_m;
    const double news = std::min(kMaxNews, 1 - std::exp(-ages));
    followed.surprise += news * (std::min(distance2, kMaxDistance2) - followed.surprise);
    if (followed.surprise < kSurprise) return;
    grow(innovation2, followed);
    followed.surprise = 1;
  }

  /// If fixes are rejected for long, the filter is wrong by up to their innovation.
  void doubt(double innovation2, GpsTime time, UpdateState& followed) {
    if (!followed.astray_since) followed.astray_since = time;
    if (time - *followed.astray_since < options.astray_s) return;
    grow(innovation2, followed);
    followed.astray_since = time;
  }
  /// Along the axes of `followed` only.
  void grow(double variance, const UpdateState& followed) {
    const Matrix3d enu =
        geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(estimate->state.position_m));
    const bool level = &followed == &horizontal;
    const Vector3d more = variance * Vector3d(level ? 1 : 0, level ? 1 : 0, level ? 0 : 1);
    estimate->p.block<3, 3>(kPositionError, kPositionError) += enu.transpose() * more.asDiagonal() * enu;
  }

  /// Processes a fix; returns false if it was not used.
  bool take_fix(const Fix& fix, GpsTime time) {
    if (!fix.measured()) return false;
    predict();
    const Innovation<3> position = position_innovation(fix, time - estimate->state.time);
    const bool level = take_axes<2>(position, 0, options.error_distance_m, time, horizontal);
    const bool height = take_axes<1>(position, 2, options.error_height_distance_m, time, vertical);
    if (level) remember(fix);
    bool moving = false;
    if (fix.velocity_enu_mps && fix.velocity_covariance_enu) {
      Innovation<3> velocity = velocity_innovation(fix);
      moving = passes(velocity);
      if (moving) {
        velocity.noise *= lasting((last_velocity ? time - *last_velocity : 1) / kVelocityError_s);
        estimate->take(velocity);
        last_velocity = time;
      }
    }
    return level || height || moving;
  }

  /// Stores the position error by errors in space, for the satellite geometries of its fixes. A few fixes
  /// with a weak geometry change it little.
  void remember(const Fix& fix) {
    if (!fix.dop && !corrected(fix.solution)) return;
    const double sigma_m = corrected(fix.solution) ? 0 : options.space_sigma_m;
    const double level = fix.dop ? sigma_m * fix.dop->hdop : 0, up = fix.dop ? sigma_m * fix.dop->vdop : 0;
    const Vector3d now(level * level / 2, level * level / 2, up * up);
    constexpr double kFraction = 0.02;
    const bool better = !has_space_variance || now.sum() < space_variance.sum();
    if (better) {
      space_variance = now;
    } else {
      constexpr double kMax = 4;
      space_variance += kFraction * (now.cwiseMin(kMax * space_variance) - space_variance);
    }
    has_space_variance = true;
  }

  [[nodiscard]] Fix result(GpsTime time, const Fix& fix, bool taken) {
    Fix result = fix;
    const InertialState& state = estimate->state;
    const Vector3d arm = state.rotation() * mounting.antenna_m;
    const Vector3d arm_mps = state.rotation() * constraints.rate(*estimate).cross(mounting.antenna_m);
    const Vector3d velocity = state.velocity_mps + arm_mps;
    result.position_ecef = state.position_m + arm + (time - state.time) * velocity;
    result.position = geodesy::geodetic_from_ecef(result.position_ecef);
    const Matrix3d enu = geodesy::enu_from_ecef_rotation(result.position);
    const auto rotated = [&](int at) -> Matrix3d {
      return enu * estimate->p.block<3, 3>(at, at) * enu.transpose();
    };
    result.covariance_enu = rotated(kPositionError);
    result.covariance_enu.diagonal() += space_variance;
    result.velocity_enu_mps = enu * velocity;
    result.velocity_covariance_enu = rotated(kVelocityError);
    result.status = result.covariance_enu.trace() <= options.max_sigma_m * options.max_sigma_m
                        ? FixStatus::Fix
                        : FixStatus::WeakGeometry;
    if (!taken) {
      result.used.clear();
      result.residuals_m.clear();
      result.dop.reset();
    }
    result.fusion = status(enu, rotated(kAttitudeError));
    return result;
  }

  [[nodiscard]] Fusion sensors_alone() const {
    Fusion fusion;
    fusion.imu_hz = 1 / mounting.imu_interval_s;
    if (mounting.wheels) fusion.wheels_hz = mounting.wheels->rate_hz;
    return fusion;
  }
  [[nodiscard]] Fusion status(const Matrix3d& enu, const Matrix3d& attitude) {
    Fusion fusion = sensors_alone();
    const Matrix3d enu_from_body = enu * estimate->state.rotation();
    const Vector3d forward = enu_from_body.col(0);
    fusion.heading_rad = std::atan2(forward.x(), forward.y());
    if (fusion.heading_rad < 0) fusion.heading_rad += 2 * geodesy::kPi;
    fusion.pitch_rad = std::asin(std::clamp(forward.z(), -1.0, 1.0));
    fusion.roll_rad = std::atan2(enu_from_body(2, 1), enu_from_body(2, 2));
    fusion.heading_sigma_rad = std::sqrt(attitude(2, 2));
    fusion.is_stationary = is_stationary;
    // Calibrated: a minute of coasting would change the heading by less than 3 deg.
    constexpr double kHeading_rad = 0.026, kBias_radps = 0.0009, kWheels = 0.004;
    const auto sigma = [this](int i) { return std::sqrt(estimate->p(i, i)); };
    const double bias =
        std::max({sigma(kGyroscopeBias), sigma(kGyroscopeBias + 1), sigma(kGyroscopeBias + 2)});
    fusion.wheels_calibrated = mounting.wheels && sigma(kWheelScale) < kWheels;
    fusion.imu_calibrated = bias < kBias_radps;
    navigating = navigating || (fusion.heading_sigma_rad < kHeading_rad && fusion.imu_calibrated &&
                                (!mounting.wheels || fusion.wheels_calibrated));
    fusion.phase = navigating ? FusionPhase::Navigating : FusionPhase::Calibrating;
    return fusion;
  }

  [[nodiscard]] Fix update(GpsTime time, const SensorReadings& readings, const Fix& fix) {
    take_readings(readings);
    if (fix.measured() && fix.velocity_enu_mps) fix_speed_mps = fix.velocity_enu_mps->norm();
    if (!estimate && standstill.full()) {
      estimate = initial_attitude.begin(fix, standstill.mean(), options);
      if (estimate) {
        estimate->state.time = time;
        horizontal.last = vertical.last = time;
        remember(fix);
        return result(time, fix, true);
      }
    }
    if (estimate && last_reading && time - *last_reading > kGap_s) reset_state();
    if (!estimate) {
      Fix result = fix;
      result.fusion = sensors_alone();
      return result;
    }
    const bool taken = take_fix(fix, time);
    return result(time, fix, taken);
  }

  DeadReckoningOptions options;
  SensorMounting mounting;
  StandstillDetector standstill;
  InitialAttitude initial_attitude;
  VehicleConstraints constraints;
  std::optional<InertialEstimate> estimate;
  bool navigating = false, is_stationary = false;
  std::optional<GpsTime> last_reading, last_constraint, last_velocity;
  UpdateState horizontal, vertical;
  std::optional<double> fix_speed_mps;
  std::array<double, 2> moved_m{};  // since the last checked fix, for horizontal and vertical
  bool has_space_variance = false;
  Vector3d space_variance = Vector3d::Zero();  // east, north, up
  std::optional<Vector3d> gravity_at;
  Vector3d gravity_mps2 = Vector3d::Zero();
  // Integrals of the motion since the last prediction of the covariance.
  Vector3d force = Vector3d::Zero(), rate = Vector3d::Zero();
  double unpredicted_s = 0;
};

DeadReckoning::DeadReckoning(const DeadReckoningOptions& options, const SensorMounting& mounting)
    : state_(std::make_unique<State>(options, mounting)) {
  options::check(options, "dead reckoning");
}
DeadReckoning::~DeadReckoning() = default;
DeadReckoning::DeadReckoning(DeadReckoning&&) noexcept = default;
DeadReckoning& DeadReckoning::operator=(DeadReckoning&&) noexcept = default;

Fix DeadReckoning::update(GpsTime time, const SensorReadings& readings, const Fix& fix) {
  return state_->update(time, readings, fix);
}

}  // namespace canyon::positioning
