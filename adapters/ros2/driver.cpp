#include "adapters/ros2/driver.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace canyon::adapters::ros2 {
namespace {

std::vector<DriverRole> make_roles() {
  DriverRole own{Driver::None, "none", "receiver", "receiver", "gnss", "", false, {}};
  own.topics.imu = "imu";
  own.topics.wheels = "wheels";
  own.topics.magnetic_field = "magnetic_field";
  own.topics.air_pressure = "air_pressure";

  DriverRole ublox{
      Driver::UbloxGps, "ublox_gps", "ublox_gps_node", "ublox_gps_node", "gps", "/rtcm", true, {}};
  ublox.topics = own.topics;
  ublox.topics.fix = "~/fix";
  ublox.topics.fix_velocity = "~/fix_velocity";

  DriverRole septentrio{Driver::Septentrio,
                        "septentrio_gnss_driver",
                        "septentrio_gnss_driver_node",
                        "septentrio_gnss",
                        "gnss",
                        "",
                        false,
                        {}};
  septentrio.topics = own.topics;
  septentrio.topics.fix = "navsatfix";
  septentrio.topics.fix_velocity = "twist_gnss";

  DriverRole novatel{
      Driver::Novatel, "novatel_gps_driver", "novatel_gps_node", "novatel_gps", "", "", true, {}};
  novatel.topics = own.topics;
  novatel.topics.gps_fix = "gps";

  DriverRole nmea{Driver::NmeaNavsat,
                  "nmea_navsat_driver",
                  "nmea_serial_driver",
                  "nmea_navsat_driver",
                  "gps",
                  "",
                  true,
                  {}};
  nmea.topics = own.topics;
  return {own, ublox, septentrio, novatel, nmea};
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
