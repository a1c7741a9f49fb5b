#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "canyon/relative/integer_least_squares.hpp"
#include "canyon/relative/rtk_filter_state.hpp"

// Whole numbers of cycles: candidates, search, acceptance.

namespace canyon::relative {
namespace {

using Eigen::Index;

/// The deviation of whole numbers that the filter holds [cycles], after so many fixed epochs in a row.
constexpr double kHeld_cycles = 1e-3;
constexpr int kHoldAfter = 10;
/// After so many fixed epochs in a row the same whole numbers need only this ratio, where so large a share of
/// them is known from before.
constexpr int kKeptAfter = 5;
constexpr double kKeptRatio = 1.5, kKeptShare = 0.75;
/// Residuals of an epoch alone tell how large errors are where no fewer are redundant.
constexpr int kFewRedundant = 5;

}  // namespace

double RtkFilter::State::squares_of_residuals(const std::vector<std::size_t>& among,
                                              const Eigen::VectorXd& x) const {
  struct Sums {
    double weights = 0, values = 0, squares = 0;
  };
  std::map<const gnss::Signal*, Sums> of_signals;
  for (const std::size_t i : among) {
    const Difference& d = differences[i];
    const SparseRow row = row_of(state, d, true);
    double residual_m = d.phase_m;
    for (std::size_t k = 0; k < row.count; ++k) residual_m -= row.terms[k].second * x(row.terms[k].first);
    const double weight = 1 / (d.variance + d.age_variance);
    Sums& sums = of_signals[d.rover->signal];
    sums.weights += weight;
    sums.values += weight * residual_m;
    sums.squares += weight * residual_m * residual_m;
  }
  double result = 0;
  for (const auto& [signal, sums] : of_signals) {
    result += sums.squares - sums.values * sums.values / sums.weights;
  }
  return result;
}

double RtkFilter::State::factor_of(const Fixed& fixed) {
  fixed_squares += kSquaresWeight * (fixed.squares - fixed_squares);
  fixed_redundant += kSquaresWeight * (std::max(0, fixed.redundant) - fixed_redundant);
  if (!moving || ionosphere_sigma_m > 0) return std::max(1.0, squares);
  const double lately = (1 + fixed_squares / kSquaresWeight) / (1 + fixed_redundant / kSquaresWeight);
  return std::max(lately, fixed.squares / std::max(kFewRedundant, fixed.redundant));
}

std::vector<std::size_t> RtkFilter::State::candidates() const {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < differences.size(); ++i) {
    const Difference& d = differences[i];
    const bool integer = d.aligned || options.fix_glonass;
    if (d.used && d.trusted && integer && !d.half_cycle &&
        d.rover->elevation_rad >= options.fix_elevation_rad) {
      result.push_back(i);
    }
  }
  std::stable_sort(result.begin(), result.end(), [this](std::size_t a, std::size_t b) {
    return differences[a].variance < differences[b].variance;
  });
  return result;
}

bool RtkFilter::State::are_kept(const std::vector<std::pair<Slot*, Slot*>>& slots,
                                const Eigen::VectorXd& whole) {
  std::size_t known = 0;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    const auto& [slot, reference] = slots[i];
    if (!slot->whole || !reference->whole) continue;
    if (*slot->whole - *reference->whole != whole(static_cast<Index>(i))) return false;
    ++known;
  }
  return known >= kKeptShare * static_cast<double>(slots.size());
}

void RtkFilter::State::keep(const std::vector<std::pair<Slot*, Slot*>>& slots, const Eigen::VectorXd& whole) {
  if (!are_kept(slots, whole)) {
    for (Slot& slot : state.slots) slot.whole.reset();
  }
  for (std::size_t i = 0; i < slots.size(); ++i) {
    const auto& [slot, reference] = slots[i];
    if (!reference->whole && slot->whole) reference->whole = *slot->whole - whole(static_cast<Index>(i));
  }
  for (std::size_t i = 0; i < slots.size(); ++i) {
    const auto& [slot, reference] = slots[i];
    if (!reference->whole) reference->whole = 0;
    slot->whole = *reference->whole + whole(static_cast<Index>(i));
  }
}

std::optional<RtkFilter::State::Fixed> RtkFilter::State::search(const std::vector<std::size_t>& among) {
  std::map<const gnss::Signal*, std::size_t> reference;
  std::vector<std::pair<Index, Index>> pairs;  // of states: an ambiguity and its signal's reference
  std::vector<std::pair<Slot*, Slot*>> slots;  // the same
  std::vector<gnss::SatelliteId> satellites;
  for (const std::size_t i : among) {
    const Difference& d = differences[i];
    satellites.push_back(d.id());
    const auto [at, is_new] = reference.emplace(d.rover->signal, i);
    if (is_new) continue;
    const std::size_t other = *differences[at->second].slot;
    pairs.emplace_back(BaselineState::index(*d.slot), BaselineState::index(other));
    slots.emplace_back(&state.slots[*d.slot], &state.slots[other]);
  }
  std::sort(satellites.begin(), satellites.end());
  satellites.erase(std::unique(satellites.begin(), satellites.end()), satellites.end());
  if (static_cast<int>(satellites.size()) < options.min_satellites || pairs.size() < 4) return std::nullopt;
  const auto n = static_cast<Index>(pairs.size());
  Eigen::VectorXd real(n);
  Eigen::MatrixXd q(n, n), with_position(3, n);
  for (Index i = 0; i < n; ++i) {
    const auto& [a, r] = pairs[static_cast<std::size_t>(i)];
    real(i) = state.x(a) - state.x(r);
    with_position.col(i) = state.p.col(a).head<3>() - state.p.col(r).head<3>();
    for (Index j = 0; j <= i; ++j) {
      const auto& [b, s] = pairs[static_cast<std::size_t>(j)];
      q(i, j) = q(j, i) = state.p(a, b) - state.p(a, s) - state.p(r, b) + state.p(r, s);
    }
  }
  const auto found = integer_least_squares(real, q);
  if (!found) return Fixed{};
  Fixed fixed;
  fixed.ratio = found->ratio();
  const bool proven = fixed.ratio >= options.ratio && found->success >= options.min_success;
  fixed.accepted =
      proven || (fixed_in_a_row >= kKeptAfter && fixed.ratio >= kKeptRatio && are_kept(slots, found->best));
  if (!fixed.accepted) return fixed;
  keep(slots, found->best);
  const Eigen::LDLT<Eigen::MatrixXd> factors(q);
  const Eigen::VectorXd weights = factors.solve(real - found->best);
  Eigen::VectorXd x = state.x;
  for (Index i = 0; i < n; ++i) {
    const auto& [a, r] = pairs[static_cast<std::size_t>(i)];
    x -= weights(i) * (state.p.col(a) - state.p.col(r));
  }
  fixed.position_error = x.segment<3>(BaselineState::kPosition);
  fixed.redundant = static_cast<int>(pairs.size()) - 3;
  fixed.squares = squares_of_residuals(among, x);
  fixed.covariance = state.p.topLeftCorner<3, 3>() - with_position * factors.solve(with_position.transpose());
  if (options.integers == Integers::Hold && fixed_in_a_row + 1 >= kHoldAfter) {
    for (Index i = 0; i < n; ++i) {
      SparseRow row;
      row.add(pairs[static_cast<std::size_t>(i)].first, 1);
      row.add(pairs[static_cast<std::size_t>(i)].second, -1);
      state.take(row, found->best(i), kHeld_cycles * kHeld_cycles);
    }
    state.mirror();
  }
  return fixed;
}

std::optional<RtkFilter::State::Fixed> RtkFilter::State::find_integers() {
  std::vector<std::size_t> among = candidates();
  std::optional<Fixed> result = find_among(among);
  if (result && result->accepted) return result;
  const auto glonass = std::remove_if(among.begin(), among.end(), [&](std::size_t i) {
    return differences[i].id().system == gnss::System::GLONASS;
  });
  if (glonass == among.end()) return result;
  among.erase(glonass, among.end());
  const std::optional<Fixed> without = find_among(among);
  return without && (!result || without->accepted) ? without : result;
}

std::optional<RtkFilter::State::Fixed> RtkFilter::State::find_among(std::vector<std::size_t> among) {
  std::optional<Fixed> result;
  for (const std::size_t fewer : {0, 1, 1, 1, 2, 3}) {
    for (std::size_t k = 0; k < fewer && !among.empty(); ++k) {
      const gnss::SatelliteId worst = differences[among.back()].id();
      among.erase(std::remove_if(among.begin(), among.end(),
                                 [&](std::size_t i) { return differences[i].id() == worst; }),
                  among.end());
    }
    std::optional<Fixed> next = search(among);
    if (!next) break;
    if (!result || next->accepted) result = next;
    if (next->accepted || !options.partial) break;
  }
  return result;
}

}  // namespace canyon::relative
