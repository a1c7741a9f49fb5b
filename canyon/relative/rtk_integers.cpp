#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

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
/// With fewer whole numbers there is no search.
constexpr std::size_t kFewestPairs = 4;
/// So many more satellites are left out, search by search.
constexpr std::size_t kFewer[] = {0, 1, 1, 1, 2, 3};

}  // namespace

double RtkFilter::State::squares_of_residuals(std::span<const std::size_t> among,
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

bool RtkFilter::State::are_kept(std::span<const std::pair<Slot*, Slot*>> slots,
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

void RtkFilter::State::keep(std::span<const std::pair<Slot*, Slot*>> slots, const Eigen::VectorXd& whole) {
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

RtkFilter::State::Pairs RtkFilter::State::pairs_of(std::vector<std::size_t> among) {
  Pairs pairs{std::move(among), {}, {}, {}, {}, {}};
  std::map<const gnss::Signal*, std::size_t> references;
  for (const std::size_t i : pairs.among) references[differences[i].rover->signal] = i;
  for (const std::size_t i : pairs.among) {
    const Difference& d = differences[i];
    pairs.before.push_back(pairs.states.size());
    const std::size_t reference = references.at(d.rover->signal);
    if (i == reference) continue;
    const std::size_t other = *differences[reference].slot;
    pairs.states.emplace_back(BaselineState::index(*d.slot), BaselineState::index(other));
    pairs.slots.emplace_back(&state.slots[*d.slot], &state.slots[other]);
  }
  const auto n = static_cast<Index>(pairs.states.size());
  pairs.real.resize(n);
  pairs.covariance.resize(n, n);
  for (Index i = 0; i < n; ++i) {
    const auto& [a, r] = pairs.states[static_cast<std::size_t>(i)];
    pairs.real(i) = state.x(a) - state.x(r);
    for (Index j = 0; j <= i; ++j) {
      const auto& [b, s] = pairs.states[static_cast<std::size_t>(j)];
      pairs.covariance(i, j) = pairs.covariance(j, i) =
          state.p(a, b) - state.p(a, s) - state.p(r, b) + state.p(r, s);
    }
  }
  return pairs;
}

RtkFilter::State::Fixed RtkFilter::State::answer(const Pairs& pairs, const Set& set,
                                                 const std::optional<IntegerSolution>& found) {
  Fixed fixed;
  if (!found) return fixed;
  fixed.ratio = found->ratio();
  const bool proven = fixed.ratio >= options.ratio && found->success >= options.min_success;
  fixed.accepted = proven || (fixed_in_a_row >= kKeptAfter && fixed.ratio >= kKeptRatio &&
                              are_kept(std::span(pairs.slots).last(set.pairs), found->best));
  if (fixed.accepted) fix_at(pairs, set, found->best, fixed);
  return fixed;
}

void RtkFilter::State::fix_at(const Pairs& pairs, const Set& set, const Eigen::VectorXd& whole,
                              Fixed& fixed) {
  keep(std::span(pairs.slots).last(set.pairs), whole);
  const auto states = std::span(pairs.states).last(set.pairs);
  const Index n = whole.size();
  const Eigen::LDLT<Eigen::MatrixXd> factors(pairs.covariance.bottomRightCorner(n, n));
  const Eigen::VectorXd weights = factors.solve(pairs.real.tail(n) - whole);
  Eigen::VectorXd x = state.x;
  Eigen::MatrixXd with_position(3, n);
  for (Index i = 0; i < n; ++i) {
    const auto& [a, r] = states[static_cast<std::size_t>(i)];
    x -= weights(i) * (state.p.col(a) - state.p.col(r));
    with_position.col(i) = state.p.col(a).head<3>() - state.p.col(r).head<3>();
  }
  fixed.position_error = x.segment<3>(BaselineState::kPosition);
  fixed.redundant = static_cast<int>(n) - 3;
  fixed.squares = squares_of_residuals(std::span(pairs.among).subspan(set.begin), x);
  fixed.covariance = state.p.topLeftCorner<3, 3>() - with_position * factors.solve(with_position.transpose());
  if (options.integers != Integers::Hold || fixed_in_a_row + 1 < kHoldAfter) return;
  for (Index i = 0; i < n; ++i) {
    const auto& [a, r] = states[static_cast<std::size_t>(i)];
    SparseRow row;
    row.add(a, 1);
    row.add(r, -1);
    state.take(row, whole(i), kHeld_cycles * kHeld_cycles);
  }
  state.mirror();
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
  // Satellites leave to the front, the least certain first, so that each set is a last part of all.
  std::vector<gnss::SatelliteId> satellites(among.size());
  std::transform(among.begin(), among.end(), satellites.begin(),
                 [&](std::size_t i) { return differences[i].id(); });
  std::sort(satellites.begin(), satellites.end());
  satellites.erase(std::unique(satellites.begin(), satellites.end()), satellites.end());
  auto remaining = static_cast<int>(satellites.size());
  std::vector<std::size_t> ordered, begins;
  for (const std::size_t fewer : kFewer) {
    for (std::size_t k = 0; k < fewer && !among.empty(); ++k, --remaining) {
      std::erase_if(among, [&, worst = differences[among.back()].id()](std::size_t i) {
        if (differences[i].id() != worst) return false;
        ordered.push_back(i);
        return true;
      });
    }
    if (remaining < options.min_satellites) break;
    begins.push_back(ordered.size());
    if (!options.partial) break;
  }
  ordered.insert(ordered.end(), among.rbegin(), among.rend());
  if (begins.empty()) return std::nullopt;
  const Pairs all = pairs_of(std::move(ordered));

  std::vector<Set> sets;
  for (const std::size_t begin : begins) {
    const Set set{begin, all.states.size() - all.before[begin]};
    if (set.pairs >= kFewestPairs) sets.push_back(set);
  }
  if (sets.empty()) return std::nullopt;
  std::optional<Fixed> result;
  if (const auto found = short_search(all.real, all.covariance)) {
    result = answer(all, sets.front(), found);
    if (result->accepted) return result;
    sets.erase(sets.begin());
  }
  std::vector<Index> sizes;
  for (const Set& set : sets) sizes.insert(sizes.begin(), static_cast<Index>(set.pairs));
  const auto decorrelated = decorrelate(all.real, all.covariance, sizes);
  const double enough = fixed_in_a_row >= kKeptAfter ? std::min(options.ratio, kKeptRatio) : options.ratio;
  for (std::size_t k = 0; k < sets.size(); ++k) {
    // The first set's ratio is stated. Those of the others only have to be large enough.
    const auto& by = decorrelated[sets.size() - 1 - k];
    const auto found = by ? integer_least_squares(*by, {.lowest = result ? enough : 1}) : std::nullopt;
    const Fixed next = answer(all, sets[k], found);
    if (!result || next.accepted) result = next;
    if (next.accepted) break;
  }
  return result;
}

}  // namespace canyon::relative
