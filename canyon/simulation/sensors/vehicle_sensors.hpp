#pragma once

#include <optional>

#include "canyon/inertial/sensor_options.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/sensors/sensor_run.hpp"

namespace canyon::simulation {

/// Throws InputError where a receiver with dead reckoning has no inertial sensor, or does not move.
void check_sensors(const inertial::SensorOptions& sensors, const ReceiverConfig& receiver);

/// The sensors of a vehicle for a receiver with dead reckoning, without readings: it knows where they are and
/// how large their errors are. Empty for other receivers.
[[nodiscard]] std::optional<receiver::VehicleSensors> vehicle_sensors(const inertial::SensorOptions& sensors,
                                                                      const ReceiverConfig& receiver);

/// The samples of an epoch in the vehicle's axes. Lost samples are left out. @param begin of the run
[[nodiscard]] positioning::SensorReadings readings_of(const SensorBatch& batch,
                                                      const inertial::SensorOptions& sensors,
                                                      geodesy::GpsTime begin);

}  // namespace canyon::simulation
