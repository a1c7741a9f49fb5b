#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "canyon/city/fwd.hpp"

namespace canyon::buildings {

/// The kind of a way of MapData::passages.
enum class PassageKind : std::uint8_t { Tunnel, Covered, Bridge };
[[nodiscard]] PassageKind passage_kind(const std::map<std::string, std::string>& tags);

/// Appends the solids of a passage, as objects of Surface::Building of concrete: of a tunnel a roof and two
/// walls with open mouths, of a covered way a roof, of a bridge its deck.
///
/// The inner height of roofs is `maxheight` and 0.3 m more, else 5 m, 3 m over footways; of a bridge's deck
/// `layer` (1 without) times 6 m. Widths: `width`, else 3.5 m for each of `lanes`, else 8 m, 3 m of footways
/// and 5 m of railways.
/// @param line in the city's frame, z the ground; at least two points
/// @param level the ground has one height: the passage is one piece, else it follows the ground in pieces of
/// 30 m at most
/// @return whether there was anything to append
bool append_passage(city::Mesh& mesh, const std::string& id, const std::map<std::string, std::string>& tags,
                    const std::vector<Eigen::Vector3d>& line, bool level);

}  // namespace canyon::buildings
