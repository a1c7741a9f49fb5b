#pragma once

#include <filesystem>
#include <vector>

#include "canyon/options/node.hpp"
#include "canyon/study/axis.hpp"

namespace canyon::study {

/// Refuses axes of which one sets what another one has set: only the last of them would count. A section in
/// front of a key within it, which its values do not have, is no such case.
/// @param base the scenario, for the names of items of its lists
/// @param file of the study, for messages
/// Throws InputError, which names both axes and the key.
void check_keys(const std::vector<Axis>& axes, const options::Node& base, const std::filesystem::path& file);

}  // namespace canyon::study
