#pragma once

#include <filesystem>

#include "canyon/receiver/rtcm/rtcm_decoder.hpp"

namespace canyon::rtcm {

struct RtcmCorrections {
  CorrectionsDecoder::Epochs epochs;
  DecoderStatus status;
};
/// A recorded stream, plain or gzip-compressed; each epoch once, without those that are not later than the
/// previous one. Throws InputError if the file cannot be read.
/// @param now a time within half a week of the first messages
[[nodiscard]] RtcmCorrections decode_rtcm_file(const std::filesystem::path& path, geodesy::GpsTime now,
                                               CorrectionsDecoder::ChannelTable glonass_channel = {},
                                               bool needs_position = true, RangeTable ranges = {});
/// Throws InputError with the missing parts if a file has no epoch.
void require_epochs(const std::filesystem::path& path, const RtcmCorrections& file);
/// decode_rtcm_file() of a file with epochs; throws InputError if it has none.
[[nodiscard]] RtcmCorrections read_rtcm_corrections(const std::filesystem::path& path, geodesy::GpsTime now,
                                                    CorrectionsDecoder::ChannelTable glonass_channel = {},
                                                    bool needs_position = true, RangeTable ranges = {});

}  // namespace canyon::rtcm
