#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>

#include "canyon/base/random.hpp"
#include "canyon/paths/disturbance/disturbance.hpp"
#include "canyon/paths/disturbance/faults/fault.hpp"
#include "canyon/sky/orbit/faulty_sky.hpp"

// Faults of satellites, and of the ionosphere along their signals.

namespace canyon::disturbance {

enum class OutageMode : std::uint8_t {
  Silent,     ///< no signals
  Unhealthy,  ///< signals continue, and the messages flag the satellite as unhealthy
};
struct OutageOptions {
  SatelliteSet satellites;
  OutageMode mode = OutageMode::Silent;
};
void visit(options::Visitor& v, OutageOptions& o);

enum class ClockFault : std::uint8_t {
  Message,  ///< the clock is right, and its message is wrong
  Signal,   ///< the clock drifts, and no message reports it
};
/// Satellites' messages differ from the truth. Pseudoranges stay true, except with ClockFault::Signal.
struct EphemerisOptions {
  SatelliteSet satellites;
  double radial_m = 0, along_m = 0, cross_m = 0;        ///< broadcast minus true, +-1e6
  double radial_mps = 0, along_mps = 0, cross_mps = 0;  ///< from the fault's begin on, +-1e3
  double clock_offset_s = 0;                            ///< +-1e-2
  double clock_drift = 0;                               ///< from the fault's begin on [s/s], +-1e-6
  ClockFault clock_in = ClockFault::Message;
};
void visit(options::Visitor& v, EphemerisOptions& o);

/// Wraps Arrival::broadcast and Arrival::messages; rebuilt when these change.
class MessageFault {
 public:
  MessageFault(SatelliteSet satellites, const orbit::MessageError& error);
  /// @param truth used if the arrival has no broadcast sky
  void apply(propagation::Arrival& arrival, const std::shared_ptr<const orbit::Sky>& truth);

 private:
  orbit::SatelliteFilter concerned_;
  orbit::MessageError error_;
  std::shared_ptr<const orbit::Sky> sky_, wrong_sky_;
  std::shared_ptr<const gnss::NavigationData> messages_, wrong_messages_;
};

class Outage final : public Disturbance {
 public:
  Outage(const OutageOptions& options, const FaultContext& context);
  void apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) override;

 private:
  OutageOptions options_;
  std::shared_ptr<const orbit::Sky> truth_;
  MessageFault unhealthy_;
};

class EphemerisFault final : public Disturbance {
 public:
  EphemerisFault(const EphemerisOptions& options, const FaultContext& context);
  void apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) override;

 private:
  EphemerisOptions options_;
  geodesy::GpsTime begin_;
  std::shared_ptr<const orbit::Sky> truth_;
  MessageFault message_;
};

/// Amplitude by Nakagami's m distribution, m = 1 / S4^2, phase Gaussian, as long records of equatorial
/// scintillation show (E. J. Fremouw, R. C. Livingston & D. A. Miller, J. Atmos. Terr. Phys. 42, 1980).
/// Satellites are independent; all carriers of one satellite have the same amplitude.
struct ScintillationOptions {
  SatelliteSet satellites;
  double s4 = 0.5;                 ///< deviation of the power over its mean, [0, 1.4]
  double sigma_phi_rad = 0.3;      ///< deviation of the phase at 1575.42 MHz, [0, 10]
  double correlation_s = 0.5;      ///< of the amplitude: to 1/e, (0, 1000]; assumed, 0.2 (fast drift) to 2
  double phase_correlation_s = 2;  ///< of the phase, (0, 1000]; assumed
};
void visit(options::Visitor& v, ScintillationOptions& o);

/// Powers are Gamma(m, 1/m) by the copula of a Gauss-Markov process. Phases are a second-order Gauss-Markov
/// process (critically damped, autocorrelation (1 + |t|/T) exp(-|t|/T)), which has a rate. Both are in exact
/// discrete form, stationary from the first epoch on.
class Scintillation final : public Disturbance {
 public:
  Scintillation(const ScintillationOptions& options, const FaultContext& context);
  void apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) override;

 private:
  struct SignalState {
    RandomStream stream;
    geodesy::GpsTime last;
    double amplitude_normal = 0;
    Eigen::Vector2d phase = Eigen::Vector2d::Zero();  // [rad], [rad/s]
  };
  [[nodiscard]] SignalState& state_of(gnss::SatelliteId id, geodesy::GpsTime time);
  [[nodiscard]] double power(double normal) const;

  ScintillationOptions options_;
  std::uint64_t seed_;
  std::string key_;
  std::map<gnss::SatelliteId, SignalState> states_;
};

}  // namespace canyon::disturbance
