#include "canyon/outputs/view/recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/outputs/drawing/views/sky_mask.hpp"

namespace canyon::view {

void Recorder::end_epoch(const std::vector<std::string>& faults, double time_s) {
  // A fault continues if it was active at the previous epoch; else a new interval begins.
  for (const std::string& name : faults) {
    const auto open =
        std::find_if(faults_.rbegin(), faults_.rend(), [&](const FaultStretch& f) { return f.name == name; });
    if (open != faults_.rend() && last_time_s_ && open->until_s == *last_time_s_)
      open->until_s = time_s;
    else
      faults_.push_back({name, time_s, time_s});
  }
  last_time_s_ = time_s;
  ++epochs_;
  if (epochs_ - block_begin_ >= epochs_per_block_) finish_block();
}

void Recorder::finish(ViewHeader& header) {
  finish_block();
  put({&rows_.epochs, &skylines_}, {fmt::format("track-{}.bin.gz", receiver_), receiver_, true, 0, epochs_});
  header.receivers.at(receiver_).faults = std::move(faults_);
  header.chunks.insert(header.chunks.end(), chunks_.begin(), chunks_.end());
}

void Recorder::finish_block() {
  if (epochs_ == block_begin_) return;
  put({&rows_.satellites, &rows_.paths, &rows_.bodies},
      {fmt::format("block-{}-{:05}.bin.gz", receiver_, block_begin_), receiver_, false, block_begin_,
       epochs_ - block_begin_, 0, rows_.satellites.size(), rows_.paths.size()});
  for (encoding::ViewRows* rows : {&rows_.satellites, &rows_.paths, &rows_.bodies}) rows->clear();
  block_begin_ = epochs_;
}

void Recorder::put(const std::vector<const encoding::ViewRows*>& tables, ChunkEntry entry) {
  entry.bytes = encoding::write_chunk(folder_, entry.file, tables);
  chunks_.push_back(std::move(entry));
}

std::string skyline_bytes(const raytrace::RayScene& scene, const Eigen::Vector3d& antenna_enu) {
  const drawing::SkyMask mask = drawing::make_sky_mask(scene, antenna_enu, encoding::kSkylineSectors);
  std::string bytes;
  for (const auto& stretches : mask.azimuths) {
    const double high_rad = stretches.empty() ? 0 : stretches.back().high_rad;
    bytes += static_cast<char>(std::lround(2 * geodesy::degrees(high_rad)));
  }
  return bytes;
}

bool MovingSkyline::move(const raytrace::RayScene& scene, const Eigen::Vector3d& antenna_enu) {
  if (!bytes_.empty() && (antenna_enu - position_).norm() < step_m_) return false;
  position_ = antenna_enu;
  bytes_ = skyline_bytes(scene, antenna_enu);
  return true;
}

}  // namespace canyon::view
