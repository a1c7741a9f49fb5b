#include "canyon/receiver/tracking/batch_code_lock.hpp"

#include <algorithm>
#include <cmath>

#include "canyon/base/arithmetic.hpp"
#include "canyon/receiver/tracking/zero_search.hpp"

namespace canyon::tracking {
namespace {

template <std::size_t Width>
using Lanes = std::array<float, Width>;
using Eight = Lanes<BatchCodeLock::kWidth>;
using One = Lanes<1>;

/// Linear between steps: with 4 curvature / 8 steps^2 below 4e-6 for a front end of four chip rates.
constexpr float kStepsPerChip = 512;
constexpr int kSteps = 4 * 512;  // chips; beyond it R is constant

/// The paths of adjacent lanes, and the correlation of their signal.
struct Group {
  const float* table;  ///< of the correlation, in steps
  float half;          ///< of the distance of early and late [chips]
  std::size_t paths;
  const float* delay;
  const float *re, *im, *incoherent;  ///< of the first lane; a path's lanes are `stride` further
  std::size_t stride;
};

/// R at a lag [chips].
[[gnu::always_inline]] inline float correlation(const float* table, float lag) {
  const float steps = std::min(std::fabs(lag) * kStepsPerChip, static_cast<float>(kSteps));
  const int step = static_cast<int>(steps);
  return table[step] + (steps - static_cast<float>(step)) * (table[step + 1] - table[step]);
}

/// R at some lags [chips]. Separate loops for steps and look-ups: compilers vectorize the first one.
template <std::size_t Width>
[[gnu::always_inline]] inline void correlations(const float* table, const Lanes<Width>& lag,
                                                Lanes<Width>& value) {
  std::array<int, Width> step;
  Lanes<Width> rest, low, high;
  for (std::size_t i = 0; i < Width; ++i) {
    const float steps = std::fabs(lag[i]) * kStepsPerChip;
    step[i] = std::min(static_cast<int>(steps), kSteps);  // the table is constant beyond it
    rest[i] = steps - static_cast<float>(step[i]);
  }
  for (std::size_t i = 0; i < Width; ++i) {
    low[i] = table[step[i]];
    high[i] = table[step[i] + 1];
  }
  for (std::size_t i = 0; i < Width; ++i) value[i] = low[i] + rest[i] * (high[i] - low[i]);
}

/// The discriminator early minus late power of the lanes' replicas, and the power of its correlators.
template <std::size_t Width>
[[gnu::always_inline]] inline void sum_correlators(const Group& group, const Lanes<Width>& tau,
                                                   Lanes<Width>& d, Lanes<Width>& total) {
  const Group g = group;
  Lanes<Width> early_re{}, early_im{}, late_re{}, late_im{}, early_power{}, late_power{};
  for (std::size_t p = 0; p < g.paths; ++p) {
    const float* a = g.re + p * g.stride;
    const float* b = g.im + p * g.stride;
    const float* c = g.incoherent + p * g.stride;
    Lanes<Width> early, late, u, v;
    for (std::size_t i = 0; i < Width; ++i) {
      const float lag = tau[i] - g.delay[p];
      early[i] = lag - g.half;
      late[i] = lag + g.half;
    }
    correlations(g.table, early, u);
    correlations(g.table, late, v);
    for (std::size_t i = 0; i < Width; ++i) {
      early_re[i] += a[i] * u[i];
      early_im[i] += b[i] * u[i];
      late_re[i] += a[i] * v[i];
      late_im[i] += b[i] * v[i];
      early_power[i] += c[i] * u[i] * u[i];
      late_power[i] += c[i] * v[i] * v[i];
    }
  }
  for (std::size_t i = 0; i < Width; ++i) {
    const float early = early_re[i] * early_re[i] + early_im[i] * early_im[i] + early_power[i];
    const float late = late_re[i] * late_re[i] + late_im[i] * late_im[i] + late_power[i];
    total[i] = early + late;
    d[i] = early - late;
  }
}

/// Power of prompt correlators.
template <std::size_t Width>
[[gnu::always_inline]] inline void sum_prompts(const Group& group, const Lanes<Width>& tau,
                                               Lanes<Width>& power) {
  const Group g = group;
  Lanes<Width> r{}, i{}, c{};
  for (std::size_t p = 0; p < g.paths; ++p) {
    Lanes<Width> lag, u;
    for (std::size_t k = 0; k < Width; ++k) lag[k] = tau[k] - g.delay[p];
    correlations(g.table, lag, u);
    for (std::size_t k = 0; k < Width; ++k) {
      r[k] += g.re[p * g.stride + k] * u[k];
      i[k] += g.im[p * g.stride + k] * u[k];
      c[k] += g.incoherent[p * g.stride + k] * u[k] * u[k];
    }
  }
  for (std::size_t k = 0; k < Width; ++k) power[k] = r[k] * r[k] + i[k] * i[k] + c[k];
}

/// The delay, of a path, at which the prompt correlator is strongest; the earlier one of two equal ones.
/// @param strongest power of the strongest path [lane]; 0: nothing arrives, and `tau` is 0
template <std::size_t Width>
[[gnu::always_inline]] inline void find_peaks(const Group& group, Lanes<Width>& strongest,
                                              Lanes<Width>& tau) {
  const Group g = group;
  Lanes<Width> maximum{}, at{}, peak;
  peak.fill(-1);
  for (std::size_t q = 0; q < g.paths; ++q) {
    Lanes<Width> r{}, i{}, c{};
    for (std::size_t p = 0; p < g.paths; ++p) {
      // R is looked up once for all lanes.
      const float u = correlation(g.table, g.delay[q] - g.delay[p]), u_squared = u * u;
      for (std::size_t k = 0; k < Width; ++k) {
        r[k] += g.re[p * g.stride + k] * u;
        i[k] += g.im[p * g.stride + k] * u;
        c[k] += g.incoherent[p * g.stride + k] * u_squared;
      }
    }
    const float* re = g.re + q * g.stride;
    const float* im = g.im + q * g.stride;
    const float* incoherent = g.incoherent + q * g.stride;
    const float delay = g.delay[q];
    for (std::size_t k = 0; k < Width; ++k) {
      const float power = r[k] * r[k] + i[k] * i[k] + c[k];
      const float own = re[k] * re[k] + im[k] * im[k] + incoherent[k];
      maximum[k] = own > maximum[k] ? own : maximum[k];
      const int stronger = power > peak[k] * (1 + 1e-6F);
      const int alike = (power >= peak[k] * (1 - 1e-6F)) & (delay < at[k]) & (peak[k] >= 0);
      const int taken = (own > 0) & (stronger | alike);
      peak[k] = taken != 0 ? power : peak[k];
      at[k] = taken != 0 ? delay : at[k];
    }
  }
  strongest = maximum;
  tau = at;
}

// Eight lanes in parallel, and one alone.
CANYON_CLONES void correlate(const Group& g, const Eight& tau, Eight& d, Eight& total) {
  sum_correlators(g, tau, d, total);
}
void correlate(const Group& g, const One& tau, One& d, One& total) {
  sum_correlators(g, tau, d, total);
}
CANYON_CLONES void prompt(const Group& g, const Eight& tau, Eight& power) {
  sum_prompts(g, tau, power);
}
void prompt(const Group& g, const One& tau, One& power) {
  sum_prompts(g, tau, power);
}
CANYON_CLONES void strongest_prompt(const Group& g, Eight& strongest, Eight& tau) {
  find_peaks(g, strongest, tau);
}
void strongest_prompt(const Group& g, One& strongest, One& tau) {
  find_peaks(g, strongest, tau);
}

}  // namespace

void BatchCodeLock::Paths::clear(std::size_t lane_count) {
  lanes = lane_count;
  stride = padded(lane_count);
  delay_chips.clear();
  re.clear();
  im.clear();
  incoherent.clear();
}

std::size_t BatchCodeLock::Paths::add(double at_chips) {
  const std::size_t index = re.size();
  delay_chips.push_back(static_cast<float>(at_chips));
  re.resize(index + stride, 0);
  im.resize(index + stride, 0);
  incoherent.resize(index + stride, 0);
  return index;
}

BatchCodeLock::BatchCodeLock(std::shared_ptr<const CodeTracker> tracker) : tracker_(std::move(tracker)) {
  const Correlation& r = tracker_->correlation();
  for (int i = 0; i <= kSteps + 1; ++i)
    table_.push_back(static_cast<float>(r.value(static_cast<double>(std::min(i, kSteps)) / kStepsPerChip)));
  const DllOptions& loop = tracker_->options();
  half_spacing_ = static_cast<float>(loop.spacing_chips / 2);
  step_ = static_cast<float>(tracker_->step_chips());
  gain_ = static_cast<float>(tracker_->gain_chips());
  least_ = static_cast<float>(kMinPrompt * r.value(0) * r.value(0));
}

template <std::size_t Width>
void BatchCodeLock::lock_group(const Paths& paths, std::size_t first, std::array<float, Width>& delay,
                               std::array<float, Width>& power) const {
  using Search = ZeroSearch<float>;
  const std::vector<float>& delays = paths.delay_chips;
  const Group group{table_.data(),
                    half_spacing_,
                    delays.size(),
                    delays.data(),
                    paths.re.data() + first,
                    paths.im.data() + first,
                    paths.incoherent.data() + first,
                    paths.stride};
  const auto [earliest, latest] = std::minmax_element(delays.begin(), delays.end());
  Lanes<Width> strongest, tau, d, total;  // d, total: discriminator, power of its correlators
  strongest_prompt(group, strongest, tau);
  const auto pull = [&] {
    correlate(group, tau, d, total);
    for (std::size_t i = 0; i < Width; ++i)
      if (std::abs(d[i]) <= Search::kSilent * total[i]) d[i] = 0;
  };
  std::array<Search, Width> searches;
  pull();
  for (std::size_t i = 0; i < Width; ++i) {
    if (!(strongest[i] > 0)) continue;
    if (d[i] == 0)  // on the peak
      searches[i].state = Search::State::Located;
    else
      searches[i].run(tau[i], d[i], gain_ * d[i] / total[i], step_);
  }
  for (bool looking = true; looking;) {
    looking = false;
    for (std::size_t i = 0; i < Width; ++i) {
      Search& search = searches[i];
      if (!search.looking()) continue;
      if (search.at < *earliest - 1 || search.at > *latest + 1) {
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
      if (searches[i].state == Search::State::Located) tau[i] = searches[i].at;
    }
  }
  delay = tau;
  prompt(group, tau, power);
  for (std::size_t i = 0; i < Width; ++i)
    if (!(strongest[i] > 0))
      power[i] = 0;
    else if (searches[i].state == Search::State::Lost || power[i] < least_ * strongest[i])
      power[i] = -1;
}

void BatchCodeLock::lock_alone(const Paths& paths, std::size_t lane, float& delay_m,
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

void BatchCodeLock::lock(const Paths& paths, std::span<float> delay_m, std::span<float> prompt_power) const {
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
  for (std::size_t first = 0; first < paths.lanes; first += kWidth)
    first + 1 == paths.lanes ? lock_lanes(first, One()) : lock_lanes(first, Eight());
}

}  // namespace canyon::tracking
