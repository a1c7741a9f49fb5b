#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "canyon/analysis/validation/pseudorange_errors.hpp"
#include "canyon/analysis/validation/receiver_clock.hpp"
#include "canyon/analysis/validation/recording.hpp"
#include "canyon/analysis/validation/segments.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/fwd.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"

// The recorded and the simulated receiver, compared observation by observation.

namespace canyon::validation {

/// The recorded receiver and the simulated one.
enum class Side : std::uint8_t { Measured, Simulated };
inline constexpr std::array kSides{Side::Measured, Side::Simulated};

/// A value of each side.
template <typename T>
struct MeasuredAndSimulated {
  T measured{}, simulated{};
  [[nodiscard]] T& of(Side side) { return side == Side::Measured ? measured : simulated; }
  [[nodiscard]] const T& of(Side side) const { return side == Side::Measured ? measured : simulated; }
};

/// Carrier phase of a signal at one epoch, recorded or simulated.
struct ComparedPhase {
  /// Phase [m] minus range, satellite clock and atmosphere: receiver clock, ambiguity, and effects of paths
  /// and noise. Empty: no phase.
  std::optional<double> residual_m;
  bool slip = false;  ///< reported by the receiver: the phase does not continue the previous epoch's
};

/// A signal in one receiver at one epoch.
struct ComparedObservation {
  bool tracked = false;           ///< it has a pseudorange, which is not gross
  std::optional<double> error_m;  ///< of the pseudorange; if simulated, from paths and noise
  std::optional<double> cn0_dbhz;
  ComparedPhase phase;
};

/// One signal of a satellite at one epoch: measured, simulated or both.
struct ComparedSignal : MeasuredAndSimulated<ComparedObservation> {
  const gnss::Signal* signal = nullptr;  ///< of gnss::signals_of()
};

/// One satellite at one epoch, above the scenario's elevation mask, with its first signal
/// (gnss::signals_of()) and the others.
struct ComparedSatellite : ComparedSignal {
  gnss::SatelliteId id;
  double azimuth_rad = 0, elevation_rad = 0;
  bool clear = false;  ///< the direct path is clear in the city (Visibility LOS or LOSMultipath)
  /// The visibility by the paths that arrive in the city, not by what the simulated receiver could track:
  /// classes must not depend on the model that is validated with them.
  propagation::Visibility visibility = propagation::Visibility::Blocked;
  /// The path that explains an NLOS signal (the strongest at the antenna if signals have strength, else the
  /// shortest), and the code delay [m] of all paths in the receiver model, without noise. Set for blocked
  /// direct paths, whether the simulated channel tracks or not. Empty: no path.
  struct Prediction {
    propagation::PathKind kind = propagation::PathKind::Reflected;
    int order = 1;
    double excess_m = 0;  ///< code delay without noise
  };
  std::optional<Prediction> prediction;
  MeasuredAndSimulated<bool> used;  ///< in the fixes
  /// Further signals that it transmits (gnss::transmits()) and the recording or the simulated receiver has,
  /// in the order of gnss::signals_of(). Measured and simulated errors are relative to the clock from first
  /// signals, minus a constant for each signal: the median over the run of satellites that are clear, since
  /// receivers have separate delays in each band.
  std::vector<ComparedSignal> more;
};

struct ComparedFix {
  bool solved = false;
  Eigen::Vector3d error_enu_m = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  int used = 0;
  /// Reported standard deviations: root of the sum of the east and north variances, and up; NaN if missing.
  double horizontal_sigma_m = std::numeric_limits<double>::quiet_NaN();
  double vertical_sigma_m = std::numeric_limits<double>::quiet_NaN();
};

struct ComparedEpoch {
  geodesy::GpsTime time;
  /// The antenna's true position in the moved city, in the frame of the unmoved map
  /// (Registration::point_in_map()): it fits the map as drawn. Convert ENU vectors of fixes by
  /// Registration::direction_in_city().
  Eigen::Vector3d position_enu_m = Eigen::Vector3d::Zero();
  std::size_t first = 0, count = 0;          ///< of Comparison::satellites
  MeasuredAndSimulated<ComparedFix> fix;     ///< of single epochs
  MeasuredAndSimulated<ComparedFix> filter;  ///< of the receiver's position filter, if it has one
  ClockSource clock = ClockSource::None;
  std::size_t segment = 0;  ///< of the street: Comparison::segments
};

struct Comparison {
  std::string name;  ///< of the model: "specular, second order"
  Registration registration;
  /// Signals in the recording, and signals that the simulated receiver tracks; by system, then in the order
  /// of gnss::signals_of().
  std::vector<const gnss::Signal*> recorded, tracked;
  std::vector<ComparedEpoch> epochs;
  std::vector<ComparedSatellite> satellites;  ///< by epoch
  std::vector<StreetSegment> segments;
  bool filtered = false;  ///< the receiver has a position filter (ReceiverOptions::filter)
};

struct CompareOptions {
  std::string name;  ///< of the model, Comparison::name
  int threads = 0;   ///< 0: as many as cores
  /// Satellites to remove from the sky, for example never_tracked().
  std::set<gnss::SatelliteId> leave_out;
  /// Epochs done, in all; on the calling thread. An exception from it ends the work and is rethrown.
  std::function<void(std::size_t, std::size_t)> progress;
};
/// Simulates a receiver (with its propagation options) at the recorded epochs, in the city moved by
/// `registration`. Solves the fixes of both with the receiver's FixOptions, and with its position filter if
/// it has one, which starts with the recording. Satellites are those of the sky above the receiver's
/// elevation mask, of systems that the recording has and the receiver tracks.
///
/// Clocks of the measured errors come from satellites that are clear in the moved city. Lines of sight,
/// ranges and errors refer to the true position; only rays start at its point in the moved city. The
/// simulated receiver has been on for long (warm start). Recorded pseudoranges have no sigmas: weights by
/// sigma count as equal ones, for both fixes. Gross pseudoranges (ReceiverClockOptions::gross_m) count as not
/// measured. The same seed gives the same comparison, on any number of threads.
[[nodiscard]] Comparison compare(const Recording& recording, const simulation::ReceiverConfig& receiver,
                                 const simulation::Environment& environment, const Registration& registration,
                                 std::uint64_t seed, const CompareOptions& options = {});
/// A receiver, which must outlive the call, and the seed of its random numbers.
struct SeededReceiver {
  const simulation::ReceiverConfig* receiver = nullptr;
  std::uint64_t seed = 1;
};
/// The same for several receivers (at least one, asserted), whose rays are traced once: all have the
/// propagation options of the first.
[[nodiscard]] std::vector<Comparison> compare(const Recording& recording,
                                              std::span<const SeededReceiver> receivers,
                                              const simulation::Environment& environment,
                                              const Registration& registration,
                                              const CompareOptions& options = {});

/// A satellite above this elevation and clear for kTrackable_s in all is tracked at some time, if the
/// receiver can.
inline constexpr double kTrackableElevation_rad = 0.26179938779914943;  // 15 deg
inline constexpr double kTrackable_s = 120;

/// A satellite that the recording never tracks although it is in clear view.
struct NeverTracked {
  gnss::SatelliteId id;
  double clear_s = 0;  ///< above the elevation and clear in the city, in all
};
/// Satellites of the whole comparison without any recorded pseudorange that are above `elevation_rad` and
/// clear in the city for `clear_s` and more, by id. A running receiver needs seconds for a satellite in the
/// open (26 to 30 s after a cold start, u-blox M8 data sheet). So a satellite missing four times that long is
/// due to the satellite or the receiver, not to the city.
[[nodiscard]] std::vector<NeverTracked> never_tracked(const Comparison& comparison,
                                                      double elevation_rad = kTrackableElevation_rad,
                                                      double clear_s = kTrackable_s);

/// A receiver and its propagation, as one step towards all effects that Canyon models.
struct Model {
  std::string key;   ///< one word, for command lines: "specular"
  std::string name;  ///< for people; "+ ..." adds to the previous step
  simulation::ReceiverConfig receiver;
  bool moved_city = false;  ///< the map's position is resampled for each run, by the scenario's georeference
};

/// The steps, each including the previous ones: mirror (the paper's model), specular (reflections of first
/// order), second (and of second), tracking (strength of signals and the receiver's tracking, with
/// `receiver`'s own SignalOptions), diffuse, ground, shadowing (by unmapped objects), diffraction. The last
/// one has shadowing if `receiver` has. Parameters that a step does not change are `receiver`'s.
[[nodiscard]] std::vector<Model> cumulative_models(const simulation::ReceiverConfig& receiver);

/// The ladder's models with these keys, in the ladder's order. Throws InputError for an unknown key, with the
/// known ones.
[[nodiscard]] std::vector<Model> models_of(const simulation::ReceiverConfig& receiver,
                                           const std::vector<std::string>& keys);

}  // namespace canyon::validation
