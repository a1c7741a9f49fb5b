#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/output/encoder.hpp"
#include "canyon/simulation/correction_links.hpp"
#include "canyon/transport/readers.hpp"

namespace canyon::output {

/// A virtual reference station for each reader of a stream, at the place that its GGA sentences report.
class VirtualStations {
 public:
  /// @param base of the base station that all of them are computed from
  VirtualStations(const Format& format, ReceiverDescription base);

  /// Takes bytes from a reader, cut anywhere. Anything but GGA sentences with a fix is ignored.
  void receive(std::uint64_t reader, std::string_view bytes);
  /// The bytes of the base's epoch for each reader that has reported a place.
  [[nodiscard]] std::vector<std::pair<std::uint64_t, std::string>> encode(const simulation::Epoch& epoch);

 private:
  struct Rover {
    transport::LineCutter lines{256};
    std::optional<Eigen::Vector3d> reported_ecef;
    simulation::VirtualStation station;
    std::unique_ptr<Encoder> encoder;
    Eigen::Vector3d place_ecef = Eigen::Vector3d::Zero();  ///< of the station that `encoder` states
  };

  const Format* format_;
  ReceiverDescription base_;
  transport::Readers<Rover> rovers_;
};

}  // namespace canyon::output
