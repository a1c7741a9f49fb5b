#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/receiver/positioning/positioning_options.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/gnss/signals.hpp"

// The range of a signal is a sum of terms. This is the only list of them: receivers, their fixes and
// corrections, map cells, virtual stations, samples and columns iterate over it. docs/extending.md describes
// how to add a term.

namespace canyon::tracking {
struct AntennaMotion;
}

namespace canyon::receiver {

/// A receiver's clock relative to GPST.
struct ClockReading {
  double bias_s = 0;
  double drift = 0;  ///< [s/s]
};

/// The antenna a short time before or after an epoch, for rates of delays.
struct ShiftedAntenna {
  [[nodiscard]] geodesy::AzimuthElevation look_angles(const orbit::LineOfSight& line) const {
    return geodesy::azimuth_elevation_from_enu(
        enu_from_ecef *
        (line.position_at_reception_m + line.velocity_at_reception_mps * dt_s - antenna_ecef));
  }

  double dt_s = 0;
  Eigen::Vector3d antenna_ecef = Eigen::Vector3d::Zero();
  geodesy::Geodetic position;
  Eigen::Matrix3d enu_from_ecef = Eigen::Matrix3d::Identity();
  double zenith_m = 0;  ///< delay in the troposphere
};

/// Inputs of the terms of a signal's range at an epoch. Pointers must not be null unless noted.
struct RangeState {
  const positioning::RangeOptions* options = nullptr;
  const std::map<gnss::System, gnss::Klobuchar>* klobuchar = nullptr;
  const propagation::SatelliteView* view = nullptr;
  const gnss::Signal* signal = nullptr;
  double carrier_hz = 0;  ///< of the satellite's signal
  geodesy::GpsTime time;
  geodesy::Geodetic position;  ///< of the antenna
  ClockReading clock{};
  double code_excess_m = 0, carrier_excess_m = 0;  ///< by paths, over the geometric range
  double code_noise_m = 0;
  double bias_m = 0;  ///< the receiver's own delay of the code
  // For rates only:
  const propagation::Path* path = nullptr;
  const tracking::AntennaMotion* motion = nullptr;
  /// The antenna half a second before and after; null: rates leave the atmosphere out.
  const ShiftedAntenna *before = nullptr, *after = nullptr;
  std::array<geodesy::AzimuthElevation, 2> looks{};  ///< from there to the satellite
};

/// Inputs of a receiver's models of the terms: data from messages, and the receiver's own estimate of its
/// position. Pointers must not be null unless noted; `klobuchar`, `position` and `look_angles` are for terms
/// of space only.
struct ModelState {
  const positioning::FixOptions* fix = nullptr;  ///< selects the models of its corrections
  const std::map<gnss::System, gnss::Klobuchar>* klobuchar = nullptr;
  const orbit::SatelliteState* satellite = nullptr;
  const gnss::Signal* signal = nullptr;  ///< null: the satellite's near L1
  gnss::SatelliteId id;
  double carrier_hz = 0;
  geodesy::GpsTime time;
  geodesy::Geodetic position;
  geodesy::AzimuthElevation look_angles;
  /// Fraction of the ionosphere in the pseudorange (positioning::Measurement::ionosphere_fraction).
  double ionosphere_fraction = 1;
};

/// Parts of a code and of a carrier: [m], or [m/s].
struct CodeAndCarrier {
  double code = 0, carrier = 0;

  CodeAndCarrier& operator+=(const CodeAndCarrier& other) {
    code += other.code;
    carrier += other.carrier;
    return *this;
  }
};

/// Origin of a term.
enum class RangeTermOf : std::uint8_t {
  Satellite,  ///< geometry and the satellite's clock, given by the broadcast messages
  Space,      ///< errors of these and the atmosphere: they depend on the antenna's position, and corrections
              ///< remove them
  Receiver,   ///< its clock and delays: equal for all of its paths
  Channel     ///< paths and noise of one signal
};

/// One term of a range.
struct RangeTerm {
  const char* name;  ///< "ionosphere"
  RangeTermOf of;
  /// Its truth [m]; 0 if the receiver's options switch it off.
  CodeAndCarrier (*truth_m)(const RangeState&);
  /// A receiver's correction for it [m]; null: none, or an unknown of its own.
  CodeAndCarrier (*model_m)(const ModelState&) = nullptr;
  /// Its rate [m/s] per second of GPST; null: none, or too slow for a Doppler.
  CodeAndCarrier (*rate_mps)(const RangeState&) = nullptr;
  const char* column = nullptr;  ///< of signals.csv, for its part of the code [m]; null: none
  const char* help = "";         ///< of the column
};

/// Numbers of the terms, in the order of range_terms().
enum class RangeTermId : std::uint8_t {
  Geometry,
  SatelliteClock,
  GroupDelay,
  Ionosphere,
  Troposphere,
  OrbitError,
  ReceiverClock,
  Bias,
  Multipath,
  Noise,
  CarrierPhaseOffset
};

inline constexpr std::size_t kRangeTermCount = static_cast<std::size_t>(RangeTermId::CarrierPhaseOffset) + 1;
/// All terms. Cycles of a carrier phase are not included: integers are not counted in metres.
[[nodiscard]] std::span<const RangeTerm, kRangeTermCount> range_terms();

/// A signal's range by its code (the pseudorange) and by its carrier (carrier phase times wavelength, without
/// an ambiguity) [m]: the sum of all terms.
/// @param code_terms_m each term's part of the code, in the order of range_terms(); empty: not needed
[[nodiscard]] CodeAndCarrier signal_range(const RangeState& state, std::span<double> code_terms_m = {});
/// The sum of the terms of one origin [m].
[[nodiscard]] CodeAndCarrier range_of(RangeTermOf of, const RangeState& state);
/// A receiver's corrections for the terms of one origin [m]: the sum of their models.
/// @param code_models_m each model's part of the code, in the order of range_terms(); empty: not needed
[[nodiscard]] CodeAndCarrier modelled_range(RangeTermOf of, const ModelState& state,
                                            std::span<double> code_models_m = {});
/// Error of a code after the fix's corrections of the terms of space [m]: truth minus model.
/// @param code_terms_m of signal_range(); empty: computed here
[[nodiscard]] double uncorrected_m(const RangeState& state, std::span<const double> code_terms_m = {});
/// d/dt of a range over RangeState::path per second of the receiver's clock [m/s]. -f / c of the carrier's is
/// the Doppler shift; the code's has Path::code_ahead_mps.
[[nodiscard]] CodeAndCarrier signal_rate(const RangeState& state);

}  // namespace canyon::receiver
