// Figures as JSON, for terminals and for documents.
#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "canyon/base/json.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/validation/alignment.hpp"
#include "canyon/validation/figures.hpp"
#include "canyon/validation/recording_table.hpp"

namespace canyon::validation {
namespace {

Json quantiles_json(const std::array<double, 5>& values, bool any) {
  Json json = Json::object();
  constexpr std::array<const char*, 5> kNames{"p5", "p25", "p50", "p75", "p95"};
  for (std::size_t i = 0; i < values.size(); ++i) json[kNames[i]] = any ? Json(values[i]) : Json();
  return json;
}

Json json_of(const std::optional<Separation>& s, const char* threshold_name, double sign,
             const std::optional<Interval>& interval) {
  if (!s) return {};
  Json json{{"auc", s->auc}};
  if (interval) json["auc_interval_95"] = {interval->low, interval->high};
  json["balanced_accuracy"] = s->balanced_accuracy;
  json[threshold_name] = sign * s->threshold;
  return json;
}

Json json_of(const DistributionPair& pair) {
  return {{"measured_n", pair.measured_n},
          {"simulated_n", pair.simulated_n},
          {"measured", quantiles_json(pair.measured, pair.measured_n > 0)},
          {"simulated", quantiles_json(pair.simulated, pair.simulated_n > 0)},
          {"ks", pair.ks}};
}

Json json_of(const TrackedShare& share) {
  const bool any = share.satellites > 0;
  return {{"satellites", share.satellites},
          {"measured", share.measured},
          {"simulated", share.simulated},
          {"measured_ratio", any ? Json(share.measured_ratio()) : Json()},
          {"simulated_ratio", any ? Json(share.simulated_ratio()) : Json()}};
}

Json json_of(const Explained& e) {
  Json json{{"kind", e.kind}, {"n", e.n}, {"share", e.share}};
  json["median_difference_m"] = e.median_difference_m;
  if (e.correlation) {
    json["spearman"] = {{"rho", e.correlation->rho},
                        {"low_95", e.correlation->low},
                        {"high_95", e.correlation->high},
                        {"n", e.correlation->n}};
  } else {
    json["spearman"] = nullptr;
  }
  return json;
}

Json json_of(const PositionFigures& p) {
  const bool any = p.fixes > 0;
  return {{"epochs", p.epochs},
          {"fixes", p.fixes},
          {"availability",
           p.epochs > 0 ? Json(static_cast<double>(p.fixes) / static_cast<double>(p.epochs)) : Json()},
          {"mean_satellites_used", any ? Json(p.mean_used) : Json()},
          {"horizontal_error_m", quantiles_json(p.horizontal_m, any)},
          {"vertical_error_m", quantiles_json(p.vertical_m, any)}};
}

Json json_of(const PhaseFigures& p) {
  const auto view = [](const PhaseView& v) {
    return Json{{"observations", v.observations},
                {"with_phase", v.with_phase},
                {"share", v.share()},
                {"noise_n", v.noise_n},
                {"noise_m", v.noise_m}};
  };
  return {{"los", view(p.los)},
          {"nlos", view(p.nlos)},
          {"time_s", p.time_s},
          {"slips", p.slips},
          {"time_between_slips_s", p.time_between_slips_s()}};
}

Json json_of(const SignalFigures& f) {
  Json json{{"system", std::string(gnss::name(f.signal->system))},
            {"signal", std::string(f.signal->name)},
            {"recorded", f.recorded},
            {"tracked_by_the_simulated", f.tracked}};
  if (!f.judged()) return json;
  json["tracked"] = {{"los", json_of(f.tracked_los)}, {"nlos", json_of(f.tracked_nlos)}};
  json["distributions"] = {{"los_error_m", json_of(f.error_los_m)},
                           {"nlos_error_m", json_of(f.error_nlos_m)},
                           {"los_cn0_dbhz", json_of(f.cn0_los_dbhz)},
                           {"nlos_cn0_dbhz", json_of(f.cn0_nlos_dbhz)}};
  json["carrier_phase"] = {{"measured", json_of(f.measured_phase)},
                           {"simulated", json_of(f.simulated_phase)}};
  return json;
}

Json json_of(const Figures& f) {
  Json json{{"model", f.model}, {"part", f.part}, {"epochs", f.epochs},
            {"runs", f.runs},   {"los", f.los},   {"nlos", f.nlos}};
  json["separation_by_cn0"] = json_of(f.by_cn0, "threshold_dbhz", -1, f.by_cn0_interval);
  json["separation_by_error"] = json_of(f.by_error, "threshold_m", 1, f.by_error_interval);
  json["elevation_bands"] = Json::array();
  for (const Band& band : f.bands) {
    json["elevation_bands"].push_back({{"low_deg", band.low_deg},
                                       {"high_deg", band.high_deg},
                                       {"los", band.los},
                                       {"nlos", band.nlos},
                                       {"by_cn0", json_of(band.by_cn0, "threshold_dbhz", -1, {})},
                                       {"by_error", json_of(band.by_error, "threshold_m", 1, {})}});
  }
  json["tracked"] = {{"los", json_of(f.tracked_los)}, {"nlos", json_of(f.tracked_nlos)}};
  json["explained"] = Json::array();
  for (const Explained& e : f.explained) json["explained"].push_back(json_of(e));
  json["distributions"] = {{"los_error_m", json_of(f.error_los_m)},
                           {"nlos_error_m", json_of(f.error_nlos_m)},
                           {"los_cn0_dbhz", json_of(f.cn0_los_dbhz)},
                           {"nlos_cn0_dbhz", json_of(f.cn0_nlos_dbhz)},
                           {"satellites_used", json_of(f.used)}};
  json["position"] = {{"measured", json_of(f.measured)}, {"simulated", json_of(f.simulated)}};
  if (f.own_fixes) {
    json["own_fixes"] = {{"own", json_of(f.own_fixes->own)},
                         {"measured_by_filter", json_of(f.own_fixes->measured)},
                         {"simulated_by_filter", json_of(f.own_fixes->simulated)}};
  }
  json["never_tracked"] = Json::array();
  for (const NeverTracked& s : f.never_tracked) {
    json["never_tracked"].push_back(
        {{"satellite", gnss::to_string(s.id)}, {"clear_s", s.clear_s}, {"left_out", f.left_out}});
  }
  json["signals"] = Json::array();
  for (const SignalFigures& s : f.signals) json["signals"].push_back(json_of(s));
  json["segments"] = Json::array();
  for (const SegmentFigures& s : f.segments) {
    json["segments"].push_back({{"first_epoch", s.segment.first},
                                {"epochs", s.segment.count},
                                {"length_m", s.segment.length_m},
                                {"heading_deg", s.segment.heading_deg},
                                {"measured", json_of(s.measured)},
                                {"simulated", json_of(s.simulated)}});
  }
  return json;
}

/// "-" where there is nothing.
std::string shown(const std::optional<double>& value, int decimals) {
  return value && std::isfinite(*value) ? fmt::format("{:.{}f}", *value, decimals) : "-";
}

std::string interval_text(const std::optional<Interval>& interval) {
  return interval ? fmt::format(" [{:.3f}, {:.3f}]", interval->low, interval->high) : "";
}

std::string separation_line(const char* what, const std::optional<Separation>& s,
                            const std::optional<Interval>& interval, double sign, const char* rule,
                            const char* unit) {
  if (!s) return fmt::format("  {:<22}-\n", what);
  return fmt::format(
      "  {:<22}AUC {:.3f}{}, balanced accuracy {:.3f}{}\n", what, s->auc, interval_text(interval),
      s->balanced_accuracy,
      std::isfinite(s->threshold) ? fmt::format(" {} {:.1f} {}", rule, sign * s->threshold, unit) : "");
}

std::string distribution_line(const char* what, const DistributionPair& pair) {
  const auto five = [](const std::array<double, 5>& values, std::size_t n) {
    std::string text = fmt::format("{:>6}", n);
    for (const double v : values) text += n > 0 ? fmt::format(" {:>7.1f}", v) : fmt::format(" {:>7}", "-");
    return text;
  };
  return fmt::format("  {:<22}{:<10}{}\n  {:<22}{:<10}{}   KS {}\n", what, "measured",
                     five(pair.measured, pair.measured_n), "", "simulated",
                     five(pair.simulated, pair.simulated_n), shown(pair.ks, 3));
}

std::string position_line(const char* what, const PositionFigures& p) {
  const double share =
      p.epochs > 0 ? 100.0 * static_cast<double>(p.fixes) / static_cast<double>(p.epochs) : 0;
  if (p.fixes == 0) return fmt::format("  {:<22}no fix in {} epochs\n", what, p.epochs);
  return fmt::format(
      "  {:<22}{:.1f} % of {} epochs, {}horizontal p50 {:.1f} p95 {:.1f} m, vertical p50 "
      "{:.1f} p95 {:.1f} m\n",
      what, share, p.epochs,
      std::isfinite(p.mean_used) ? fmt::format("{:.1f} satellites; ", p.mean_used) : "", p.horizontal_m[2],
      p.horizontal_m[4], p.vertical_m[2], p.vertical_m[4]);
}

std::string tracked_line(const char* what, const TrackedShare& share) {
  return fmt::format("  {:<22}{:.3f} and {:.3f} of {}\n", what, share.measured_ratio(),
                     share.simulated_ratio(), share.satellites);
}

std::string distributions_head(const std::string& what) {
  return fmt::format("\n{:<34}{:>6} {:>7} {:>7} {:>7} {:>7} {:>7}\n", what, "n", "p5", "p25", "p50", "p75",
                     "p95");
}

/// Of signals beyond the first, which the other figures are of.
std::string further_signals(const Figures& f) {
  std::string text, one_sided;
  for (const SignalFigures& s : f.signals) {
    if (!s.judged()) {
      one_sided += fmt::format("  {:<22}{}\n", s.name(),
                               s.recorded ? "recorded, not tracked by the simulated receiver"
                                          : "tracked by the simulated receiver, not recorded");
    } else if (!s.first()) {
      text += distributions_head(s.name());
      text += distribution_line("LOS error [m]", s.error_los_m);
      text += distribution_line("NLOS error [m]", s.error_nlos_m);
      text += distribution_line("LOS C/N0 [dB-Hz]", s.cn0_los_dbhz);
      text += distribution_line("NLOS C/N0 [dB-Hz]", s.cn0_nlos_dbhz);
      text += tracked_line("tracked LOS", s.tracked_los);
      text += tracked_line("tracked NLOS", s.tracked_nlos);
    }
  }
  return text + (one_sided.empty() ? "" : "\nSignals not judged\n" + one_sided);
}

std::string phase_lines(const Figures& f) {
  std::string text;
  const auto line = [](const std::string& what, const char* side, const PhaseFigures& p) {
    if (p.los.with_phase + p.nlos.with_phase == 0) return fmt::format("  {:<22}{:<10}no phase\n", what, side);
    const auto mm = [](const PhaseView& v) {
      return shown(v.noise_m ? std::optional(1e3 * *v.noise_m) : std::nullopt, 1);
    };
    return fmt::format("  {:<22}{:<10}{:>7} {:>7} {:>9} {:>7} {:>8} {:>7}\n", what, side,
                       shown(p.los.share(), 3), shown(p.nlos.share(), 3), shown(p.time_between_slips_s(), 1),
                       p.slips, mm(p.los), mm(p.nlos));
  };
  for (const SignalFigures& s : f.signals) {
    if (!s.judged()) continue;
    text += line(s.name(), "measured", s.measured_phase) + line("", "simulated", s.simulated_phase);
  }
  if (text.empty()) return "";
  return fmt::format("\n{:<34}{:>15} {:>17} {:>16}\n  {:<32}{:>7} {:>7} {:>9} {:>7} {:>8} {:>7}\n",
                     "Carrier phase", "with phase", "between slips", "noise [mm]", "", "LOS", "NLOS", "[s]",
                     "slips", "LOS", "NLOS") +
         text;
}

}  // namespace

std::optional<double> auc_of(const std::optional<Separation>& s) {
  return s ? std::optional(s->auc) : std::nullopt;
}

std::optional<double> error_ratio(const Figures& f, std::size_t quantile) {
  if (f.measured.fixes == 0 || f.simulated.fixes == 0 || !(f.measured.horizontal_m[quantile] > 0)) return {};
  return f.simulated.horizontal_m[quantile] / f.measured.horizontal_m[quantile];
}

std::string to_json(const std::vector<Figures>& models, const std::optional<std::string>& alignment_json) {
  Json json = Json::object();
  if (alignment_json) json["alignment"] = Json::parse(*alignment_json);
  json["models"] = Json::array();
  for (const Figures& f : models) json["models"].push_back(json_of(f));
  return json.dump(2) + "\n";
}

std::string to_json(const Alignment& a) {
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

std::string never_tracked_text(const Figures& f) {
  std::string text;
  for (const NeverTracked& s : f.never_tracked) {
    text += fmt::format("{} {} ({:.0f} s)", text.empty() ? "" : ",", gnss::to_string(s.id), s.clear_s);
  }
  if (text.empty()) return text;
  return fmt::format("never tracked above 30 deg in clear view{}:{}", f.left_out ? ", left out" : "", text);
}

std::string to_text(const Figures& f) {
  std::string text = fmt::format("{}\n{}\n\n", f.model, f.part);
  const std::size_t all = f.los + f.nlos;
  text += fmt::format("LOS and NLOS by the city: {} observations, {:.1f} % NLOS\n", all,
                      all > 0 ? 100.0 * static_cast<double>(f.nlos) / static_cast<double>(all) : 0);
  text += separation_line("by C/N0", f.by_cn0, f.by_cn0_interval, -1, "below", "dB-Hz");
  text += separation_line("by pseudorange error", f.by_error, f.by_error_interval, 1, "above", "m");
  for (const Band& band : f.bands) {
    text += fmt::format("  {:>2.0f} to {:.0f} deg           AUC by C/N0 {}, by error {} ({} LOS, {} NLOS)\n",
                        band.low_deg, band.high_deg, shown(auc_of(band.by_cn0), 3),
                        shown(auc_of(band.by_error), 3), band.los, band.nlos);
  }
  text += "\nTracked satellites, measured and simulated\n";
  text += tracked_line("LOS", f.tracked_los) + tracked_line("NLOS", f.tracked_nlos);
  if (!f.never_tracked.empty()) text += "  " + never_tracked_text(f) + "\n";
  text += "\nMeasured NLOS errors explained by the model's paths\n";
  for (const Explained& e : f.explained) {
    if (e.n == 0 && e.kind != "all") continue;
    text += fmt::format("  {:<22}{:>5} ({:>4.1f} %), |error - delay| median {} m, Spearman {}\n", e.kind, e.n,
                        100 * e.share, shown(e.median_difference_m, 1),
                        e.correlation ? fmt::format("{:.2f}", e.correlation->rho) : "-");
  }
  text += distributions_head("Distributions");
  text += distribution_line("LOS error [m]", f.error_los_m);
  text += distribution_line("NLOS error [m]", f.error_nlos_m);
  text += distribution_line("LOS C/N0 [dB-Hz]", f.cn0_los_dbhz);
  text += distribution_line("NLOS C/N0 [dB-Hz]", f.cn0_nlos_dbhz);
  text += distribution_line("satellites used", f.used);
  text += further_signals(f) + phase_lines(f);
  text += "\nFixes by the same solver\n";
  text += position_line("measured", f.measured);
  text += position_line("simulated", f.simulated);
  text += fmt::format("  {:<22}p50 {}, p95 {}\n", "simulated / measured", shown(error_ratio(f, 2), 2),
                      shown(error_ratio(f, 4), 2));
  if (f.own_fixes) {
    text += "\nThe recorded receiver's own fixes, and the position filter's\n";
    text += position_line("own", f.own_fixes->own);
    text += position_line("measured, filter", f.own_fixes->measured);
    text += position_line("simulated, filter", f.own_fixes->simulated);
  }
  if (!f.segments.empty()) text += "\nStreet segments (horizontal error p50, p95)\n";
  for (const SegmentFigures& s : f.segments) {
    const auto fifty = [](const PositionFigures& p) {
      return p.fixes > 0
                 ? fmt::format("{:>5.1f} {:>6.1f} m, {:>3.0f} %", p.horizontal_m[2], p.horizontal_m[4],
                               100.0 * static_cast<double>(p.fixes) / static_cast<double>(p.epochs))
                 : std::string("no fix");
    };
    text +=
        fmt::format("  epochs {:>5} to {:>5}, {:>4.0f} m towards {:>3.0f} deg: measured {}; simulated {}\n",
                    s.segment.first, s.segment.first + s.segment.count - 1, s.segment.length_m,
                    s.segment.heading_deg, fifty(s.measured), fifty(s.simulated));
  }
  return text;
}

std::string to_markdown(const std::vector<Figures>& models) {
  std::string text =
      "| model | AUC C/N0 | AUC error | NLOS explained | median difference [m] | Spearman | KS error LOS, "
      "NLOS "
      "| KS C/N0 LOS, NLOS | tracked LOS | tracked NLOS | satellites used | horizontal p50 [m] | p95 [m] |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  const auto versus = [](bool both, double simulated, double measured, int decimals) {
    return both ? fmt::format("{:.{}f} ({:.{}f})", simulated, decimals, measured, decimals)
                : std::string("-");
  };
  for (const Figures& f : models) {
    const Explained none;
    const Explained& all = f.explained.empty() ? none : f.explained.back();
    const bool fixes = f.simulated.fixes > 0 && f.measured.fixes > 0;
    text += fmt::format(
        "| {} | {} | {} | {} | {} | {} | {}, {} | {}, {} | {} | {} | {} | {} | {} |\n",
        markdown_cell(f.model), shown(auc_of(f.by_cn0), 3), shown(auc_of(f.by_error), 3),
        f.nlos > 0 ? fmt::format("{:.1f} %", 100 * all.share) : "-", shown(all.median_difference_m, 1),
        all.correlation ? fmt::format("{:.2f}", all.correlation->rho) : "-", shown(f.error_los_m.ks, 2),
        shown(f.error_nlos_m.ks, 2), shown(f.cn0_los_dbhz.ks, 2), shown(f.cn0_nlos_dbhz.ks, 2),
        versus(f.tracked_los.satellites > 0, f.tracked_los.simulated_ratio(), f.tracked_los.measured_ratio(),
               2),
        versus(f.tracked_nlos.satellites > 0, f.tracked_nlos.simulated_ratio(),
               f.tracked_nlos.measured_ratio(), 2),
        versus(fixes, f.simulated.mean_used, f.measured.mean_used, 1),
        versus(fixes, f.simulated.horizontal_m[2], f.measured.horizontal_m[2], 1),
        versus(fixes, f.simulated.horizontal_m[4], f.measured.horizontal_m[4], 1));
  }
  return text + "\nSimulated, with measured in brackets, where both are given.\n";
}

}  // namespace canyon::validation
