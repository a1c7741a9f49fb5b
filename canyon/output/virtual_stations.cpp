#include "canyon/output/virtual_stations.hpp"

#include "canyon/geodesy/frames.hpp"
#include "canyon/simulation/motion/track_readers.hpp"

namespace canyon::output {

VirtualStations::VirtualStations(const Format& format, ReceiverDescription base)
    : format_(&format), base_(std::move(base)) {
  base_.virtual_station = true;
}

void VirtualStations::receive(std::uint64_t reader, std::string_view bytes) {
  Rover& rover = rovers_.of(reader);
  rover.lines.receive(bytes, [&rover](std::optional<std::string_view> line) {
    if (!line) return;
    if (const auto place = simulation::position_of_gga(*line)) {
      rover.reported_ecef = geodesy::ecef_from_geodetic(*place);
    }
  });
}

std::vector<std::pair<std::uint64_t, std::string>> VirtualStations::encode(const simulation::Epoch& epoch) {
  std::vector<std::pair<std::uint64_t, std::string>> result;
  for (auto& [reader, rover] : rovers_) {
    const std::optional<simulation::Epoch> moved = rover.station.move(epoch, rover.reported_ecef);
    if (!moved) continue;
    if (!rover.encoder || moved->truth_ecef != rover.place_ecef) {
      rover.place_ecef = moved->truth_ecef;
      base_.station_ecef = rover.place_ecef;
      rover.encoder = format_->make(base_);
    }
    result.emplace_back(reader, rover.encoder->encode(*moved));
  }
  return result;
}

}  // namespace canyon::output
