#include "canyon/receiver/fix.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/receiver/atmosphere.hpp"

namespace canyon::receiver {
namespace {

using geodesy::kSpeedOfLight;
using orbit::SatelliteId;
using orbit::System;

/// Mask and atmosphere wait until the last step was below this: Newton's next error is then about 5 m, 1e-6
/// rad of elevation.
constexpr double kPlaceKnown_m = 1e4;
/// After so many looks a satellite below the mask is gone for good, so that one at the mask's edge, which
/// moves the position when it comes or goes, cannot keep the iteration from settling.
constexpr int kMaskLooks = 3;
/// Where receivers may be: check_geodetic()'s lower bound, and the edge of space, below every mirrored root.
constexpr double kLowest_m = -1e4;
constexpr double kHighest_m = 1e5;
constexpr double kEarthRadius_m = 6.371e6;
/// Beyond every orbit: an iteration that got there does not come back.
constexpr double kAstray_m = 1e9;
/// Pivots below this part of the largest count as zero.
constexpr double kRankThreshold = 1e-6;
/// While still far from the place only an exactly degenerate geometry stops the iteration.
constexpr double kWorkingThreshold = 1e-13;

/// Largest error of a satellite's clock over which its state is carried. GPS lets them grow to 1 ms.
constexpr double kCarried_s = 1.2e-3;

/// The state `dt_s` later, |dt_s| <= kCarried_s, where asking the sky again would cost half of a fix.
/// Two-body acceleration in the rotating frame; what it leaves out (J2, 1e-4 of it) is below 1e-9 m and 1e-6
/// m/s.
void carry(orbit::SatelliteState& state, double dt_s) {
  constexpr double kGravity = 3.986005e14;  // [m^3/s^2], IS-GPS-200 table 20-IV
  const Eigen::Vector3d omega(0, 0, geodesy::kEarthRotationRate);
  const double radius = state.position_m.norm();
  const Eigen::Vector3d acceleration = -kGravity / (radius * radius * radius) * state.position_m -
                                       2 * omega.cross(state.velocity_mps) -
                                       omega.cross(omega.cross(state.position_m));
  state.position_m += (state.velocity_mps + acceleration * (dt_s / 2)) * dt_s;
  state.velocity_mps += acceleration * dt_s;
  state.clock_bias_s += state.clock_drift * dt_s;
}

/// A measured satellite with its state at transmission; what depends on the receiver's place is renewed in
/// each iteration.
struct Candidate {
  const Measurement* measured = nullptr;
  orbit::SatelliteState state;  ///< ECEF of the transmission instant
  double pseudorange_m = 0;     ///< cleaned of the satellite's clock, minus Solver::offset_m
  double flight_time_s = 0.07;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();   ///< in the axes of reception
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< unit, receiver to satellite
  double range_m = 0;
  double atmosphere_m = 0;
  bool above_mask = true;
  bool active = false;  ///< above the mask and not alone in its constellation
};

class Solver {
 public:
  Solver(geodesy::GpsTime receiver_time, const std::vector<Measurement>& measurements, const orbit::Sky& sky,
         const FixOptions& options, const std::map<System, orbit::Klobuchar>& klobuchar,
         const Eigen::Vector3d& start)
      : receiver_time_(receiver_time), options_(options), klobuchar_(klobuchar), position_(start) {
    collect(measurements, sky);
  }

  Fix solve() {
    const Fix fix = attempt();
    if (fix.solved() || fix.iterations == 0) return fix;
    // With few satellites Newton may run to the mirrored solution or away; the ground below the satellites is
    // a safer place to begin. (2000 sets of four satellites: the Earth's centre led 9 astray, both together
    // 1, with a GDOP of 744.)
    position_.setZero();
    for (const Candidate& candidate : candidates_) position_ += candidate.state.position_m.normalized();
    if (!(position_.norm() > 0)) return fix;
    position_ *= kEarthRadius_m / position_.norm();
    clock_m_.fill(0);
    for (Candidate& candidate : candidates_) {
      candidate.above_mask = true;
      candidate.atmosphere_m = 0;
    }
    const Fix again = attempt();
    return !again.solved() && fix.status == FixStatus::Singular ? fix : again;
  }

 private:
  Fix attempt() {
    Fix fix;
    double step = std::numeric_limits<double>::infinity();
    bool place_known = false;
    int looks = 0;
    while (fix.iterations < options_.max_iterations) {
      place_known = place_known || step < kPlaceKnown_m;
      if (place_known) look_up(looks++ >= kMaskLooks);
      if (!choose(fix)) return fix;
      ++fix.iterations;
      step = iterate(fix);
      if (fix.status == FixStatus::Singular) return fix;
      if (!(position_.norm() < kAstray_m)) {
        fix.status = FixStatus::NotConverged;
        return fix;
      }
      // Mask and atmosphere were looked up where this step began, less than convergence_m away.
      if (place_known && step < options_.convergence_m) {
        fix.status = FixStatus::Fix;
        break;
      }
    }
    // A weak geometry magnifies the rounding of ranges (about 1e-8 m) above the criterion: settled all the
    // same.
    if (fix.status != FixStatus::Fix && place_known && step < 1 && fix.rank == fix.unknowns &&
        step < 1e-8 * std::sqrt(weighted_cofactor().trace()) / smallest_sigma_m_) {
      fix.status = FixStatus::Fix;
    }
    finish(fix);
    return fix;
  }

  void collect(const std::vector<Measurement>& measurements, const orbit::Sky& sky) {
    candidates_.reserve(measurements.size());
    for (const Measurement& m : measurements) {
      check(m);
      const geodesy::GpsTime shown = receiver_time_ - m.pseudorange_m / kSpeedOfLight;
      std::optional<orbit::SatelliteState> state = sky.state(m.id, shown);
      if (!state) continue;
      const double clock_s = state->clock_bias_s - state->group_delay_s;
      if (std::abs(clock_s) <= kCarried_s) {
        carry(*state, -clock_s);
      } else if (!(state = sky.state(m.id, shown - clock_s))) {
        continue;
      }
      Candidate candidate;
      candidate.measured = &m;
      candidate.state = *state;
      candidate.pseudorange_m =
          m.pseudorange_m + kSpeedOfLight * (state->clock_bias_s - state->group_delay_s);
      candidates_.push_back(candidate);
    }
    std::sort(candidates_.begin(), candidates_.end(),
              [](const Candidate& a, const Candidate& b) { return a.measured->id < b.measured->id; });
    for (std::size_t i = 1; i < candidates_.size(); ++i) {
      if (candidates_[i].measured->id == candidates_[i - 1].measured->id) {
        throw InputError(fmt::format("satellite {} is measured twice at one epoch",
                                     orbit::to_string(candidates_[i].measured->id)),
                         "give one L1-band pseudorange for each satellite");
      }
    }
    // A large receiver clock bias would cost digits in every residual.
    if (!candidates_.empty()) offset_m_ = candidates_.front().pseudorange_m;
    for (Candidate& candidate : candidates_) candidate.pseudorange_m -= offset_m_;
  }

  static void check(const Measurement& m) {
    const char* bad = nullptr;
    if (!std::isfinite(m.pseudorange_m) || std::abs(m.pseudorange_m) > 1e12) bad = "pseudorange_m";
    if (!(m.sigma_m > 0) || !std::isfinite(m.sigma_m)) bad = "sigma_m";
    if (m.doppler_hz) {
      if (!std::isfinite(*m.doppler_hz)) bad = "doppler_hz";
      if (!(m.doppler_sigma_hz > 0) || !std::isfinite(m.doppler_sigma_hz)) bad = "doppler_sigma_hz";
      if (!(m.carrier_frequency_hz > 0) || !std::isfinite(m.carrier_frequency_hz))
        bad = "carrier_frequency_hz";
    }
    if (bad != nullptr) {
      throw InputError(fmt::format("{} of satellite {} is not usable", bad, orbit::to_string(m.id)),
                       "pseudoranges and Doppler must be finite, sigmas and frequencies finite and above 0");
    }
  }

  /// Mask and atmosphere at the iterated position.
  void look_up(bool settled) {
    const geodesy::Geodetic place = geodesy::geodetic_from_ecef(position_);
    const Eigen::Matrix3d enu_from_ecef = geodesy::enu_from_ecef_rotation(place);
    const double sine_of_mask = std::sin(options_.elevation_mask_rad);
    for (Candidate& candidate : candidates_) {
      candidate.direction = (candidate.position - position_).normalized();
      const Eigen::Vector3d enu = enu_from_ecef * candidate.direction;
      const bool above = enu.z() >= sine_of_mask;
      candidate.above_mask = above && (candidate.above_mask || !settled);
      if (!above || !(options_.correct_ionosphere || options_.correct_troposphere)) continue;
      const geodesy::AzimuthElevation look = geodesy::azimuth_elevation_from_enu(enu);
      const Measurement& m = *candidate.measured;
      candidate.atmosphere_m = 0;
      if (options_.correct_ionosphere) {
        candidate.atmosphere_m +=
            klobuchar_delay_m(klobuchar_of(klobuchar_, m.id.system), receiver_time_, place, look.azimuth_rad,
                              look.elevation_rad, candidate.state.carrier_frequency_hz);
      }
      if (options_.correct_troposphere) {
        candidate.atmosphere_m += saastamoinen_delay_m(place, look.elevation_rad);
      }
    }
  }

  /// Satellites and clocks of the next step; false, with the status, where they are too few.
  bool choose(Fix& fix) {
    std::array<int, orbit::kSystemCount> count{};
    fix.available = 0;
    for (const Candidate& candidate : candidates_) {
      if (!candidate.above_mask) continue;
      ++count[static_cast<std::size_t>(candidate.measured->id.system)];
      ++fix.available;
    }
    clocks_ = 0;
    for (std::size_t system = 0; system < orbit::kSystemCount; ++system) {
      column_[system] = count[system] >= 2 ? 3 + clocks_++ : -1;
    }
    rows_ = 0;
    for (Candidate& candidate : candidates_) {
      candidate.active = candidate.above_mask && column_of(candidate) >= 0;
      if (candidate.active) ++rows_;
    }
    fix.unknowns = 3 + std::max(clocks_, 1);
    if (rows_ >= options_.min_satellites + std::max(clocks_, 1) - 1) return true;
    fix.status = FixStatus::TooFewSatellites;
    fix.rank = 0;
    return false;
  }

  [[nodiscard]] int column_of(const Candidate& candidate) const {
    return column_[static_cast<std::size_t>(candidate.measured->id.system)];
  }

  void place(Candidate& candidate) const {
    candidate.position = orbit::rotate_earth(candidate.state.position_m, candidate.flight_time_s);
    const Eigen::Vector3d towards = candidate.position - position_;
    candidate.range_m = towards.norm();
    candidate.direction = towards / candidate.range_m;
    // Converges along with the position: 1e-6 m of range turn the Earth by 1e-11 m.
    candidate.flight_time_s = candidate.range_m / kSpeedOfLight;
  }

  /// One Gauss-Newton step; its length [m].
  double iterate(Fix& fix) {
    design_.setZero(rows_, 3 + clocks_);
    residual_.resize(rows_);
    smallest_sigma_m_ = std::numeric_limits<double>::infinity();
    int row = 0;
    for (Candidate& candidate : candidates_) {
      place(candidate);
      if (!candidate.active) continue;
      const double sigma = candidate.measured->sigma_m;
      smallest_sigma_m_ = std::min(smallest_sigma_m_, sigma);
      const int column = column_of(candidate);
      design_.row(row).head<3>() = -candidate.direction.transpose() / sigma;
      design_(row, column) = 1 / sigma;
      residual_(row) = (candidate.pseudorange_m - candidate.range_m - candidate.atmosphere_m -
                        clock_m_[static_cast<std::size_t>(candidate.measured->id.system)]) /
                       sigma;
      ++row;
    }
    qr_.compute(design_);
    qr_.setThreshold(kRankThreshold);
    fix.rank = static_cast<int>(qr_.rank());
    qr_.setThreshold(kWorkingThreshold);
    if (qr_.rank() < fix.unknowns) {
      fix.status = FixStatus::Singular;
      return 0;
    }
    const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 8, 1> dx = qr_.solve(residual_);
    residual_ -= design_ * dx;
    position_ += dx.head<3>();
    for (std::size_t system = 0; system < orbit::kSystemCount; ++system) {
      if (column_[system] >= 0) clock_m_[system] += dx(column_[system]);
    }
    return dx.norm();
  }

  /// (A^T W A)^-1 of the last step [m^2].
  [[nodiscard]] Cofactor weighted_cofactor() const {
    const Eigen::Index unknowns = design_.cols();
    const Cofactor r = qr_.matrixQR().topRows(unknowns);
    Cofactor inverse = Cofactor::Identity(unknowns, unknowns);
    r.triangularView<Eigen::Upper>().solveInPlace(inverse);
    const Cofactor permuted = qr_.colsPermutation() * inverse;
    return permuted * permuted.transpose();
  }

  void finish(Fix& fix) {
    if (fix.status == FixStatus::Fix && fix.rank < fix.unknowns) fix.status = FixStatus::Singular;
    if (fix.status == FixStatus::NotSolved) {
      fix.status = fix.rank < fix.unknowns ? FixStatus::Singular : FixStatus::NotConverged;
    }
    if (!fix.solved()) return;
    const geodesy::Geodetic place = geodesy::geodetic_from_ecef(position_);
    if (!(place.height_m >= kLowest_m && place.height_m <= kHighest_m)) {
      fix.status = FixStatus::NotConverged;
      return;
    }
    fix.position_ecef = position_;
    fix.position = place;
    const Eigen::Matrix3d enu_from_ecef = geodesy::enu_from_ecef_rotation(place);

    const Cofactor weighted = weighted_cofactor();
    fix.covariance_enu = enu_from_ecef * weighted.topLeftCorner<3, 3>() * enu_from_ecef.transpose();
    Design unit = design_;
    int row = 0;
    for (const Candidate& candidate : candidates_) {
      if (!candidate.active) continue;
      const double sigma = candidate.measured->sigma_m;
      fix.used.push_back(candidate.measured->id);
      fix.residuals_m.push_back(residual_(row) * sigma);
      unit.row(row) *= sigma;
      ++row;
    }
    if (const std::optional<Cofactor> q = cofactor(unit, kRankThreshold)) {
      Cofactor enu = *q;
      enu.topLeftCorner<3, 3>() = enu_from_ecef * q->topLeftCorner<3, 3>() * enu_from_ecef.transpose();
      fix.dop = dop_from_cofactor(enu);
    }
    for (const System system : orbit::kAllSystems) {
      const auto index = static_cast<std::size_t>(system);
      if (column_[index] >= 0) fix.clock_bias_s[system] = (clock_m_[index] + offset_m_) / kSpeedOfLight;
    }
    solve_velocity(fix, enu_from_ecef);
  }

  /// Doppler D = -(f/c) dP/dT. With T' = 1 + d, d the receiver clock's drift, and the light-time equation
  /// derived once, range rate r' = e.(V - v) / g, g = 1 + e.(V + omega x S)/c:
  ///   -lambda D = r' + (1 + lambda D / c) c d - c d_sat,
  /// linear in v and d.
  void solve_velocity(Fix& fix, const Eigen::Matrix3d& enu_from_ecef) const {
    const auto rows = std::count_if(candidates_.begin(), candidates_.end(), [](const Candidate& candidate) {
      return candidate.active && candidate.measured->doppler_hz;
    });
    if (rows < 4) return;
    Eigen::Matrix<double, Eigen::Dynamic, 4> design(rows, 4);
    Eigen::VectorXd rate(rows);
    const Eigen::Vector3d omega(0, 0, geodesy::kEarthRotationRate);
    int row = 0;
    for (const Candidate& candidate : candidates_) {
      if (!candidate.active || !candidate.measured->doppler_hz) continue;
      const Measurement& m = *candidate.measured;
      const double wavelength = kSpeedOfLight / m.carrier_frequency_hz;
      const double sigma = wavelength * m.doppler_sigma_hz;
      const Eigen::Vector3d satellite =
          orbit::rotate_earth(candidate.state.velocity_mps, candidate.flight_time_s);
      const double g =
          1 + candidate.direction.dot(satellite + omega.cross(candidate.position)) / kSpeedOfLight;
      const double measured = -wavelength * *m.doppler_hz;
      design.row(row).head<3>() = -candidate.direction.transpose() / (g * sigma);
      design(row, 3) = (1 - measured / kSpeedOfLight) / sigma;
      rate(row) =
          (measured - candidate.direction.dot(satellite) / g + kSpeedOfLight * candidate.state.clock_drift) /
          sigma;
      ++row;
    }
    Eigen::ColPivHouseholderQR<Eigen::Matrix<double, Eigen::Dynamic, 4>> qr(design);
    qr.setThreshold(kRankThreshold);
    if (qr.rank() < 4) return;
    const Eigen::Vector4d x = qr.solve(rate);
    const Eigen::Matrix4d r = qr.matrixQR().topRows<4>();
    Eigen::Matrix4d inverse = Eigen::Matrix4d::Identity();
    r.triangularView<Eigen::Upper>().solveInPlace(inverse);
    const Eigen::Matrix4d permuted = qr.colsPermutation() * inverse;
    const Eigen::Matrix4d covariance = permuted * permuted.transpose();
    fix.velocity_enu_mps = enu_from_ecef * x.head<3>();
    fix.velocity_covariance_enu =
        enu_from_ecef * covariance.topLeftCorner<3, 3>() * enu_from_ecef.transpose();
    fix.clock_drift = x(3) / kSpeedOfLight;
  }

  geodesy::GpsTime receiver_time_;
  const FixOptions& options_;
  const std::map<System, orbit::Klobuchar>& klobuchar_;
  Eigen::Vector3d position_;
  std::vector<Candidate> candidates_;
  double offset_m_ = 0;
  std::array<double, orbit::kSystemCount> clock_m_{};  ///< receiver minus system, minus offset_m_
  std::array<int, orbit::kSystemCount> column_{};      ///< of each system's clock; -1 without
  int clocks_ = 0;
  int rows_ = 0;
  double smallest_sigma_m_ = 1;
  Design design_;             ///< weighted
  Eigen::VectorXd residual_;  ///< weighted; after a step what it leaves
  Eigen::ColPivHouseholderQR<Design> qr_;
};

}  // namespace

std::string_view name(FixStatus status) {
  return status == FixStatus::Fix ? "fix" : "no fix";
}

std::string_view reason(FixStatus status) {
  switch (status) {
    case FixStatus::NotSolved:
      return "not solved";
    case FixStatus::Fix:
      return "solved";
    case FixStatus::TooFewSatellites:
      return "too few satellites";
    case FixStatus::Singular:
      return "satellite geometry does not determine a position";
    case FixStatus::NotConverged:
      return "least squares found no place near the ground";
    case FixStatus::NoSignal:
      break;
  }
  return "antenna inside a building or under the terrain";
}

void FixOptions::validate() const {
  if (!(elevation_mask_rad >= 0 && elevation_mask_rad < geodesy::kPi / 2)) {
    throw InputError(fmt::format("elevation_mask_rad is {} ({} deg)", elevation_mask_rad,
                                 geodesy::degrees(elevation_mask_rad)),
                     "it must lie within 0 and 90 deg, 90 excluded");
  }
  if (min_satellites < 4) {
    throw InputError(fmt::format("min_satellites is {}", min_satellites),
                     "a position and a clock need at least 4");
  }
  if (max_iterations < 5 || max_iterations > 1000) {
    throw InputError(fmt::format("max_iterations is {}", max_iterations), "it must lie within 5 and 1000");
  }
  if (!(convergence_m > 0 && convergence_m <= 1)) {
    throw InputError(fmt::format("convergence_m is {}", convergence_m), "it must lie above 0 and up to 1 m");
  }
}

const orbit::Klobuchar& klobuchar_of(const std::map<System, orbit::Klobuchar>& klobuchar, System system) {
  auto found = klobuchar.find(system);
  if (found == klobuchar.end()) found = klobuchar.find(System::GPS);
  if (found == klobuchar.end()) {
    throw InputError(
        fmt::format("no Klobuchar coefficients for {}, nor GPS's, are known", orbit::name(system)),
        "give a navigation file whose header has them (GPSA and GPSB), or switch the ionosphere off");
  }
  return found->second;
}

Fix solve_fix(geodesy::GpsTime receiver_time, const std::vector<Measurement>& measurements,
              const orbit::Sky& sky, const FixOptions& options,
              const std::map<System, orbit::Klobuchar>& klobuchar, const Eigen::Vector3d& start) {
  options.validate();
  if (!start.allFinite()) {
    throw InputError("the initial position of the fix is not finite", "the Earth's centre (0, 0, 0) works");
  }
  return Solver(receiver_time, measurements, sky, options, klobuchar, start).solve();
}

}  // namespace canyon::receiver
