#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "canyon/base/options/visitor.hpp"
#include "canyon/base/random.hpp"
#include "canyon/paths/disturbance/disturbance.hpp"
#include "canyon/paths/disturbance/faults/fault.hpp"

// Faults of one receiver: oscillator, date, antenna, restart, forced fix.

namespace canyon::disturbance {

/// An error beside the receiver's own clock, which ends with the fault.
struct OscillatorOptions {
  double jump_s = 0;  ///< +-0.1
  double drift = 0;   ///< from the fault's begin on [s/s], +-1e-4
};
void visit(options::Visitor& v, OscillatorOptions& o);

/// A firmware that misreads the date. Measurements and fix are as ever; what the receiver states is off.
struct DateOptions {
  int weeks = 0;  ///< +-2048; -1024: as after a rollover of the ten-bit week that it does not know of
  int utc_s = 0;  ///< +-60; 1: a leap second that it has not inserted
  void validate() const;
};
void visit(options::Visitor& v, DateOptions& o);

enum class AntennaStage : std::uint8_t { Before, Behind };
/// A part of the sky that the antenna does not see, or a cable that loses. Strength acts where signals have
/// one; without a limit ("none") nothing arrives, for all receivers.
struct AntennaFaultOptions {
  double azimuth_from_rad = 0, azimuth_to_rad = 6.283185307179586;  ///< clockwise; [0, 360] deg
  double elevation_from_rad = -1.5707963267948966, elevation_to_rad = 1.5707963267948966;
  double loss_db = 20;                        ///< [0, infinity]
  AntennaStage stage = AntennaStage::Before;  ///< of the amplifier at the antenna
  /// A loose contact: on for the first `on_s` of each period [s]; no period: always.
  double period_s = 0, on_s = 1;
  void validate() const;

  /// Loss of C/N0 [dB]: the whole loss before the amplifier; behind it that of Friis' formula for
  /// the noise figures in a row (H. T. Friis, Proc. IRE 32(7), 1944), sources at 290 K.
  [[nodiscard]] double cn0_loss_db() const;
};
void visit(options::Visitor& v, AntennaFaultOptions& o);

/// "hot", "warm", "cold".
[[nodiscard]] std::string_view name(RestartKind kind);
/// A receiver that begins anew at the fault's begin.
struct RestartOptions {
  RestartKind kind = RestartKind::Cold;
  /// Instead of the receiver's own times (receiver::KnownEphemerides): until signals are measured again, and
  /// how long a satellite is then tracked before the fix uses it [s], [0, 1e4].
  std::optional<double> search_s, ephemeris_s;

  /// Duration in tables: the sum of both times, or the kind's usual one (1, 20 and 26 s).
  [[nodiscard]] double duration_s() const;
};
void visit(options::Visitor& v, RestartOptions& o);

/// A receiver that states the fix it is told to, for tests of what follows it. Its position is the true one
/// with an error as large as it states: Gaussian, of a correlation time of 60 s.
struct ForceOptions {
  StatedFix fix = StatedFix::None;
  /// Standard deviations of east and north each, and of the height [m], (0, 1000]; empty: usual ones.
  std::optional<double> horizontal_m, vertical_m;
};
void visit(options::Visitor& v, ForceOptions& o);

/// A receiver, or what stands behind it, that states its fix wrongly; measurements stay right.
struct FixFaultOptions {
  bool stuck = false;  ///< the fix of the begin, with fresh stamps
  double late_s = 0;   ///< the fix of so long ago, none before the first, with fresh stamps, [0, 1e4]
  int repeat = 1;      ///< each fix is stated so many times, [1, 1e6]
  double drop = 0;     ///< share of epochs without a fix, at random, [0, 1]
  double east_m = 0, north_m = 0, up_m = 0;  ///< added, +-1e6
  double forward_m = 0;                      ///< added along the direction of travel, +-1e6
  double growth_s = 0;                       ///< the offset grows to its whole over this time, [0, 1e6]
  StatedFix state = StatedFix::None;         ///< the kind of fix that is stated; None: its own
  std::optional<double> accuracy_m;          ///< standard deviation of each axis that is stated; 0: none
  double accuracy_factor = 1;                ///< of the standard deviations that are stated, (0, 1000]
  bool without_satellites = false;           ///< states 0 satellites
  std::optional<double> after_outage_s;      ///< only for so long after an outage of fixes, (0, 1e6]
};
void visit(options::Visitor& v, FixFaultOptions& o);

class OscillatorFault final : public Disturbance {
 public:
  OscillatorFault(const OscillatorOptions& options, const FaultContext& context)
      : options_(options), begin_(context.begin) {}
  void happen(const propagation::Antenna& antenna, ReceiverEvents& events) override;

 private:
  OscillatorOptions options_;
  geodesy::GpsTime begin_;
};

class DateFault final : public Disturbance {
 public:
  DateFault(const DateOptions& options, const FaultContext& /*context*/) : options_(options) {}
  void happen(const propagation::Antenna& antenna, ReceiverEvents& events) override;

 private:
  DateOptions options_;
};

class AntennaFault final : public Disturbance {
 public:
  AntennaFault(const AntennaFaultOptions& options, const FaultContext& context)
      : options_(options), begin_(context.begin) {}
  void apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) override;

 private:
  [[nodiscard]] bool concerns(const Eigen::Vector3d& direction) const;

  AntennaFaultOptions options_;
  geodesy::GpsTime begin_;
};

class RestartFault final : public Disturbance {
 public:
  RestartFault(const RestartOptions& options, const FaultContext& context);
  void happen(const propagation::Antenna& antenna, ReceiverEvents& events) override;

 private:
  Restart restart_;
};

class ForceFault final : public Disturbance {
 public:
  ForceFault(const ForceOptions& options, const FaultContext& context);
  void happen(const propagation::Antenna& antenna, ReceiverEvents& events) override;

 private:
  ForcedFix forced_;
  RandomStream stream_;
  std::optional<geodesy::GpsTime> last_;
};

class FixFault final : public Disturbance {
 public:
  FixFault(const FixFaultOptions& options, const FaultContext& context);
  void happen(const propagation::Antenna& antenna, ReceiverEvents& events) override;

 private:
  FixFaultOptions options_;
  geodesy::GpsTime begin_, repeated_;
  int times_ = 0;                                      // that the fix of repeated_ was stated
  Eigen::Vector2d forward_ = Eigen::Vector2d::Zero();  // direction of travel, east and north
  RandomStream stream_;
};

}  // namespace canyon::disturbance
