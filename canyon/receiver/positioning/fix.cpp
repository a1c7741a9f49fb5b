#include "canyon/receiver/positioning/fix.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/receiver/positioning/pseudorange_model.hpp"

namespace canyon::positioning {
namespace {

using geodesy::kSpeedOfLight;
using gnss::System;

/// Mask and atmosphere apply from this accuracy on: Newton's next error is about 5 m, 1e-6 rad of elevation.
constexpr double kPositionKnown_m = 1e4;
/// Mask and atmosphere are updated after this motion: delays change by 1e-8 m over it.
constexpr double kLookedUp_m = 0.01;
constexpr double kEarthRadius_m = 6.371e6;
/// Radius beyond every orbit: an iteration beyond it does not return.
constexpr double kAstray_m = 1e9;
/// Far from the solution only an exactly degenerate geometry stops the iteration.
constexpr double kWorkingThreshold = 1e-13;

class Solver {
 public:
  Solver(geodesy::GpsTime receiver_time, const std::vector<RangedSatellite>& satellites,
         const FixOptions& options, const std::map<System, gnss::Klobuchar>& klobuchar,
         const Eigen::Vector3d& start)
      : receiver_time_(receiver_time), options_(options), klobuchar_(klobuchar), position_(start) {
    satellites_ = satellites;
    // A large receiver clock bias would cost digits in all residuals.
    if (!satellites_.empty()) offset_m_ = satellites_.front().pseudorange_m;
    for (RangedSatellite& satellite : satellites_) satellite.pseudorange_m -= offset_m_;
  }

  Fix solve() {
    Fix fix = locate();
    if (fix.solved() && options_.raim.enabled) fix = monitor(std::move(fix));
    return fix;
  }

  /// At a position from another method, with the satellites that RAIM keeps.
  Fix at(const Eigen::Vector3d& geodetic) {
    Fix fix, own = solve();
    fix.consistent = own.consistent;
    fix.excluded = std::move(own.excluded);
    position_ = geodetic;
    for (RangedSatellite& satellite : satellites_) {
      satellite.excluded = std::count(fix.excluded.begin(), fix.excluded.end(), satellite.measured->id) > 0;
      for (int i = 0; i < 3; ++i) update_satellite_geometry(satellite, geodetic);
    }
    look_up(satellites_, geodetic, receiver_time_, options_, klobuchar_);
    if (!choose(fix)) return fix;
    iterate(fix, true);
    if (fix.status == FixStatus::Singular) return fix;
    fix.status = FixStatus::Fix;
    finish(fix);
    return fix;
  }

 private:
  Fix locate() {
    if (position_.norm() > kEarthRadius_m / 2) {
      const Eigen::Vector3d start = position_;
      if (Fix fix = attempt(true); fix.solved()) return fix;
      begin_at(start);
    }
    Fix fix = attempt(false);
    if (fix.solved() || fix.status == FixStatus::WeakGeometry || fix.iterations == 0) return fix;
    // With few satellites Newton may converge to the mirrored solution or diverge; the ground below the
    // satellites is a safer start. (2000 sets of four satellites: 9 failures from the Earth's centre, 1 with
    // both, with a GDOP of 744.)
    Eigen::Vector3d below = Eigen::Vector3d::Zero();
    for (const RangedSatellite& satellite : satellites_) below += satellite.state.position_m.normalized();
    if (!(below.norm() > 0)) return fix;
    begin_at(below * (kEarthRadius_m / below.norm()));
    const Fix again = attempt(false);
    return !again.solved() && fix.status == FixStatus::Singular ? fix : again;
  }

  void begin_at(const Eigen::Vector3d& position) {
    position_ = position;
    clock_m_.fill(0);
    forget_looks();
  }
  void forget_looks() {
    for (RangedSatellite& satellite : satellites_) {
      satellite.above_mask = true;
      satellite.space_m = 0;
    }
  }

  /// @param position_known the position is near that of the fix
  Fix attempt(bool position_known) {
    Fix fix;
    double step = std::numeric_limits<double>::infinity();
    const Eigen::Vector3d unknown = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
    Eigen::Vector3d looked_at = unknown;
    const auto is_looked_up = [&] { return (position_ - looked_at).norm() < kLookedUp_m; };
    int looks = 0;
    while (fix.iterations < options_.max_iterations) {
      if (position_known && !is_looked_up()) {
        for (RangedSatellite& satellite : satellites_)
          for (int i = 0; i < 2; ++i) update_satellite_geometry(satellite, position_);
        look_up(satellites_, position_, receiver_time_, options_, klobuchar_, looks++);
        looked_at = position_;
      }
      if (!choose(fix)) return fix;
      ++fix.iterations;
      const Eigen::Vector3d before = position_;
      step = iterate(fix);
      if (fix.status == FixStatus::Singular) return fix;
      const bool near = (position_ - before).norm() < kPositionKnown_m;
      if (!(position_.norm() < kAstray_m)) {
        fix.status = FixStatus::NotConverged;
        return fix;
      }
      if (step < options_.convergence_m && is_looked_up()) {
        fix.status = FixStatus::Fix;
        break;
      }
      position_known = near;
      if (near || looks == 0) continue;
      forget_looks();
      looked_at = unknown;
      looks = 0;
    }
    // A weak geometry amplifies the rounding of ranges (about 1e-8 m) above the criterion: it has converged.
    if (fix.status != FixStatus::Fix && position_known && step < 1 && fix.rank == fix.unknowns &&
        step < 1e-8 * std::sqrt(least_squares_.cofactor().trace()) / smallest_sigma_m_)
      fix.status = FixStatus::Fix;
    finish(fix);
    return fix;
  }

  /// Satellites and clocks of the next step; returns false and sets the status if they are too few.
  bool choose(Fix& fix) {
    std::array<int, gnss::kSystemCount> count{};
    fix.available = 0;
    for (const RangedSatellite& satellite : satellites_) {
      if (!satellite.above_mask) continue;
      ++fix.available;
      if (!satellite.excluded) ++count[static_cast<std::size_t>(satellite.measured->id.system)];
    }
    clocks_ = clocks_of(count);
    active_.clear();
    for (RangedSatellite& satellite : satellites_)
      if (satellite.above_mask && !satellite.excluded && column_of(satellite) >= 0)
        active_.push_back(&satellite);
    rows_ = static_cast<int>(active_.size());
    if (options_.weights.weighting == Weighting::Equal) weigh_equally();
    fix.unknowns = 3 + std::max(clocks_.count, 1);
    if (enough_satellites(rows_, clocks_.count, options_)) return true;
    fix.status = FixStatus::TooFewSatellites;
    fix.rank = 0;
    return false;
  }

  /// Sets all sigmas to their rms, so that the covariance is that of the measurements.
  void weigh_equally() {
    double sum = 0;
    for (const RangedSatellite* satellite : active_)
      sum += satellite->measured->sigma_m * satellite->measured->sigma_m;
    for (RangedSatellite* satellite : active_) satellite->sigma_m = std::sqrt(sum / rows_);
  }

  [[nodiscard]] int column_of(const RangedSatellite& satellite) const {
    return clocks_.column[static_cast<std::size_t>(satellite.measured->id.system)];
  }

  /// The satellite of a row of the design.
  [[nodiscard]] const RangedSatellite& active(Eigen::Index row) const {
    return *active_[static_cast<std::size_t>(row)];
  }

  /// One Gauss-Newton step; returns its length [m]. @param clocks_alone keeps the position
  double iterate(Fix& fix, bool clocks_alone = false) {
    design_.setZero(rows_, 3 + clocks_.count);
    residual_.resize(rows_);
    smallest_sigma_m_ = std::numeric_limits<double>::infinity();
    // Flight time and position converge together: 1e-6 m of range rotate the Earth by 1e-11 m.
    for (RangedSatellite& satellite : satellites_) update_satellite_geometry(satellite, position_);
    for (Eigen::Index row = 0; row < rows_; ++row) {
      const RangedSatellite& satellite = active(row);
      const double sigma = satellite.sigma_m;
      smallest_sigma_m_ = std::min(smallest_sigma_m_, sigma);
      const int column = column_of(satellite);
      design_.row(row).head<3>() = -satellite.direction.transpose() / sigma;
      design_(row, column) = 1 / sigma;
      residual_(row) = (satellite.pseudorange_m - satellite.range_m - satellite.space_m -
                        clock_m_[static_cast<std::size_t>(satellite.measured->id.system)]) /
                       sigma;
    }
    least_squares_.compute(design_);
    fix.rank = static_cast<int>(least_squares_.rank(kRankThreshold));
    if (least_squares_.rank(kWorkingThreshold) < fix.unknowns) {
      fix.status = FixStatus::Singular;
      return 0;
    }
    auto dx = least_squares_.solve(residual_);
    if (clocks_alone) {
      dx.head<3>().setZero();
      dx.tail(clocks_.count) = LeastSquares(design_.rightCols(clocks_.count)).solve(residual_);
    }
    residual_ -= design_ * dx;
    position_ += dx.head<3>();
    for (std::size_t system = 0; system < gnss::kSystemCount; ++system)
      if (clocks_.column[system] >= 0) clock_m_[system] += dx(clocks_.column[system]);
    return dx.norm();
  }

  void finish(Fix& fix) {
    if (fix.status == FixStatus::Fix && fix.rank < fix.unknowns) fix.status = FixStatus::Singular;
    if (fix.status == FixStatus::NotSolved)
      fix.status = fix.rank < fix.unknowns ? FixStatus::Singular : FixStatus::NotConverged;
    if (!fix.solved()) return;
    const geodesy::Geodetic geodetic = geodesy::geodetic_from_ecef(position_);
    if (!is_near_ground(geodetic.height_m)) {
      fix.status = FixStatus::NotConverged;
      return;
    }
    Design unit = design_;
    for (Eigen::Index row = 0; row < rows_; ++row) unit.row(row) *= active(row).sigma_m;
    const Eigen::Matrix3d enu_from_ecef = geodesy::enu_from_ecef_rotation(geodetic);
    if (const std::optional<Cofactor> q = cofactor(unit, kRankThreshold)) {
      Cofactor enu = *q;
      enu.topLeftCorner<3, 3>() = geodesy::rotated(enu_from_ecef, q->topLeftCorner<3, 3>());
      fix.dop = dop_from_cofactor(enu);
    }
    if (!strong_enough(fix.dop, options_)) {
      fix.dop.reset();
      fix.status = FixStatus::WeakGeometry;
      return;
    }
    fix.position_ecef = position_;
    fix.position = geodetic;
    Rows fractions(rows_);
    for (Eigen::Index row = 0; row < rows_; ++row)
      fractions(row) = active(row).measured->reported_sigma_ratio;
    const bool corrected = (fractions.array() != 1).any();
    const Cofactor covariance = corrected ? least_squares_.covariance(fractions) : least_squares_.cofactor();
    fix.covariance_enu = geodesy::rotated(enu_from_ecef, covariance.topLeftCorner<3, 3>());
    if (options_.covariance_by_residuals) {
      fix.covariance_enu *=
          excess_variance(residual_.cwiseQuotient(fractions).squaredNorm(), rows_ - fix.unknowns);
      add_ionosphere(enu_from_ecef, fix);
    }
    fix.used.reserve(active_.size());
    fix.residuals_m.reserve(active_.size());
    for (Eigen::Index row = 0; row < rows_; ++row) {
      fix.used.push_back(active(row).measured->id);
      fix.residuals_m.push_back(residual_(row) * active(row).sigma_m);
    }
    for (const System system : gnss::kConstellations) {
      const auto index = static_cast<std::size_t>(system);
      if (clocks_.column[index] >= 0)
        fix.clock_bias_s[system] = (clock_m_[index] + offset_m_) / kSpeedOfLight;
    }
    solve_velocity(fix, enu_from_ecef);
  }

  /// Adds the motion of the fix to the covariance if all delays of the ionosphere are wrong by the same
  /// fraction: residuals do not contain it.
  void add_ionosphere(const Eigen::Matrix3d& enu_from_ecef, Fix& fix) {
    Rows delays(rows_);
    for (Eigen::Index row = 0; row < rows_; ++row)
      delays(row) = active(row).ionosphere_m / active(row).sigma_m;
    const auto moved = least_squares_.solve(delays);
    const Eigen::Vector3d enu = kIonosphereLeft * (enu_from_ecef * moved.head<3>());
    fix.covariance_enu += enu * enu.transpose();
  }

  /// RAIM's global test of the last step's residuals: their weighted squares are chi-square distributed with
  /// as many degrees as there are measurements above the unknowns. Empty without redundancy.
  [[nodiscard]] std::optional<bool> consistent(const Fix& fix) const {
    const int redundancy = rows_ - fix.unknowns;
    if (redundancy < 1) return std::nullopt;
    return residual_.squaredNorm() <= chi_square_quantile(options_.raim.false_alarm, redundancy);
  }

  /// Fault detection and exclusion (Kuusniemi 2005): while the global test fails, the satellite with the
  /// largest normalised residual is excluded. Once it passes, earlier exclusions are tried again, because
  /// they were made in the presence of other faults. With one redundant measurement all normalised residuals
  /// are equal, and identify no fault: exclusions that lead there and still do not agree are not supported by
  /// the data and are undone (docs/receiver.md has the measurement).
  Fix monitor(Fix fix) {
    fix.consistent = consistent(fix);
    if (fix.consistent != false) return fix;
    Fix all_in_view = fix;
    std::vector<RangedSatellite*> gone;
    while (fix.consistent == false && static_cast<int>(gone.size()) < options_.raim.max_exclusions) {
      if (rows_ - fix.unknowns < 2) return all_in_view;
      RangedSatellite* worst = worst_satellite();
      if (worst == nullptr) return all_in_view;
      worst->excluded = true;
      Fix next = attempt(true);
      if (!next.solved()) return all_in_view;
      gone.push_back(worst);
      next.consistent = consistent(next);
      fix = std::move(next);
    }
    if (fix.consistent != true && rows_ - fix.unknowns < 2) return all_in_view;
    if (fix.consistent == true) {
      for (std::size_t i = 0; i + 1 < gone.size(); ++i) {
        RangedSatellite* again = gone[i];
        again->excluded = false;
        position_ = fix.position_ecef;
        Fix next = attempt(true);
        if (next.solved() && (next.consistent = consistent(next)) == true)
          fix = std::move(next);
        else
          again->excluded = true;
      }
    }
    for (const RangedSatellite* satellite : gone)
      if (satellite->excluded) fix.excluded.push_back(satellite->measured->id);
    return fix;
  }

  /// The satellite with the largest normalised residual in the last step; null if none is redundant.
  [[nodiscard]] RangedSatellite* worst_satellite() {
    const std::optional<Eigen::Index> worst = largest_normalised_residual(design_, residual_);
    return worst ? active_[static_cast<std::size_t>(*worst)] : nullptr;
  }

  /// doppler_equation() of satellites over its deviation, and its solution for velocity and clock drift by
  /// normal equations: rates have few digits, and most of the solutions only select weights.
  struct Rates {
    std::array<gnss::SatelliteId, kMaxRows> ids;
    Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor, kMaxRows, 4> design;
    Rows rate, weight, residual;  // weight: of rows, on top
    Eigen::LDLT<Eigen::Matrix4d> normal;
    Eigen::Vector4d x;

    [[nodiscard]] int redundancy() const { return static_cast<int>((weight.array() > 0).count()) - 4; }
    [[nodiscard]] double squares() const { return residual.cwiseProduct(weight).squaredNorm(); }
    [[nodiscard]] bool solve() {
      if (redundancy() < 0) return false;
      Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
      Eigen::Vector4d right = Eigen::Vector4d::Zero();
      for (Eigen::Index k = 0; k < rate.size(); ++k) {
        const Eigen::Vector4d row = weight(k) * design.row(k);
        sum.noalias() += row * row.transpose();
        right += row * (weight(k) * rate(k));
      }
      normal.compute(sum);
      const Eigen::Vector4d pivots = normal.vectorD();
      if (!(pivots.minCoeff() > kRankThreshold * kRankThreshold * pivots.maxCoeff())) return false;
      x = normal.solve(right);
      residual.noalias() = rate - design * x;
      return true;
    }
  };

  [[nodiscard]] Rates rates() const {
    Rates all;
    const Eigen::Index rows = std::count_if(active_.begin(), active_.end(), [](const RangedSatellite* each) {
      return each->measured->doppler_hz.has_value();
    });
    all.design.resize(rows, 4);
    all.rate.resize(rows);
    all.weight.setOnes(rows);
    Eigen::Index row = 0;
    for (const RangedSatellite* each : active_) {
      const RangedSatellite& satellite = *each;
      if (!satellite.measured->doppler_hz) continue;
      const DopplerEquation doppler = doppler_equation(satellite);
      all.design.row(row).head<3>() = -satellite.direction.transpose() / (doppler.g * doppler.sigma_mps);
      all.design(row, 3) = (1 - doppler.measured_mps / kSpeedOfLight) / doppler.sigma_mps;
      all.rate(row) = (doppler.measured_mps - satellite.direction.dot(doppler.satellite_mps) / doppler.g +
                       kSpeedOfLight * satellite.state.clock_drift) /
                      doppler.sigma_mps;
      all.ids[static_cast<std::size_t>(row++)] = satellite.measured->id;
    }
    return all;
  }

  /// Removes satellites beyond `gate` of the scatter of the Dopplers around the velocity of least absolute
  /// residuals (iterated weights 1 / |r|), which outliers do not move. No change if too few would remain.
  static void leave_out_contradictions(Rates& rates, double gate) {
    constexpr int kWeighings = 15, kChoices = 3;
    Rates robust = rates;
    for (int i = 0; i < kWeighings; ++i) {
      robust.weight = robust.residual.cwiseAbs().cwiseMax(1).cwiseSqrt().cwiseInverse();
      if (!robust.solve()) return;
    }
    const auto rows = static_cast<double>(rates.rate.size());
    for (int i = 0; i < kChoices; ++i) {
      Rows sizes = robust.residual.cwiseAbs();
      const double scatter = kMadToSigma * upper_median(std::span(sizes.data(), sizes.data() + sizes.size()));
      const double widest = gate * std::max(1.0, scatter * std::sqrt(rows / (rows - 4)));
      robust.weight = (robust.residual.array().abs() < widest).cast<double>();
      if (robust.redundancy() < 1 || !robust.solve()) return;
    }
    rates = robust;
  }

  /// Velocity and clock drift by Dopplers of used satellites; if RAIM's global test fails, without outliers.
  void solve_velocity(Fix& fix, const Eigen::Matrix3d& enu_from_ecef) const {
    const auto contradict = [this](const Rates& by) {
      const int n = by.redundancy();
      return n > 0 && by.squares() > chi_square_quantile(options_.raim.false_alarm, n);
    };
    Rates all = rates();
    if (!all.solve()) return;
    if (contradict(all)) {
      leave_out_contradictions(all, std::sqrt(chi_square_quantile(options_.raim.false_alarm, 1)));
      for (Eigen::Index i = 0; i < all.weight.size(); ++i)
        if (all.weight(i) == 0) fix.excluded.push_back(all.ids[static_cast<std::size_t>(i)]);
    }
    fix.velocity_enu_mps = enu_from_ecef * all.x.head<3>();
    fix.velocity_covariance_enu = geodesy::rotated(
        enu_from_ecef, Eigen::Matrix4d(all.normal.solve(Eigen::Matrix4d::Identity())).topLeftCorner<3, 3>());
    if (options_.covariance_by_residuals || contradict(all))
      *fix.velocity_covariance_enu *= excess_variance(all.squares(), all.redundancy());
    fix.clock_drift = all.x(3) / kSpeedOfLight;
  }

  geodesy::GpsTime receiver_time_;
  const FixOptions& options_;
  const std::map<System, gnss::Klobuchar>& klobuchar_;
  Eigen::Vector3d position_;
  // Memory kept by each thread. active_: above the mask, not excluded, not alone in its constellation.
  static inline thread_local std::vector<RangedSatellite> satellites_;  // NOLINT(*-naming)
  static inline thread_local std::vector<RangedSatellite*> active_;     // NOLINT(*-naming)
  double offset_m_ = 0;
  std::array<double, gnss::kSystemCount> clock_m_{};  ///< receiver minus system, minus offset_m_
  Clocks clocks_;
  int rows_ = 0;
  double smallest_sigma_m_ = 1;
  Design design_;               ///< weighted
  Rows residual_;               ///< weighted; after a step the remaining residual
  LeastSquares least_squares_;  ///< of the last step; its cofactor is (A^T W A)^-1 [m^2]
};

}  // namespace

std::string_view name(FixStatus status) {
  return status == FixStatus::Fix ? "fix" : "no fix";
}

std::string_view reason(FixStatus status) {
  constexpr std::string_view kReasons[]{"not solved",
                                        "solved",
                                        "too few satellites",
                                        "satellite geometry does not determine a position",
                                        "least squares found no position near the ground",
                                        "satellite geometry is too weak",
                                        "antenna inside a building or under the terrain"};
  return kReasons[static_cast<std::size_t>(status)];
}

std::string_view name(FusionPhase phase) {
  constexpr std::array<std::string_view, 3> kNames{"initialising", "calibrating", "navigating"};
  return kNames.at(static_cast<std::size_t>(phase));
}

double Baseline::heading_rad() const {
  const double azimuth = std::atan2(vector_enu.x(), vector_enu.y());
  return azimuth < 0 ? azimuth + 2 * geodesy::kPi : azimuth;
}

double Baseline::pitch_rad() const {
  return std::atan2(vector_enu.z(), vector_enu.head<2>().norm());
}

double Baseline::heading_sigma_rad() const {
  const double length_m = vector_enu.head<2>().norm();
  const Eigen::Vector2d across = Eigen::Vector2d(vector_enu.y(), -vector_enu.x()) / length_m;
  const double variance = across.dot(covariance_enu.topLeftCorner<2, 2>() * across);
  return length_m > 0 ? std::sqrt(variance) / length_m : std::numeric_limits<double>::infinity();
}

void add_offset(Fix& fix, const Eigen::Vector3d& enu_m) {
  fix.position_ecef += geodesy::enu_from_ecef_rotation(fix.position).transpose() * enu_m;
  fix.position = geodesy::geodetic_from_ecef(fix.position_ecef);
}

std::optional<double> residual_m(const Fix& fix, gnss::SatelliteId id) {
  const auto at = std::lower_bound(fix.used.begin(), fix.used.end(), id);
  const auto index = static_cast<std::size_t>(at - fix.used.begin());
  if (!fix.solved() || at == fix.used.end() || *at != id || index >= fix.residuals_m.size()) return {};
  return fix.residuals_m[index];
}

Fix solve_fix(geodesy::GpsTime receiver_time, const std::vector<Measurement>& measurements,
              const orbit::Sky& sky, const FixOptions& options,
              const std::map<System, gnss::Klobuchar>& klobuchar, const Eigen::Vector3d& start) {
  options.validate();
  std::vector<RangedSatellite> satellites;
  range_satellites(receiver_time, measurements, sky, options, satellites);
  return solve_fix(receiver_time, satellites, options, klobuchar, start);
}

Fix solve_fix(geodesy::GpsTime receiver_time, const std::vector<RangedSatellite>& satellites,
              const FixOptions& options, const std::map<System, gnss::Klobuchar>& klobuchar,
              const Eigen::Vector3d& start) {
  if (!start.allFinite())
    throw InputError("the initial position of the fix is not finite",
                     "give a finite one; the Earth's centre (0, 0, 0) works");
  return Solver(receiver_time, satellites, options, klobuchar, start).solve();
}

Fix fix_at(const Eigen::Vector3d& point, geodesy::GpsTime receiver_time,
           const std::vector<Measurement>& measurements, const orbit::Sky& sky, const FixOptions& options,
           const std::map<System, gnss::Klobuchar>& klobuchar) {
  std::vector<RangedSatellite> satellites;
  range_satellites(receiver_time, measurements, sky, options, satellites);
  return Solver(receiver_time, satellites, options, klobuchar, point).at(point);
}

}  // namespace canyon::positioning
