#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "canyon/base/options/fwd.hpp"
#include "canyon/base/random.hpp"
#include "canyon/paths/disturbance/disturbance.hpp"
#include "canyon/paths/disturbance/faults/fault.hpp"
#include "canyon/sky/gnss/fix_kind.hpp"

// Faults of one receiver: oscillator, date, antenna, restart, forced fix.

namespace canyon::disturbance {

/// An error added to the receiver's own clock, which ends with the fault.
struct OscillatorOptions {
  double jump_s = 0;  ///< +-0.1
  double drift = 0;   ///< from the fault's begin on [s/s], +-1e-4
};
void visit(options::Visitor& v, OscillatorOptions& o);

/// Firmware that misreads the date. Measurements and fix stay correct; the reported date is wrong.
struct DateOptions {
  int weeks = 0;  ///< +-2048; -1024: an unhandled rollover of the ten-bit week
  int utc_s = 0;  ///< +-60; 1: a leap second that the firmware has not inserted
  void validate() const;
};
void visit(options::Visitor& v, DateOptions& o);

enum class AntennaStage : std::uint8_t { Before, After, Behind };  ///< Behind: another word for After
/// A blocked sector of the antenna's sky, or a lossy cable. A finite loss acts on signals with strength. An
/// infinite loss ("none") removes the signals of the sector for all receivers.
struct AntennaFaultOptions {
  double azimuth_from_rad = 0, azimuth_to_rad = 6.283185307179586;  ///< clockwise; [0, 360] deg
  double elevation_from_rad = -1.5707963267948966, elevation_to_rad = 1.5707963267948966;
  double loss_db = 20;                        ///< [0, infinity]
  AntennaStage stage = AntennaStage::Before;  ///< of the amplifier at the antenna
  /// A loose contact: on for the first `on_s` of each period [s]; no period: always on.
  double period_s = 0, on_s = 1;
  void validate() const;

  /// Loss of C/N0 [dB]. Before the amplifier: the whole loss. After it: the loss by Friis' formula for a
  /// cascade of noise figures (H. T. Friis, Proc. IRE 32(7), 1944), sources at 290 K.
  [[nodiscard]] double cn0_loss_db() const;
};
void visit(options::Visitor& v, AntennaFaultOptions& o);

/// "hot", "warm", "cold".
[[nodiscard]] std::string_view name(RestartKind kind);
/// A restart of a receiver at the fault's begin.
struct RestartOptions {
  RestartKind kind = RestartKind::Cold;
  /// In place of the receiver's own times (receiver::EphemerisAcquisition): time until signals are measured
  /// again, and time for which a satellite is then tracked before the fix uses it [s], [0, 1e4].
  std::optional<double> search_s, ephemeris_s;

  /// Duration shown in tables: the sum of both times, or the kind's default (1, 20 and 26 s).
  [[nodiscard]] double duration_s() const;
};
void visit(options::Visitor& v, RestartOptions& o);

/// A receiver that reports a forced fix, for tests of the software that uses the fix. Its position is the
/// true one with an error of the reported size: Gaussian, of a correlation time of 60 s.
struct ForceOptions {
  gnss::FixKind fix = gnss::FixKind::None;  ///< None to Fixed
  /// Standard deviations of east and north each, and of the height [m], (0, 1000]; empty: by kind.
  std::optional<double> horizontal_m, vertical_m;
};
void visit(options::Visitor& v, ForceOptions& o);

/// A receiver, or software after it, that reports its fix wrongly; measurements stay right.
struct FixFaultOptions {
  bool stuck = false;  ///< the fix at the fault's begin, with fresh timestamps
  double late_s = 0;   ///< age of the reported fix, none before the first, with fresh timestamps, [0, 1e4]
  int repeat = 1;      ///< each fix is reported this many times, [1, 1e6]
  double drop = 0;     ///< fraction of epochs without a fix, at random, [0, 1]
  double east_m = 0, north_m = 0, up_m = 0;   ///< added, +-1e6
  double forward_m = 0;                       ///< added along the direction of travel, +-1e6
  double growth_s = 0;                        ///< the offset grows to its full value over this time, [0, 1e6]
  gnss::FixKind state = gnss::FixKind::None;  ///< the reported kind of fix, to Fixed; None: the computed one
  std::optional<double> accuracy_m;           ///< reported standard deviation of each axis; 0: none
  double accuracy_factor = 1;                 ///< of the reported standard deviations, (0, 1000]
  bool without_satellites = false;            ///< reports 0 satellites
  std::optional<double> after_outage_s;       ///< only for this time after an outage of fixes, (0, 1e6]
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
  int times_ = 0;                                      // number of reports of the fix of repeated_
  Eigen::Vector2d forward_ = Eigen::Vector2d::Zero();  // direction of travel, east and north
  RandomStream stream_;
};

}  // namespace canyon::disturbance
