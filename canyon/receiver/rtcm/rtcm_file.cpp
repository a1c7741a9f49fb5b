#include "canyon/receiver/rtcm/rtcm_file.hpp"

#include <array>
#include <string>
#include <utility>

#include "canyon/base/gzip_file.hpp"

namespace canyon::rtcm {

using geodesy::GpsTime;

RtcmCorrections decode_rtcm_file(const std::filesystem::path& path, GpsTime now,
                                 CorrectionsDecoder::ChannelTable glonass_channel, bool needs_position,
                                 RangeTable ranges) {
  GzipFile file(path);
  CorrectionsDecoder decoder(std::move(glonass_channel), needs_position, std::move(ranges));
  RtcmCorrections read;
  std::uint64_t out_of_order = 0;
  const auto take = [&](const CorrectionsDecoder::Epochs& epochs) {
    for (const auto& epoch : epochs) {
      // A repeated epoch has more observations.
      const bool again = !read.epochs.empty() && read.epochs.back()->receiver_time == epoch->receiver_time;
      if (again) read.epochs.pop_back();
      if (!read.epochs.empty() && epoch->receiver_time < read.epochs.back()->receiver_time) {
        ++out_of_order;
        continue;
      }
      read.epochs.push_back(epoch);
    }
  };
  std::array<char, 4096> block{};
  while (const std::size_t n = file.read(block.data(), block.size(), 0))
    take(decoder.feed({block.data(), n}, decoder.status().last_epoch.value_or(now)));
  take(decoder.finish());
  read.status = decoder.status();
  if (out_of_order > 0)
    read.status.problems["the time of an epoch is not after the previous one"] = out_of_order;
  if (read.status.bytes_held > 0) ++read.status.problems["the file ends within a frame"];
  return read;
}

void require_epochs(const std::filesystem::path& path, const RtcmCorrections& read) {
  if (!read.epochs.empty()) return;
  if (read.status.messages.empty())
    throw InputError(path, 0, "has no message of RTCM 3", "give a recorded stream of RTCM 3");
  if (read.status.epochs_held_back > 0)
    throw InputError(path, 0, "has no position of the station",
                     "have the base send message 1005 or 1006, or give its position (--base-position)");
  if (!read.status.without_milliseconds.empty()) {
    throw InputError(
        path, 0,
        "its observations omit the whole milliseconds of ranges (MSM1, MSM3, 1001, 1003, 1009, 1011), which "
        "were not found",
        "give the ephemerides of that day and the right position of the base, or have the base send "
        "MSM4 to MSM7");
  }
  if (read.status.checksum_errors > 0) {
    throw InputError(path, 0,
                     "has no observations of a base, but " + std::to_string(read.status.checksum_errors) +
                         " frames with a wrong checksum",
                     "record the raw bytes: it is damaged, or was saved as text or with HTTP chunk headers");
  }
  const auto& problems = read.status.problems;
  throw InputError(
      path, 0,
      "has no observations of a base" +
          (problems.empty() ? std::string() : " (" + problems.begin()->first + ")"),
      "have the base send MSM4 to MSM7 (1074 to 1127), 1002, 1004, 1010 or 1012, and record again");
}

RtcmCorrections read_rtcm_corrections(const std::filesystem::path& path, GpsTime now,
                                      CorrectionsDecoder::ChannelTable glonass_channel, bool needs_position,
                                      RangeTable ranges) {
  RtcmCorrections file =
      decode_rtcm_file(path, now, std::move(glonass_channel), needs_position, std::move(ranges));
  require_epochs(path, file);
  return file;
}

}  // namespace canyon::rtcm
