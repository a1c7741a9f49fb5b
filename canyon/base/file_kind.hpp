#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

#include "canyon/base/input_error.hpp"

namespace canyon {

/// The kind of a measurement file, detected from its first bytes.
enum class FileKind : std::uint8_t {
  Other,
  RinexObservation,  ///< plain or in Hatanaka's compression
  RinexNavigation,
  GnssLogger,
  Sp3,
  Gpx,
  Kml,
  Rtcm,
  Nmea,
  Foreign,  ///< of a kind that Canyon recognises but does not read
  Columns   ///< text with commas, semicolons, tabs or blanks
};

/// Whether a file is a scenario, judged by its name extension: .yaml or .yml.
[[nodiscard]] bool is_scenario(const std::filesystem::path& path);

/// @param head the first bytes, unpacked: 16 KiB suffice
[[nodiscard]] FileKind kind_of_head(std::string_view head);
/// The kind of a file, plain or packed. Throws InputError as GzipFile does.
[[nodiscard]] FileKind file_kind(const std::filesystem::path& path);

/// "an SP3 file", for messages.
[[nodiscard]] std::string_view name(FileKind kind);
/// The name of a kind as a trajectory format; empty for other kinds and for columns.
[[nodiscard]] std::string_view trajectory_format(FileKind kind);
/// The kind of the files of a trajectory format; columns for any other.
[[nodiscard]] FileKind kind_of_trajectory(std::string_view format);

/// The error for a file that a reader of `wanted` rejected with `fault`. If the file is of another known
/// kind: an error with this kind and its use; else `fault`. Precondition: not FileKind::Other or Foreign.
[[nodiscard]] InputError explained(const InputError& fault, const std::filesystem::path& path,
                                   FileKind wanted);

/// The same for a reader whose files have no FileKind. @param wanted "a city"
[[nodiscard]] InputError explained(const InputError& fault, const std::filesystem::path& path,
                                   std::string_view wanted);
/// The same for the first bytes of a file; empty if their kind is unknown or is columns.
[[nodiscard]] std::optional<InputError> wrong_kind_error(std::string_view head,
                                                         const std::filesystem::path& path,
                                                         std::string_view wanted);

/// Calls `read`, which reads a file of kind `wanted`; its InputError is explained().
template <typename Read>
auto read_as(FileKind wanted, const std::filesystem::path& path, const Read& read) {
  try {
    return read();
  } catch (const InputError& fault) {
    throw explained(fault, path, wanted);
  }
}

}  // namespace canyon
