#pragma once

#include <optional>
#include <string>

#include "canyon/disturbance/disturbance.hpp"
#include "canyon/disturbance/shadowing.hpp"
#include "canyon/disturbance/skyline.hpp"

namespace canyon::disturbance {

/// Obstacles that the map lacks, at one antenna: shadows on every satellite's direct path (Shadowing), and
/// obstacles on all paths by their direction of arrival (Skyline). The obstacles move, too
/// (ShadowingOptions::obstacle_speed_mps). Antennas of one seed and name that drive the same way meet the
/// same shadows; all of one seed meet the same skyline.
class DirectShadowing : public Disturbance {
 public:
  /// Throws InputError where options.validate() does.
  DirectShadowing(const ShadowingOptions& options, std::uint64_t seed, const std::string& receiver);

  void apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) override;

 private:
  double obstacle_speed_mps_;
  Shadowing shadowing_;
  Skyline skyline_;
  std::optional<propagation::Antenna> before_;
  double way_m_ = 0;
};

}  // namespace canyon::disturbance
