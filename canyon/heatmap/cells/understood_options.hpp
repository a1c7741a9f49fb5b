#pragma once

#include <initializer_list>
#include <string_view>

#include "canyon/receiver/receiver_options.hpp"

namespace canyon::heatmap {

/// What changes no fix that has no epoch before: the clock, which all pseudoranges share, Doppler, warnings,
/// and parts that must be switched off (RAIM, the position filter).
inline constexpr std::string_view kWithoutEffect =
    "clock.bias_s clock.drift clock.drift_walk noise.doppler_sigma_hz spoofing_check.enabled "
    "spoofing_check.gain_db spoofing_check.jump_m spoofing_check.hold_s raim. position_filter.";

/// Whether every field of a receiver's options has its default but those that are understood. So a
/// computation refuses an option that is added later, until it is listed.
/// @param understood paths of fields as in options::exact_text(), with blanks between; one that ends in '.'
/// is all of a section
[[nodiscard]] bool differs_only_in(const receiver::ReceiverOptions& options,
                                   std::initializer_list<std::string_view> understood);

}  // namespace canyon::heatmap
