#pragma once

#include <string>
#include <vector>

#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::simulation {

/// The receivers' names, in their order.
[[nodiscard]] inline std::vector<std::string> receiver_names(const std::vector<ReceiverConfig>& receivers) {
  std::vector<std::string> names;
  names.reserve(receivers.size());
  for (const ReceiverConfig& receiver : receivers) names.push_back(receiver.options.name);
  return names;
}

}  // namespace canyon::simulation
