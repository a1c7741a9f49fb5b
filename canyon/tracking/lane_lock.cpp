#include "canyon/tracking/lane_lock.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/base/simd_clones.hpp"
#include "canyon/tracking/zero_search.hpp"

namespace canyon::tracking {
namespace {

template <std::size_t Width>
using Lanes = std::array<float, Width>;

/// Linear between steps: with 4 curvature / 8 steps^2 below 4e-6 for a front end of four chip rates.
constexpr float kStepsPerChip = 512;
constexpr float kReach = 4;  // chips; beyond it R is as at its end

/// The paths of neighbouring lanes, and the correlation of their signal.
struct Group {
  const float* table;  ///< of the correlation, in steps
  float half;          ///< of the distance of early and late [chips]
  std::size_t paths;
  const float* delay;
  const float *re, *im, *incoherent;  ///< of the first lane; a path's lanes are `stride` further
  std::size_t stride;

  [[gnu::always_inline]] float correlation(float lag) const {
    const float x = std::min(std::fabs(lag) * kStepsPerChip, kReach * kStepsPerChip);
    const int j = static_cast<int>(x);
    return table[j] + (x - static_cast<float>(j)) * (table[j + 1] - table[j]);
  }
};

/// Correlators of the lanes' replicas, summed over all paths.
template <std::size_t Width>
struct Sums {
  Lanes<Width> early_re{}, early_im{}, late_re{}, late_im{}, early{}, late{};
};

template <std::size_t Width>
[[gnu::always_inline]] inline void sum_correlators(const Group& group, const Lanes<Width>& tau,
                                                   Sums<Width>& result) {
  const Group g = group;
  Sums<Width> sums;
  for (std::size_t p = 0; p < g.paths; ++p) {
    const float* a = g.re + p * g.stride;
    const float* b = g.im + p * g.stride;
    const float* c = g.incoherent + p * g.stride;
    for (std::size_t i = 0; i < Width; ++i) {
      const float lag = tau[i] - g.delay[p];
      const float u = g.correlation(lag - g.half), v = g.correlation(lag + g.half);
      sums.early_re[i] += a[i] * u;
      sums.early_im[i] += b[i] * u;
      sums.late_re[i] += a[i] * v;
      sums.late_im[i] += b[i] * v;
      sums.early[i] += c[i] * u * u;
      sums.late[i] += c[i] * v * v;
    }
  }
  result = sums;
}

/// Power of prompt correlators.
template <std::size_t Width>
[[gnu::always_inline]] inline void sum_prompts(const Group& group, const Lanes<Width>& tau,
                                               Lanes<Width>& power) {
  const Group g = group;
  Lanes<Width> r{}, i{}, c{};
  for (std::size_t p = 0; p < g.paths; ++p) {
    for (std::size_t k = 0; k < Width; ++k) {
      const float u = g.correlation(tau[k] - g.delay[p]);
      r[k] += g.re[p * g.stride + k] * u;
      i[k] += g.im[p * g.stride + k] * u;
      c[k] += g.incoherent[p * g.stride + k] * u * u;
    }
  }
  for (std::size_t k = 0; k < Width; ++k) power[k] = r[k] * r[k] + i[k] * i[k] + c[k];
}

/// The same where all lanes' replicas stand at one delay: R is looked up once for each path.
template <std::size_t Width>
[[gnu::always_inline]] inline void sum_prompts_at(const Group& group, float tau, Lanes<Width>& power) {
  const Group g = group;
  Lanes<Width> r{}, i{}, c{};
  for (std::size_t p = 0; p < g.paths; ++p) {
    const float u = g.correlation(tau - g.delay[p]);
    for (std::size_t k = 0; k < Width; ++k) {
      r[k] += g.re[p * g.stride + k] * u;
      i[k] += g.im[p * g.stride + k] * u;
      c[k] += g.incoherent[p * g.stride + k] * (u * u);
    }
  }
  for (std::size_t k = 0; k < Width; ++k) power[k] = r[k] * r[k] + i[k] * i[k] + c[k];
}

// Eight lanes side by side, and one alone.
using Eight = Lanes<LaneCodeLock::kWidth>;
using One = Lanes<1>;
CANYON_CLONES void correlate(const Group& g, const Eight& tau, Sums<LaneCodeLock::kWidth>& sums) {
  sum_correlators(g, tau, sums);
}
void correlate(const Group& g, const One& tau, Sums<1>& sums) {
  sum_correlators(g, tau, sums);
}
CANYON_CLONES void prompt(const Group& g, const Eight& tau, Eight& power) {
  sum_prompts(g, tau, power);
}
void prompt(const Group& g, const One& tau, One& power) {
  sum_prompts(g, tau, power);
}
CANYON_CLONES void prompt_at(const Group& g, float tau, Eight& power) {
  sum_prompts_at(g, tau, power);
}
void prompt_at(const Group& g, float tau, One& power) {
  sum_prompts_at(g, tau, power);
}

}  // namespace

void LaneCodeLock::Paths::clear(std::size_t of_lanes) {
  lanes = of_lanes;
  stride = padded(of_lanes);
  delay_chips.clear();
  re.clear();
  im.clear();
  incoherent.clear();
}

std::size_t LaneCodeLock::Paths::add(double at_chips) {
  const std::size_t place = re.size();
  delay_chips.push_back(static_cast<float>(at_chips));
  re.resize(place + stride, 0);
  im.resize(place + stride, 0);
  incoherent.resize(place + stride, 0);
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

template <std::size_t Width>
void LaneCodeLock::lock_group(const Paths& paths, std::size_t first, std::array<float, Width>& delay,
                              std::array<float, Width>& power) const {
  using Search = ZeroSearch<float>;
  const std::size_t count = paths.size(), stride = paths.stride;
  const float* re = paths.re.data() + first;
  const float* im = paths.im.data() + first;
  const float* incoherent = paths.incoherent.data() + first;
  const float* delays = paths.delay_chips.data();
  const Group group{table_.data(), half_spacing_, count, delays, re, im, incoherent, stride};

  // Where the prompt correlator is strongest.
  Lanes<Width> strongest{}, peak_power, tau{};
  float earliest = delays[0], latest = delays[0];
  peak_power.fill(-1);
  for (std::size_t p = 0; p < count; ++p) {
    earliest = std::min(earliest, delays[p]);
    latest = std::max(latest, delays[p]);
    Lanes<Width> at_path;
    prompt_at(group, delays[p], at_path);
    for (std::size_t i = 0; i < Width; ++i) {
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

  Lanes<Width> d, total;  // discriminator, power of its correlators
  const auto pull = [&] {
    Sums<Width> s;
    correlate(group, tau, s);
    for (std::size_t i = 0; i < Width; ++i) {
      const float early = s.early_re[i] * s.early_re[i] + s.early_im[i] * s.early_im[i] + s.early[i];
      const float late = s.late_re[i] * s.late_re[i] + s.late_im[i] * s.late_im[i] + s.late[i];
      total[i] = early + late;
      d[i] = std::abs(early - late) <= Search::kSilent * total[i] ? 0 : early - late;
    }
  };
  std::array<Search, Width> searches;
  pull();
  for (std::size_t i = 0; i < Width; ++i) {
    if (!(strongest[i] > 0)) continue;
    if (d[i] == 0) {  // on the peak
      searches[i].state = Search::State::Found;
    } else {
      searches[i].run(tau[i], d[i], gain_ * d[i] / total[i], step_);
    }
  }
  for (bool looking = true; looking;) {
    looking = false;
    for (std::size_t i = 0; i < Width; ++i) {
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
    for (std::size_t i = 0; i < Width; ++i) {
      if (!searches[i].looking()) continue;
      searches[i].take(d[i]);
      if (searches[i].state == Search::State::Found) tau[i] = searches[i].at;
    }
  }
  delay = tau;
  prompt(group, tau, power);
  for (std::size_t i = 0; i < Width; ++i) {
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
    const std::size_t k = p * paths.stride + lane;
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
  const auto lock_lanes = [&](std::size_t first, auto lanes) {
    auto delay = lanes, found = lanes;
    found.fill(-1);
    if (power) lock_group(paths, first, delay, found);
    for (std::size_t i = 0; i < std::min(lanes.size(), paths.lanes - first); ++i) {
      if (found[i] < 0) {
        lock_alone(paths, first + i, delay_m[first + i], prompt_power[first + i]);
      } else {
        delay_m[first + i] = delay[i] * chip_m;
        prompt_power[first + i] = found[i];
      }
    }
  };
  for (std::size_t first = 0; first < paths.lanes; first += kWidth) {
    first + 1 == paths.lanes ? lock_lanes(first, One()) : lock_lanes(first, Eight());
  }
}

}  // namespace canyon::tracking
