#include "canyon/receiver/position_solver.hpp"

#include <Eigen/LU>
#include <cmath>
#include <utility>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/receiver/receiver.hpp"

namespace canyon::receiver {

namespace {

/// Positions contradict each other beyond this multiple of their common deviation.
constexpr double kContradict = 1.5;

/// Adds to the covariances of two positions of an epoch the part of their difference d that they do not
/// explain: (1 - kContradict^2 / m^2) d d^T, with m its horizontal length over their common deviation. Added
/// to both, since either of the two may be wrong.
void add_contradiction(positioning::Fix& a, positioning::Fix& b) {
  const Eigen::Vector3d d = geodesy::enu_from_ecef_rotation(b.position) * (a.position_ecef - b.position_ecef);
  const Eigen::Matrix2d covariance = (a.covariance_enu + b.covariance_enu).topLeftCorner<2, 2>();
  const double square = d.head<2>().dot(covariance.inverse() * d.head<2>());
  if (!(square > kContradict * kContradict)) return;
  const Eigen::Matrix3d more = (1 - kContradict * kContradict / square) * d * d.transpose();
  a.covariance_enu += more;
  b.covariance_enu += more;
}

}  // namespace

using Klobuchars = std::map<gnss::System, gnss::Klobuchar>;

PositionSolver::PositionSolver(const ReceiverOptions& options, const UserModels& models)
    : options_(options), models_(models), fix_(options.fix), corrections_(options.corrections) {
  if (models.sigma_m) fix_.weights.weighting = positioning::Weighting::Sigma;
  restart();
}

void PositionSolver::restart() {
  last_ecef_.setZero();
  corrections_ = CodeCorrections(options_.corrections);
  if (options_.filter.enabled) filter_.emplace(options_.filter, fix_);
  if (options_.rtk.enabled) rtk_.emplace(options_.rtk, fix_, options_.corrections.max_age_s);
}

void PositionSolver::take(const EpochContext& context, const orbit::Sky& sky) {
  if (context.corrections == nullptr) return;
  if (!context.corrections->moving) {
    const double apart_m = (context.corrections->station_ecef - context.antenna.position_ecef).norm();
    corrections_.take(
        *context.corrections, sky, fix_, context.klobuchar, options_.shared_error_m(),
        apart_m * std::hypot(options_.rtk.ionosphere_gradient, options_.rtk.troposphere_gradient));
  }
  if (rtk_) rtk_->take(*context.corrections, sky);
}

const CodeCorrections* PositionSolver::corrections(geodesy::GpsTime receiver_time) const {
  return corrections_.age_s(receiver_time) ? &corrections_ : nullptr;
}

/// The position by an epoch's measurements alone.
positioning::Fix PositionSolver::solve_alone(geodesy::GpsTime receiver_time,
                                             const std::vector<positioning::Measurement>& measurements,
                                             const orbit::Sky& sky, const Klobuchars& klobuchar) {
  if (!models_.solve || filter_)
    positioning::range_satellites(receiver_time, measurements, sky, fix_, ranged_);
  if (models_.solve) return models_.solve(receiver_time, measurements, sky, fix_, klobuchar);
  return solve_fix(receiver_time, ranged_, fix_, klobuchar, last_ecef_);
}

const positioning::Fix& PositionSolver::without_signal() {
  epoch_fix_ = {};
  epoch_fix_.status = positioning::FixStatus::NoSignal;
  return epoch_fix_;
}

positioning::Fix PositionSolver::solve(geodesy::GpsTime receiver_time, const SolverInput& measured,
                                       const orbit::Sky& sky, const Klobuchars& klobuchar) {
  positioning::Fix fix;
  if (!measured.corrected.empty()) fix = solve_alone(receiver_time, measured.corrected, sky, klobuchar);
  const bool differential = fix.solved();
  if (differential) {
    fix.solution = positioning::FixKind::Differential;
    fix.correction_age_s = corrections_.age_s(receiver_time);
    fix.correction_station = corrections_.station();
  } else {
    fix = solve_alone(receiver_time, measured.codes, sky, klobuchar);
  }
  if (fix.solved()) last_ecef_ = fix.position_ecef;
  epoch_fix_ = fix;
  if (filter_) fix = filter_->update(receiver_time, ranged_, fix, klobuchar);
  if (!rtk_) return fix;
  // The carrier-phase filter starts from the best position; the epoch's own velocity is new to it.
  positioning::Fix begin = fix;
  begin.velocity_enu_mps = epoch_fix_.velocity_enu_mps;
  begin.velocity_covariance_enu = epoch_fix_.velocity_covariance_enu;
  begin.used = epoch_fix_.used;
  begin.excluded = epoch_fix_.excluded;
  auto relative = rtk_->update(receiver_time, measured.signal_entries, sky, begin);
  if (!relative) return fix;
  // With echoes a float position may be worse than that of codes. Hysteresis: a factor of two in the
  // deviation prevents switching back and forth.
  constexpr double kWorse = 4;
  const bool better = relative->kind() == positioning::FixKind::Fixed || !fix.measured() ||
                      relative->covariance_enu.trace() < kWorse * fix.covariance_enu.trace();
  if (!relative->baseline->moving_base) {
    if (relative->kind() == positioning::FixKind::Float && fix.measured()) {
      add_contradiction(*relative, fix);
      relative->baseline->covariance_enu = relative->covariance_enu;
    }
    if (better) return *relative;
  }
  fix.baseline = std::move(relative->baseline);
  return fix;
}

}  // namespace canyon::receiver
