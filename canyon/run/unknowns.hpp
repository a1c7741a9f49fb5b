#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/run/scenario/scenario.hpp"

// Properties that the author of a scenario does not know and does not say, drawn from priors
// (docs/study.md).

namespace canyon::unknowns {

/// Level: of the installation. Skyline: share of azimuths with an obstacle that the map lacks. Facades: share
/// of coated glass. Map: place of the city.
enum class Unknown : std::uint8_t { Level, Skyline, Facades, Map };
/// "level", "skyline", "facades", "map".
[[nodiscard]] std::string_view name_of(Unknown unknown);
/// Throws InputError for other names.
[[nodiscard]] Unknown unknown_of(std::string_view name);
/// The unknowns of names with commas between them; none for an empty text. Throws InputError for other names.
[[nodiscard]] std::vector<Unknown> unknowns_of(std::string_view list);
[[nodiscard]] std::vector<std::string_view> names();

/// Unknowns of a scenario but for those in `known`, each with the distribution that it is drawn from: "level:
/// -10 to 6 dB, uniform". The scenario's own settings narrow or remove them.
[[nodiscard]] std::vector<std::string> priors_of(const simulation::Scenario& scenario,
                                                 const std::vector<Unknown>& known = {});

/// Draws of all unknowns: a Latin hypercube, the same for the same seed and count.
class Draws {
 public:
  Draws(std::uint64_t seed, std::size_t count, std::vector<Unknown> known = {});

  [[nodiscard]] std::size_t size() const { return count_; }
  /// Sets what is unknown in a scenario to its values of a draw < size(). Receivers share a draw's place in
  /// their distributions. The place of the map becomes a standard deviation, from which a run draws by its
  /// seed, as it draws facades, shadows, obstacles, errors from space and noise.
  /// @return what was drawn: "level" [dB], "skyline", "facades" (share of coated glass), "map" [m]; with
  /// several receivers "level of NAME"
  std::map<std::string, double> apply(std::size_t draw, simulation::Scenario& scenario) const;

 private:
  std::size_t count_;
  std::vector<Unknown> known_;
  std::vector<std::vector<double>> shares_;  // [unknown][draw]
};

/// Shares of facades (city::FacadeOptions::shares) with that share of coated glass, [0, 0.7]: between
/// traditional and thermally_efficient buildings.
[[nodiscard]] std::map<std::string, double> facades_with(double coated_glass);
/// Whether a scenario says nothing about the facades of its city.
[[nodiscard]] bool leaves_facades_open(const simulation::Scenario& scenario);

/// Takes from a scenario what it says about installations, surroundings, obstacles and facades.
void forget(simulation::Scenario& scenario);

}  // namespace canyon::unknowns
