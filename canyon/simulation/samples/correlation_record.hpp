#pragma once

#include <complex>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "canyon/receiver/tracking/correlation.hpp"
#include "canyon/simulation/epoch.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::samples {

/// Correlation of one satellite's signal in a channel over a run: the sum over its paths of amplitude times
/// the correlation function of the signal, delayed by the path's excess length.
struct CorrelationSeries {
  struct Instant {
    double time_s = 0;  ///< from the run's beginning
    /// At each of delays_m, relative to a clear line of sight at an antenna without a pattern; 0 if nothing
    /// arrives.
    std::vector<std::complex<double>> values;
    /// The receiver's measured excess delay [m]; NaN if it does not track the satellite.
    double measured_m = std::numeric_limits<double>::quiet_NaN();
  };
  gnss::SatelliteId satellite;
  std::string signal, receiver;
  std::vector<double> delays_m;  ///< relative to the line of sight
  std::vector<Instant> instants;
};

/// Records a CorrelationSeries. Phases are those of the paths' lengths, without the random phases that
/// diffuse paths have in samples. Codes are ideal: no correlation between satellites, no noise.
class CorrelationRecord final : public simulation::EpochSink {
 public:
  struct Options {
    std::size_t receiver = 0;
    gnss::SatelliteId satellite;
    std::string signal;                                             ///< empty: the signal near L1
    double bandwidth_hz = std::numeric_limits<double>::infinity();  ///< two-sided, of the front end
    std::vector<double> delays_m;                                   ///< ascending; empty: -1 to 2 chips
  };
  /// Throws InputError for an unknown receiver, satellite or signal, delays that are not finite and
  /// ascending, and a bandwidth outside tracking::CorrelationOptions. The simulation must outlive it.
  CorrelationRecord(const simulation::Simulation& simulation, Options options);

  void write(const simulation::Epoch& epoch) override;
  void finish() override {}

  [[nodiscard]] const CorrelationSeries& series() const { return series_; }

 private:
  const simulation::Simulation* simulation_;
  Options options_;
  const gnss::Signal* signal_;
  tracking::Correlation correlation_;
  CorrelationSeries series_;
};

}  // namespace canyon::samples
