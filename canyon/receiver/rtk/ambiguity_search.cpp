#include "canyon/receiver/rtk/ambiguity_search.hpp"

#include <algorithm>
#include <map>

namespace canyon::rtk {
namespace {

using Eigen::Index;

/// Integers::Hold: after kHoldAfter successive fixed epochs, the filter constrains ambiguities to integers
/// with this standard deviation [cycles].
constexpr double kHeld_cycles = 1e-3;
constexpr int kHoldAfter = 10;
/// After kKeptAfter successive fixed epochs, a set of which the fraction kKeptFraction was fixed before
/// passes the ratio test with kKeptRatio.
constexpr int kKeptAfter = 5;
constexpr double kKeptRatio = 1.5, kKeptFraction = 0.75;
/// A new set of integers is accepted if two successive epochs find it, or at once if its ratio is
/// kCertainRatio times RtkOptions::ratio: one search in many passes the ratio test by chance.
constexpr double kCertainRatio = 2;
/// Minimum number of pairs of satellites for a search.
constexpr std::size_t kMinPairs = 4;
/// Minimum number of satellites for a fix.
constexpr int kMinSatellites = 5;
/// Satellites below this are used in the filter, not in the search: 15 deg.
constexpr double kFixElevation_rad = 0.26179938779914941;
/// Partial fixing: each further search omits this many more satellites.
constexpr std::size_t kFewer[] = {0, 1, 1, 1, 2, 3};

/// Indices of two slots' ambiguities in the state.
std::pair<Index, Index> states_of(const std::pair<std::size_t, std::size_t>& slots) {
  return {BaselineState::index(slots.first), BaselineState::index(slots.second)};
}

}  // namespace

double AmbiguitySearch::squares_of_residuals(std::span<const std::size_t> among,
                                             const Eigen::VectorXd& x) const {
  struct Sums {
    double weights = 0, values = 0, squares = 0;
  };
  std::map<const gnss::Signal*, Sums> signal_entries;
  for (const std::size_t i : among) {
    const Difference& d = differences_[i];
    const SparseRow row = state_.row_of(d, true, ionosphere_);
    double residual_m = d.phase_m;
    for (std::size_t k = 0; k < row.count; ++k) residual_m -= row.terms[k].second * x(row.terms[k].first);
    const double weight = 1 / (d.variance + d.age_variance);
    Sums& sums = signal_entries[d.rover->signal];
    sums.weights += weight;
    sums.values += weight * residual_m;
    sums.squares += weight * residual_m * residual_m;
  }
  double result = 0;
  for (const auto& [signal, sums] : signal_entries)
    result += sums.squares - sums.values * sums.values / sums.weights;
  return result;
}

std::vector<std::size_t> AmbiguitySearch::candidates() const {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < differences_.size(); ++i) {
    const Difference& d = differences_[i];
    const bool integer = d.aligned || options_.fix_glonass;
    if (d.used && d.trusted && integer && !d.half_cycle && d.rover->elevation_rad >= kFixElevation_rad)
      result.push_back(i);
  }
  std::stable_sort(result.begin(), result.end(), [this](std::size_t a, std::size_t b) {
    return differences_[a].variance < differences_[b].variance;
  });
  return result;
}

bool AmbiguitySearch::are_kept(std::span<const SlotPair> slots, const Eigen::VectorXd& whole) const {
  std::size_t known = 0;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    const auto& slot = state_.slots[slots[i].first].whole;
    const auto& reference = state_.slots[slots[i].second].whole;
    if (!slot || !reference) continue;
    if (*slot - *reference != whole(static_cast<Index>(i))) return false;
    ++known;
  }
  return known >= kKeptFraction * static_cast<double>(slots.size());
}

void AmbiguitySearch::keep(std::span<const SlotPair> slots, const Eigen::VectorXd& whole) {
  if (!are_kept(slots, whole))
    for (BaselineSlot& slot : state_.slots) slot.whole.reset();
  for (std::size_t i = 0; i < slots.size(); ++i) {
    const auto& slot = state_.slots[slots[i].first].whole;
    auto& reference = state_.slots[slots[i].second].whole;
    if (!reference && slot) reference = *slot - whole(static_cast<Index>(i));
  }
  for (std::size_t i = 0; i < slots.size(); ++i) {
    auto& reference = state_.slots[slots[i].second].whole;
    if (!reference) reference = 0;
    state_.slots[slots[i].first].whole = *reference + whole(static_cast<Index>(i));
  }
}

Eigen::Vector3d AmbiguitySearch::cycles_of(std::size_t difference) const {
  const Difference& d = differences_[difference];
  return d.rover->direction / d.rover->wavelength_m;
}

AmbiguitySearch::Pairs AmbiguitySearch::pairs_of(std::vector<std::size_t> among) {
  Pairs pairs;
  pairs.among = std::move(among);
  std::map<const gnss::Signal*, std::size_t> references;
  for (const std::size_t i : pairs.among) references[differences_[i].rover->signal] = i;
  for (const std::size_t i : pairs.among) {
    const Difference& d = differences_[i];
    pairs.before.push_back(pairs.slots.size());
    const std::size_t reference = references.at(d.rover->signal);
    if (i == reference) continue;
    pairs.slots.emplace_back(*d.slot, *differences_[reference].slot);
  }
  const auto n = static_cast<Index>(pairs.slots.size());
  pairs.gradients.resize(3, n);
  Index column = 0;
  for (const std::size_t i : pairs.among) {
    const std::size_t reference = references.at(differences_[i].rover->signal);
    if (i != reference) pairs.gradients.col(column++) = cycles_of(i) - cycles_of(reference);
  }
  const Eigen::MatrixXd by_echoes = pairs.gradients.transpose() * echoes_ * pairs.gradients;
  pairs.real.resize(n);
  pairs.covariance.resize(n, n);
  for (Index i = 0; i < n; ++i) {
    const auto [a, r] = states_of(pairs.slots[static_cast<std::size_t>(i)]);
    pairs.real(i) = state_.x(a) - state_.x(r);
    for (Index j = 0; j <= i; ++j) {
      const auto [b, s] = states_of(pairs.slots[static_cast<std::size_t>(j)]);
      pairs.covariance(i, j) = pairs.covariance(j, i) =
          state_.p(a, b) - state_.p(a, s) - state_.p(r, b) + state_.p(r, s) + by_echoes(i, j);
    }
  }
  return pairs;
}

AmbiguitySolution AmbiguitySearch::solution_of(const Pairs& pairs, const Set& set,
                                               const std::optional<IntegerSolution>& found) {
  AmbiguitySolution fixed;
  if (!found) return fixed;
  fixed.ratio = found->ratio();
  const auto slots = std::span<const SlotPair>(pairs.slots).last(set.pairs);
  const bool kept = are_kept(slots, found->best);
  if (fixed.ratio >= options_.ratio && found->success >= options_.min_success) {
    fixed.accepted =
        kept || fixed.ratio >= kCertainRatio * options_.ratio || options_.integers == Integers::Instantaneous;
    if (!fixed.accepted && !unconfirmed_) unconfirmed_ = {{slots.begin(), slots.end()}, found->best};
  } else {
    fixed.accepted = kept && fixed_in_a_row_ >= kKeptAfter && fixed.ratio >= kKeptRatio;
  }
  if (fixed.accepted) fix_at(pairs, set, found->best, fixed);
  return fixed;
}

void AmbiguitySearch::fix_at(const Pairs& pairs, const Set& set, const Eigen::VectorXd& whole,
                             AmbiguitySolution& fixed) {
  const auto slots = std::span<const SlotPair>(pairs.slots).last(set.pairs);
  const Index n = whole.size();
  const Eigen::Matrix3Xd with_echoes = echoes_ * pairs.gradients.rightCols(n);
  const Triangular factors = triangular(pairs.covariance.bottomRightCorner(n, n));
  fixed.accepted = factors.d.size() == n;
  if (!fixed.accepted) return;
  keep(slots, whole);
  // Rows: innovations, and covariances of these with the position.
  Eigen::MatrixXd rows(4, n);
  rows.row(0) = pairs.real.tail(n) - whole;
  for (Index i = 0; i < n; ++i) {
    const auto [a, r] = states_of(slots[static_cast<std::size_t>(i)]);
    rows.col(i).tail<3>() = state_.p.col(a).head<3>() - state_.p.col(r).head<3>() + with_echoes.col(i);
  }
  const Eigen::MatrixXd weights = times_inverse(rows, factors);
  Eigen::VectorXd x = state_.x;
  const Eigen::Vector3d by_echoes = with_echoes * weights.row(0).transpose();
  x.segment<3>(BaselineState::kPosition) -= by_echoes;
  for (const std::size_t i : pairs.among)
    x(BaselineState::index(*differences_[i].slot)) -= cycles_of(i).dot(by_echoes);
  fixed.covariance = state_.p.topLeftCorner<3, 3>() + echoes_;
  for (Index i = 0; i < n; ++i) {
    const auto [a, r] = states_of(slots[static_cast<std::size_t>(i)]);
    add_multiple(-weights(0, i), &state_.p(0, a), x.size(), x.data());
    add_multiple(weights(0, i), &state_.p(0, r), x.size(), x.data());
    for (Index j = 0; j < 3; ++j) fixed.covariance.col(j) -= rows(1 + j, i) * weights.col(i).tail<3>();
  }
  fixed.position_error = x.segment<3>(BaselineState::kPosition);
  fixed.redundant = static_cast<int>(n) - 3;
  fixed.squares = squares_of_residuals(std::span(pairs.among).subspan(set.begin), x);
  if (options_.integers != Integers::Hold || fixed_in_a_row_ + 1 < kHoldAfter) return;
  for (Index i = 0; i < n; ++i) {
    const auto [a, r] = states_of(slots[static_cast<std::size_t>(i)]);
    SparseRow row;
    row.add(a, 1);
    row.add(r, -1);
    state_.take(row, whole(i), kHeld_cycles * kHeld_cycles);
  }
  state_.mirror();
}

std::optional<AmbiguitySolution> AmbiguitySearch::find() {
  unconfirmed_.reset();
  std::optional<AmbiguitySolution> result = find_with_glonass_or_without();
  const bool accepted = result && result->accepted;
  if (!accepted && unconfirmed_) keep(unconfirmed_->slots, unconfirmed_->whole);
  return result;
}

std::optional<AmbiguitySolution> AmbiguitySearch::find_with_glonass_or_without() {
  std::vector<std::size_t> among = candidates();
  std::optional<AmbiguitySolution> result = find_among(among);
  if (result && result->accepted) return result;
  const auto glonass = std::remove_if(among.begin(), among.end(), [&](std::size_t i) {
    return differences_[i].id().system == gnss::System::GLONASS;
  });
  if (glonass == among.end()) return result;
  among.erase(glonass, among.end());
  const std::optional<AmbiguitySolution> without = find_among(among);
  return without && (!result || without->accepted) ? without : result;
}

std::optional<AmbiguitySolution> AmbiguitySearch::find_among(std::vector<std::size_t> among) {
  // Satellites are removed from the front, the least certain first, so that each set is a last part of all.
  std::vector<gnss::SatelliteId> satellites(among.size());
  std::transform(among.begin(), among.end(), satellites.begin(),
                 [&](std::size_t i) { return differences_[i].id(); });
  std::sort(satellites.begin(), satellites.end());
  satellites.erase(std::unique(satellites.begin(), satellites.end()), satellites.end());
  auto remaining = static_cast<int>(satellites.size());
  std::vector<std::size_t> ordered, begins;
  for (const std::size_t fewer : kFewer) {
    for (std::size_t k = 0; k < fewer && !among.empty(); ++k, --remaining) {
      std::erase_if(among, [&, worst = differences_[among.back()].id()](std::size_t i) {
        if (differences_[i].id() != worst) return false;
        ordered.push_back(i);
        return true;
      });
    }
    if (remaining < kMinSatellites) break;
    begins.push_back(ordered.size());
  }
  ordered.insert(ordered.end(), among.rbegin(), among.rend());
  if (begins.empty()) return std::nullopt;
  const Pairs all = pairs_of(std::move(ordered));

  std::vector<Set> sets;
  for (const std::size_t begin : begins) {
    const Set set{begin, all.slots.size() - all.before[begin]};
    if (set.pairs >= kMinPairs) sets.push_back(set);
  }
  if (sets.empty()) return std::nullopt;
  std::optional<AmbiguitySolution> result;
  if (const auto found = short_search(all.real, all.covariance)) {
    result = solution_of(all, sets.front(), found);
    if (result->accepted) return result;
    sets.erase(sets.begin());
  }
  std::vector<Index> sizes;
  for (const Set& set : sets) sizes.insert(sizes.begin(), static_cast<Index>(set.pairs));
  const auto decorrelated = decorrelate(all.real, all.covariance, sizes);
  const double enough = fixed_in_a_row_ >= kKeptAfter ? std::min(options_.ratio, kKeptRatio) : options_.ratio;
  for (std::size_t k = 0; k < sets.size(); ++k) {
    // The first set's ratio is reported. Those of the others only have to be large enough.
    const auto& by = decorrelated[sets.size() - 1 - k];
    const auto found = by ? integer_least_squares(*by, {.lowest = result ? enough : 1}) : std::nullopt;
    const AmbiguitySolution next = solution_of(all, sets[k], found);
    if (!result || next.accepted) result = next;
    if (next.accepted) break;
  }
  return result;
}

}  // namespace canyon::rtk
