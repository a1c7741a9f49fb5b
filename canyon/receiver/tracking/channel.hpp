#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "canyon/paths/propagation/paths.hpp"
#include "canyon/receiver/tracking/channel_fading.hpp"
#include "canyon/receiver/tracking/loop_noise.hpp"
#include "canyon/receiver/tracking/signal_options.hpp"

namespace canyon::tracking {

/// An interfering wave after an antenna.
struct ReceivedWave {
  propagation::Spectrum spectrum;
  std::optional<gnss::SatelliteId> copy_of;
  std::array<double, 2> over_noise_hz{};  ///< I / N0 [Hz] in the bands of antennas, by signal::Band
};

/// A number for each spectrum of interference, centre_hz relative to a carrier.
using SpectrumValues = std::vector<std::pair<propagation::Spectrum, double>>;

/// The common part of one receiver's channels: options, phases of paths, a code loop for each kind of signal.
class ChannelModel {
 public:
  struct Kind {
    std::shared_ptr<const CodeTracker> tracker;
    double peak_power = 1;       ///< R(0)^2: power of the prompt correlator on a path of power 1
    CodeLoopNoise noise;         ///< of the code
    SpectrumValues separations;  ///< cache of spectral separations, except of tones
    PllOptions pll;              ///< for_signal(); tracker->options() likewise
    FllOptions fll;
  };

  /// Throws InputError if options.validate() does.
  /// @param receiver its name in messages; @param stream_name name of its random streams
  ChannelModel(SignalOptions options, std::uint64_t seed, std::string receiver, std::string stream_name = {});

  [[nodiscard]] const SignalOptions& options() const { return options_; }
  [[nodiscard]] const PathPhases& phases() const { return phases_; }
  /// Created at first use. InputError, naming system and signal, if its correlators are too far apart for it.
  [[nodiscard]] const Kind& kind(const gnss::Signal& signal) { return mutable_kind(signal); }
  /// C/N0 [dB-Hz] of a signal in a clear line of sight: link budget and offset_db().
  [[nodiscard]] double clear_cn0_dbhz(const gnss::Signal& signal, double elevation_rad,
                                      double offset_db) const {
    return signal::los_cn0_dbhz(signal, elevation_rad, options_.antenna, options_.link) + offset_db;
  }
  /// Offset of a satellite's signal from the link budget in a clear line of sight [dB]:
  /// SignalOptions::offset_db and installation, N(0, installation_sigma_db) by seed and receiver, and N(0,
  /// satellite_sigma_db) by seed and satellite.
  [[nodiscard]] double offset_db(gnss::SatelliteId id, const gnss::Signal& signal,
                                 geodesy::GpsTime time) const;
  /// Interference after this receiver's antenna. @param received replaced; it keeps its capacity
  void receive(std::span<const propagation::Interference> waves, std::vector<ReceivedWave>& received) const;
  /// Amplitude gain (0, 1] of the signals of a band under waves that saturate the stages before the filter
  /// (small_signal_gain()).
  [[nodiscard]] double gain_under_interference(std::span<const ReceivedWave> waves, signal::Band band) const;
  /// Power of noise plus interference over noise alone after a correlator [1], >= 1: 1 + sum of (I / N0)
  /// kappa / R(0) (spectral_separation_per_hz(); J. W. Betz, Navigation 48(4), 2001), over the power gain of
  /// gain_under_interference(). C/N0 minus this is the effective C/N0. @param id satellite whose copies are
  /// not counted
  /// @param carrier_hz of the satellite; @param received_hz that carrier as received
  [[nodiscard]] double noise_factor(const gnss::Signal& signal, gnss::SatelliteId id, double carrier_hz,
                                    double received_hz, std::span<const ReceivedWave> waves);
  /// Interference in the front end around a signal's carrier over its own noise [1]. Without a filter the
  /// front end is assumed to be four chip rates wide.
  struct FrontEndLoad {
    double interference = 0;
    double tones = 0;  ///< part of interference
  };
  [[nodiscard]] FrontEndLoad front_end_load(const gnss::Signal& signal, std::span<const ReceivedWave> waves);
  /// Random factors of a satellite's paths.
  [[nodiscard]] PathFades fades(gnss::SatelliteId id, const gnss::Signal& signal) const;
  /// The random stream of a satellite's signal in this receiver for one purpose.
  [[nodiscard]] RandomStream stream(gnss::SatelliteId id, const gnss::Signal& signal,
                                    std::string_view purpose) const;

 private:
  Kind& mutable_kind(const gnss::Signal& signal);

  SignalOptions options_;
  double noise_dbw_per_hz_ = 0;
  double compression_hz_ = 0;  // SignalOptions::front_end_compression_dbm over the noise's density
  std::uint64_t seed_;
  std::string receiver_, stream_name_;
  PathPhases phases_;
  std::map<const gnss::Signal*, SpectrumValues> spectra_;  // within the front end, cached
  std::array<std::array<std::unique_ptr<Kind>, gnss::kMaxSignals>, gnss::kSystemCount> kinds_;
};

/// The antenna at one epoch.
struct AntennaMotion {
  geodesy::GpsTime time;
  geodesy::GpsTime first_epoch;                  ///< of the receiver
  std::optional<geodesy::GpsTime> epoch_before;  ///< previous epoch of the receiver; empty at its first
  double step_m = 0;                             ///< of the antenna since then [m], >= 0
  Eigen::Vector3d velocity_ecef = Eigen::Vector3d::Zero();      ///< [m/s], in the rotating frame
  Eigen::Matrix3d ecef_from_enu = Eigen::Matrix3d::Identity();  ///< of the frame of the paths
  std::span<const ReceivedWave> interference;                   ///< valid during the epoch only
};

/// Accumulated carrier phase of a channel beyond geometric range and clocks.
struct TrackedPhase {
  double excess_m = 0;     ///< of the carrier over the geometric range, multipath included
  double ambiguity = 0;    ///< a whole number [cycles]
  geodesy::GpsTime since;  ///< continuous since then
};

/// Result of a channel at one epoch.
struct Reception {
  LockState lock = LockState::Searching;
  std::optional<double> cn0_dbhz;  ///< true one at the correlator; empty: no signal
  double code_delay_m = 0;         ///< of the code loop relative to the direct path; 0 without a signal
  std::size_t tracked = 0;         ///< index of the path whose carrier is tracked; with a signal
  std::optional<double> direct_cn0_dbhz;  ///< of the direct path alone; empty without one
  /// While Tracking, at SignalOptions::phase_threshold_dbhz or above, and not on a diffuse cluster.
  std::optional<TrackedPhase> phase;
};

/// Thermal noise of one measurement, with its standard deviations; and the reported C/N0.
struct LoopErrors {
  double code_m = 0, doppler_hz = 0, phase_cycles = 0;
  double code_sigma_m = 0, doppler_sigma_hz = 0, phase_sigma_cycles = 0;
  double code_rate_per_s = 0;  ///< of the code's: errors tau apart correlate by e^(-rate tau)
  double reported_cn0_dbhz = 0;
};

/// One channel of a receiver: a signal of one satellite from its paths to code delay, C/N0, lock and phase.
/// Every path's amplitude is signal::path_amplitude() times its random factor (PathFades). The tracked
/// carrier is that of the strongest path at the delay of the code loop, which CodeTracker computes. The true
/// C/N0 drives the lock (docs/tracking.md).
class Channel {
 public:
  /// Channel of a satellite that is first received at motion.time; before, no signal since the first epoch.
  /// @param signal of gnss::signals_of()
  Channel(ChannelModel& model, gnss::SatelliteId id, const gnss::Signal& signal, const AntennaMotion& motion);

  [[nodiscard]] const gnss::Signal& signal() const { return *signal_; }

  void search_for(double seconds) { lock_.search_for(seconds); }

  /// Processes the paths of this channel's satellite at motion.time, after the last call.
  [[nodiscard]] Reception receive(ChannelModel& model, const AntennaMotion& motion,
                                  const propagation::SatelliteView& view);
  /// Processes an epoch without signal: below the horizon, antenna inside a building.
  Reception receive_nothing(geodesy::GpsTime time);
  /// Noise of a measurement at that C/N0; continues from the last call, after any time.
  [[nodiscard]] LoopErrors sample(ChannelModel& model, geodesy::GpsTime time, double cn0_dbhz);

 private:
  /// Line of sight at the last epoch with a signal.
  struct Geometry {
    geodesy::GpsTime time;
    double range_m = 0, rate_mps = 0;
  };
  struct Phase {
    propagation::PathKind kind = propagation::PathKind::Direct;
    std::uint64_t reflector = 0;
    geodesy::GpsTime lock_since;
    double rotated_rad = 0;  // argument of the prompt correlator minus the tracked path's detour, unwrapped
    TrackedPhase tracked;
  };
  [[nodiscard]] bool jumped(const AntennaMotion& motion, const orbit::LineOfSight& line, double chip_m);
  /// Whether the carrier loop pulls in a path's frequency. Among a spoofer's signals it neither follows nor
  /// switches to another path.
  [[nodiscard]] bool within_reach(std::size_t path, bool spoofed, double reach_mps) const;
  /// Sets rates and amplitudes of the epoch's paths, and which of them is tracked.
  void choose_path(const ChannelModel::Kind& kind, const SignalOptions& options, const AntennaMotion& motion,
                   const propagation::SatelliteView& view, double carrier_hz);
  /// Sets the paths of the code loop relative to the tracked one: fading, drifts, random factors.
  void fade_paths(const ChannelModel::Kind& kind, const ChannelModel& model, const AntennaMotion& motion,
                  const propagation::SatelliteView& view, double carrier_hz);
  /// Acquires the strongest path, or propagates the loop.
  [[nodiscard]] std::optional<CodeLock> follow_code(const AntennaMotion& motion,
                                                    const ChannelModel::Kind& kind, double clear_cn0_dbhz);
  [[nodiscard]] std::optional<TrackedPhase> follow_phase(const AntennaMotion& motion,
                                                         const propagation::Path& path,
                                                         std::complex<double> prompt, double wavelength_m);

  gnss::SatelliteId id_;
  const gnss::Signal* signal_;
  double offset_db_;  // relative to the link budget
  SignalLock lock_;
  PathFades fades_;
  std::optional<CodeLoopState> loop_;     // of the code
  double bandwidth_ratio_ = 1;            // of the code loop, by the previous epoch's C/N0
  std::optional<propagation::Path> aid_;  // path whose carrier was tracked at the last epoch with a signal
  double aid_offset_mps_ = 0;             // its rate over the line of sight's
  std::optional<Geometry> geometry_;
  std::optional<Phase> phase_;
  RandomStream ambiguity_;
  RandomStream cn0_noise_;
  LoopNoise code_noise_, doppler_noise_, phase_noise_;
  std::optional<geodesy::GpsTime> sampled_;
  double mean_cn0_hz_ = 0;  // as reported
  // Values of the current epoch; members to keep their capacity.
  std::vector<std::complex<double>> amplitudes_;
  std::vector<SignalPath> paths_;
  std::vector<double> rates_mps_;
  std::size_t tracked_ = 0;
};

}  // namespace canyon::tracking
