#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "canyon/sky/rinex/observation_reader.hpp"

namespace canyon::test {

/// Signals of an epoch by satellite and RINEX code.
using Observations = std::map<std::pair<gnss::SatelliteId, std::string>, rinex::ObservedSignal>;

/// Epochs of a RINEX file. If Galileo's data and pilot are tracked together, the code is the pilot's, as in
/// binary formats of receivers: 1C, 5Q, 7Q.
inline std::vector<std::pair<geodesy::GpsTime, Observations>> observation_epochs(
    const std::filesystem::path& path) {
  rinex::ObservationOptions options;
  options.all_signals = true;
  rinex::RinexObservationReader reader(path, options);
  std::vector<std::pair<geodesy::GpsTime, Observations>> epochs;
  while (const auto epoch = reader.next()) {
    Observations observations;
    for (const auto& s : epoch->signals) {
      std::string code = s.code.data();
      if (code.back() == 'X') code.back() = code.front() == '1' ? 'C' : 'Q';
      observations[{s.id, code}] = s;
    }
    epochs.emplace_back(epoch->receiver_time, std::move(observations));
  }
  return epochs;
}

}  // namespace canyon::test
