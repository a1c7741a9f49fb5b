#include "canyon/simulation/samples/waveform.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "canyon/base/arithmetic.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/receiver/tracking/channel.hpp"
#include "canyon/sky/broadcast/symbols.hpp"

namespace canyon::samples {

Waveform::Waveform(gnss::SatelliteId id, const gnss::Signal& signal, geodesy::GpsTime zero)
    : id_(id), signal_(&signal), zero_(zero) {
  std::vector<Component> sent = components(id, signal);
  if (sent.empty()) return;
  for (const Component& c : sent)
    slots_per_chip_ = std::max<std::int64_t>(slots_per_chip_, tracking::slots_per_chip(c.modulation));
  slot_rate_hz_ = sent.front().chip_rate_hz * static_cast<double>(slots_per_chip_);
  constexpr std::int64_t kWeek = geodesy::GpsTime::kSecondsPerWeek;
  second_ = zero.nanosecond_of_week() / geodesy::GpsTime::kNanosecondsPerSecond;
  if (id.system == gnss::System::BeiDou) second_ += kWeek - geodesy::kBdtSecondsOffset;
  // All components of an 'X' are tracked, else the pilot if there is one.
  const bool all = signal.code.back() == 'X' ||
                   std::all_of(sent.begin(), sent.end(), [](const Component& c) { return c.data; });
  double tracked = 0;
  for (Component& component : sent) {
    assert(component.chip_rate_hz == sent.front().chip_rate_hz);
    if (all || !component.data) tracked += component.power_fraction;
    Part part;
    const double factor = amplitude(component);
    const auto projected = [&](double x) { return std::abs(x) > 1e-9 ? factor * x : 0; };
    part.re = projected(std::cos(component.phase_rad));
    part.im = projected(std::sin(component.phase_rad));
    complex_ = complex_ || part.im != 0;
    part.rows = tracking::chips_per_pattern(component.modulation);
    for (std::int64_t row = 0; row < part.rows; ++row) {
      for (std::int64_t slot = 0; slot < slots_per_chip_; ++slot) {
        const double fraction = (static_cast<double>(slot) + 0.5) / static_cast<double>(slots_per_chip_);
        part.patterns.push_back(
            static_cast<float>(subcarrier(component.modulation, fraction, static_cast<std::size_t>(row))));
      }
    }
    part.component = std::move(component);
    parts_.push_back(std::move(part));
  }
  power_over_tracked_ = 1 / tracked;
}

bool Waveform::read_symbols(const gnss::NavigationData& navigation, double from_s, double to_s) {
  if (std::none_of(parts_.begin(), parts_.end(), [](const Part& part) { return part.component.data; }))
    return true;
  symbols_.erase(
      std::remove_if(symbols_.begin(), symbols_.end(), [&](const Symbols& s) { return s.end_s() <= from_s; }),
      symbols_.end());
  double next_s = symbols_.empty() ? from_s : symbols_.back().end_s();
  bool complete = true;
  while (next_s <= to_s) {
    // Frames follow each other; no symbol ends in the first millisecond.
    const auto frame = broadcast::symbol_frame(navigation, id_, *signal_, zero_ + (next_s + 5e-4));
    if (!frame || frame->symbols.empty()) {
      complete = false;
      next_s += 1;
      continue;
    }
    symbols_.push_back({frame->start - zero_, frame->symbol_s, frame->symbols});
    assert(symbols_.back().end_s() > next_s);
    next_s = symbols_.back().end_s();
  }
  return complete;
}

int Waveform::symbol_at(double seconds) const {
  for (const Symbols& s : symbols_) {
    if (seconds < s.start_s || seconds >= s.end_s()) continue;
    return s
        .values[std::min(s.values.size() - 1, static_cast<std::size_t>((seconds - s.start_s) / s.symbol_s))];
  }
  return 1;
}

void Waveform::send(const Part& part, std::int64_t first, std::size_t count, float amplitude,
                    float* out) const {
  const Component& c = part.component;
  const auto chip_rate = static_cast<std::int64_t>(std::llround(c.chip_rate_hz));
  const auto length = static_cast<std::int64_t>(c.chips.size());
  const auto n = static_cast<std::int64_t>(count);
  // Chips since the begin of the week, and the part of them within [first, first + count).
  const std::int64_t before = second_ * chip_rate;
  const std::int64_t first_chip = floor_div(first, slots_per_chip_);
  const std::int64_t end_chip = floor_div(first + n - 1, slots_per_chip_) + 1;
  for (std::int64_t chip = first_chip; chip < end_chip;) {
    const std::int64_t period = (before + chip) / length;
    const std::int64_t begin = period * length - before;  // of the period
    const std::int64_t end = std::min(end_chip, begin + length);
    float value = amplitude;
    if (c.data) value *= static_cast<float>(symbol_at((static_cast<double>(begin) + 0.5) / c.chip_rate_hz));
    value *= static_cast<float>(
        c.secondary[static_cast<std::size_t>(period % static_cast<std::int64_t>(c.secondary.size()))]);
    const std::int8_t* chips = c.chips.data() + (chip - begin);
    if (slots_per_chip_ == 1) {
      float* to = out + (chip - first);
      for (std::int64_t i = 0; i < end - chip; ++i) to[i] += value * static_cast<float>(chips[i]);
    } else {
      for (std::int64_t i = chip; i < end; ++i) {
        const float chip_value = value * static_cast<float>(chips[i - chip]);
        const float* pattern = part.patterns.data() + (i - begin) % part.rows * slots_per_chip_;
        const std::int64_t at = i * slots_per_chip_ - first;
        const std::int64_t from = std::max<std::int64_t>(0, -at);
        const std::int64_t to = std::min(slots_per_chip_, n - at);
        for (std::int64_t s = from; s < to; ++s) out[at + s] += chip_value * pattern[s];
      }
    }
    chip = end;
  }
}

void Waveform::send(std::int64_t first, std::size_t count, Slots& slots) const {
  slots.re.assign(count, 0);
  slots.im.assign(complex_ ? count : 0, 0);
  for (const Part& part : parts_) {
    if (part.re != 0) send(part, first, count, static_cast<float>(part.re), slots.re.data());
    if (part.im != 0) send(part, first, count, static_cast<float>(part.im), slots.im.data());
  }
}

}  // namespace canyon::samples
