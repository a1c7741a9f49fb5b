#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "canyon/geodesy/frames.hpp"
#include "canyon/positioning/filter_track.hpp"
#include "canyon/relative/rtk_filter_state.hpp"

// Codes, phases and velocity as observations of the filter.

namespace canyon::relative {
namespace {

using Eigen::Index;
using positioning::Fix;

/// Before anything is known [m].
constexpr double kUnknownClock_m = 100, kUnknownAmbiguity_m = 30;
/// Phases of a direct signal are off by a quarter of a cycle at most, by echoes.
constexpr double kLeastSlip_cycles = 0.3;
/// Errors of codes are the same for so long [s]: more epochs in that time add no information.
constexpr double kCodeTime_s = 1;

}  // namespace

SparseRow RtkFilter::State::row_of(const BaselineState& of, const Difference& d, bool phase) const {
  SparseRow row;
  for (Index i = 0; i < 3; ++i) row.add(BaselineState::kPosition + i, -d.rover->direction(i));
  row.add(BaselineState::kClock, 1);
  if (of.p(BaselineState::kZenith, BaselineState::kZenith) > 0) {
    row.add(BaselineState::kZenith, 1 / std::max(0.05, std::sin(d.rover->elevation_rad)));
  }
  if (ionosphere_sigma_m > 0) {
    if (const auto slot = of.find(d.id(), nullptr)) {
      row.add(BaselineState::index(*slot), (phase ? -1 : 1) * d.ionosphere_rate());
    }
  }
  if (phase && d.slot) row.add(BaselineState::index(*d.slot), d.rover->wavelength_m);
  return row;
}

std::vector<std::size_t> RtkFilter::State::ordered(BaselineState& of, const std::vector<std::size_t>& group,
                                                   bool phase) const {
  of.reset(BaselineState::kClock, 0, 0);
  std::vector<std::pair<double, std::size_t>> innovations;
  std::vector<double> values;
  for (const std::size_t i : group) {
    const Difference& d = differences[i];
    if (phase && !d.slot) continue;
    const double value = phase ? d.phase_m : d.code_m;
    innovations.emplace_back(of.innovation(row_of(of, d, phase), value, 0).value, i);
    values.push_back(innovations.back().first);
  }
  if (innovations.size() < 2) return {};
  const double middle = positioning::median(values);
  for (auto& [innovation, i] : innovations) innovation = std::abs(innovation - middle);
  std::sort(innovations.begin(), innovations.end());
  of.reset(BaselineState::kClock, middle, kUnknownClock_m * kUnknownClock_m);
  std::vector<std::size_t> order;
  order.reserve(innovations.size());
  for (const auto& [innovation, i] : innovations) order.push_back(i);
  return order;
}

void RtkFilter::State::take_codes() {
  int considered = 0, failed = 0;
  double sum = 0;
  BaselineState part = state.without_ambiguities();
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  const double repeats = dt_s > 0 ? std::max(1.0, kCodeTime_s / dt_s) : 1;
  for (const auto& [signal, group] : groups) {
    Eigen::Matrix3d squares_of = Eigen::Matrix3d::Zero();
    Eigen::Vector3d sum_of = Eigen::Vector3d::Zero();
    double weights = 0;
    for (const std::size_t i : ordered(part, group, false)) {
      const Difference& d = differences[i];
      const SparseRow row = row_of(part, d, false);
      const double noise = d.variance * options.code_ratio * options.code_ratio + d.age_variance;
      const double normalised = std::abs(part.innovation(row, d.code_m, noise).normalised());
      ++considered;
      sum += std::min(normalised * normalised, 25.0);
      if (normalised > options.gate_sigmas) {
        ++failed;
        continue;
      }
      part.take(row, d.code_m, repeats * noise);
      const Eigen::Vector3d& e = d.rover->direction;
      weights += 1 / noise;
      sum_of += e / noise;
      squares_of += e * e.transpose() / noise;
    }
    if (weights > 0) information += squares_of - sum_of * sum_of.transpose() / weights;
  }
  part.mirror();
  state.learn(part);
  code_covariance.setZero();
  if (information.determinant() > 1e-9) code_covariance = information.inverse();
  const auto redundant = considered - static_cast<int>(groups.size()) - 3;
  if (redundant > 3) {
    code_squares += kSquaresWeight * (std::max(1.0, sum / redundant) - code_squares);
  }
  if (2 * failed > considered && considered > 4) {
    if (!astray_since) astray_since = time;
    astray = time - *astray_since > 3;
  } else {
    astray_since.reset();
    astray = false;
  }
}

double RtkFilter::State::code_jump_m(const std::vector<std::size_t>& group) const {
  std::vector<double> jumps;
  for (const std::size_t i : group) {
    const Difference& d = differences[i];
    if (!d.has_phase) continue;
    if (const auto slot = state.find(d.id(), d.rover->signal)) {
      jumps.push_back(d.phase_m - d.code_m - d.rover->wavelength_m * state.x(BaselineState::index(*slot)));
    }
  }
  const double jump_m = jumps.empty() ? 0 : positioning::median(jumps);
  return std::abs(jump_m) > kUnknownAmbiguity_m ? jump_m : 0;
}

void RtkFilter::State::start_ambiguities(const std::vector<std::size_t>& group, double jump_m) {
  for (const std::size_t i : group) {
    Difference& d = differences[i];
    if (!d.has_phase) continue;
    d.slot = state.find(d.id(), d.rover->signal);
    if (d.slot) continue;
    const double cycles = (d.phase_m - d.code_m - jump_m) / d.rover->wavelength_m;
    d.slot = state.add(
        {d.id(), d.rover->signal, time, time, d.rover->phase_since, d.base_since, d.half_cycle, 0, d.phase_m},
        cycles, std::pow(kUnknownAmbiguity_m / d.rover->wavelength_m, 2));
  }
}

void RtkFilter::State::take_phases() {
  double sum = 0;
  int count = 0;
  for (auto& [signal, group] : groups) {
    const double jump_m = code_jump_m(group);
    start_ambiguities(group, jump_m);
    bool first = true;
    for (const std::size_t i : ordered(state, group, true)) {
      Difference& d = differences[i];
      const SparseRow row = row_of(state, d, true);
      double variance = d.variance + d.age_variance;
      const auto innovation = state.innovation(row, d.phase_m, variance);
      const double normalised = std::abs(innovation.normalised());
      Slot& slot = state.slots[*d.slot];
      const bool beyond = normalised > options.gate_sigmas;
      if (beyond && std::abs(innovation.value) > kLeastSlip_cycles * d.rover->wavelength_m) {
        // It slipped: its ambiguity starts again, from this epoch's observations.
        state.reset(BaselineState::index(*d.slot), (d.phase_m - d.code_m - jump_m) / d.rover->wavelength_m,
                    std::pow(kUnknownAmbiguity_m / d.rover->wavelength_m, 2));
        slot.begun = time;
        slot.epochs = 0;
        slot.whole.reset();
      } else if (beyond) {
        // An echo: it counts as little as it fits.
        variance += std::pow(innovation.value / options.gate_sigmas, 2);
      }
      d.trusted = !beyond;
      if (!first && slot.epochs > 0) {
        sum += std::min(normalised * normalised, 100.0);
        ++count;
      }
      first = false;
      state.take(row, d.phase_m, variance);
      d.used = true;
      slot.seen = time;
      slot.phase_m = d.phase_m;
      slot.rover_since = d.rover->phase_since;
      slot.base_since = d.base_since;
      ++slot.epochs;
    }
    for (const std::size_t i : group) {
      Difference& d = differences[i];
      if (!d.used) continue;
      d.residual_m = state.innovation(row_of(state, d, true), d.phase_m, 0).value;
    }
  }
  state.mirror();
  if (count > 4) squares += kSquaresWeight * (sum / count - squares);
}

void RtkFilter::State::take_velocity(const Fix& alone) {
  if (!alone.velocity_enu_mps || !alone.velocity_covariance_enu) return;
  const Eigen::Matrix3d enu = geodesy::enu_from_ecef_rotation(alone.position);
  for (Index i = 0; i < 3; ++i) {
    SparseRow row;
    for (Index j = 0; j < 3; ++j) row.add(BaselineState::kVelocity + j, enu(i, j));
    const double variance = std::max((*alone.velocity_covariance_enu)(i, i), 1e-4);
    const double value = (*alone.velocity_enu_mps)(i);
    if (std::abs(state.innovation(row, value, variance).normalised()) > options.gate_sigmas) continue;
    state.take(row, value, variance);
  }
  state.mirror();
}

}  // namespace canyon::relative
