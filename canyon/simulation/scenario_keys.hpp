#pragma once

#include <string>
#include <vector>

#include "canyon/simulation/scenario.hpp"

// Parts of the table of keys. Private to canyon/simulation.

namespace canyon::simulation {

/// Defaults as the table shows them, and as the reader takes them back; infinity is "none".
[[nodiscard]] std::string show(bool value);
[[nodiscard]] std::string show(int value);
[[nodiscard]] std::string show(double value);
[[nodiscard]] std::string show_deg(double radians);

/// Keys below `at`, "receivers[]." or "": all of a receiver but name and profile.
void add_receiver_keys(std::vector<ScenarioKey>& keys, const std::string& at);
void add_propagation_keys(std::vector<ScenarioKey>& keys, const std::string& at);
void add_noise_keys(std::vector<ScenarioKey>& keys, const std::string& at);

}  // namespace canyon::simulation
