#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "canyon/receiver/receiver.hpp"

namespace canyon::receiver {

/// Names that receiver_preset() knows.
[[nodiscard]] std::vector<std::string> receiver_preset_names();

/// Options by one word: "default" is ReceiverOptions as constructed; "paper" takes the paper's section III:
/// mask 15 deg, more than four satellites, OU noise, atmosphere taken as corrected. (The paper's mirror model
/// is an option of propagation.) Throws InputError for another name, listing those there are.
[[nodiscard]] ReceiverOptions receiver_preset(std::string_view name);

}  // namespace canyon::receiver
