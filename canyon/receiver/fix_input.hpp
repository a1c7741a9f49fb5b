#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/positioning/positioning_options.hpp"
#include "canyon/receiver/positioning/pseudorange_model.hpp"
#include "canyon/sky/gnss/signal_groups.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::receiver {

class CodeCorrections;
struct ReceiverOptions;
struct SatelliteObservation;
struct SignalObservation;

/// Combination of a satellite's pseudoranges into one for the fix.
enum class Combination : std::uint8_t {
  First,           ///< the first tracked signal's; with FixInputOptions::uses the first measured one in it
  IonosphereFree,  ///< of the first and the one farthest from it in frequency, at least 100 MHz; without a
                   ///< second, the first if FixOptions::correct_ionosphere has a model for it, else none
  /// All, each with the ionosphere's delay at its carrier. The delay is estimated with the a priori deviation
  /// FixInputOptions::ionosphere_sigma_m. By least squares; equal to a fix with the delays among its
  /// unknowns, since each belongs to one satellite.
  Uncombined,
};

struct FixInputOptions {
  Combination combination = Combination::First;
  /// Names of signals for the fix, best first; empty: all tracked ones, in the order of gnss::signals_of().
  std::vector<std::string> uses;
  positioning::SmoothingOptions smoothing;
  /// Uncombined: standard deviation [m] of the slant delay at 1575.42 MHz that no model corrects, (0, 1000].
  double ionosphere_sigma_m = 5;
  /// Factor on the deviations of groups of signals in the fix, (0, 1000]; signals in several groups take the
  /// product.
  gnss::GroupValues sigma_factor;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, FixInputOptions& o);

/// Converts one receiver's observations into the measurements of its fix; stores the smoothed codes.
class FixInput {
 public:
  /// Uses weights, C/N0 mask and the correlation times of code errors from options that validate().
  explicit FixInput(const ReceiverOptions& options);

  struct CombinedMeasurement {
    positioning::Measurement measurement;  ///< referred to the signal near L1, as the sky's satellite clock
    /// Slant ionosphere delay at 1575.42 MHz [m], model plus estimate; only Uncombined, two signals or more.
    std::optional<double> ionosphere_m;
    /// The measurement with corrections; empty without any.
    std::optional<positioning::Measurement> corrected;
  };
  /// A satellite's measurement for the fix; call once per epoch. Empty if it has none.
  /// @param model_m the ionosphere's delay at 1575.42 MHz that the fix corrects [m]
  /// @param corrections of smoothed codes; null: none
  [[nodiscard]] std::optional<CombinedMeasurement> next(const SatelliteObservation& satellite,
                                                        const orbit::SatelliteState& state,
                                                        geodesy::GpsTime time, double model_m,
                                                        const CodeCorrections* corrections = nullptr);

 private:
  /// A signal that may be used in the fix.
  struct Code {
    const gnss::Signal* signal = nullptr;
    positioning::Measurement measurement;
    double sigma_m = 1;          ///< by the weights
    double shared_m = 0;         ///< part of its deviation: errors in space
    double iono_rate = 1;        ///< ratio of its delay to that at 1575.42 MHz
    double loop_rate_per_s = 0;  ///< SignalObservation::code_rate_per_s
  };
  struct Carrier {
    positioning::CodeSmoother code;
    geodesy::GpsTime time;
    std::optional<double> phase_m;
  };
  void gather(const SatelliteObservation& satellite, geodesy::GpsTime time);
  void choose(const gnss::Signal& first);
  void smooth(gnss::SatelliteId id, geodesy::GpsTime time);
  /// Removes the satellite's group delay relative to the signal near L1 from the codes.
  void refer_to_l1(const orbit::SatelliteState& state);
  /// Keeps and corrects codes with a correction; deviations without removed errors go to reported_sigmas_m_.
  void correct(gnss::SatelliteId id, geodesy::GpsTime time, const CodeCorrections& corrections);
  /// Combines the remaining codes into one measurement; precondition: at least one.
  [[nodiscard]] std::optional<CombinedMeasurement> combine(double elevation_rad, double model_m);
  [[nodiscard]] std::optional<CombinedMeasurement> ionosphere_free() const;
  [[nodiscard]] CombinedMeasurement uncombined(double elevation_rad, double model_m);
  [[nodiscard]] std::optional<double> step_m(const Carrier& carrier, const positioning::Measurement& m) const;

  FixInputOptions options_;
  positioning::FixOptions fix_;
  // Slow error of every pseudorange; the rest of sigma_m is the error of the code loop, with a rate of its
  // own.
  positioning::CodeNoise noise_;
  double shared_m_;                                                        ///< errors from space in noise_
  std::map<std::pair<gnss::SatelliteId, std::size_t>, Carrier> carriers_;  // and index_of() the signal
  // Values of the current satellite; members to keep their capacity.
  std::vector<Code> codes_;
  std::vector<std::optional<double>> steps_m_;
  std::vector<double> reported_sigmas_m_;
};

}  // namespace canyon::receiver
