#include "canyon/receiver/rtk/baseline_state.hpp"

#include <algorithm>
#include <cmath>

#include "canyon/base/arithmetic.hpp"
#include "canyon/base/geodesy/constants.hpp"

namespace canyon::rtk {

using Eigen::Index;

namespace {

/// p -= gain gain^T in the lower triangle of p, n x n, column by column.
CANYON_CLONES void subtract_square(const double* __restrict gain, std::ptrdiff_t n, double* __restrict p) {
  for (std::ptrdiff_t j = 0; j < n; ++j, p += n)
    for (std::ptrdiff_t i = j; i < n; ++i) p[i] -= gain[j] * gain[i];
}

}  // namespace

double Difference::ionosphere_rate() const {
  const double l1_m = geodesy::kSpeedOfLight / gnss::kL1_hz;
  return std::pow(rover->wavelength_m / l1_m, 2);
}

SparseRow BaselineState::row_of(const Difference& d, bool phase, bool ionosphere) const {
  SparseRow row;
  for (Index i = 0; i < 3; ++i) row.add(kPosition + i, -d.rover->direction(i));
  row.add(kClock, 1);
  if (p(kZenith, kZenith) > 0) row.add(kZenith, 1 / std::max(0.05, std::sin(d.rover->elevation_rad)));
  if (ionosphere) {
    if (const auto slot = find(d.id(), nullptr))
      row.add(index(*slot), (phase ? -1 : 1) * d.ionosphere_rate());
  }
  if (phase && d.slot) row.add(index(*d.slot), d.rover->wavelength_m);
  return row;
}

std::optional<std::size_t> BaselineState::find(gnss::SatelliteId id, const gnss::Signal* signal) const {
  for (std::size_t i = 0; i < slots.size(); ++i)
    if (slots[i].id == id && slots[i].signal == signal) return i;
  return std::nullopt;
}

std::size_t BaselineState::add(const BaselineSlot& slot, double value, double variance) {
  slots.push_back(slot);
  const Index n = x.size();
  x.conservativeResize(n + 1);
  p.conservativeResize(n + 1, n + 1);
  reset(n, value, variance);
  return slots.size() - 1;
}

void BaselineState::remove(std::size_t slot) {
  const Index at = index(slot), last = x.size() - 1, after = last - at;
  // The columns before the rows: blocks overlap, and Eigen copies these in memory order.
  for (Index i = at; i < last; ++i) {
    x(i) = x(i + 1);
    p.col(i) = p.col(i + 1);
  }
  for (Index j = 0; j < last; ++j)
    for (Index i = at; i < at + after; ++i) p(i, j) = p(i + 1, j);
  x.conservativeResize(last);
  p.conservativeResize(last, last);
  slots.erase(slots.begin() + static_cast<std::ptrdiff_t>(slot));
}

void BaselineState::reset(Index state, double value, double variance) {
  x(state) = value;
  p.row(state).setZero();
  p.col(state).setZero();
  p(state, state) = variance;
}

void BaselineState::move(double dt_s, const Eigen::Matrix3d& q) {
  x.segment<3>(kPosition) += dt_s * x.segment<3>(kVelocity);
  p.middleRows<3>(kPosition) += dt_s * p.middleRows<3>(kVelocity);
  p.middleCols<3>(kPosition) += dt_s * p.middleCols<3>(kVelocity);
  p.block<3, 3>(kPosition, kPosition) += dt_s * dt_s * dt_s / 3 * q;
  p.block<3, 3>(kPosition, kVelocity) += dt_s * dt_s / 2 * q;
  p.block<3, 3>(kVelocity, kPosition) += dt_s * dt_s / 2 * q;
  p.block<3, 3>(kVelocity, kVelocity) += dt_s * q;
}

double BaselineState::Innovation::normalised() const {
  return value / std::sqrt(variance);
}

BaselineState::Innovation BaselineState::innovation(const SparseRow& row, double value,
                                                    double variance) const {
  Innovation result{value, variance};
  for (std::size_t i = 0; i < row.count; ++i) {
    const auto& [state, gradient] = row.terms[i];
    result.value -= gradient * x(state);
    for (std::size_t j = 0; j < row.count; ++j) {
      const Index other = row.terms[j].first;
      result.variance += gradient * row.terms[j].second * p(std::max(state, other), std::min(state, other));
    }
  }
  return result;
}

void BaselineState::take(const SparseRow& row, double value, double variance) {
  const Innovation by = innovation(row, value, variance);
  gain_.setZero(x.size());
  const Index n = x.size();
  for (std::size_t i = 0; i < row.count; ++i) {
    const auto& [state, gradient] = row.terms[i];
    gain_.head(state) += gradient * p.row(state).head(state).transpose();
    gain_.tail(n - state) += gradient * p.col(state).tail(n - state);
  }
  x += gain_ * (by.value / by.variance);
  gain_ /= std::sqrt(by.variance);
  subtract_square(gain_.data(), n, p.data());
}

void BaselineState::mirror() {
  p.triangularView<Eigen::StrictlyUpper>() = p.transpose();
}

}  // namespace canyon::rtk
