#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "canyon/outputs/encoding/summary.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::encoding {

/// Folder names for receivers: letters, digits, '.', '-' and '_' stay, anything else becomes '_'; "-2", "-3",
/// ... is appended to equal names (ignoring case).
[[nodiscard]] std::vector<std::string> receiver_folder_names(const std::vector<std::string>& receiver_names);
/// The folder of a receiver's files: `folder` itself with one receiver, else a subfolder.
/// Precondition: `receiver` is an index into simulation.scenario().receivers.
[[nodiscard]] std::filesystem::path receiver_folder(const simulation::Simulation& simulation,
                                                    const std::filesystem::path& folder,
                                                    std::size_t receiver);

/// Writes all files requested by the scenario's `outputs:` into `folder`. With one receiver the names are
/// plain (epochs.csv, satellites.csv, receiver.nmea, receiver.obs, sky.nav, track.kml, track.geojson); with
/// several, each receiver has a folder with its name (sky.nav, imu.csv and motion.csv stay in `folder`;
/// sky.nav is left out for skies without broadcast records). Pictures are part of canyon::io (pictures.hpp).
/// `simulation` must outlive the sinks. Throws InputError if a folder or file cannot be made.
[[nodiscard]] std::vector<std::unique_ptr<simulation::EpochSink>> make_file_sinks(
    const simulation::Simulation& simulation, const std::filesystem::path& folder);

}  // namespace canyon::encoding
