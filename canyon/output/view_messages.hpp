#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/output/epoch_rows.hpp"

namespace canyon::output {

/// Messages between the engine and the viewer's page are JSON objects, a line each where they are bytes of a
/// stream; docs/view-format.md and viewer/schema.json define them. This is their version.
inline constexpr int kViewMessages = 1;

struct ReceiverDescription;

/// {"type":"hello",...}: of which receiver, and from when on, epochs follow.
[[nodiscard]] std::string hello_message(const ReceiverDescription& receiver);

/// An epoch on its own, as the page shows it.
struct EpochMessage {
  std::string receiver;            ///< its name
  std::optional<std::int64_t> id;  ///< of the question that it answers
  Eigen::Vector3d place =
      Eigen::Vector3d::Zero();                ///< of the antenna, city's frame [m]; NaN where nobody knows
  double time_s = 0;                          ///< since the begin
  std::vector<std::string> faults;            ///< at work
  std::vector<gnss::SatelliteId> satellites;  ///< what the rows' satellites are
  std::string skyline;                        ///< a row of the table "skylines"; empty: none
};
/// {"type":"epoch",...}; `rows` is one epoch with its satellites and paths.
[[nodiscard]] std::string epoch_message(const EpochMessage& message, const EpochRows& rows);

/// {"type":"error",...}: what was wrong with a question, for people.
[[nodiscard]] std::string error_message(std::optional<std::int64_t> id, std::string_view problem);

}  // namespace canyon::output
