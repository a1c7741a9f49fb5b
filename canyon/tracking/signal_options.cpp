#include "canyon/tracking/signal_options.hpp"

#include <fmt/format.h>

#include <cassert>
#include <cmath>

#include "canyon/base/input_error.hpp"

namespace canyon::tracking {
namespace {

void check_range(const char* field, double value, double least, double most, const char* unit) {
  if (!(value >= least && value <= most)) {
    throw InputError(fmt::format("{} of the signals is {}", field, value),
                     fmt::format("it must be {} to {} {}", least, most, unit));
  }
}

}  // namespace

void SignalOptions::validate() const {
  link.validate();
  for (const auto& [system, offset_db] : system_offset_db) {
    if (!(std::abs(offset_db) <= 20)) {
      throw InputError(fmt::format("system_offset_db of {} is {}", gnss::name(system), offset_db),
                       "it must be -20 to 20 dB");
    }
  }
  check_range("satellite_sigma_db", satellite_sigma_db, 0, 10, "dB");
  strength.validate();
  shadowing.validate();
  for (const gnss::System system : gnss::kAllSystems) {
    try {
      open_signal(system, front_end_bandwidth_hz).validate();
    } catch (const InputError&) {
      throw InputError(fmt::format("front_end_bandwidth_hz of the signals is {}", front_end_bandwidth_hz),
                       "it must be 1.023e6 to 511e6 Hz or infinite");
    }
  }
  dll.validate();
  pll.validate();
  fll.validate();
  lock.validate();
  check_range("phase_threshold_dbhz", phase_threshold_dbhz, 0, 100, "dB-Hz");
  check_range("cn0_sigma_db", cn0_sigma_db, 0, 10, "dB");
  check_range("cn0_step_db", cn0_step_db, 0, 10, "dB");
}

CorrelationOptions open_signal(gnss::System system, double front_end_bandwidth_hz) {
  CorrelationOptions signal;
  signal.bandwidth_hz = front_end_bandwidth_hz;
  switch (system) {
    case gnss::System::GPS:
    case gnss::System::QZSS:
      signal.chip_rate_hz = 1.023e6;
      return signal;
    case gnss::System::GLONASS:
      signal.chip_rate_hz = 0.511e6;
      return signal;
    case gnss::System::Galileo:
      signal.modulation = Modulation::CBOCPilot;
      signal.chip_rate_hz = 1.023e6;
      return signal;
    case gnss::System::BeiDou:
      signal.chip_rate_hz = 2.046e6;
      return signal;
  }
  assert(false);
  return signal;
}

}  // namespace canyon::tracking
