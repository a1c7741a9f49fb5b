#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "canyon/paths/disturbance/disturbance.hpp"

namespace canyon::test {

/// A disturbance without memory.
template <typename Apply>
disturbance::DisturbanceSource always(std::string name, Apply apply) {
  class Each final : public disturbance::Disturbance {
   public:
    explicit Each(Apply apply) : apply_(std::move(apply)) {}
    void apply(const propagation::Antenna& /*antenna*/, propagation::Arrival& arrival) override {
      apply_(arrival);
    }

   private:
    Apply apply_;
  };
  return {std::move(name),
          [apply](std::uint64_t, const std::string&) { return std::make_unique<Each>(apply); }};
}

inline disturbance::DisturbanceSource without(gnss::SatelliteId id) {
  return always("without " + gnss::to_string(id), [id](propagation::Arrival& arrival) {
    arrival.views.erase(
        std::remove_if(arrival.views.begin(), arrival.views.end(),
                       [id](const propagation::SatelliteView& view) { return view.line.id == id; }),
        arrival.views.end());
  });
}

}  // namespace canyon::test
