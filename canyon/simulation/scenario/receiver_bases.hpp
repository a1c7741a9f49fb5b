#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::simulation {

/// Throws InputError where receivers[index] cannot take the corrections that it names: of no receiver of the
/// run, of itself, of one without a fixed place, of one that itself depends on it, or of one that draws the
/// same noise.
void check_corrections(const std::vector<ReceiverConfig>& receivers, std::size_t index);

/// Whether a receiver uses the measurements of a base.
[[nodiscard]] inline bool has_base(const receiver::ReceiverOptions& options) {
  return options.rtk.enabled || !options.corrections.from.empty();
}

/// The base of a receiver in the same run; empty: it takes no corrections, or those of a stream.
[[nodiscard]] std::optional<ReceiverConfig> base_of(const std::vector<ReceiverConfig>& receivers,
                                                    const ReceiverConfig& receiver);

/// The index of that base.
[[nodiscard]] std::optional<std::size_t> index_of_base(const std::vector<ReceiverConfig>& receivers,
                                                       const ReceiverConfig& receiver);

}  // namespace canyon::simulation
