#pragma once

#include <map>
#include <string>

#include "canyon/gnss/navigation_data.hpp"
#include "canyon/heatmap/engine/engine.hpp"
#include "canyon/simulation/scenario/fwd.hpp"

namespace canyon::heatmap {

/// Everything that values of a map depend on but the city, the sky and the program, one "name: value" a line;
/// numbers so that they read back the same. Options come by their lists of fields.
/// @param base of layers of RTK; null: none
[[nodiscard]] std::string canonical_text(const Request& request, const simulation::ReceiverConfig& receiver,
                                         const std::map<gnss::System, gnss::Klobuchar>& klobuchar,
                                         const simulation::ReceiverConfig* base = nullptr);

/// 128 bits of a text in 32 hexadecimal digits: two FNV-1a hashes, of the text and of the text behind a word.
/// Against accidents, not against malice.
[[nodiscard]] std::string hash_text(const std::string& text);

}  // namespace canyon::heatmap
