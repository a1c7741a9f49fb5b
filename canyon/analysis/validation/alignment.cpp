#include "canyon/analysis/validation/alignment.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "canyon/analysis/validation/statistics.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/ordered_blocks.hpp"

namespace canyon::validation {
namespace {

constexpr double kCoarse_m = 2;
constexpr double kFine_m = 0.25;
/// Fine offsets on each side of the best coarse one, up to the neighbouring coarse ones.
constexpr int kFineSteps = 8;
/// Scores change in steps, since single observations cross edges. They are smoothed by a normal weight of
/// this deviation before the maximum is searched.
constexpr double kSmooth_m = 0.5;
constexpr double kHeadingStep_rad = 0.0021816615649929116;  // 0.125 deg
constexpr double kSmoothHeading_rad = kHeadingStep_rad;

/// Scores of one move: of the original epochs, then of each resample. NaN: no LOS or no NLOS.
using Scores = std::vector<double>;

struct Move {
  double east_m = 0, north_m = 0, heading_rad = 0;
};

/// The index of the highest score of resample `r`, the first of equal ones; empty if none has one.
std::optional<std::size_t> best_of(const std::vector<Scores>& scores, std::size_t r) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    if (std::isnan(scores[i][r])) continue;
    if (!best || scores[i][r] > scores[*best][r]) best = i;
  }
  return best;
}

/// Mean of the scores around each point of a square or a line, with normal weights by distance in steps.
std::vector<Scores> smoothed(const std::vector<Scores>& scores, int width, int height, double sigma_steps) {
  const int reach = static_cast<int>(std::ceil(2.5 * sigma_steps));
  std::vector<Scores> result(scores.size(), Scores(scores.front().size()));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      Scores& to = result[static_cast<std::size_t>(y * width + x)];
      std::vector<double> total(to.size(), 0);
      for (int v = std::max(0, y - reach); v <= std::min(height - 1, y + reach); ++v) {
        for (int u = std::max(0, x - reach); u <= std::min(width - 1, x + reach); ++u) {
          const double squared = (u - x) * (u - x) + (v - y) * (v - y);
          const double weight = std::exp(-squared / (2 * sigma_steps * sigma_steps));
          const Scores& from = scores[static_cast<std::size_t>(v * width + u)];
          for (std::size_t r = 0; r < to.size(); ++r) {
            if (std::isnan(from[r])) continue;
            to[r] += weight * from[r];
            total[r] += weight;
          }
        }
      }
      for (std::size_t r = 0; r < to.size(); ++r)
        to[r] = total[r] > 0 ? to[r] / total[r] : std::numeric_limits<double>::quiet_NaN();
    }
  }
  return result;
}

double deviation(const std::vector<double>& values) {
  if (values.size() < 2) return 0;
  double mean = 0, squares = 0;
  for (const double v : values) mean += v / static_cast<double>(values.size());
  for (const double v : values) squares += (v - mean) * (v - mean);
  return std::sqrt(squares / static_cast<double>(values.size() - 1));
}

/// The part of a recording's residuals that is used to align a city.
class Aligner {
 public:
  Aligner(const Recording& recording, const simulation::Environment& environment, double elevation_mask_rad,
          std::size_t first, std::size_t count, const AlignOptions& options)
      : recording_(recording), environment_(environment), options_(options), first_(first) {
    const PseudorangeResiduals& all = recording.residuals;
    for (std::size_t e = first; e < first + count; ++e) {
      ResidualEpoch epoch = all.epochs[e];
      const std::size_t at = part_.observations.size();
      for (PseudorangeResidual o : all.of(epoch)) {
        if (o.elevation_rad < elevation_mask_rad) continue;
        o.epoch = part_.epochs.size();
        part_.observations.push_back(o);
      }
      epoch.first = at;
      epoch.count = part_.observations.size() - at;
      if (epoch.count == 0) continue;
      part_.epochs.push_back(epoch);
      epoch_of_.push_back(e);
      pivot_ += recording.antennas[e].enu_m.head<2>();
    }
    if (part_.epochs.empty()) {
      throw InputError("the city cannot be aligned: no epoch has a satellite above the mask",
                       "give a longer part of the recording or a lower elevation mask");
    }
    pivot_ /= static_cast<double>(part_.epochs.size());
    samples_.emplace_back(part_.epochs.size(), std::uint16_t{1});
    for (auto& draw : time_block_bootstrap(part_.epochs, options.block_s, options.resamples, options.seed))
      samples_.push_back(std::move(draw));
    rotation_ = environment.city().frame.ecef_from_local_rotation().transpose();
  }

  CityAlignment align() {
    const int coarse_steps = static_cast<int>(std::ceil(options_.reach_m / kCoarse_m - 1e-9));
    const int coarse_width = 2 * coarse_steps + 1;
    const int fine_width = 2 * kFineSteps + 1;
    const int heading_steps =
        static_cast<int>(std::ceil(options_.heading_reach_rad / kHeadingStep_rad - 1e-9));
    planned_ = static_cast<std::size_t>(coarse_width * coarse_width + fine_width * fine_width +
                                        (options_.heading ? 2 * (2 * heading_steps + 1) + 25 : 0));

    const std::vector<Move> coarse = offsets({}, kCoarse_m, coarse_steps);
    const std::vector<Scores> coarse_scores = try_all(coarse);
    const std::optional<std::size_t> start = best_of(coarse_scores, 0);
    if (!start) {
      throw InputError(
          "the city has no LOS or no NLOS satellites in this part of the recording, at any offset",
          "check that trajectory, heights and city match");
    }
    Move best = coarse[*start];

    // With the drive's middle as the pivot, heading and offset are nearly independent: searched alternately.
    const auto headings = [&](const Move& about) {
      std::vector<Move> moves;
      for (int h = -heading_steps; h <= heading_steps; ++h)
        moves.push_back({about.east_m, about.north_m, h * kHeadingStep_rad});
      return moves;
    };
    const int heading_width = 2 * heading_steps + 1;
    const double heading_sigma = kSmoothHeading_rad / kHeadingStep_rad;
    if (options_.heading) {
      const std::vector<Move> rotated = headings(best);
      best.heading_rad =
          rotated[*best_of(smoothed(try_all(rotated), heading_width, 1, heading_sigma), 0)].heading_rad;
      const std::vector<Move> again = offsets(best, kCoarse_m, 2);
      best = again[*best_of(try_all(again), 0)];
    }

    // The maximum may be outside the fine square, which is moved until its maximum is inside.
    std::vector<Move> fine;
    std::vector<Scores> fine_scores;
    Move middle;
    for (int round = 0; round < 4; ++round) {
      middle = best;
      fine = offsets(middle, kFine_m, kFineSteps);
      fine_scores = smoothed(try_all(fine), fine_width, fine_width, kSmooth_m / kFine_m);
      best = fine[*best_of(fine_scores, 0)];
      const double off =
          std::max(std::abs(best.east_m - middle.east_m), std::abs(best.north_m - middle.north_m));
      if (off < (kFineSteps - 0.5) * kFine_m) break;
    }

    CityAlignment alignment;
    std::vector<double> east, north;
    for (std::size_t r = 1; r < samples_.size(); ++r) {
      const auto near = best_of(fine_scores, r);
      const auto far = best_of(coarse_scores, r);
      if (!near || !far) continue;
      // A resample with its maximum beyond the fine square shows that the square is uncertain.
      const double reach = kCoarse_m + 1e-9;
      const bool beyond = std::abs(coarse[*far].east_m - middle.east_m) > reach ||
                          std::abs(coarse[*far].north_m - middle.north_m) > reach;
      const Move& move = beyond ? coarse[*far] : fine[*near];
      east.push_back(move.east_m);
      north.push_back(move.north_m);
    }
    alignment.sigma_east_m = std::max(deviation(east), kFine_m / std::sqrt(12.0));
    alignment.sigma_north_m = std::max(deviation(north), kFine_m / std::sqrt(12.0));

    if (options_.heading) {
      const std::vector<Move> rotated = headings(best);
      const std::vector<Scores> rotated_scores = smoothed(try_all(rotated), heading_width, 1, heading_sigma);
      best.heading_rad = rotated[*best_of(rotated_scores, 0)].heading_rad;
      std::vector<double> found;
      for (std::size_t r = 1; r < samples_.size(); ++r)
        if (const auto at = best_of(rotated_scores, r)) found.push_back(rotated[*at].heading_rad);
      alignment.sigma_heading_rad = std::max(deviation(found), kHeadingStep_rad / std::sqrt(12.0));
    }

    alignment.registration = registration(best);
    alignment.score = scores(best).front();
    alignment.score_before = scores({}).front();
    alignment.first = first_;
    const double edge = coarse_steps * kCoarse_m - kFine_m / 2;
    alignment.at_border =
        std::abs(best.east_m) >= edge || std::abs(best.north_m) >= edge ||
        (options_.heading && std::abs(best.heading_rad) >= (heading_steps - 0.5) * kHeadingStep_rad);
    return alignment;
  }

 private:
  [[nodiscard]] Registration registration(const Move& move) const {
    Registration r;
    r.east_m = move.east_m;
    r.north_m = move.north_m;
    r.heading_rad = move.heading_rad;
    r.pivot = pivot_;
    return r;
  }

  /// Thread-safe.
  [[nodiscard]] Scores scores(const Move& move) const {
    const Registration moved = registration(move);
    const raytrace::RayScene& scene = environment_.scene();
    std::vector<std::uint8_t> clear(part_.observations.size());
    std::vector<raytrace::Ray> rays;
    std::array<bool, 128> blocked{};
    for (std::size_t e = 0; e < part_.epochs.size(); ++e) {
      const ResidualEpoch& epoch = part_.epochs[e];
      const Eigen::Vector3d antenna = recording_.point_in_map(scene, moved, epoch_of_[e]);
      // An epoch has each satellite once, so normally fewer than `blocked` holds; else it is done in pieces.
      for (std::size_t from = 0; from < epoch.count; from += blocked.size()) {
        const std::size_t n = std::min(blocked.size(), epoch.count - from);
        rays.clear();
        for (std::size_t i = 0; i < n; ++i) {
          const PseudorangeResidual& o = part_.observations[epoch.first + from + i];
          rays.push_back({antenna, moved.direction_in_city(rotation_ * o.direction_ecef).normalized()});
        }
        scene.occluded(rays, std::span<bool>(blocked.data(), n), scene.surface_offset_m(antenna));
        for (std::size_t i = 0; i < n; ++i) clear[epoch.first + from + i] = blocked[i] ? 0 : 1;
      }
    }
    std::size_t next = 0;
    const PseudorangeErrors errors = remove_receiver_clock(
        part_, [&](const PseudorangeResidual&, const ResidualEpoch&) { return clear[next++] != 0; });

    std::vector<RankedSample::Item> by_error, by_weakness;
    for (std::size_t i = 0; i < part_.observations.size(); ++i) {
      const PseudorangeResidual& o = part_.observations[i];
      const PseudorangeError& error = errors.observations[i];
      if (error.gross || errors.clocks[o.epoch].source == ClockSource::None) continue;
      const auto epoch = static_cast<std::uint32_t>(o.epoch);
      by_error.push_back({error.error_m, !error.clear, epoch});
      if (o.cn0_dbhz) by_weakness.push_back({-*o.cn0_dbhz, !error.clear, epoch});
    }
    const RankedSample late(std::move(by_error)), weak(std::move(by_weakness));
    Scores scores;
    for (const auto& times : samples_) {
      const std::optional<double> a = late.auc(times);
      const std::optional<double> b = weak.auc(times);
      scores.push_back(a && b ? (*a + *b) / 2 : a.value_or(std::numeric_limits<double>::quiet_NaN()));
    }
    return scores;
  }

  [[nodiscard]] std::vector<Scores> try_all(const std::vector<Move>& moves) {
    std::vector<Scores> result(moves.size());
    simulation::for_each_in_order<Scores>(
        moves.size(), 16, options_.threads, [] { return true; },
        [&](std::size_t i) { return scores(moves[i]); },
        [&](std::size_t i, Scores& made) {
          result[i] = std::move(made);
          ++done_;
          if (options_.progress) options_.progress(done_, std::max(done_, planned_));
        });
    return result;
  }

  /// A square of (2 steps + 1)^2, row by row from the south-west.
  [[nodiscard]] std::vector<Move> offsets(const Move& about, double step_m, int steps) const {
    std::vector<Move> moves;
    for (int n = -steps; n <= steps; ++n)
      for (int e = -steps; e <= steps; ++e)
        moves.push_back({about.east_m + e * step_m, about.north_m + n * step_m, about.heading_rad});
    return moves;
  }

  const Recording& recording_;
  const simulation::Environment& environment_;
  const AlignOptions& options_;
  std::size_t first_;
  PseudorangeResiduals part_;
  std::vector<std::size_t> epoch_of_;  ///< recording's epoch by part_'s
  Eigen::Vector2d pivot_ = Eigen::Vector2d::Zero();
  std::vector<std::vector<std::uint16_t>> samples_;  ///< the first: every epoch once
  Eigen::Matrix3d rotation_;                         ///< local from ECEF
  std::size_t done_ = 0, planned_ = 0;
};

}  // namespace

void AlignOptions::validate() const {
  options::check(*this, "alignment");
}

void visit(options::Visitor& v, AlignOptions& o) {
  v.number({"reach_m", "m", "largest offset east and north to try"}, o.reach_m, {4, 200});
  v.boolean({"heading", "", "estimate the city's heading as well"}, o.heading);
  v.angle({"heading_reach_deg", "deg", "largest rotation to try"}, o.heading_reach_rad, {0.125, 45});
  v.integer({"resamples", "", "of the bootstrap for the uncertainty"}, o.resamples, 20, 10'000);
  v.number({"block_s", "s", "of time, resampled together"}, o.block_s, {1, 600});
  v.integer({"seed", "", "of the bootstrap"}, o.seed);
}

CityAlignment align(const Recording& recording, const simulation::Environment& environment,
                    double elevation_mask_rad, std::size_t first, std::size_t count,
                    const AlignOptions& options) {
  options.validate();
  assert(first + count <= recording.residuals.epochs.size());
  CityAlignment alignment =
      Aligner(recording, environment, elevation_mask_rad, first, count, options).align();
  alignment.count = count;
  return alignment;
}

std::string to_json(const CityAlignment& a) {
  const Json json{{"east_m", a.registration.east_m},
                  {"north_m", a.registration.north_m},
                  {"heading_deg", geodesy::degrees(a.registration.heading_rad)},
                  {"pivot_east_m", a.registration.pivot.x()},
                  {"pivot_north_m", a.registration.pivot.y()},
                  {"sigma_east_m", a.sigma_east_m},
                  {"sigma_north_m", a.sigma_north_m},
                  {"sigma_heading_deg", geodesy::degrees(a.sigma_heading_rad)},
                  {"score", a.score},
                  {"score_before", a.score_before},
                  {"first_epoch", a.first},
                  {"epochs", a.count},
                  {"at_border", a.at_border}};
  return json.dump(2) + "\n";
}

}  // namespace canyon::validation
