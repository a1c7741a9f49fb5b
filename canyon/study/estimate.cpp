#include "canyon/study/estimate.hpp"

#include <algorithm>

#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::study {

double estimated_epochs(const simulation::Scenario& scenario, const Axis* drives,
                        std::vector<std::string>& warnings) {
  const simulation::TrajectoryConfig& way = scenario.trajectory;
  double way_s = scenario.duration_s.value_or(0), rate_hz = scenario.rate_hz.value_or(1);
  if (drives != nullptr) {
    way_s = drives->drives.length_m / drives->drives.speed_mps;
  } else if (way.file) {
    const simulation::HeightReading heights{!way.height_above_terrain_m};
    const simulation::TrajectoryFile file = simulation::read_trajectory_file(
        *way.file, way.format, scenario.start.value_or(geodesy::GpsTime{}), heights);
    warnings.insert(warnings.end(), file.warnings.begin(), file.warnings.end());
    const simulation::Trajectory& trajectory = file.trajectory;
    way_s = trajectory.end() - trajectory.begin();
    rate_hz = scenario.rate_hz.value_or(1 / trajectory.sample_interval_s());
  } else if (way.waypoints.size() > 1) {
    // Waypoints in the frame of a city that is not read yet give only their distances.
    std::vector<Eigen::Vector3d> places;
    for (const auto& place : way.waypoints) places.push_back(geodesy::ecef_from_geodetic(place));
    for (const auto& [index, local] : way.local_waypoints) places.at(index) = local;
    way_s = way.hold_s * static_cast<double>(places.size());
    for (std::size_t i = 1; i < places.size(); ++i)
      way_s += (places[i] - places[i - 1]).norm() / way.speed_mps;
  }
  if (scenario.duration_s) way_s = std::min(way_s, *scenario.duration_s);
  return std::max(1.0, way_s * rate_hz + 1);
}

}  // namespace canyon::study
