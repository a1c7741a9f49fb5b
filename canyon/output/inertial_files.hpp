#pragma once

#include <filesystem>
#include <memory>

#include "canyon/simulation/simulator.hpp"

namespace canyon::output {

/// Files of the scenario's sensors in `folder` (docs/imu.md has the columns), as `outputs:` asks for
/// them, of sensors that the scenario has. `imu`: imu.csv, its samples, and motion.csv, the true motion of
/// the sensor at their instants, with all digits; `kf_gins`: kf_gins_imu.txt, kf_gins_gnss.txt (fixes of the
/// first receiver) and kf_gins_truth.nav, the layouts of KF-GINS and OB_GINS; `gici`: gici_imu.txt,
/// that of GICI; `wheels`: wheels.csv;
/// `barometer`: barometer.csv; `magnetometer`: magnetometer.csv; `sensors_npz`: sensors.npz, all of these for
/// NumPy.
[[nodiscard]] std::unique_ptr<simulation::EpochSink> make_inertial_files(
    const simulation::Simulation& simulation, const std::filesystem::path& folder);

}  // namespace canyon::output
