#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/outputs/encoding/epoch_rows.hpp"

namespace canyon::encoding {

/// Messages between the engine and the viewer's page are JSON objects, one per line in a byte stream;
/// docs/view-format.md and viewer/schema.json define them. This is their version.
inline constexpr int kViewMessages = 1;

struct ReceiverDescription;

/// {"type":"hello",...}: the receivers and the beginning of the epochs that follow.
/// Precondition: there is at least one; beginning and interval are the first one's.
[[nodiscard]] std::string hello_message(std::span<const ReceiverDescription> receivers);

/// A single epoch for the page.
struct EpochMessage {
  std::string receiver;                                ///< its name
  std::optional<std::int64_t> id;                      ///< ID of the request that it responds to
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of the antenna, city's frame [m]; NaN: not known
  double time_s = 0;                                   ///< since the begin
  std::vector<std::string> faults;                     ///< active
  std::vector<gnss::SatelliteId> satellites;           ///< referred to by index in the rows
  std::string skyline;                                 ///< a row of the table "skylines"; empty: none
};
/// {"type":"epoch",...}; `rows` is one epoch with its satellites and paths.
[[nodiscard]] std::string epoch_message(const EpochMessage& message, const EpochRows& rows);
/// The message of an epoch, with its position, faults, satellites and rows; others are from `message`.
/// @param rows of the receiver; overwritten
[[nodiscard]] std::string epoch_message(EpochMessage message, const simulation::Epoch& epoch,
                                        const EpochRows::ToLocal& local, EpochRows& rows);

/// {"type":"progress",...}: number of computed epochs of a run.
[[nodiscard]] std::string progress_message(std::size_t done, std::size_t planned);

/// {"type":"finished",...}: the run has ended, and the folder has all of its data.
[[nodiscard]] std::string finished_message();

/// {"type":"error",...}: the error in a request or, without a request, of the run; readable text.
[[nodiscard]] std::string error_message(std::optional<std::int64_t> id, std::string_view problem);

}  // namespace canyon::encoding
