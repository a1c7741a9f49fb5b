// Declared in canyon/receiver/relative/baseline_filter.hpp.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/receiver/positioning/least_squares.hpp"
#include "canyon/receiver/relative/baseline_filter.hpp"

// Codes, phases and velocity as observations of BaselineFilter, which baseline_filter.hpp declares.

namespace canyon::relative {
namespace {

using Eigen::Index;
using positioning::Fix;

/// Before anything is known [m].
constexpr double kUnknownClock_m = 100, kUnknownAmbiguity_m = 30;
/// Phases of a direct signal are off by a quarter of a cycle at most, by echoes.
constexpr double kLeastSlip_cycles = 0.3;
/// Weight of an epoch in the mean square of innovations.
constexpr double kSquaresWeight = 0.1;
/// Errors of codes are the same for so long [s]: more epochs in that time add no information.
constexpr double kCodeTime_s = 1;
/// Deviation of a code over that of its phase: RTKLIB's stats-eratio1.
constexpr double kCodeRatio = 100;
/// Innovations beyond so many of their standard deviations: a code is left out, a phase has slipped.
constexpr double kGateSigmas = 4;

}  // namespace

SparseRow BaselineFilter::row_of(const Difference& d, bool phase) const {
  SparseRow row;
  for (Index i = 0; i < 3; ++i) row.add(BaselineState::kPosition + i, -d.rover->direction(i));
  row.add(BaselineState::kClock, 1);
  if (state_.p(BaselineState::kZenith, BaselineState::kZenith) > 0) {
    row.add(BaselineState::kZenith, 1 / std::max(0.05, std::sin(d.rover->elevation_rad)));
  }
  if (ionosphere_sigma_m_ > 0) {
    if (const auto slot = state_.find(d.id(), nullptr)) {
      row.add(BaselineState::index(*slot), (phase ? -1 : 1) * d.ionosphere_rate());
    }
  }
  if (phase && d.slot) row.add(BaselineState::index(*d.slot), d.rover->wavelength_m);
  return row;
}

std::vector<std::size_t> BaselineFilter::ordered(const std::vector<std::size_t>& group, bool phase) {
  state_.reset(BaselineState::kClock, 0, 0);
  std::vector<std::pair<double, std::size_t>> innovations;
  std::vector<double> values;
  for (const std::size_t i : group) {
    const Difference& d = differences_[i];
    if (phase && !d.slot) continue;
    const double value = phase ? d.phase_m : d.code_m;
    innovations.emplace_back(state_.innovation(row_of(d, phase), value, 0).value, i);
    values.push_back(innovations.back().first);
  }
  if (innovations.size() < 2) return {};
  const double middle = positioning::median(values);
  for (auto& [innovation, i] : innovations) innovation = std::abs(innovation - middle);
  std::sort(innovations.begin(), innovations.end());
  state_.reset(BaselineState::kClock, middle, kUnknownClock_m * kUnknownClock_m);
  std::vector<std::size_t> order;
  order.reserve(innovations.size());
  for (const auto& [innovation, i] : innovations) order.push_back(i);
  return order;
}

void BaselineFilter::take_codes() {
  int considered = 0, failed = 0;
  double sum = 0;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  const double repeats = dt_s_ > 0 ? std::max(1.0, kCodeTime_s / dt_s_) : 1;
  for (const auto& [signal, group] : groups_) {
    Eigen::Matrix3d squares_of = Eigen::Matrix3d::Zero();
    Eigen::Vector3d sum_of = Eigen::Vector3d::Zero();
    double weights = 0;
    for (const std::size_t i : ordered(group, false)) {
      const Difference& d = differences_[i];
      const SparseRow row = row_of(d, false);
      const double noise = d.variance * kCodeRatio * kCodeRatio + d.age_variance;
      const double normalised = std::abs(state_.innovation(row, d.code_m, noise).normalised());
      ++considered;
      sum += std::min(normalised * normalised, 25.0);
      if (normalised > kGateSigmas) {
        ++failed;
        continue;
      }
      state_.take(row, d.code_m, repeats * noise);
      const Eigen::Vector3d& e = d.rover->direction;
      weights += 1 / noise;
      sum_of += e / noise;
      squares_of += e * e.transpose() / noise;
    }
    if (weights > 0) information += squares_of - sum_of * sum_of.transpose() / weights;
  }
  state_.mirror();
  code_covariance_.setZero();
  if (information.determinant() > 1e-9) code_covariance_ = information.inverse();
  const auto redundant = considered - static_cast<int>(groups_.size()) - 3;
  if (redundant > 3) {
    code_squares_ += kSquaresWeight * (std::max(1.0, sum / redundant) - code_squares_);
  }
  if (2 * failed > considered && considered > 4) {
    if (!astray_since_) astray_since_ = time_;
    astray_ = time_ - *astray_since_ > 3;
  } else {
    astray_since_.reset();
    astray_ = false;
  }
}

double BaselineFilter::code_jump_m(const std::vector<std::size_t>& group) const {
  std::vector<double> jumps;
  for (const std::size_t i : group) {
    const Difference& d = differences_[i];
    if (!d.has_phase) continue;
    if (const auto slot = state_.find(d.id(), d.rover->signal)) {
      jumps.push_back(d.phase_m - d.code_m - d.rover->wavelength_m * state_.x(BaselineState::index(*slot)));
    }
  }
  const double jump_m = jumps.empty() ? 0 : positioning::median(jumps);
  return std::abs(jump_m) > kUnknownAmbiguity_m ? jump_m : 0;
}

void BaselineFilter::start_ambiguities(const std::vector<std::size_t>& group, double jump_m) {
  for (const std::size_t i : group) {
    Difference& d = differences_[i];
    if (!d.has_phase) continue;
    d.slot = state_.find(d.id(), d.rover->signal);
    if (d.slot) continue;
    const double cycles = (d.phase_m - d.code_m - jump_m) / d.rover->wavelength_m;
    d.slot = state_.add({d.id(), d.rover->signal, time_, time_, d.rover->phase_since, d.base_since,
                         d.half_cycle, 0, d.phase_m},
                        cycles, std::pow(kUnknownAmbiguity_m / d.rover->wavelength_m, 2));
  }
}

void BaselineFilter::take_phases() {
  double sum = 0;
  int count = 0;
  for (auto& [signal, group] : groups_) {
    const double jump_m = code_jump_m(group);
    start_ambiguities(group, jump_m);
    bool first = true;
    for (const std::size_t i : ordered(group, true)) {
      Difference& d = differences_[i];
      const SparseRow row = row_of(d, true);
      double variance = d.variance + d.age_variance;
      const auto innovation = state_.innovation(row, d.phase_m, variance);
      const double normalised = std::abs(innovation.normalised());
      Slot& slot = state_.slots[*d.slot];
      const bool beyond = normalised > kGateSigmas;
      if (beyond && std::abs(innovation.value) > kLeastSlip_cycles * d.rover->wavelength_m) {
        // It slipped: its ambiguity starts again, from this epoch's observations.
        state_.reset(BaselineState::index(*d.slot), (d.phase_m - d.code_m - jump_m) / d.rover->wavelength_m,
                     std::pow(kUnknownAmbiguity_m / d.rover->wavelength_m, 2));
        slot.begun = time_;
        slot.epochs = 0;
        slot.whole.reset();
      } else if (beyond) {
        // An echo: it counts as little as it fits.
        variance += std::pow(innovation.value / kGateSigmas, 2);
      }
      d.trusted = !beyond;
      if (!first && slot.epochs > 0) {
        sum += std::min(normalised * normalised, 100.0);
        ++count;
      }
      first = false;
      state_.take(row, d.phase_m, variance);
      d.used = true;
      slot.seen = time_;
      slot.phase_m = d.phase_m;
      slot.rover_since = d.rover->phase_since;
      slot.base_since = d.base_since;
      ++slot.epochs;
    }
    for (const std::size_t i : group) {
      Difference& d = differences_[i];
      if (!d.used) continue;
      d.residual_m = state_.innovation(row_of(d, true), d.phase_m, 0).value;
    }
  }
  state_.mirror();
  if (count > 4) squares_ += kSquaresWeight * (sum / count - squares_);
}

void BaselineFilter::take_velocity(const Fix& alone) {
  if (!alone.velocity_enu_mps || !alone.velocity_covariance_enu) return;
  // At its own place: that fix need not have one.
  const Eigen::Matrix3d enu = geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(position_));
  for (Index i = 0; i < 3; ++i) {
    SparseRow row;
    for (Index j = 0; j < 3; ++j) row.add(BaselineState::kVelocity + j, enu(i, j));
    const double variance = std::max((*alone.velocity_covariance_enu)(i, i), 1e-4);
    const double value = (*alone.velocity_enu_mps)(i);
    if (std::abs(state_.innovation(row, value, variance).normalised()) > kGateSigmas) continue;
    state_.take(row, value, variance);
  }
  state_.mirror();
}

}  // namespace canyon::relative
