#include "canyon/simulation/samples/path_interpolator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <set>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/receiver/positioning/range_terms.hpp"
#include "canyon/receiver/random_streams.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/receiver/tracking/channel_fading.hpp"

namespace canyon::samples {
namespace {

using geodesy::kSpeedOfLight;
using propagation::Path;
using propagation::PathKind;
using Complex = std::complex<double>;

constexpr double kTwoPi = 2 * geodesy::kPi;
/// A path farther than this from its prediction by rates is another path [m].
constexpr double kJump_m = 20;
/// Diffuse paths are merged within this [chips].
constexpr double kMerged_chips = 0.1;

/// A satellite's signal during the run.
struct Source {
  std::string name;  ///< "G05 L1CA"
  Waveform waveform;
  tracking::PathFades fades;
  double offset_db = 0;
  struct Bundle {
    RandomStream stream;
    Complex value;
    double cycles = 0;
  };
  std::map<std::uint64_t, Bundle> bundles;
  std::size_t sampled = 0;
  bool without_message = false;
};

/// A path at an epoch. Lengths are whole pseudoranges [m] without atmosphere; rates are per second of the
/// receiver's clock.
struct PathAtEpoch {
  PathKind kind = PathKind::Direct;
  std::uint64_t reflector = 0;
  std::uint32_t signals = 0;
  receiver::CodeAndCarrier range, rate;
  Complex amplitude;                     ///< relative to the noise; without the phase of carrier_m
  double decay_per_s = 0, shift_hz = 0;  ///< Diffuse: of its fading

  [[nodiscard]] bool is(const PathAtEpoch& other) const {
    return kind == other.kind && reflector == other.reflector && signals == other.signals;
  }
};

/// A satellite's signal at an epoch.
struct SignalAtEpoch {
  Source* source = nullptr;
  double carrier_hz = 0;
  receiver::CodeAndCarrier air;  ///< atmosphere delays
  std::vector<PathAtEpoch> paths;
};

/// All signals that arrive at an epoch.
struct EpochSignals {
  double reading_s = 0;  ///< of the receiver's clock since the whole second
  std::map<std::pair<gnss::SatelliteId, std::size_t>, SignalAtEpoch> signals;
  std::vector<tracking::ReceivedWave> waves;
};

Cubic hermite(double from, double from_slope, double to, double to_slope) {
  const double rise = to - from;
  return {from, from_slope, 3 * rise - 2 * from_slope - to_slope, from_slope + to_slope - 2 * rise};
}

/// Between the same path at two epochs; if one is null, the path appears or disappears.
InterpolatedPath interpolate(const PathAtEpoch* from, const PathAtEpoch* to,
                             const std::array<receiver::CodeAndCarrier, 2>& air, double length_s) {
  InterpolatedPath path;
  const auto cubic = [&](double receiver::CodeAndCarrier::*part) {
    Cubic c;
    if (from != nullptr && to != nullptr)
      c = hermite(from->range.*part, from->rate.*part * length_s, to->range.*part, to->rate.*part * length_s);
    else if (from != nullptr)
      c = {from->range.*part, from->rate.*part * length_s, 0, 0};
    else
      c = {to->range.*part - to->rate.*part * length_s, to->rate.*part * length_s, 0, 0};
    c.a += air[0].*part;
    c.b += air[1].*part - air[0].*part;
    return c;
  };
  path.code_m = cubic(&receiver::CodeAndCarrier::code);
  path.carrier_m = cubic(&receiver::CodeAndCarrier::carrier);
  if (from != nullptr) path.from = from->amplitude;
  if (to != nullptr) path.to = to->amplitude;
  return path;
}

bool follows(const PathAtEpoch& from, const PathAtEpoch& to, double length_s) {
  const double expected = from.range.code + (from.rate.code + to.rate.code) / 2 * length_s;
  return from.is(to) && std::abs(to.range.code - expected) < kJump_m;
}

class Interpolator final : public PathInterpolator {
 public:
  Interpolator(const receiver::ReceiverOptions& receiver_options, std::uint64_t seed,
               const std::map<gnss::System, gnss::Klobuchar>& coefficients, const FrontEnd& sample_front_end,
               double rate_hz)
      : options(receiver_options),
        klobuchar(coefficients),
        front_end(sample_front_end),
        made_hz(rate_hz),
        model(options.signal, seed, options.name, receiver::stream_name(options)),
        run_key(RandomStream(seed, options.name + "/samples").next()) {
    options.validate();
    if (options.signal.enabled) return;
    throw InputError(
        fmt::format("receiver '{}': its signals have no strength, but samples need it", options.name),
        "give it signal: {enabled: true}, or another profile");
  }

  [[nodiscard]] std::optional<SignalSegment> next(const simulation::Epoch& epoch) override {
    EpochSignals now = signals_at(epoch);
    std::optional<SignalSegment> segment;
    if (last) {
      segment = segment_to(now);
      if (!(segment->length_s > 0))
        throw InputError("samples: time goes backwards", "give epochs in order of time");
      if (epoch.navigation != nullptr) read_symbols(*epoch.navigation, now);
    }
    last = std::move(now);
    return segment;
  }

  [[nodiscard]] double reading_s() const override { return last->reading_s; }
  [[nodiscard]] geodesy::GpsTime zero() const override { return *whole_second; }
  [[nodiscard]] const Generator::Contents& contents() const override { return counted; }
  [[nodiscard]] std::uint64_t noise_key() const override { return run_key; }

 private:
  EpochSignals signals_at(const simulation::Epoch& epoch) {
    assert(epoch.arrival != nullptr);
    const geodesy::GpsTime time = epoch.truth.time;
    if (!whole_second) {
      constexpr std::int64_t kSecond = geodesy::GpsTime::kNanosecondsPerSecond;
      whole_second = geodesy::GpsTime::from_nanoseconds(time.nanoseconds() / kSecond * kSecond);
    }
    EpochSignals now;
    now.reading_s = (time - *whole_second) + epoch.observed.clock_bias_s - epoch.observed.events.clock_bias_s;
    model.receive(epoch.arrival->interference, now.waves);
    if (epoch.arrival->containment == raytrace::Containment::Free) {
      for (const propagation::SatelliteView& view : epoch.arrival->views)
        for (const gnss::Signal& signal : gnss::signals_of(view.line.id.system))
          add_signal(epoch, view, signal, now);
    }
    count(now);
    return now;
  }

  /// Null if no code of the satellite's is known.
  [[nodiscard]] Source* source_of(const propagation::SatelliteView& view, const gnss::Signal& signal,
                                  geodesy::GpsTime time) {
    const gnss::SatelliteId id = view.line.id;
    const auto [found, is_new] = sources.try_emplace({id, gnss::index_of(signal)});
    if (!is_new) return found->second.get();
    Waveform waveform(id, signal, *whole_second);
    if (waveform.empty()) return nullptr;
    if (waveform.slot_rate_hz() > kMaxSlots * made_hz) {
      throw InputError(fmt::format("{} samples per second are too few for {} {}", front_end.rate_hz,
                                   gnss::name(signal.system), signal.name),
                       "choose a higher sample rate");
    }
    found->second = std::make_unique<Source>(Source{fmt::format("{} {}", gnss::to_string(id), signal.name),
                                                    std::move(waveform),
                                                    model.fades(id, signal),
                                                    model.offset_db(id, signal, time),
                                                    {}});
    return found->second.get();
  }

  /// Adds a satellite's signal with its paths if it is carried and arrives.
  void add_signal(const simulation::Epoch& epoch, const propagation::SatelliteView& view,
                  const gnss::Signal& signal, EpochSignals& now) {
    const orbit::LineOfSight& line = view.line;
    const double carrier_hz = gnss::carrier_hz(signal, line.state.carrier_frequency_hz);
    if (!options.signal.antenna.receives(signal::band_of(carrier_hz)) ||
        !gnss::transmits(line.id, signal, epoch.truth.time) || !carries(front_end, signal, carrier_hz))
      return;
    Source* source = source_of(view, signal, epoch.truth.time);
    if (source == nullptr) return;

    SignalAtEpoch sent;
    sent.source = source;
    sent.carrier_hz = carrier_hz;
    tracking::AntennaMotion motion;
    motion.velocity_ecef =
        geodesy::enu_from_ecef_rotation(epoch.truth.position).transpose() * epoch.truth.velocity_enu_mps;
    motion.ecef_from_enu = epoch.arrival->ecef_from_enu;
    receiver::RangeState state{&options,
                               &klobuchar,
                               &view,
                               &signal,
                               carrier_hz,
                               epoch.truth.time,
                               epoch.truth.position,
                               {epoch.observed.clock_bias_s - epoch.observed.events.clock_bias_s,
                                epoch.observed.clock_drift - epoch.observed.events.clock_drift}};
    state.bias_m = receiver::fixed_bias_m(options.biases, line.id, signal, carrier_hz, epoch.truth.time);
    state.motion = &motion;
    // The atmosphere delays are interpolated separately from the paths.
    sent.air = receiver::range_of(receiver::RangeTermOf::Space, state);
    const auto path_of = [&](const Path& path, double excess_m, double code_ahead_m) {
      state.code_excess_m = excess_m + code_ahead_m;
      state.carrier_excess_m = excess_m;
      state.path = &path;
      PathAtEpoch at;
      at.kind = path.kind;
      at.reflector = path.reflector;
      at.signals = path.signals;
      for (const auto of : {receiver::RangeTermOf::Satellite, receiver::RangeTermOf::Receiver,
                            receiver::RangeTermOf::Channel})
        at.range += receiver::range_of(of, state);
      at.rate = receiver::signal_rate(state);
      return at;
    };

    const double wavelength = kSpeedOfLight / carrier_hz;
    const double cn0_hz =
        std::pow(10, model.clear_cn0_dbhz(signal, line.elevation_rad, source->offset_db) / 10);
    // The noise has the variance 2 at this rate, so its density is 2 / rate.
    const double unit = std::sqrt(cn0_hz * 2 / made_hz * source->waveform.power_over_tracked()) *
                        model.gain_under_interference(now.waves, signal::band_of(carrier_hz));
    signal::path_amplitudes(view, carrier_hz, options.signal.antenna, options.signal.strength, amplitudes);
    source->fades.next_epoch();
    const auto path_mps = [&](const Path& path) {
      return tracking::path_rate_mps(line, motion.velocity_ecef, path, motion.ecef_from_enu);
    };
    struct Merged {
      double power = 0, excess_m = 0, rate_mps = 0;
    };
    std::map<std::int64_t, Merged> diffuse;
    const std::vector<Path>& paths = view.paths.paths;
    for (std::size_t i = 0; i < paths.size(); ++i) {
      const Path& path = paths[i];
      if ((path.signals & (1U << gnss::index_of(signal))) == 0) continue;
      if (path.kind == PathKind::Diffuse) {
        const double power = std::norm(amplitudes[i]);
        const auto bin = static_cast<std::int64_t>(
            std::floor(path.excess_m * signal.chip_rate_hz / kSpeedOfLight / kMerged_chips));
        Merged& merged = diffuse[bin];
        merged.power += power;
        merged.excess_m += power * path.excess_m;
        merged.rate_mps += power * path_mps(path);
        continue;
      }
      PathAtEpoch& at = sent.paths.emplace_back(path_of(path, path.carrier_excess_m(), path.code_ahead_m));
      at.amplitude = amplitudes[i] * unit *
                     std::polar(1.0, kTwoPi * std::remainder(path.carrier_excess_m() / wavelength, 1));
      if (path.kind == PathKind::Reflected || path.kind == PathKind::Transmitted)
        at.amplitude *= source->fades.fixed(model.phases(), path.reflector);
    }
    const Path direct;
    for (const auto& [bin, merged] : diffuse) {
      if (!(merged.power > 0)) continue;
      PathAtEpoch& at = sent.paths.emplace_back(path_of(direct, 0, merged.excess_m / merged.power));
      const double rate_mps = merged.rate_mps / merged.power - path_mps(direct);
      const double coherence_m = tracking::kCoherenceWavelengths * wavelength;
      at.kind = PathKind::Diffuse;
      at.reflector = static_cast<std::uint64_t>(bin);
      at.rate.code += rate_mps;
      at.amplitude = std::sqrt(merged.power) * unit;
      at.shift_hz = tracking::fading_rate_hz(rate_mps, wavelength);
      at.decay_per_s =
          (motion.velocity_ecef.norm() + merged.excess_m / merged.power * view.direction_rate_radps()) /
          coherence_m;
    }
    if (!sent.paths.empty()) now.signals.emplace(std::pair(line.id, gnss::index_of(signal)), std::move(sent));
  }

  void count(const EpochSignals& now) {
    std::map<std::string, std::size_t> satellites;
    std::size_t paths = 0;
    for (const auto& [key, sent] : now.signals) {
      const gnss::System system = key.first.system;
      ++satellites[fmt::format("{} {}", gnss::name(system), gnss::signals_of(system)[key.second].name)];
      paths += sent.paths.size();
    }
    for (const auto& [name, count] : satellites)
      counted.satellites[name] = std::max(counted.satellites[name], count);
    counted.max_paths = std::max(counted.max_paths, paths);
  }

  [[nodiscard]] SignalSegment segment_to(const EpochSignals& now) {
    SignalSegment segment;
    segment.waves = last->waves;
    segment.begin_s = last->reading_s;
    segment.length_s = now.reading_s - last->reading_s;
    std::set<std::pair<gnss::SatelliteId, std::size_t>> keys;
    for (const auto& [key, sent] : last->signals) keys.insert(key);
    for (const auto& [key, sent] : now.signals) keys.insert(key);
    for (const auto& key : keys) {
      static const SignalAtEpoch nothing;
      const auto found_from = last->signals.find(key);
      const auto found_to = now.signals.find(key);
      const SignalAtEpoch& from = found_from != last->signals.end() ? found_from->second : nothing;
      const SignalAtEpoch& to = found_to != now.signals.end() ? found_to->second : nothing;
      const SignalAtEpoch& any = from.source != nullptr ? from : to;
      const SignalAtEpoch& other = to.source != nullptr ? to : from;
      const std::array air{any.air, other.air};
      SignalSegment::Signal& signal =
          segment.signals.emplace_back(SignalSegment::Signal{&any.source->waveform, any.carrier_hz, {}});
      std::vector<bool> met(to.paths.size());
      const auto add = [&](const PathAtEpoch* begin, const PathAtEpoch* end) {
        InterpolatedPath& added = signal.paths.emplace_back(interpolate(begin, end, air, segment.length_s));
        const PathAtEpoch& path = end != nullptr ? *end : *begin;
        if (path.kind == PathKind::Diffuse) fade(*any.source, path, begin, segment.length_s, added);
      };
      for (const PathAtEpoch& path : from.paths) {
        std::size_t k = 0;
        while (k < to.paths.size() && (met[k] || !follows(path, to.paths[k], segment.length_s))) ++k;
        if (k < to.paths.size()) met[k] = true;
        add(&path, k < to.paths.size() ? &to.paths[k] : nullptr);
      }
      for (std::size_t k = 0; k < to.paths.size(); ++k)
        if (!met[k]) add(nullptr, &to.paths[k]);
      std::erase_if(any.source->bundles, [&](const auto& bundle) {
        return std::none_of(to.paths.begin(), to.paths.end(), [&](const PathAtEpoch& path) {
          return path.kind == PathKind::Diffuse && path.reflector == bundle.first;
        });
      });
    }
    return segment;
  }

  /// Samples the fading of a diffuse path over a segment.
  void fade(Source& source, const PathAtEpoch& path, const PathAtEpoch* before, double length_s,
            InterpolatedPath& interpolated) {
    auto found = source.bundles.find(path.reflector);
    if (found == source.bundles.end()) {
      RandomStream stream(run_key, fmt::format("{}/{}", source.name, ++source.sampled));
      const double re = stream.normal(), im = stream.normal();
      found =
          source.bundles.emplace(path.reflector, Source::Bundle{stream, Complex(re, im) * std::sqrt(0.5), 0})
              .first;
    }
    Source::Bundle& bundle = found->second;
    const auto count = static_cast<std::size_t>(std::ceil(length_s / kBlock_s)) + 1;
    const double shift_hz = before != nullptr ? (path.shift_hz + before->shift_hz) / 2 : path.shift_hz;
    const double kept = std::exp(-path.decay_per_s * kBlock_s);
    const double sampled = std::sqrt((1 - kept * kept) / 2);
    interpolated.fading.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
      interpolated.fading.emplace_back(bundle.value * std::polar(1.0, kTwoPi * bundle.cycles));
      const double re = bundle.stream.normal(), im = bundle.stream.normal();
      bundle.value = kept * bundle.value + sampled * Complex(re, im);
      bundle.cycles = std::remainder(bundle.cycles + shift_hz * kBlock_s, 1);
    }
  }

  void read_symbols(const gnss::NavigationData& navigation, const EpochSignals& now) {
    // Upper bound of the signals' travel time.
    constexpr double kTravel_s = 0.3;
    for (const auto& [key, source] : sources) {
      if (!source || last->signals.count(key) + now.signals.count(key) == 0) continue;
      if (source->waveform.read_symbols(navigation, last->reading_s - kTravel_s, now.reading_s)) continue;
      if (!std::exchange(source->without_message, true)) counted.without_message.push_back(source->name);
    }
  }

  receiver::ReceiverOptions options;
  std::map<gnss::System, gnss::Klobuchar> klobuchar;
  FrontEnd front_end;
  double made_hz;
  tracking::ChannelModel model;
  std::uint64_t run_key;  // of random streams

  std::optional<geodesy::GpsTime> whole_second;  // readings count from it
  std::map<std::pair<gnss::SatelliteId, std::size_t>, std::unique_ptr<Source>> sources;  // null: no code
  std::optional<EpochSignals> last;
  std::vector<Complex> amplitudes;
  Generator::Contents counted;
};

}  // namespace

std::unique_ptr<PathInterpolator> make_path_interpolator(
    const receiver::ReceiverOptions& options, std::uint64_t seed,
    const std::map<gnss::System, gnss::Klobuchar>& klobuchar, const FrontEnd& front_end, double made_hz) {
  return std::make_unique<Interpolator>(options, seed, klobuchar, front_end, made_hz);
}

}  // namespace canyon::samples
