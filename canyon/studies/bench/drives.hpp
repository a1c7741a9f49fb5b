#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "canyon/base/options/fwd.hpp"
#include "canyon/run/simulator.hpp"

// The drives that estimators are put on: docs/bench.md.

namespace canyon::bench {

/// A piece of a scenario that drives share.
struct ScenarioPart {
  std::string name, scenario;
};
struct BenchDrive {
  std::string name, about, town, way;
  std::vector<std::string> needs;  ///< what an estimator needs to do well: fixes, imu, wheels, raw
  std::string faults;              ///< YAML of `faults:`; empty: clean physics
  std::string sensors;             ///< YAML; empty: those of the catalogue
};
/// examples/bench/drives.yaml. Same version, same bytes.
struct Catalogue {
  int bench = 0;
  std::string common, sensors;
  std::vector<ScenarioPart> towns, ways;
  std::vector<BenchDrive> drives;
};
void visit(options::Visitor& v, Catalogue& o);
/// The one that the program was built with.
[[nodiscard]] const Catalogue& catalogue();

/// The scenario of a drive. @param profile of the rover; "ublox-f9p" has a base for RTK
/// @param place YAML of city, start and trajectory instead of the town and the way
[[nodiscard]] std::string scenario_of(const BenchDrive& drive, const std::string& profile, std::uint64_t seed,
                                      const std::string& place = {});

/// Writes a drive's folder: truth.csv, fixes.csv, imu.csv, wheels.csv, events.csv, card.yaml (docs/bench.md).
/// The files of formats are the run's own.
[[nodiscard]] std::unique_ptr<simulation::EpochSink> make_drive_sink(const simulation::Simulation& simulation,
                                                                     const BenchDrive& drive,
                                                                     const std::string& profile,
                                                                     const std::filesystem::path& folder);

}  // namespace canyon::bench
