#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/outputs/output/epoch_rows.hpp"

namespace canyon::output {

/// Messages between the engine and the viewer's page are JSON objects, a line each where they are bytes of a
/// stream; docs/view-format.md and viewer/schema.json define them. This is their version.
inline constexpr int kViewMessages = 1;

struct ReceiverDescription;

/// {"type":"hello",...}: of which receivers, and from when on, epochs follow.
/// Precondition: there is one; begin and interval are the first one's.
[[nodiscard]] std::string hello_message(std::span<const ReceiverDescription> receivers);

/// An epoch on its own, as the page shows it.
struct EpochMessage {
  std::string receiver;                             ///< its name
  std::optional<std::int64_t> id;                   ///< of the question that it answers
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< of the antenna, city's frame [m]; NaN: not known
  double time_s = 0;                                ///< since the begin
  std::vector<std::string> faults;                  ///< at work
  std::vector<gnss::SatelliteId> satellites;        ///< that the rows count
  std::string skyline;                              ///< a row of the table "skylines"; empty: none
};
/// {"type":"epoch",...}; `rows` is one epoch with its satellites and paths.
[[nodiscard]] std::string epoch_message(const EpochMessage& message, const EpochRows& rows);
/// The same of an epoch: its place, faults, satellites and rows; the rest is as `message` says.
/// @param rows of the receiver; what they held is gone
[[nodiscard]] std::string epoch_message(EpochMessage message, const simulation::Epoch& epoch,
                                        const EpochRows::ToLocal& local, EpochRows& rows);

/// {"type":"progress",...}: so many epochs of a run are computed.
[[nodiscard]] std::string progress_message(std::size_t done, std::size_t planned);

/// {"type":"finished",...}: the run has ended, and the folder holds all of it.
[[nodiscard]] std::string finished_message();

/// {"type":"error",...}: what was wrong with a question or, without one, with the run; for people.
[[nodiscard]] std::string error_message(std::optional<std::int64_t> id, std::string_view problem);

}  // namespace canyon::output
