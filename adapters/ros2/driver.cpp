#include "adapters/ros2/driver.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace canyon::adapters::ros2 {
namespace {

std::vector<DriverRole> make_roles() {
  TopicNames own;
  own.imu = "imu";
  own.wheels = "wheels";
  own.magnetic_field = "magnetic_field";
  own.air_pressure = "air_pressure";
  TopicNames ublox = own, septentrio = own, novatel = own;
  ublox.fix = "~/fix";
  ublox.fix_velocity = "~/fix_velocity";
  septentrio.fix = "navsatfix";
  septentrio.fix_velocity = "twist_gnss";
  novatel.gps_fix = "gps";
  // Package, program, node, frame, corrections, whether covariances are diagonal.
  return {{Driver::None, "none", "receiver", "receiver", "gnss", "", false, own},
          {Driver::UbloxGps, "ublox_gps", "ublox_gps_node", "ublox_gps_node", "gps", "/rtcm", true, ublox},
          {Driver::Septentrio, "septentrio_gnss_driver", "septentrio_gnss_driver_node", "septentrio_gnss",
           "gnss", "", false, septentrio},
          {Driver::Novatel, "novatel_gps_driver", "novatel_gps_node", "novatel_gps", "", "", true, novatel},
          {Driver::NmeaNavsat, "nmea_navsat_driver", "nmea_serial_driver", "nmea_navsat_driver", "gps", "",
           true, own}};
}

using Number = std::optional<double>;

Number number_of(const Parameters& given, const std::string& name) {
  const auto at = given.find(name);
  if (at == given.end()) return std::nullopt;
  if (const auto* number = std::get_if<double>(&at->second)) return *number;
  if (const auto* integer = std::get_if<std::int64_t>(&at->second)) return static_cast<double>(*integer);
  return std::nullopt;
}

/// Constellations that ublox_gps switches on: `gnss.gps`, which is its only default, and so on. Empty where
/// no parameter names one.
std::vector<std::string> ublox_systems(const Parameters& given) {
  static constexpr std::array<std::pair<const char*, const char*>, 6> kSystems{{{"gnss.gps", "GPS"},
                                                                                {"gnss.glonass", "GLONASS"},
                                                                                {"gnss.galileo", "Galileo"},
                                                                                {"gnss.beidou", "BeiDou"},
                                                                                {"gnss.qzss", "QZSS"},
                                                                                {"gnss.sbas", "SBAS"}}};
  std::vector<std::string> systems;
  bool any = false;
  for (const auto& [name, system] : kSystems) {
    const auto at = given.find(name);
    const bool* on = at == given.end() ? nullptr : std::get_if<bool>(&at->second);
    any = any || on != nullptr;
    if (on != nullptr ? *on : systems.empty() && std::string_view(system) == "GPS") {
      systems.emplace_back(system);
    }
  }
  return any ? systems : std::vector<std::string>();
}

/// Meanings of a driver's parameters, as the node's own.
Parameters meanings(Driver driver, const Parameters& given, std::vector<std::string>& used) {
  Parameters own;
  const auto rate = [&](const char* name, double hz_of_one, bool period) {
    const Number value = number_of(given, name);
    if (!value || *value <= 0) return;
    own["rate_hz"] = period ? hz_of_one / *value : *value;
    used.emplace_back(name);
  };
  switch (driver) {
    case Driver::UbloxGps: {
      rate("rate", 1, false);
      if (const auto systems = ublox_systems(given); !systems.empty()) own["sky.systems"] = systems;
      for (const auto& [name, value] : given) {
        if (name.rfind("gnss.", 0) == 0 && name != "gnss.imes") used.push_back(name);
      }
      break;
    }
    case Driver::Septentrio:
      rate("polling_period.pvt", 1000, true);  // [ms]
      break;
    case Driver::Novatel:
      rate("polling_period", 1, true);  // [s]
      break;
    case Driver::NmeaNavsat:
    case Driver::None:
      break;
  }
  return own;
}

}  // namespace

const std::vector<DriverRole>& driver_roles() {
  static const std::vector<DriverRole> roles = make_roles();
  return roles;
}

const DriverRole& role_of(Driver driver) {
  return driver_roles().at(static_cast<std::size_t>(driver));
}

const DriverRole& role_of_program(std::string_view path) {
  const std::string_view name = path.substr(path.rfind('/') + 1);  // npos + 1 is 0
  const auto at = std::find_if(driver_roles().begin(), driver_roles().end(),
                               [name](const DriverRole& role) { return role.program == name; });
  return at == driver_roles().end() ? driver_roles().front() : *at;
}

TopicNames topics_of(const NodeSettings& settings) {
  TopicNames names = role_of(settings.driver).topics;
  const inertial::SensorOptions& sensors = settings.live.sensors;
  const bool drives = !settings.by_poses();
  if (!drives || !sensors.imu) names.imu.clear();
  if (!drives || !sensors.wheels) names.wheels.clear();
  if (!drives || !sensors.magnetometer) names.magnetic_field.clear();
  if (!drives || !sensors.barometer) names.air_pressure.clear();
  if (settings.drive_clock) names.clock = "/clock";
  return names;
}

Parameters own_parameters(const Parameters& given, std::vector<std::string>& unused) {
  Driver driver = Driver::None;
  if (const auto at = given.find("driver"); at != given.end()) {
    const auto* name = std::get_if<std::string>(&at->second);
    for (const DriverRole& role : driver_roles()) {
      if (name != nullptr && role.name == *name) driver = role.driver;
    }
  }
  std::vector<std::string> used;
  Parameters own = meanings(driver, given, used);
  for (const auto& [name, value] : given) {
    if (find_parameter(name) != nullptr) {
      own[name] = value;
    } else if (std::find(used.begin(), used.end(), name) == used.end()) {
      unused.push_back(name);
    }
  }
  return own;
}

}  // namespace canyon::adapters::ros2
