#include "canyon/tracking/lane_lock.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/base/simd_clones.hpp"
#include "canyon/tracking/zero_search.hpp"

namespace canyon::tracking {
namespace {

constexpr std::size_t kWidth = LaneCodeLock::kWidth;
using Lanes = std::array<float, kWidth>;

/// Linear between steps: with 4 curvature / 8 steps^2 below 4e-6 for a front end of four chip rates.
constexpr float kStepsPerChip = 512;
constexpr float kReach = 4;  // chips; beyond it R is as at its end

/// Correlators of eight replicas, summed over all paths.
struct Sums {
  Lanes early_re, early_im, late_re, late_im, early, late;
};

CANYON_CLONES
void correlate(const float* table, const float* tau, float half, std::size_t paths, const float* delay,
               const float* re, const float* im, const float* incoherent, std::size_t stride, Sums& sums) {
  Lanes er{}, ei{}, lr{}, li{}, e{}, l{};
  for (std::size_t p = 0; p < paths; ++p) {
    const float* a = re + p * stride;
    const float* b = im + p * stride;
    const float* c = incoherent + p * stride;
    for (std::size_t i = 0; i < kWidth; ++i) {
      const float lag = tau[i] - delay[p];
      const float x = std::min(std::fabs(lag - half) * kStepsPerChip, kReach * kStepsPerChip);
      const float y = std::min(std::fabs(lag + half) * kStepsPerChip, kReach * kStepsPerChip);
      const int j = static_cast<int>(x), k = static_cast<int>(y);
      const float u = table[j] + (x - static_cast<float>(j)) * (table[j + 1] - table[j]);
      const float v = table[k] + (y - static_cast<float>(k)) * (table[k + 1] - table[k]);
      er[i] += a[i] * u;
      ei[i] += b[i] * u;
      lr[i] += a[i] * v;
      li[i] += b[i] * v;
      e[i] += c[i] * u * u;
      l[i] += c[i] * v * v;
    }
  }
  sums = {er, ei, lr, li, e, l};
}

/// Power of prompt correlators.
CANYON_CLONES
void prompt(const float* table, const float* tau, std::size_t paths, const float* delay, const float* re,
            const float* im, const float* incoherent, std::size_t stride, float* power) {
  Lanes r{}, i{}, c{};
  for (std::size_t p = 0; p < paths; ++p) {
    for (std::size_t k = 0; k < kWidth; ++k) {
      const float x = std::min(std::fabs(tau[k] - delay[p]) * kStepsPerChip, kReach * kStepsPerChip);
      const int j = static_cast<int>(x);
      const float u = table[j] + (x - static_cast<float>(j)) * (table[j + 1] - table[j]);
      r[k] += re[p * stride + k] * u;
      i[k] += im[p * stride + k] * u;
      c[k] += incoherent[p * stride + k] * u * u;
    }
  }
  for (std::size_t k = 0; k < kWidth; ++k) power[k] = r[k] * r[k] + i[k] * i[k] + c[k];
}

/// The same where all lanes' replicas stand at one delay: R is looked up once for each path.
CANYON_CLONES
void prompt_at(const float* table, float tau, std::size_t paths, const float* delay, const float* re,
               const float* im, const float* incoherent, std::size_t stride, float* power) {
  Lanes r{}, i{}, c{};
  for (std::size_t p = 0; p < paths; ++p) {
    const float x = std::min(std::fabs(tau - delay[p]) * kStepsPerChip, kReach * kStepsPerChip);
    const int j = static_cast<int>(x);
    const float u = table[j] + (x - static_cast<float>(j)) * (table[j + 1] - table[j]);
    for (std::size_t k = 0; k < kWidth; ++k) {
      r[k] += re[p * stride + k] * u;
      i[k] += im[p * stride + k] * u;
      c[k] += incoherent[p * stride + k] * (u * u);
    }
  }
  for (std::size_t k = 0; k < kWidth; ++k) power[k] = r[k] * r[k] + i[k] * i[k] + c[k];
}

}  // namespace

void LaneCodeLock::Paths::clear(std::size_t of_lanes) {
  lanes = of_lanes;
  delay_chips.clear();
  re.clear();
  im.clear();
  incoherent.clear();
}

std::size_t LaneCodeLock::Paths::add(double at_chips) {
  const std::size_t place = re.size();
  delay_chips.push_back(static_cast<float>(at_chips));
  re.resize(place + lanes, 0);
  im.resize(place + lanes, 0);
  incoherent.resize(place + lanes, 0);
  return place;
}

LaneCodeLock::LaneCodeLock(std::shared_ptr<const CodeTracker> tracker) : tracker_(std::move(tracker)) {
  const Correlation& r = tracker_->correlation();
  const auto steps = static_cast<std::size_t>(kReach * kStepsPerChip);
  for (std::size_t i = 0; i <= steps + 1; ++i) {
    table_.push_back(static_cast<float>(r.value(static_cast<double>(std::min(i, steps)) / kStepsPerChip)));
  }
  const DllOptions& loop = tracker_->options();
  half_spacing_ = static_cast<float>(loop.spacing_chips / 2);
  step_ = static_cast<float>(tracker_->step_chips());
  gain_ = static_cast<float>(tracker_->gain_chips());
  least_ = static_cast<float>(kLeastPrompt * r.value(0) * r.value(0));
}

void LaneCodeLock::lock_group(const Paths& paths, std::size_t first, Lanes& delay, Lanes& power) const {
  using Search = ZeroSearch<float>;
  const std::size_t count = paths.size(), stride = paths.lanes;
  const float* re = paths.re.data() + first;
  const float* im = paths.im.data() + first;
  const float* incoherent = paths.incoherent.data() + first;
  const float* delays = paths.delay_chips.data();

  // Where the prompt correlator is strongest.
  Lanes strongest{}, peak_power, tau{};
  float earliest = delays[0], latest = delays[0];
  peak_power.fill(-1);
  for (std::size_t p = 0; p < count; ++p) {
    earliest = std::min(earliest, delays[p]);
    latest = std::max(latest, delays[p]);
    Lanes at_path;
    prompt_at(table_.data(), delays[p], count, delays, re, im, incoherent, stride, at_path.data());
    for (std::size_t i = 0; i < kWidth; ++i) {
      const std::size_t k = p * stride + i;
      const float own = re[k] * re[k] + im[k] * im[k] + incoherent[k];
      strongest[i] = std::max(strongest[i], own);
      if (!(own > 0)) continue;
      if (at_path[i] > peak_power[i] * (1 + 1e-6F) ||
          (at_path[i] >= peak_power[i] * (1 - 1e-6F) && delays[p] < tau[i] && peak_power[i] >= 0)) {
        peak_power[i] = at_path[i];
        tau[i] = delays[p];
      }
    }
  }

  Lanes d, total;  // discriminator, power of its correlators
  const auto pull = [&] {
    Sums s;
    correlate(table_.data(), tau.data(), half_spacing_, count, delays, re, im, incoherent, stride, s);
    for (std::size_t i = 0; i < kWidth; ++i) {
      const float early = s.early_re[i] * s.early_re[i] + s.early_im[i] * s.early_im[i] + s.early[i];
      const float late = s.late_re[i] * s.late_re[i] + s.late_im[i] * s.late_im[i] + s.late[i];
      total[i] = early + late;
      d[i] = std::abs(early - late) <= Search::kSilent * total[i] ? 0 : early - late;
    }
  };
  std::array<Search, kWidth> searches;
  pull();
  for (std::size_t i = 0; i < kWidth; ++i) {
    if (!(strongest[i] > 0)) continue;
    if (d[i] == 0) {  // on the peak
      searches[i].state = Search::State::Found;
    } else {
      searches[i].run(tau[i], d[i], gain_ * d[i] / total[i], step_);
    }
  }
  for (bool looking = true; looking;) {
    looking = false;
    for (std::size_t i = 0; i < kWidth; ++i) {
      Search& search = searches[i];
      if (!search.looking()) continue;
      if (search.at < earliest - 1 || search.at > latest + 1) {
        search.state = Search::State::Lost;
        continue;
      }
      looking = true;
      tau[i] = search.at;
    }
    if (!looking) break;
    pull();
    for (std::size_t i = 0; i < kWidth; ++i) {
      if (!searches[i].looking()) continue;
      searches[i].take(d[i]);
      if (searches[i].state == Search::State::Found) tau[i] = searches[i].at;
    }
  }
  delay = tau;
  prompt(table_.data(), tau.data(), count, delays, re, im, incoherent, stride, power.data());
  for (std::size_t i = 0; i < kWidth; ++i) {
    if (!(strongest[i] > 0)) {
      power[i] = 0;
    } else if (searches[i].state == Search::State::Lost || power[i] < least_ * strongest[i]) {
      power[i] = -1;
    }
  }
}

void LaneCodeLock::lock_alone(const Paths& paths, std::size_t lane, float& delay_m,
                              float& prompt_power) const {
  std::vector<CodeTracker::Averaged> alone;
  for (std::size_t p = 0; p < paths.size(); ++p) {
    const std::size_t k = p * paths.lanes + lane;
    alone.push_back({static_cast<double>(paths.delay_chips[p]),
                     {static_cast<double>(paths.re[k]), static_cast<double>(paths.im[k])},
                     static_cast<double>(paths.incoherent[k])});
  }
  const auto lock = tracker_->lock_averaged(alone);
  delay_m = lock ? static_cast<float>(lock->delay_m) : 0;
  prompt_power = lock ? static_cast<float>(lock->prompt_power) : 0;
}

void LaneCodeLock::lock(const Paths& paths, std::span<float> delay_m, std::span<float> prompt_power) const {
  if (paths.size() == 0) {
    std::fill(prompt_power.begin(), prompt_power.end(), 0.0F);
    return;
  }
  const bool power = tracker_->options().discriminator == Discriminator::EarlyLatePower;
  const auto chip_m = static_cast<float>(tracker_->correlation().chip_m());
  for (std::size_t first = 0; first < paths.lanes; first += kWidth) {
    Lanes delay, found;
    found.fill(-1);
    if (power) lock_group(paths, first, delay, found);
    for (std::size_t i = 0; i < kWidth; ++i) {
      if (found[i] < 0) {
        lock_alone(paths, first + i, delay_m[first + i], prompt_power[first + i]);
      } else {
        delay_m[first + i] = delay[i] * chip_m;
        prompt_power[first + i] = found[i];
      }
    }
  }
}

}  // namespace canyon::tracking
