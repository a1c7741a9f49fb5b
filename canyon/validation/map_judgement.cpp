#include "canyon/validation/map_judgement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/validation/epoch_interval.hpp"
#include "canyon/validation/ranked_sample.hpp"

namespace canyon::validation {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr int kResamples = 1000;
constexpr double kBlock_s = 60;

std::optional<std::size_t> place_of(const std::vector<heatmap::Layer>& layers, heatmap::Layer layer) {
  const auto found = std::find(layers.begin(), layers.end(), layer);
  if (found == layers.end()) return std::nullopt;
  return static_cast<std::size_t>(found - layers.begin());
}

std::size_t needed(const std::vector<heatmap::Layer>& layers, heatmap::Layer layer) {
  if (const auto at = place_of(layers, layer)) return *at;
  const auto name = heatmap::info(layer).name;
  throw InputError(fmt::format("the map has no layer {}", name),
                   "compute it with --layers horizontal_error_p50,horizontal_error_p95,availability");
}

bool is_comparable(const MapEpoch& epoch) {
  return epoch.known && epoch.solved && std::isfinite(epoch.p50_m) && std::isfinite(epoch.p95_m);
}

/// Number of times that each epoch is drawn, by resample.
using Draws = std::vector<std::vector<std::uint16_t>>;

Draws draw(const std::vector<MapEpoch>& epochs) {
  return draws_in_time(epochs, kBlock_s, kResamples, 1);
}

/// The share of a stratum's epochs that `is` true of, over all resamples.
template <typename Is>
JudgedValue share_where(const std::vector<MapEpoch>& epochs, const std::vector<std::size_t>& stratum,
                        const Draws& draws, const Is& is) {
  const auto share = [&](const auto& times_drawn) {
    double all = 0, such = 0;
    for (const std::size_t i : stratum) {
      const double times = times_drawn(i);
      all += times;
      if (is(epochs[i])) such += times;
    }
    return all > 0 ? such / all : kNan;
  };
  JudgedValue result{share([](std::size_t) { return 1.0; }), kNan, kNan};
  std::vector<double> shares;
  for (const std::vector<std::uint16_t>& drawn : draws) {
    const double one = share([&drawn](std::size_t i) { return static_cast<double>(drawn[i]); });
    if (!std::isnan(one)) shares.push_back(one);
  }
  if (shares.size() < 2) return result;
  result.low = *quantile(shares, 0.025);
  result.high = *quantile(shares, 0.975);
  return result;
}

MapStratum stratum(const std::string& name, const std::vector<MapEpoch>& epochs,
                   const std::vector<std::size_t>& in, const Draws& draws) {
  MapStratum result;
  result.name = name;
  std::vector<double> errors, p50s, p95s;
  for (const std::size_t i : in) {
    errors.push_back(epochs[i].error_m);
    p50s.push_back(epochs[i].p50_m);
    p95s.push_back(epochs[i].p95_m);
  }
  result.epochs = errors.size();
  result.within_p50 = share_where(epochs, in, draws, [](const MapEpoch& e) { return e.error_m <= e.p50_m; });
  result.within_p95 = share_where(epochs, in, draws, [](const MapEpoch& e) { return e.error_m <= e.p95_m; });
  result.recorded_p50_m = quantile(errors, 0.5).value_or(kNan);
  result.recorded_p95_m = quantile(errors, 0.95).value_or(kNan);
  result.map_p50_m = median(p50s).value_or(kNan);
  result.map_p95_m = median(p95s).value_or(kNan);
  return result;
}

}  // namespace

std::vector<MapEpoch> map_epochs(const Comparison& comparison, std::size_t first, std::size_t count,
                                 const geodesy::LocalFrame& city, const heatmap::MapLookup& map,
                                 const geodesy::LocalFrame& frame, const std::vector<heatmap::Layer>& layers,
                                 std::optional<double> altitude_m) {
  const std::size_t p50 = needed(layers, heatmap::Layer::HorizontalErrorP50);
  const std::size_t p95 = needed(layers, heatmap::Layer::HorizontalErrorP95);
  const auto availability = place_of(layers, heatmap::Layer::Availability);
  std::vector<MapEpoch> epochs;
  for (std::size_t i = first; i < first + count; ++i) {
    const ComparedEpoch& compared = comparison.epochs.at(i);
    MapEpoch epoch;
    epoch.time = compared.time;
    if (i > first) {
      epoch.way_m = epochs.back().way_m +
                    (compared.place_enu_m - comparison.epochs[i - 1].place_enu_m).head<2>().norm();
    }
    epoch.solved = compared.measured.solved;
    epoch.error_m = epoch.solved ? compared.measured.error_enu_m.head<2>().norm() : kNan;
    epoch.p50_m = epoch.p95_m = epoch.availability = kNan;
    const geodesy::Geodetic place = city.geodetic_from_local(compared.place_enu_m);
    const Eigen::Vector3d enu = frame.local_from_geodetic(place);
    const auto answer = map(enu.head<2>(), altitude_m.value_or(place.height_m), compared.time);
    epoch.known = answer && answer->state == heatmap::CellState::Computed;
    if (epoch.known) {
      epoch.p50_m = static_cast<double>(answer->values[p50]);
      epoch.p95_m = static_cast<double>(answer->values[p95]);
      if (availability) epoch.availability = static_cast<double>(answer->values[*availability]);
    }
    epochs.push_back(epoch);
  }
  return epochs;
}

MapJudgement judge_map(const std::vector<MapEpoch>& epochs) {
  MapJudgement result;
  result.epochs = epochs.size();
  std::vector<std::size_t> compared;
  std::vector<double> errors, p95s;
  double solved = 0, available = 0;
  for (std::size_t i = 0; i < epochs.size(); ++i) {
    const MapEpoch& epoch = epochs[i];
    if (!epoch.known) continue;
    ++result.known;
    solved += epoch.solved ? 1 : 0;
    available += epoch.availability;
    if (!is_comparable(epoch)) continue;
    compared.push_back(i);
    errors.push_back(epoch.error_m);
    p95s.push_back(epoch.p95_m);
  }
  result.judged = compared.size();
  const auto known = static_cast<double>(result.known);
  result.recorded_availability = result.known > 0 ? solved / known : kNan;
  result.map_availability = result.known > 0 ? available / known : kNan;
  if (compared.empty()) return result;
  result.correlation = spearman(p95s, errors);
  const Draws draws = draw(epochs);
  result.strata.push_back(stratum("all", epochs, compared, draws));
  const double low = *quantile(p95s, 1.0 / 3), high = *quantile(p95s, 2.0 / 3);
  constexpr std::array kNames{"map's best third", "map's middle third", "map's worst third"};
  for (std::size_t third = 0; third < 3; ++third) {
    std::vector<std::size_t> in;
    for (const std::size_t i : compared) {
      const std::size_t of = epochs[i].p95_m <= low ? 0 : epochs[i].p95_m <= high ? 1 : 2;
      if (of == third) in.push_back(i);
    }
    result.strata.push_back(stratum(kNames.at(third), epochs, in, draws));
  }
  return result;
}

std::string to_text(const MapJudgement& judgement) {
  std::string text =
      fmt::format("{} recorded epochs, {} of them in computed cells, {} with a fix and the map's errors\n",
                  judgement.epochs, judgement.known, judgement.judged);
  text += fmt::format("a fix: recorded {:.1f} %, map {}\n", 100 * judgement.recorded_availability,
                      std::isnan(judgement.map_availability)
                          ? "-"
                          : fmt::format("{:.1f} %", 100 * judgement.map_availability));
  if (judgement.strata.empty()) return text;
  const auto share = [](const JudgedValue& v) {
    const std::string value = fmt::format("{:.1f}", 100 * v.value);
    return std::isnan(v.low) ? value : fmt::format("{} ({:.1f}..{:.1f})", value, 100 * v.low, 100 * v.high);
  };
  text += fmt::format("\n{:<20} {:>7}  {:>20}  {:>20}  {:>9} {:>9}  {:>9} {:>9}\n", "", "epochs",
                      "within 50 % [%]", "within 95 % [%]", "rec. 50 %", "map", "rec. 95 %", "map");
  for (const MapStratum& s : judgement.strata) {
    text += fmt::format("{:<20} {:>7}  {:>20}  {:>20}  {:>9.2f} {:>9.2f}  {:>9.2f} {:>9.2f}\n", s.name,
                        s.epochs, share(s.within_p50), share(s.within_p95), s.recorded_p50_m, s.map_p50_m,
                        s.recorded_p95_m, s.map_p95_m);
  }
  text += "errors in metres; in brackets 95 % intervals, blocks of a minute\n";
  if (judgement.correlation) {
    text += fmt::format("rank correlation of the map's 95 % and the recorded errors {:.2f}\n",
                        judgement.correlation->rho);
  }
  return text;
}

std::string to_csv(const std::vector<MapEpoch>& epochs) {
  std::string text = "time_utc,way_m,known,fix,error_m,map_p50_m,map_p95_m,map_availability\n";
  const auto number = [](double v) { return std::isnan(v) ? std::string() : fmt::format("{:.4g}", v); };
  for (const MapEpoch& e : epochs) {
    text +=
        fmt::format("{},{:.1f},{:d},{:d},{},{},{},{}\n", geodesy::format_utc(e.time), e.way_m, e.known,
                    e.solved, number(e.error_m), number(e.p50_m), number(e.p95_m), number(e.availability));
  }
  return text;
}

}  // namespace canyon::validation
