#include "canyon/simulation/scenario/map_motion.hpp"

#include <fmt/format.h>

namespace canyon::simulation {
namespace {

constexpr std::string_view kMotions[]{"auto", "standing", "driving", "flying"};

}  // namespace

void visit(options::Visitor& v, MapOptions& o) {
  v.choice(
      {"motion", "",
       "receiver of a heat map: standing, driving (along the longest way through a cell), flying (in all "
       "directions); auto: one with a position filter and without a fixed place drives below 5 m above "
       "the terrain and flies above, others stand"},
      o.motion, kMotions);
  v.number({"pace_mps", "m/s", "speed of a receiver of a heat map that drives or flies"}, o.pace_mps,
           {0.1, 300});
}

std::string_view name(Motion motion) {
  return kMotions[static_cast<std::size_t>(motion)];
}

std::string describe(const MapOptions& options) {
  const std::string_view motion = name(options.motion);
  return options.moves() ? fmt::format("{} at {:g} m/s", motion, options.pace_mps) : std::string(motion);
}

}  // namespace canyon::simulation
