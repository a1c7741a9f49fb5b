#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/simulation/scenario/scenario.hpp"

// Properties that the author of a scenario does not know and does not give, sampled from priors
// (docs/study.md).

namespace canyon::unknowns {

/// Level: of the installation. Skyline: fraction of azimuths with an obstacle that the map lacks. Facades:
/// fraction of coated glass. Map: position of the city.
enum class Unknown : std::uint8_t { Level, Skyline, Facades, Map };
/// "level", "skyline", "facades", "map".
[[nodiscard]] std::string_view name_of(Unknown unknown);
/// Throws InputError for other names.
[[nodiscard]] Unknown unknown_of(std::string_view name);
/// The unknowns of comma-separated names; none for an empty text. Throws InputError for other names.
[[nodiscard]] std::vector<Unknown> unknowns_of(std::string_view list);
[[nodiscard]] std::vector<std::string_view> names();

/// Unknowns of a scenario except those in `known`, each with its distribution: "level: -10 to 6 dB, uniform".
/// The scenario's own settings narrow or remove them.
[[nodiscard]] std::vector<std::string> priors_of(const simulation::Scenario& scenario,
                                                 const std::vector<Unknown>& known = {});

/// Samples of all unknowns: a Latin hypercube, the same for the same seed and count.
class UnknownSamples {
 public:
  UnknownSamples(std::uint64_t seed, std::size_t count, std::vector<Unknown> known = {});

  [[nodiscard]] std::size_t size() const { return count_; }
  /// Sets the unknowns of a scenario to sample `draw` < size(). All receivers have the same quantile in their
  /// distributions. The map's position becomes a standard deviation, from which a run samples by its seed, as
  /// it samples facades, shadows, obstacles, range errors and noise. @return the sampled values: "level"
  /// [dB], "skyline", "facades" (fraction of coated glass), "map" [m]; with several receivers "level of NAME"
  std::map<std::string, double> apply(std::size_t draw, simulation::Scenario& scenario) const;

 private:
  std::size_t count_;
  std::vector<Unknown> known_;
  std::vector<std::vector<double>> fractions_;  // [unknown][sample]
};

/// Fractions of facades (city::FacadeOptions::shares) with that fraction of coated glass, [0, 0.7]: between
/// traditional and thermally_efficient buildings.
[[nodiscard]] std::map<std::string, double> facades_with(double coated_glass);
/// Whether a scenario does not set the facades of its city.
[[nodiscard]] bool leaves_facades_open(const simulation::Scenario& scenario);

/// Removes a scenario's settings of installations, surroundings, obstacles and facades.
void forget(simulation::Scenario& scenario);

}  // namespace canyon::unknowns
