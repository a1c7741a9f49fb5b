#include "canyon/samples/generator.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <complex>
#include <limits>
#include <optional>
#include <set>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/receiver/receiver_draws.hpp"
#include "canyon/receiver/signal_delays.hpp"
#include "canyon/samples/front_end_filter.hpp"
#include "canyon/samples/waveform.hpp"
#include "canyon/tracking/channel.hpp"
#include "canyon/tracking/channel_rate.hpp"
#include "canyon/tracking/interference.hpp"

namespace canyon::samples {
namespace {

using geodesy::kSpeedOfLight;
using propagation::Path;
using propagation::PathKind;
using Complex = std::complex<double>;

constexpr double kTurn = 2 * geodesy::kPi;
constexpr float kSqrt2 = 1.41421356F;
constexpr double kBlock_s = 1e-3;
constexpr std::size_t kBlocksAtOnce = 64;
/// Farther than its rates say, a path is another one [m].
constexpr double kJump_m = 20;
/// Paths of less than this C/N0 [Hz] are left out.
constexpr double kLeastCn0_hz = 1;
/// Diffuse paths are merged within this [chips].
constexpr double kMerged_chips = 0.1;

/// A satellite's signal as long as the run.
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
  std::size_t drawn = 0;
  bool without_message = false;
};

/// A path at an epoch. Lengths are whole pseudoranges [m] without atmosphere, rates per second of the
/// receiver's clock.
struct Way {
  PathKind kind = PathKind::Direct;
  std::uint64_t reflector = 0;
  std::uint32_t signals = 0;
  double code_m = 0, code_mps = 0, carrier_m = 0, carrier_mps = 0;
  Complex amplitude;                     ///< over the noise; the phase of carrier_m is not in it
  double decay_per_s = 0, shift_hz = 0;  ///< Diffuse: of its fading

  [[nodiscard]] bool is(const Way& other) const {
    return kind == other.kind && reflector == other.reflector && signals == other.signals;
  }
};

/// A satellite's signal at an epoch.
struct Sent {
  Source* source = nullptr;
  double carrier_hz = 0;
  double code_air_m = 0, carrier_air_m = 0;
  std::vector<Way> ways;
};

struct Knot {
  double reading_s = 0;  ///< of the receiver's clock since the whole second
  std::map<std::pair<gnss::SatelliteId, std::size_t>, Sent> sent;
  std::vector<tracking::ReceivedWave> waves;
};

/// a + b s + c s^2 + d s^3 over [0, 1].
struct Cubic {
  double a = 0, b = 0, c = 0, d = 0;
  [[nodiscard]] double at(double s) const { return a + s * (b + s * (c + s * d)); }
};
Cubic hermite(double from, double from_slope, double to, double to_slope) {
  const double rise = to - from;
  return {from, from_slope, 3 * rise - 2 * from_slope - to_slope, from_slope + to_slope - 2 * rise};
}

/// A path from epoch to epoch.
struct Flight {
  Cubic code_m, carrier_m;
  Complex from, to;
  std::vector<std::complex<float>> fading;  ///< by block; empty: none
};
struct Segment {
  double begin_s = 0, length_s = 0;
  struct Of {
    const Waveform* waveform;
    double carrier_hz;
    std::vector<Flight> flights;
  };
  std::vector<Of> signals;
};

/// A flight between the same path at two epochs, or, where one is null, to or from nothing.
Flight fly(const Way* from, const Way* to, const std::array<double, 2>& code_air_m,
           const std::array<double, 2>& carrier_air_m, double length_s) {
  Flight flight;
  const auto cubic = [&](double Way::*value, double Way::*rate, const std::array<double, 2>& air) {
    Cubic c;
    if (from != nullptr && to != nullptr) {
      c = hermite(from->*value, from->*rate * length_s, to->*value, to->*rate * length_s);
    } else if (from != nullptr) {
      c = {from->*value, from->*rate * length_s, 0, 0};
    } else {
      c = {to->*value - to->*rate * length_s, to->*rate * length_s, 0, 0};
    }
    c.a += air[0];
    c.b += air[1] - air[0];
    return c;
  };
  flight.code_m = cubic(&Way::code_m, &Way::code_mps, code_air_m);
  flight.carrier_m = cubic(&Way::carrier_m, &Way::carrier_mps, carrier_air_m);
  if (from != nullptr) flight.from = from->amplitude;
  if (to != nullptr) flight.to = to->amplitude;
  return flight;
}

bool follows(const Way& from, const Way& to, double length_s) {
  const double expected = from.code_m + (from.code_mps + to.code_mps) / 2 * length_s;
  return from.is(to) && std::abs(to.code_m - expected) < kJump_m;
}

/// Complex noise of power 1 and about this width, the same at the same time: random values 1 / width apart,
/// joined by lines.
Complex band_noise(std::uint64_t key, double seconds, double width_hz) {
  const double steps = seconds * width_hz;
  const double before = std::floor(steps);
  const auto value = [key](double step) {
    RandomStream stream =
        keyed_stream(key ^ mix64(static_cast<std::uint64_t>(static_cast<std::int64_t>(step))));
    const double re = stream.normal(), im = stream.normal();
    return Complex(re, im);
  };
  const double s = steps - before;
  // Of variance 2 at the values; on average 2/3 of it between them.
  return ((1 - s) * value(before) + s * value(before + 1)) * std::sqrt(0.75);
}

}  // namespace

void FrontEnd::validate() const {
  if (!(rate_hz >= 1e6 && rate_hz <= 200e6)) {
    throw InputError(fmt::format("{} samples per second are out of range", rate_hz), "give 1e6 to 200e6");
  }
  if (!(centre_hz >= 1e9 && centre_hz <= 2e9)) {
    throw InputError(fmt::format("a centre of {} Hz is out of range", centre_hz),
                     "give 1e9 to 2e9 Hz, e.g. 1575.42e6");
  }
  if (!(centre_hz > lowest_hz() && centre_hz < highest_hz())) {
    throw InputError(
        fmt::format(
            "an intermediate frequency of {} Hz is aliased: {} {} samples per second carry {} to {} Hz",
            intermediate_hz, rate_hz, real ? "real" : "complex", lowest_hz() - zero_hz(), rate_hz / 2),
        real ? fmt::format("give half the band's width at least, and so much less than {} Hz at most; {} Hz "
                           "leaves the widest band",
                           rate_hz / 2, rate_hz / 4)
             : "sample faster, or choose a lower one");
  }
  if (bandwidth_hz == 0) return;
  if (!(bandwidth_hz >= rate_hz / 50 && kStopLeast * bandwidth_hz <= room_hz())) {
    throw InputError(fmt::format("a filter of {} Hz needs {} Hz to either side, and {} Hz are there",
                                 bandwidth_hz, kStopLeast * bandwidth_hz, room_hz()),
                     fmt::format("give {} to {} Hz{}", rate_hz / 50, room_hz() / kStopLeast,
                                 room_hz() < rate_hz / (real ? 4 : 2)
                                     ? fmt::format(", or {} the intermediate frequency",
                                                   real ? "a quarter of the rate for" : "lower")
                                     : ""));
  }
}

bool carries(const FrontEnd& front_end, const gnss::Signal& signal, double carrier_hz) {
  propagation::Spectrum spectrum;
  spectrum.shape = propagation::Spectrum::Shape::Code;
  spectrum.centre_hz = carrier_hz;
  spectrum.modulation = signal.modulation;
  spectrum.chip_rate_hz = signal.chip_rate_hz;
  double width_hz = 2 * std::min(carrier_hz - front_end.lowest_hz(), front_end.highest_hz() - carrier_hz);
  if (front_end.bandwidth_hz > 0) {
    width_hz = std::min(width_hz, front_end.bandwidth_hz - 2 * std::abs(carrier_hz - front_end.centre_hz));
  }
  return width_hz > 0 && tracking::share_within(spectrum, carrier_hz, width_hz) >= kLeastShare;
}

struct Generator::State {
  State(const receiver::ReceiverOptions& receiver_options, std::uint64_t run_seed,
        const std::map<gnss::System, gnss::Klobuchar>& coefficients, const FrontEnd& of_samples, int threads)
      : options(receiver_options),
        seed(run_seed),
        klobuchar(coefficients),
        front_end(of_samples),
        model(options.signal, seed, options.name, receiver::draws_of(options)),
        noise_key(RandomStream(seed, options.name + "/samples").next()),
        arena(threads == 0 ? tbb::this_task_arena::max_concurrency()
                           : std::min(threads, tbb::this_task_arena::max_concurrency())) {
    options.validate();
    front_end.validate();
    made = front_end;
    if (front_end.bandwidth_hz > 0) {
      made.real = false;
      made.intermediate_hz = made.bandwidth_hz = 0;
      made.rate_hz = front_end.rate_hz * kOversampling;
      per_sample = kOversampling;
      taps = low_pass(made.rate_hz, front_end.bandwidth_hz / 2,
                      std::min(kStop * front_end.bandwidth_hz, front_end.room_hz()));
      history = taps.size() - 1;
      lead_s = static_cast<double>(history / 2) / made.rate_hz;
      taps.resize((taps.size() + kLanes - 1) / kLanes * kLanes);
      unfiltered_re.assign(history, 0);
      unfiltered_im.assign(history, 0);
    }
    block_samples = static_cast<std::size_t>(std::llround(front_end.rate_hz * kBlock_s / kLanes)) * kLanes;
    if (options.signal.enabled) return;
    throw InputError(
        fmt::format("receiver '{}': its signals have no strength, and samples need one", options.name),
        "give it signal: {enabled: true}, or another profile");
  }

  Knot knot_at(const simulation::Epoch& epoch);
  void add_ways(const simulation::Epoch& epoch, const propagation::SatelliteView& view,
                const gnss::Signal& signal, Knot& knot);
  [[nodiscard]] Segment segment_to(const Knot& knot);
  void fade(Source& source, const Way& way, const Way* before, double length_s, Flight& flight);
  void make(const Segment& segment, std::size_t first, std::size_t samples, std::size_t in_segment,
            Block& block) const;
  void interfere(double begin_s, Block& block) const;
  void filter(std::size_t first, std::size_t samples, std::size_t at, Block& block) const;
  void make_blocks(const Segment& segment, std::size_t end, const Take& take);
  /// Of the samples that are made.
  [[nodiscard]] double made_s(std::size_t number) const {
    return first_s + static_cast<double>(number) / made.rate_hz + lead_s;
  }

  receiver::ReceiverOptions options;
  std::uint64_t seed;
  std::map<gnss::System, gnss::Klobuchar> klobuchar;
  FrontEnd front_end;
  FrontEnd made;               // what is made: without a filter front_end, else what comes to the filter
  std::size_t per_sample = 1;  // of them
  std::vector<float> taps;     // of the filter, from both ends alike but for zeros; empty: none
  std::size_t history = 0;     // samples before one that the filter takes
  double lead_s = 0;           // by which they are made ahead of the filter's delay
  tracking::ChannelModel model;
  std::uint64_t noise_key;
  tbb::task_arena arena;
  std::size_t block_samples = 0;

  std::optional<geodesy::GpsTime> zero;  // whole second that readings count from
  double first_s = 0;                    // reading of the first sample
  std::size_t sample = 0;                // that comes next
  std::map<std::pair<gnss::SatelliteId, std::size_t>, std::unique_ptr<Source>> sources;  // null: no code
  std::optional<Knot> last;
  std::vector<Block> blocks{kBlocksAtOnce};
  std::vector<float> unfiltered_re, unfiltered_im;  // history, then those of the blocks
  std::vector<Complex> amplitudes;
  Contents contents;
};

void Generator::State::add_ways(const simulation::Epoch& epoch, const propagation::SatelliteView& view,
                                const gnss::Signal& signal, Knot& knot) {
  const orbit::LineOfSight& line = view.line;
  const double carrier_hz = gnss::carrier_hz(signal, line.state.carrier_frequency_hz);
  if (!options.signal.antenna.receives(signal::band_of(carrier_hz)) ||
      !gnss::transmits(line.id, signal, epoch.truth.time) || !carries(front_end, signal, carrier_hz)) {
    return;
  }
  const std::pair key(line.id, gnss::index_of(signal));
  const auto [found, is_new] = sources.try_emplace(key);
  if (is_new) {
    Waveform waveform(line.id, signal, *zero);
    if (!waveform.empty()) {
      if (waveform.slot_rate_hz() > kMostSlots * made.rate_hz) {
        throw InputError(fmt::format("{} samples per second are too few for {} {}", front_end.rate_hz,
                                     gnss::name(signal.system), signal.name),
                         "sample faster");
      }
      found->second =
          std::make_unique<Source>(Source{fmt::format("{} {}", gnss::to_string(line.id), signal.name),
                                          std::move(waveform),
                                          model.fades(line.id, signal),
                                          model.offset_db(line.id, signal, epoch.truth.time),
                                          {}});
    }
  }
  if (!found->second) return;
  Source& source = *found->second;

  const double clock_s = epoch.observed.clock_bias_s - epoch.observed.events.clock_bias_s;
  const double drift = epoch.observed.clock_drift - epoch.observed.events.clock_drift;
  const receiver::DelaysInSignal delays = receiver::delays_in_signal(options, klobuchar, view, carrier_hz,
                                                                     epoch.truth.time, epoch.truth.position);
  Sent sent;
  sent.source = &source;
  sent.carrier_hz = carrier_hz;
  sent.code_air_m = delays.ionosphere_m + delays.troposphere_m + delays.orbit_error_m;
  sent.carrier_air_m = delays.troposphere_m - delays.ionosphere_m + delays.orbit_error_m;

  const double clocks_m = kSpeedOfLight * (clock_s - line.state.clock_bias_s);
  const double code_only_m =
      kSpeedOfLight * line.state.group_delay_of(signal) +
      receiver::fixed_bias_m(options.biases, line.id, signal, carrier_hz, epoch.truth.time);
  const double wavelength = kSpeedOfLight / carrier_hz;
  // A phase turns by the same time on every carrier's scale: cycles times this carrier's wavelength.
  const double metres_per_rad = gnss::kL1_hz / carrier_hz / kTurn * wavelength;
  const Eigen::Vector3d velocity_ecef =
      geodesy::enu_from_ecef_rotation(epoch.truth.position).transpose() * epoch.truth.velocity_enu_mps;
  const Eigen::Matrix3d& ecef_from_enu = epoch.arrival->ecef_from_enu;
  const auto way_of = [&](const Path& path, double excess_m, double code_ahead_m) {
    Way way;
    way.kind = path.kind;
    way.reflector = path.reflector;
    way.signals = path.signals;
    const double rate = (tracking::path_rate_mps(line, velocity_ecef, path, ecef_from_enu) +
                         kSpeedOfLight * (drift - line.state.clock_drift)) /
                        (1 + drift);
    way.carrier_m = line.range_m + excess_m + clocks_m + view.carrier_turn_rad * metres_per_rad;
    way.carrier_mps = rate + view.carrier_turn_radps * metres_per_rad;
    way.code_m = line.range_m + excess_m + code_ahead_m + clocks_m + code_only_m;
    way.code_mps = rate + path.code_ahead_mps;
    return way;
  };

  const double cn0_hz = std::pow(10, model.clear_cn0_dbhz(signal, line.elevation_rad, source.offset_db) / 10);
  // With the noise's variance 2 over the rate the density is 2 / rate.
  const double unit = std::sqrt(cn0_hz * 2 / made.rate_hz * source.waveform.power_over_tracked());
  signal::path_amplitudes(view, carrier_hz, options.signal.antenna, options.signal.strength, amplitudes);
  source.fades.next_epoch();
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
      merged.rate_mps += power * tracking::path_rate_mps(line, velocity_ecef, path, ecef_from_enu);
      continue;
    }
    Way& way = sent.ways.emplace_back(way_of(path, path.carrier_excess_m(), path.code_ahead_m));
    way.amplitude = amplitudes[i] * unit *
                    std::polar(1.0, kTurn * std::remainder(path.carrier_excess_m() / wavelength, 1));
    if (path.kind == PathKind::Reflected || path.kind == PathKind::Transmitted) {
      way.amplitude *= source.fades.fixed(model.phases(), path.reflector);
    }
  }
  const Path direct;
  const double direct_mps = tracking::path_rate_mps(line, velocity_ecef, direct, ecef_from_enu);
  for (const auto& [bin, merged] : diffuse) {
    if (!(merged.power > 0)) continue;
    Way& way = sent.ways.emplace_back(way_of(direct, 0, merged.excess_m / merged.power));
    const double rate_mps = merged.rate_mps / merged.power - direct_mps;
    const double coherence_m = tracking::kCoherenceWavelengths * wavelength;
    way.kind = PathKind::Diffuse;
    way.reflector = static_cast<std::uint64_t>(bin);
    way.code_mps += rate_mps;
    way.amplitude = std::sqrt(merged.power) * unit;
    way.shift_hz = tracking::fading_rate_hz(rate_mps, wavelength);
    way.decay_per_s =
        (velocity_ecef.norm() + merged.excess_m / merged.power * view.turning_radps()) / coherence_m;
  }
  if (!sent.ways.empty()) knot.sent.emplace(key, std::move(sent));
}

Knot Generator::State::knot_at(const simulation::Epoch& epoch) {
  assert(epoch.arrival != nullptr);
  const geodesy::GpsTime time = epoch.truth.time;
  if (!zero) {
    constexpr std::int64_t kSecond = geodesy::GpsTime::kNanosecondsPerSecond;
    zero = geodesy::GpsTime::from_nanoseconds(time.nanoseconds() / kSecond * kSecond);
  }
  Knot knot;
  knot.reading_s = (time - *zero) + epoch.observed.clock_bias_s - epoch.observed.events.clock_bias_s;
  model.receive(epoch.arrival->interference, knot.waves);
  if (epoch.arrival->placement == raytrace::Placement::Free) {
    for (const propagation::SatelliteView& view : epoch.arrival->views) {
      for (const gnss::Signal& signal : gnss::signals_of(view.line.id.system)) {
        add_ways(epoch, view, signal, knot);
      }
    }
  }
  std::map<std::string, std::size_t> satellites;
  std::size_t paths = 0;
  for (const auto& [key, sent] : knot.sent) {
    const gnss::System system = key.first.system;
    ++satellites[fmt::format("{} {}", gnss::name(system), gnss::signals_of(system)[key.second].name)];
    paths += sent.ways.size();
  }
  for (const auto& [name, count] : satellites) {
    contents.satellites[name] = std::max(contents.satellites[name], count);
  }
  contents.most_paths = std::max(contents.most_paths, paths);
  return knot;
}

void Generator::State::fade(Source& source, const Way& way, const Way* before, double length_s,
                            Flight& flight) {
  auto found = source.bundles.find(way.reflector);
  if (found == source.bundles.end()) {
    RandomStream stream(noise_key, fmt::format("{}/{}", source.name, ++source.drawn));
    const double re = stream.normal(), im = stream.normal();
    found = source.bundles.emplace(way.reflector, Source::Bundle{stream, Complex(re, im) * std::sqrt(0.5), 0})
                .first;
  }
  Source::Bundle& bundle = found->second;
  const auto count = static_cast<std::size_t>(std::ceil(length_s / kBlock_s)) + 1;
  const double shift_hz = before != nullptr ? (way.shift_hz + before->shift_hz) / 2 : way.shift_hz;
  const double kept = std::exp(-way.decay_per_s * kBlock_s);
  const double drawn = std::sqrt((1 - kept * kept) / 2);
  flight.fading.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    flight.fading.emplace_back(bundle.value * std::polar(1.0, kTurn * bundle.cycles));
    const double re = bundle.stream.normal(), im = bundle.stream.normal();
    bundle.value = kept * bundle.value + drawn * Complex(re, im);
    bundle.cycles = std::remainder(bundle.cycles + shift_hz * kBlock_s, 1);
  }
}

Segment Generator::State::segment_to(const Knot& knot) {
  Segment segment;
  segment.begin_s = last->reading_s;
  segment.length_s = knot.reading_s - last->reading_s;
  std::set<std::pair<gnss::SatelliteId, std::size_t>> keys;
  for (const auto& [key, sent] : last->sent) keys.insert(key);
  for (const auto& [key, sent] : knot.sent) keys.insert(key);
  for (const auto& key : keys) {
    static const Sent nothing;
    const auto found_from = last->sent.find(key);
    const auto found_to = knot.sent.find(key);
    const Sent& from = found_from != last->sent.end() ? found_from->second : nothing;
    const Sent& to = found_to != knot.sent.end() ? found_to->second : nothing;
    const Sent& any = from.source != nullptr ? from : to;
    const Sent& other = to.source != nullptr ? to : from;
    const std::array code_air{any.code_air_m, other.code_air_m};
    const std::array carrier_air{any.carrier_air_m, other.carrier_air_m};
    Segment::Of& of = segment.signals.emplace_back(Segment::Of{&any.source->waveform, any.carrier_hz, {}});
    std::vector<bool> met(to.ways.size());
    const auto add = [&](const Way* begin, const Way* end) {
      Flight flight = fly(begin, end, code_air, carrier_air, segment.length_s);
      const Way& way = end != nullptr ? *end : *begin;
      if (way.kind == PathKind::Diffuse) fade(*any.source, way, begin, segment.length_s, flight);
      of.flights.push_back(std::move(flight));
    };
    for (const Way& way : from.ways) {
      std::size_t k = 0;
      while (k < to.ways.size() && (met[k] || !follows(way, to.ways[k], segment.length_s))) ++k;
      if (k < to.ways.size()) met[k] = true;
      add(&way, k < to.ways.size() ? &to.ways[k] : nullptr);
    }
    for (std::size_t k = 0; k < to.ways.size(); ++k) {
      if (!met[k]) add(nullptr, &to.ways[k]);
    }
    // Bundles that are gone are forgotten.
    auto& bundles = any.source->bundles;
    for (auto it = bundles.begin(); it != bundles.end();) {
      const bool there = std::any_of(to.ways.begin(), to.ways.end(), [&](const Way& way) {
        return way.kind == PathKind::Diffuse && way.reflector == it->first;
      });
      it = there ? std::next(it) : bundles.erase(it);
    }
  }
  return segment;
}

void Generator::State::make(const Segment& segment, std::size_t first, std::size_t samples,
                            std::size_t in_segment, Block& out) const {
  thread_local Slots slots;
  thread_local std::vector<PathBlock> paths;
  out.clear(samples);
  const double begin_s = made_s(first), end_s = made_s(first + samples);
  const auto at = [&](double seconds) { return (seconds - segment.begin_s) / segment.length_s; };
  const double begin = at(begin_s), end = at(end_s), middle = (begin + end) / 2;
  const auto count = static_cast<double>(samples);
  const double least = std::sqrt(kLeastCn0_hz * 2 / made.rate_hz);
  for (const Segment::Of& of : segment.signals) {
    const double slot_rate = of.waveform->slot_rate_hz();
    const double wavelength = kSpeedOfLight / of.carrier_hz;
    const double offset_hz = of.carrier_hz - made.zero_hz();
    const auto slot_at = [&](const Flight& flight, double seconds, double s) {
      return (seconds - flight.code_m.at(s) / kSpeedOfLight) * slot_rate;
    };
    const auto cycles_at = [&](const Flight& flight, double seconds, double s) {
      return offset_hz * seconds - flight.carrier_m.at(s) / wavelength;
    };
    paths.clear();
    double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
    for (const Flight& flight : of.flights) {
      Complex amplitude = flight.from + middle * (flight.to - flight.from);
      if (!flight.fading.empty()) {
        amplitude *= Complex(flight.fading[std::min(in_segment, flight.fading.size() - 1)]);
      }
      if (std::abs(amplitude) < least) continue;
      PathBlock path;
      path.slot = slot_at(flight, begin_s, begin);
      path.slots_per_sample = (slot_at(flight, end_s, end) - path.slot) / count;
      const double cycles = cycles_at(flight, begin_s, begin);
      path.cycles_per_sample = (cycles_at(flight, end_s, end) - cycles) / count;
      path.cycles = std::remainder(cycles, 1) + std::arg(amplitude) / kTurn;
      path.amplitude = std::abs(amplitude);
      lowest = std::min(lowest, path.slot);
      highest = std::max(highest, path.slot + path.slots_per_sample * static_cast<double>(out.re.size()));
      paths.push_back(path);
    }
    if (paths.empty()) continue;
    const double base = std::floor(lowest);
    // Beyond the end for the last samples that are made together.
    const auto length =
        static_cast<std::size_t>(highest - base) + 2 + static_cast<std::size_t>(kMostSlots) * kLanes;
    of.waveform->send(static_cast<std::int64_t>(base), length, slots);
    for (PathBlock& path : paths) {
      path.slot -= base;
      add_path(slots, path, out);
    }
  }
  interfere(begin_s, out);
  if (made.real) {
    for (float& value : out.re) value *= kSqrt2;
  }
  if (front_end.noise) add_noise(noise_key ^ mix64(first + kGolden64), out);
}

void Generator::State::interfere(double begin_s, Block& out) const {
  const double lowest_hz = made.lowest_hz() - made.zero_hz();
  const double highest_hz = made.highest_hz() - made.zero_hz();
  const auto band = static_cast<std::size_t>(signal::band_of(front_end.centre_hz));
  std::uint64_t number = 0;
  for (const tracking::ReceivedWave& wave : last->waves) {
    const std::uint64_t key = mix64(noise_key + ++number * kGolden64);
    const propagation::Spectrum& spectrum = wave.spectrum;
    const double amplitude = std::sqrt(wave.over_noise_hz[band] * 2 / made.rate_hz);
    const double centre_hz = spectrum.centre_hz - made.zero_hz();
    const auto add = [&](auto value_at) {
      for (std::size_t n = 0; n < out.re.size(); ++n) {
        const Complex value = amplitude * value_at(begin_s + static_cast<double>(n) / made.rate_hz);
        out.re[n] += static_cast<float>(value.real());
        out.im[n] += static_cast<float>(value.imag());
      }
    };
    switch (spectrum.shape) {
      case propagation::Spectrum::Shape::Tone:
        if (centre_hz > lowest_hz && centre_hz < highest_hz) {
          add_tone(centre_hz * begin_s, centre_hz / made.rate_hz, amplitude, out);
        }
        break;
      case propagation::Spectrum::Shape::Chirp:
        add([&](double t) {
          const double into_s = t - std::floor(t / spectrum.period_s) * spectrum.period_s;
          const double slope = spectrum.width_hz / spectrum.period_s;
          const double hz = centre_hz - spectrum.width_hz / 2 + slope * into_s;
          if (hz <= lowest_hz || hz >= highest_hz) return Complex();
          const double cycles = (centre_hz - spectrum.width_hz / 2 + slope / 2 * into_s) * into_s;
          return std::polar(1.0, kTurn * std::remainder(cycles, 1));
        });
        break;
      case propagation::Spectrum::Shape::Band: {
        const double low = std::max(centre_hz - spectrum.width_hz / 2, lowest_hz);
        const double high = std::min(centre_hz + spectrum.width_hz / 2, highest_hz);
        if (!(high > low)) break;
        const double share = std::sqrt((high - low) / spectrum.width_hz);
        add([&](double t) {
          return share * band_noise(key, t, high - low) *
                 std::polar(1.0, kTurn * std::remainder((low + high) / 2 * t, 1));
        });
        break;
      }
      case propagation::Spectrum::Shape::Code:
        break;  // a copy: its satellite's view has its path
    }
  }
}

/// @param first of the block @param at where its samples begin behind the history
void Generator::State::filter(std::size_t first, std::size_t samples, std::size_t at, Block& block) const {
  block.clear(samples);
  decimate(unfiltered_re.data() + at, taps, per_sample, samples, block.re.data());
  decimate(unfiltered_im.data() + at, taps, per_sample, samples, block.im.data());
  if (front_end.intermediate_hz == 0) return;
  const double begin_s = first_s + static_cast<double>(first) / front_end.rate_hz;
  turn(front_end.intermediate_hz * begin_s, front_end.intermediate_hz / front_end.rate_hz, block);
}

/// From `sample` to `end`, in blocks of block_samples.
void Generator::State::make_blocks(const Segment& segment, std::size_t end, const Take& take) {
  const std::size_t size = block_samples;
  for (std::size_t in_segment = 0; sample < end;) {
    const std::size_t count = std::min(kBlocksAtOnce, (end - sample + size - 1) / size);
    const auto samples_of = [&](std::size_t i) { return std::min(size, end - sample - i * size); };
    const std::size_t all = std::min(end - sample, count * size);
    if (!taps.empty()) {
      // The last sums reach over the taps that are zeros.
      unfiltered_re.resize(history + all * per_sample + kLanes);
      unfiltered_im.resize(history + all * per_sample + kLanes);
    }
    arena.execute([&] {
      tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
        const std::size_t first = sample + i * size;
        make(segment, first * per_sample, samples_of(i) * per_sample, in_segment + i, blocks[i]);
        if (taps.empty()) return;
        const auto at = static_cast<std::ptrdiff_t>(history + i * size * per_sample);
        const auto made_here = static_cast<std::ptrdiff_t>(samples_of(i) * per_sample);
        std::copy_n(blocks[i].re.begin(), made_here, unfiltered_re.begin() + at);
        std::copy_n(blocks[i].im.begin(), made_here, unfiltered_im.begin() + at);
      });
      if (taps.empty()) return;
      tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
        filter(sample + i * size, samples_of(i), i * size * per_sample, blocks[i]);
      });
    });
    if (!taps.empty()) {
      for (std::vector<float>* unfiltered : {&unfiltered_re, &unfiltered_im}) {
        const auto from = unfiltered->begin() + static_cast<std::ptrdiff_t>(all * per_sample);
        std::copy_n(from, history, unfiltered->begin());
      }
    }
    for (std::size_t i = 0; i < count; ++i) take(blocks[i], samples_of(i));
    sample += all;
    in_segment += count;
  }
}

Generator::Generator(const receiver::ReceiverOptions& options, std::uint64_t seed,
                     const std::map<gnss::System, gnss::Klobuchar>& klobuchar, const FrontEnd& front_end,
                     int threads)
    : state_(std::make_unique<State>(options, seed, klobuchar, front_end, threads)) {}
Generator::~Generator() = default;
Generator::Generator(Generator&&) noexcept = default;
Generator& Generator::operator=(Generator&&) noexcept = default;

void Generator::next(const simulation::Epoch& epoch, const Take& take) {
  State& state = *state_;
  Knot knot = state.knot_at(epoch);
  if (!state.last) {
    state.first_s = knot.reading_s;
    state.last = std::move(knot);
    return;
  }
  const Segment segment = state.segment_to(knot);
  if (!(segment.length_s > 0))
    throw InputError("samples: time runs backwards", "give epochs in order of time");
  if (epoch.navigation != nullptr) {
    // From the longest flight before the first sample to the last one.
    constexpr double kFlight_s = 0.3;
    for (const auto& [key, source] : state.sources) {
      if (!source) continue;
      if (state.last->sent.count(key) + knot.sent.count(key) == 0) continue;
      if (!source->waveform.read_symbols(*epoch.navigation, segment.begin_s - kFlight_s, knot.reading_s)) {
        if (!std::exchange(source->without_message, true)) {
          state.contents.without_message.push_back(source->name);
        }
      }
    }
  }
  const auto end =
      static_cast<std::size_t>(std::ceil((knot.reading_s - state.first_s) * state.front_end.rate_hz - 1e-6));
  state.make_blocks(segment, end, take);
  state.last = std::move(knot);
}

geodesy::GpsTime Generator::begin() const {
  assert(state_->zero);
  return *state_->zero + state_->first_s;
}

Generator::Contents Generator::contents() const {
  return state_->contents;
}

}  // namespace canyon::samples
