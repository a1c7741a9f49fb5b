#include "canyon/samples/flights.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <set>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/receiver/receiver_draws.hpp"
#include "canyon/receiver/signal_delays.hpp"
#include "canyon/tracking/channel_rate.hpp"

namespace canyon::samples {
namespace {

using geodesy::kSpeedOfLight;
using propagation::Path;
using propagation::PathKind;
using Complex = std::complex<double>;

constexpr double kTurn = 2 * geodesy::kPi;
/// Farther than its rates say, a path is another one [m].
constexpr double kJump_m = 20;
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

Cubic hermite(double from, double from_slope, double to, double to_slope) {
  const double rise = to - from;
  return {from, from_slope, 3 * rise - 2 * from_slope - to_slope, from_slope + to_slope - 2 * rise};
}

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

}  // namespace

struct Flights::State {
  State(const receiver::ReceiverOptions& receiver_options, std::uint64_t run_seed,
        const std::map<gnss::System, gnss::Klobuchar>& coefficients, const FrontEnd& of_samples,
        double rate_hz)
      : options(receiver_options),
        seed(run_seed),
        klobuchar(coefficients),
        front_end(of_samples),
        made_hz(rate_hz),
        model(options.signal, seed, options.name, receiver::draws_of(options)),
        noise_key(RandomStream(seed, options.name + "/samples").next()) {
    options.validate();
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
  void read_symbols(const gnss::NavigationData& navigation, const Knot& knot);

  receiver::ReceiverOptions options;
  std::uint64_t seed;
  std::map<gnss::System, gnss::Klobuchar> klobuchar;
  FrontEnd front_end;
  double made_hz;
  tracking::ChannelModel model;
  std::uint64_t noise_key;

  std::optional<geodesy::GpsTime> zero;  // whole second that readings count from
  std::map<std::pair<gnss::SatelliteId, std::size_t>, std::unique_ptr<Source>> sources;  // null: no code
  std::optional<Knot> last;
  std::vector<Complex> amplitudes;
  Generator::Contents contents;
};

void Flights::State::add_ways(const simulation::Epoch& epoch, const propagation::SatelliteView& view,
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
      if (waveform.slot_rate_hz() > kMostSlots * made_hz) {
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
  const double unit = std::sqrt(cn0_hz * 2 / made_hz * source.waveform.power_over_tracked()) *
                      model.gain_beside(knot.waves, signal::band_of(carrier_hz));
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

Knot Flights::State::knot_at(const simulation::Epoch& epoch) {
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

void Flights::State::fade(Source& source, const Way& way, const Way* before, double length_s,
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

Segment Flights::State::segment_to(const Knot& knot) {
  Segment segment;
  segment.waves = last->waves;
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

void Flights::State::read_symbols(const gnss::NavigationData& navigation, const Knot& knot) {
  // From the longest flight before the first sample to the last one.
  constexpr double kFlight_s = 0.3;
  for (const auto& [key, source] : sources) {
    if (!source || last->sent.count(key) + knot.sent.count(key) == 0) continue;
    if (source->waveform.read_symbols(navigation, last->reading_s - kFlight_s, knot.reading_s)) continue;
    if (!std::exchange(source->without_message, true)) contents.without_message.push_back(source->name);
  }
}

Flights::Flights(const receiver::ReceiverOptions& options, std::uint64_t seed,
                 const std::map<gnss::System, gnss::Klobuchar>& klobuchar, const FrontEnd& front_end,
                 double made_hz)
    : state_(std::make_unique<State>(options, seed, klobuchar, front_end, made_hz)) {}
Flights::~Flights() = default;

std::optional<Segment> Flights::next(const simulation::Epoch& epoch) {
  State& state = *state_;
  Knot knot = state.knot_at(epoch);
  std::optional<Segment> segment;
  if (state.last) {
    segment = state.segment_to(knot);
    if (!(segment->length_s > 0)) {
      throw InputError("samples: time runs backwards", "give epochs in order of time");
    }
    if (epoch.navigation != nullptr) state.read_symbols(*epoch.navigation, knot);
  }
  state.last = std::move(knot);
  return segment;
}

double Flights::reading_s() const {
  return state_->last->reading_s;
}
geodesy::GpsTime Flights::zero() const {
  assert(state_->zero);
  return *state_->zero;
}
const Generator::Contents& Flights::contents() const {
  return state_->contents;
}
std::uint64_t Flights::noise_key() const {
  return state_->noise_key;
}

}  // namespace canyon::samples
