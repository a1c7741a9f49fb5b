#include "canyon/tracking/lane_lock.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/base/simd_clones.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::tracking {
namespace {

constexpr std::size_t kWidth = LaneCodeLock::kWidth;
using Lanes = std::array<float, kWidth>;

/// Linear between steps: with 4 curvature / 8 steps^2 below 4e-6 for a front end of four chip rates.
constexpr float kStepsPerChip = 512;
constexpr float kReach = 4;           // chips; beyond it R is as at its end
constexpr float kLaneAtRest = 3e-6F;  // of the correlators' power: below it D is rounding
constexpr int kMostSteps = 96;
constexpr int kMostRefinements = 24;

/// What correlators of eight replicas see of all paths.
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

/// Eight lanes on their way.
struct LaneCodeLock::Group {
  Lanes delay{}, power{};  // the answer: chips, prompt power; power -1: none
  Lanes d{}, total{};      // discriminator, power of its correlators
};

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
  step_ = static_cast<float>(std::min(loop.spacing_chips / 8, r.knot_spacing_chips() / 8));
  const double small = loop.spacing_chips / 64;
  const double early = r.value(small - loop.spacing_chips / 2),
               late = r.value(small + loop.spacing_chips / 2);
  gain_ = static_cast<float>(small * (early * early + late * late) / (early * early - late * late));
  least_ = static_cast<float>(kLeastPrompt * r.value(0) * r.value(0));
}

LaneCodeLock::Share LaneCodeLock::average(double fading_hz) const {
  const DllOptions& loop = tracker_->options();
  const double turn = geodesy::kPi * fading_hz * loop.integration_s;
  const double kept = std::abs(turn) < 1e-8 ? 1 : std::sin(turn) / turn;
  const double ratio = 2 * geodesy::kPi * fading_hz / (4 * loop.loop_bandwidth_hz);
  const double share = 1 / (1 + ratio * ratio);
  return {std::sqrt(share) * kept, (1 - share) * kept * kept};
}

bool LaneCodeLock::lock_group(const Paths& paths, std::size_t first, Group& g) const {
  const std::size_t count = paths.size(), stride = paths.lanes;
  const float* re = paths.re.data() + first;
  const float* im = paths.im.data() + first;
  const float* incoherent = paths.incoherent.data() + first;
  const float* delays = paths.delay_chips.data();
  const auto pull = [&](const Lanes& tau) {
    Sums s;
    correlate(table_.data(), tau.data(), half_spacing_, count, delays, re, im, incoherent, stride, s);
    for (std::size_t i = 0; i < kWidth; ++i) {
      const float early = s.early_re[i] * s.early_re[i] + s.early_im[i] * s.early_im[i] + s.early[i];
      const float late = s.late_re[i] * s.late_re[i] + s.late_im[i] * s.late_im[i] + s.late[i];
      // Early of the replica: it comes before, so that a path lies behind it by lag - spacing / 2.
      g.d[i] = early - late;
      g.total[i] = early + late;
    }
  };

  // Where the prompt correlator is strongest.
  Lanes strongest{}, peak_power{}, tau{};
  float earliest = delays[0], latest = delays[0];
  peak_power.fill(-1);
  for (std::size_t p = 0; p < count; ++p) {
    earliest = std::min(earliest, delays[p]);
    latest = std::max(latest, delays[p]);
    Lanes power;
    prompt_at(table_.data(), delays[p], count, delays, re, im, incoherent, stride, power.data());
    for (std::size_t i = 0; i < kWidth; ++i) {
      const std::size_t k = p * stride + i;
      const float own = re[k] * re[k] + im[k] * im[k] + incoherent[k];
      strongest[i] = std::max(strongest[i], own);
      if (!(own > 0)) continue;
      if (power[i] > peak_power[i] * (1 + 1e-6F) ||
          (power[i] >= peak_power[i] * (1 - 1e-6F) && delays[p] < tau[i] && peak_power[i] >= 0)) {
        peak_power[i] = power[i];
        tau[i] = delays[p];
      }
    }
  }

  enum class State : unsigned char { Scanning, Refining, Done, Lost };
  std::array<State, kWidth> state{};
  Lanes way{}, step{}, low{}, high{}, d_low{}, d_high{}, from = tau, d_from{};
  std::array<signed char, kWidth> side{};
  pull(tau);
  bool scanning = false;
  for (std::size_t i = 0; i < kWidth; ++i) {
    if (!(strongest[i] > 0)) {
      state[i] = State::Lost;
    } else if (std::abs(g.d[i]) <= kLaneAtRest * g.total[i]) {
      state[i] = State::Done;
    } else {
      way[i] = g.d[i] < 0 ? 1.0F : -1.0F;
      d_from[i] = g.d[i];
      step[i] = std::clamp(1.2F * std::abs(gain_ * g.d[i] / g.total[i]), step_ / 32, step_);
      scanning = true;
    }
  }
  for (int n = 0; scanning && n < kMostSteps; ++n) {
    for (std::size_t i = 0; i < kWidth; ++i) {
      if (state[i] == State::Scanning) tau[i] = from[i] + way[i] * step[i];
    }
    pull(tau);
    scanning = false;
    for (std::size_t i = 0; i < kWidth; ++i) {
      if (state[i] != State::Scanning) continue;
      if (tau[i] < earliest - 1 || tau[i] > latest + 1) {
        state[i] = State::Lost;
      } else if (std::abs(g.d[i]) <= kLaneAtRest * g.total[i]) {
        state[i] = State::Done;
      } else if ((g.d[i] < 0) != (d_from[i] < 0)) {
        const bool up = way[i] > 0;
        low[i] = up ? from[i] : tau[i];
        high[i] = up ? tau[i] : from[i];
        d_low[i] = up ? d_from[i] : g.d[i];
        d_high[i] = up ? g.d[i] : d_from[i];
        state[i] = State::Refining;
      } else {
        from[i] = tau[i];
        d_from[i] = g.d[i];
        step[i] = std::min(2 * step[i], step_);
        scanning = true;
      }
    }
  }
  // Regula falsi with the Illinois correction, and bisection where that is slow, as CodeTracker.
  for (int n = 0; n < kMostRefinements; ++n) {
    bool refining = false;
    for (std::size_t i = 0; i < kWidth; ++i) {
      if (state[i] != State::Refining) continue;
      refining = true;
      float middle = n % 4 == 3 ? (low[i] + high[i]) / 2
                                : (low[i] * d_high[i] - high[i] * d_low[i]) / (d_high[i] - d_low[i]);
      if (!(middle > low[i] && middle < high[i])) middle = (low[i] + high[i]) / 2;
      tau[i] = middle;
    }
    if (!refining) break;
    pull(tau);
    for (std::size_t i = 0; i < kWidth; ++i) {
      if (state[i] != State::Refining) continue;
      if (std::abs(g.d[i]) <= kLaneAtRest * g.total[i] || high[i] - low[i] < 1e-5F) {
        state[i] = State::Done;
      } else if (g.d[i] > 0) {
        high[i] = tau[i];
        d_high[i] = g.d[i];
        if (side[i] == 1) d_low[i] /= 2;
        side[i] = 1;
      } else {
        low[i] = tau[i];
        d_low[i] = g.d[i];
        if (side[i] == -1) d_high[i] /= 2;
        side[i] = -1;
      }
    }
  }
  g.delay = tau;
  prompt(table_.data(), tau.data(), count, delays, re, im, incoherent, stride, g.power.data());
  bool all = true;
  for (std::size_t i = 0; i < kWidth; ++i) {
    if (!(strongest[i] > 0)) {
      g.power[i] = 0;
    } else if (state[i] == State::Lost || state[i] == State::Scanning || g.power[i] < least_ * strongest[i]) {
      g.power[i] = -1;
      all = false;
    }
  }
  return all;
}

void LaneCodeLock::lock_alone(const Paths& paths, std::size_t lane, float& delay_m,
                              float& prompt_power) const {
  const DllOptions& loop = tracker_->options();
  std::vector<SignalPath> alone;
  for (std::size_t p = 0; p < paths.size(); ++p) {
    const std::size_t k = p * paths.lanes + lane;
    const std::complex<double> coherent(paths.re[k], paths.im[k]);
    const double in_phase = std::norm(coherent), power = in_phase + static_cast<double>(paths.incoherent[k]);
    if (!(power > 0)) continue;
    // The fading whose average() this is.
    SignalPath path;
    path.delay_m = static_cast<double>(paths.delay_chips[p]) * tracker_->correlation().chip_m();
    const double share = std::max(in_phase / power, 1e-6);
    path.fading_hz =
        std::sqrt(std::max(0.0, 1 / share - 1)) * 4 * loop.loop_bandwidth_hz / (2 * geodesy::kPi);
    const double turn = geodesy::kPi * path.fading_hz * loop.integration_s;
    const double kept = std::abs(turn) < 1e-8 ? 1 : std::sin(turn) / turn;
    path.amplitude = std::polar(std::sqrt(power) / std::max(std::abs(kept), 1e-3), std::arg(coherent));
    alone.push_back(path);
  }
  const auto lock = tracker_->lock(alone);
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
    Group group;
    group.power.fill(-1);
    if (power) lock_group(paths, first, group);
    for (std::size_t i = 0; i < kWidth; ++i) {
      if (group.power[i] < 0) {
        lock_alone(paths, first + i, delay_m[first + i], prompt_power[first + i]);
      } else {
        delay_m[first + i] = group.delay[i] * chip_m;
        prompt_power[first + i] = group.power[i];
      }
    }
  }
}

}  // namespace canyon::tracking
