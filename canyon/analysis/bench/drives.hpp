#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/base/options/fwd.hpp"
#include "canyon/simulation/simulator.hpp"

// The drives of the bench, on which estimators are run: docs/bench.md.

namespace canyon::bench {

/// A part of a scenario, common to several drives.
struct ScenarioPart {
  std::string name, scenario;
};
struct BenchDrive {
  std::string name, about, town, route;
  std::vector<std::string> needs;  ///< what an estimator needs to do well: fixes, imu, wheels, raw
  std::string faults;              ///< YAML of `faults:`; empty: clean physics
  std::string sensors;             ///< YAML; empty: those of the catalogue

  [[nodiscard]] bool has_fault() const { return !faults.empty() || !sensors.empty(); }
};
/// The drives of an edition: examples/bench/drives.yaml. Equal editions and versions of Canyon, equal bytes.
struct Catalogue {
  int bench = 0;  ///< edition
  std::string common, sensors;
  std::vector<ScenarioPart> towns, routes;
  std::vector<BenchDrive> drives;
};
void visit(options::Visitor& v, Catalogue& o);
inline constexpr int kEdition = 2;  ///< the latest
/// The built-in drives. Throws InputError for another edition than 1 and 2.
[[nodiscard]] const Catalogue& catalogue(int edition = kEdition);

struct BenchReceiver {
  std::string name;     ///< in names of drives
  std::string profile;  ///< a scenario's `profile:`, YAML
  std::string base;     ///< `fixed:` of its base for RTK, YAML; empty: none
};
/// The scenario of a drive.
/// @param own YAML of city, start and trajectory; empty: the drive's town and route
[[nodiscard]] std::string scenario_of(const Catalogue& all, const BenchDrive& drive,
                                      const BenchReceiver& receiver, std::uint64_t seed,
                                      const std::string& own = {});
/// `fixed:` of a base in the open, in synthetic towns.
inline constexpr const char* kTownBase = "{east_m: 900, north_m: 300, up_m: 30}";

/// The first time at which a fault of a drive is active [s since its begin]; empty: it has no fault.
[[nodiscard]] std::optional<double> first_fault_s(const simulation::Scenario& scenario);

/// Properties of a drive for its card that its run lacks.
struct DriveCard {
  int edition = kEdition;
  BenchDrive drive;
  std::string receiver;
  std::string without_fault;  ///< name of the drive that differs only by the fault; empty: none
};
/// Writes a drive's folder: truth.csv, fixes.csv, imu.csv, wheels.csv, events.csv (docs/bench.md). Files of
/// formats are written by the run itself.
[[nodiscard]] std::unique_ptr<simulation::EpochSink> make_drive_sink(const simulation::Simulation& simulation,
                                                                     const std::filesystem::path& folder);
/// Writes card.yaml, which marks a folder as a drive: after a whole run.
void write_card(const simulation::Simulation& simulation, const DriveCard& card,
                const std::filesystem::path& folder);

}  // namespace canyon::bench
