#pragma once

#include <string>
#include <vector>

#include "canyon/disturbance/disturbance.hpp"
#include "canyon/disturbance/faults/fault.hpp"
#include "canyon/disturbance/faults/transmitter.hpp"
#include "canyon/options/fwd.hpp"

namespace canyon::disturbance {

/// One carrier of a jammer.
struct EmissionOptions {
  enum class Shape : std::uint8_t { Noise, Chirp, Tone };
  Shape shape = Shape::Noise;
  double centre_hz = 1575.42e6;  ///< [1e9, 2e9]; of a tone its frequency
  double width_hz = 20e6;        ///< of noise and chirp, (0, 200e6]
  double period_s = 10e-6;       ///< of a chirp's sweep, [1e-7, 1e-2]
  double power_dbm = 10;         ///< equivalent isotropically radiated, on the beam's axis, [-100, 100]
  void validate() const;
};
void visit(options::Visitor& v, EmissionOptions& o);

/// A transmitter that jams.
struct JammingOptions {
  TransmitterOptions transmitter;
  propagation::Polarisation polarisation = propagation::Polarisation::Linear;
  /// A known kind of jammer instead of emissions: "privacy_l1", "privacy_l1_l2", "noise_l1".
  std::string preset;
  std::vector<EmissionOptions> emissions;
  /// Throws InputError naming what is missing or out of range.
  void validate() const;
};
void visit(options::Visitor& v, JammingOptions& o);

/// Adds its emissions to what interferes at the antenna (propagation::Arrival::interference), each as the
/// city lets it through (Transmitter).
class Jamming : public Disturbance {
 public:
  /// Throws InputError where options do not validate().
  Jamming(const JammingOptions& options, FaultContext context);
  void apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) override;

 private:
  std::vector<EmissionOptions> emissions_;
  propagation::Polarisation polarisation_;
  Transmitter transmitter_;
};

}  // namespace canyon::disturbance
