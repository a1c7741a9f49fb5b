#pragma once

#include <filesystem>

#include "canyon/receiver/rtcm/rtcm_decoder.hpp"

namespace canyon::rtcm {

/// A whole file.
struct RtcmCorrections {
  CorrectionsDecoder::Epochs epochs;
  DecoderStatus status;
};
/// A stream that was recorded, plain or gzip-compressed; each epoch once, without those whose times
/// do not follow the one before. Throws InputError where the file cannot be read.
/// @param now a time within half a week of the first messages
[[nodiscard]] RtcmCorrections decode_rtcm_file(const std::filesystem::path& path, geodesy::GpsTime now,
                                               CorrectionsDecoder::ChannelTable glonass_channel = {},
                                               bool needs_place = true, RangeTable ranges = {});
/// Throws InputError, which says what is missing, where no epoch was in a file.
void require_epochs(const std::filesystem::path& path, const RtcmCorrections& file);
/// decode_rtcm_file() of a file with epochs; throws InputError where it has none.
[[nodiscard]] RtcmCorrections read_rtcm_corrections(const std::filesystem::path& path, geodesy::GpsTime now,
                                                    CorrectionsDecoder::ChannelTable glonass_channel = {},
                                                    bool needs_place = true, RangeTable ranges = {});

}  // namespace canyon::rtcm
