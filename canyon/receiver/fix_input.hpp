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

/// How the pseudoranges of a satellite's signals become the one of the fix.
enum class Combination : std::uint8_t {
  First,           ///< the first tracked signal's; with FixInputOptions::uses the first measured one of these
  IonosphereFree,  ///< of the first and the one farthest from it in frequency, 100 MHz at least; without a
                   ///< second, the first where FixOptions::correct_ionosphere has a model for it, else none
  /// All of them, each with the ionosphere's delay at its carrier, which is estimated beside: known to
  /// FixInputOptions::ionosphere_sigma_m before. By least squares; the same as with the delays among the
  /// unknowns of the fix, since each is one satellite's alone.
  Uncombined,
};

struct FixInputOptions {
  Combination combination = Combination::First;
  /// Names of signals, best first, that go into the fix; empty: all that are tracked, in the order of
  /// gnss::signals_of().
  std::vector<std::string> uses;
  positioning::SmoothingOptions smoothing;
  /// Uncombined: standard deviation [m] of the slant delay at 1575.42 MHz that no model corrects, (0, 1000].
  double ionosphere_sigma_m = 5;
  /// The fix takes deviations of groups of signals times this, (0, 1000]; what belongs to several groups
  /// times their product.
  gnss::GroupValues sigma_factor;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, FixInputOptions& o);

/// Turns one receiver's observations into the measurements of its fix; remembers the smoothed codes.
class FixInput {
 public:
  /// Takes weights, C/N0 mask and the correlation times of code errors from options that validate().
  explicit FixInput(const ReceiverOptions& options);

  struct Chosen {
    positioning::Measurement measurement;  ///< as if of the signal near L1, whose clock the sky gives
    /// Slant delay of the ionosphere at 1575.42 MHz [m], model and estimate together; only of
    /// Combination::Uncombined with two signals or more.
    std::optional<double> ionosphere_m;
    /// The measurement with corrections; empty without any.
    std::optional<positioning::Measurement> corrected;
  };
  /// A satellite's measurement for the fix, asked for once an epoch; empty where it has none.
  /// @param model_m the ionosphere's delay at 1575.42 MHz that the fix corrects [m]
  /// @param corrections of smoothed codes; null: none
  [[nodiscard]] std::optional<Chosen> next(const SatelliteObservation& satellite,
                                           const orbit::SatelliteState& state, geodesy::GpsTime time,
                                           double model_m, const CodeCorrections* corrections = nullptr);

 private:
  /// A signal that may go into the fix.
  struct Code {
    const gnss::Signal* signal = nullptr;
    positioning::Measurement measurement;
    double sigma_m = 1;          ///< that weights give it
    double shared_m = 0;         ///< of its measurement's deviation: errors from space
    double iono_rate = 1;        ///< its delay over that at 1575.42 MHz
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
  /// Takes off the codes by how much more the satellite delays their signals than the one near L1.
  void refer_to_l1(const orbit::SatelliteState& state);
  /// Keeps the codes that have a correction, corrected; their deviations without the errors that it removes
  /// go to stated_sigmas_m_.
  void correct(gnss::SatelliteId id, geodesy::GpsTime time, const CodeCorrections& corrections);
  /// One measurement of the codes that are left; there is one at least where next() asks.
  [[nodiscard]] std::optional<Chosen> combine(double elevation_rad, double model_m);
  [[nodiscard]] std::optional<Chosen> ionosphere_free() const;
  [[nodiscard]] Chosen uncombined(double elevation_rad, double model_m);
  [[nodiscard]] std::optional<double> step_m(const Carrier& carrier, const positioning::Measurement& m) const;

  FixInputOptions options_;
  positioning::FixOptions fix_;
  // In every pseudorange, and the rate at which errors of the rest of sigma_m, the code loop's, forget.
  positioning::CodeNoise noise_;
  double shared_m_;                                                        ///< errors from space in noise_
  std::map<std::pair<gnss::SatelliteId, std::size_t>, Carrier> carriers_;  // and index_of() the signal
  // Values of the satellite in hand; members for their memory alone.
  std::vector<Code> codes_;
  std::vector<std::optional<double>> steps_m_;
  std::vector<double> stated_sigmas_m_;
};

}  // namespace canyon::receiver
