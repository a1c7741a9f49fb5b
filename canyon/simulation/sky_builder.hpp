#pragma once

#include <memory>
#include <span>

#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/fwd.hpp"

namespace canyon::receiver {
struct ReceiverOptions;
}

namespace canyon::simulation {

struct BuiltSky {
  std::shared_ptr<const orbit::Sky> sky;
  gnss::NavigationData navigation;  ///< empty for SP3 and frozen skies
  ReadReport report;                ///< of its files, and possible mistakes
  /// make_range_errors() of this seed, for all users of the sky; null: each makes its own.
  std::shared_ptr<const sky::RangeErrorModel> errors{};
  std::uint64_t errors_seed = 0;
};
/// Builds the sky of `config`, valid over [begin, end], seen from `position` (frozen skies). Throws
/// InputError, with both spans and a hint, if no satellite has an ephemeris at `begin`. Warns if the
/// ephemerides end before `end`, or are older than their system allows (allow_stale).
[[nodiscard]] BuiltSky build_sky(const SkyConfig& config, geodesy::GpsTime begin, geodesy::GpsTime end,
                                 const geodesy::Geodetic& position);

/// The range errors under a sky (SkyConfig::errors), the same for the same seed; null: none.
[[nodiscard]] std::shared_ptr<const sky::RangeErrorModel> make_range_errors(const SkyConfig& config,
                                                                            const BuiltSky& sky,
                                                                            std::uint64_t seed);
/// A city under a built sky, with these errors.
[[nodiscard]] Environment make_environment(std::shared_ptr<CityScene> scene, const BuiltSky& sky,
                                           const SkyConfig& config, std::uint64_t seed);

/// Decides the options that are left open: by the range errors, and for a radio that cannot track all signals
/// at once by the systems of the sky. @param sky null: a recording gives the tracked signals
void decide_options(receiver::ReceiverOptions& options, const sky::RangeErrorModel* errors,
                    const orbit::Sky* sky);

/// Whether any satellite is known at `t`.
[[nodiscard]] bool has_satellites(const orbit::Sky& sky, geodesy::GpsTime t);
/// Throws InputError for the first time at which no satellite of the sky has an ephemeris.
void require_satellites(const orbit::Sky& sky, std::span<const geodesy::GpsTime> times);
/// Throws InputError if a sky has satellites without ionosphere coefficients of their system or of GPS.
void require_ionosphere(const BuiltSky& sky);

}  // namespace canyon::simulation
