#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/base/options/node.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

// Fields common to scenarios, hosts' configurations and profiles. Private to canyon/simulation.

namespace canyon::simulation {

inline constexpr options::Range kLatitude_deg{-90, 90}, kLongitude_deg{-180, 180}, kHeight_m{-10e3, 100e3};

void visit_rate(options::Visitor& v, std::optional<double>& rate_hz);
void visit_seed(options::Visitor& v, std::uint64_t& seed);
/// A mapping of names to true and false, or a list of names.
void visit_outputs(options::Visitor& v, OutputConfig& config);
/// A reader sets the positions of waypoints given by east, north, up if the city's origin is known.
void visit_trajectory(options::Visitor& v, TrajectoryConfig& config, const CityConfig& city);
void visit_fixed(options::Visitor& v, std::optional<FixedPosition>& fixed, const CityConfig& city);
/// Name and profile, which a reader applies before other fields. `several`: a name is required.
void visit_name_and_profile(options::Visitor& v, ReceiverConfig& config, bool several);
/// The list of receivers, with their profiles, below the scenario's own sections propagation, noise,
/// surroundings and shadowing.
void visit_receivers(options::Visitor& v, std::vector<ReceiverConfig>& receivers, const CityConfig& city);
/// Whether `noise` of a receiver has no effect, because range errors replace it (ReceiverOptions::decide())
/// and the scenario does not request both.
[[nodiscard]] bool has_idle_noise(const SkyConfig& sky, const ReceiverConfig& receiver);
/// The warning if `noise` was given without effect. @param names of the receivers; empty: there is only one
[[nodiscard]] std::string idle_noise_warning(const std::vector<std::string>& names);
/// A reader sets the whole config from the given profile, or from the default one.
void visit_profile(options::Visitor& v, ReceiverConfig& config);

/// The document of a text of this kind. `name` appears in messages.
[[nodiscard]] options::Document document_of(const std::filesystem::path& name, const char* kind = "scenario");

}  // namespace canyon::simulation
