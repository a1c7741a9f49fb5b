#include "canyon/validation/report/report_html.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>

#include "canyon/base/utf8.hpp"
#include "canyon/city/city.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/output/number.hpp"
#include "canyon/output/track.hpp"
#include "canyon/validation/report/report_samples.hpp"
#include "canyon/validation/report/report_targets.hpp"

namespace canyon::validation {
namespace {

using Row = std::vector<std::string>;  // cells, escaped; the first one is the row's head

constexpr const char* kNone = "\u2013";

constexpr const char* kStyle = R"(
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, -apple-system, "Segoe UI", "Liberation Sans", "DejaVu Sans", sans-serif;
  color: #222; background: #fff; margin: 0 auto; padding: 1rem; max-width: 64rem; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0.5rem 0 0.2rem; }
h2 { font-size: 1.25rem; margin: 2.2rem 0 0.6rem; border-bottom: 1px solid #d9d9d9; padding-bottom: 0.2rem; }
h3 { font-size: 1.05rem; margin: 1.6rem 0 0.4rem; }
p { max-width: 46rem; margin: 0.5rem 0; }
.lead { font-size: 1.1rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; margin: 0.6rem 0; font-size: 0.9rem; font-variant-numeric: tabular-nums; }
th, td { padding: 0.25rem 0.7rem; text-align: right; border-bottom: 1px solid #e3e3e3; vertical-align: top; }
thead th { border-bottom: 2px solid #6b6b6b; vertical-align: bottom; }
th:first-child { text-align: left; font-weight: normal; padding-left: 0; }
thead th:first-child { font-weight: bold; }
td.mark { white-space: nowrap; }
.reached { color: #00563f; }
.missed { color: #8a3a00; font-weight: bold; }
figure { margin: 1.5rem 0; break-inside: avoid; }
figure img { max-width: 100%; height: auto; display: block; }
figcaption { font-size: 0.92rem; color: #444; max-width: 46rem; margin-top: 0.3rem; }
li { max-width: 46rem; overflow-wrap: anywhere; }
@media (max-width: 40rem) { body { font-size: 15px; padding: 0.6rem; } th, td { padding: 0.25rem 0.4rem; } }
@media print { body { max-width: none; padding: 0; font-size: 10pt; } .scroll { overflow: visible; }
  h2, h3 { break-after: avoid; } tr { break-inside: avoid; } table { font-size: 8.5pt; } }
)";

constexpr const char* kPageEnd = "</main>\n</body>\n</html>\n";

/// All in front of the first heading.
std::string page_head(const std::string& title) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\" />\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\" />\n"
      "<title>{}: recorded and simulated receiver</title>\n<style>{}</style>\n</head>\n<body>\n<main>\n",
      xml_escaped(title), kStyle);
}

std::string number(double value, int decimals) {
  const std::string text = output::fixed(value, decimals);
  return text.empty() ? kNone : text;
}
std::string number(const std::optional<double>& value, int decimals) {
  return value ? number(*value, decimals) : kNone;
}
std::string count(std::size_t n) {
  return fmt::format("{}", n);
}
std::string percent(double share) {
  return number(100 * share, 1);
}
std::string share_of(std::size_t part, std::size_t all) {
  return all > 0 ? percent(static_cast<double>(part) / static_cast<double>(all)) : kNone;
}

std::string table(const Row& head, const std::vector<Row>& rows) {
  std::string html = "<div class=\"scroll\"><table>\n<thead><tr>";
  for (const std::string& cell : head) html += fmt::format("<th scope=\"col\">{}</th>", cell);
  html += "</tr></thead>\n<tbody>\n";
  for (const Row& row : rows) {
    html += "<tr>";
    for (std::size_t k = 0; k < row.size(); ++k) {
      html += k == 0 ? fmt::format("<th scope=\"row\">{}</th>", row[k]) : fmt::format("<td>{}</td>", row[k]);
    }
    html += "</tr>\n";
  }
  return html + "</tbody>\n</table></div>\n";
}

std::string heading(int level, const std::string& text) {
  return fmt::format("<h{0}>{1}</h{0}>\n", level, xml_escaped(text));
}
std::string paragraph(const std::string& text) {
  return fmt::format("<p>{}</p>\n", xml_escaped(text));
}

/// Symbol and word: some readers do not see the colours.
std::string verdict(const Target& target) {
  if (!target.value) return kNone;
  return target.reached() ? "<span class=\"reached\">\u2713 reached</span>"
                          : "<span class=\"missed\">\u2717 not reached</span>";
}

std::string summary(const ReportInput& input) {
  const Figures& own = input.models.front();
  const std::vector<Target> all = targets(own);
  const auto reached = std::count_if(all.begin(), all.end(), [](const Target& t) { return t.reached(); });
  std::string html = fmt::format(
      "<h1>{}: recorded and simulated receiver</h1>\n<p class=\"lead\">The model "
      "\u201C{}\u201D reaches {} of {} targets.</p>\n",
      xml_escaped(input.title), xml_escaped(own.model), reached, all.size());
  html += paragraph(fmt::format("Figures of the {}: {} LOS and {} NLOS observations recorded.", own.part,
                                own.los, own.nlos));
  html += paragraph(
      "LOS: the city leaves the straight line between satellite and antenna free. NLOS: it does not. The "
      "pseudorange error is what remains of a pseudorange when true distance, clocks and atmosphere are "
      "taken "
      "away; positive ones are too long.");
  return html;
}

std::string targets_table(const ReportInput& input) {
  std::vector<Row> rows;
  for (const Target& t : targets(input.models.front())) {
    rows.push_back({xml_escaped(t.name), xml_escaped(t.wanted), xml_escaped(t.value_text()), verdict(t)});
  }
  return heading(2, "Targets") + table({"Figure", "Target", "Reached", "Verdict"}, rows);
}

std::string models_table(const ReportInput& input) {
  if (input.models.size() < 2) return "";
  Row head{"Figure", "Target"};
  for (const Figures& f : input.models) head.push_back(xml_escaped(f.model));
  std::vector<std::vector<Target>> all;
  for (const Figures& f : input.models) all.push_back(targets(f));
  std::vector<Row> rows;
  for (std::size_t k = 0; k < all.front().size(); ++k) {
    Row row{xml_escaped(all.front()[k].name), xml_escaped(all.front()[k].wanted)};
    for (const auto& model : all) {
      const char* symbol = !model[k].value ? "" : model[k].reached() ? "\u2713 " : "\u2717 ";
      row.push_back(symbol + xml_escaped(model[k].value ? model[k].value_text() : kNone));
    }
    rows.push_back(row);
  }
  const auto figure = [&](const std::string& name,
                          const std::function<std::string(const Figures&)>& value_of) {
    Row row{name, ""};
    for (const Figures& f : input.models) row.push_back(value_of(f));
    rows.push_back(row);
  };
  figure("Targets reached", [](const Figures& f) {
    const auto list = targets(f);
    return fmt::format("{} of {}",
                       std::count_if(list.begin(), list.end(), [](const Target& t) { return t.reached(); }),
                       list.size());
  });
  const auto pair = [](const PositionFigures& m, const PositionFigures& s, std::size_t q) {
    return (m.fixes > 0 ? number(m.horizontal_m[q], 1) : kNone) + std::string(" / ") +
           (s.fixes > 0 ? number(s.horizontal_m[q], 1) : kNone);
  };
  figure("Horizontal error p50, measured / simulated [m]",
         [&](const Figures& f) { return pair(f.measured, f.simulated, 2); });
  figure("Horizontal error p95, measured / simulated [m]",
         [&](const Figures& f) { return pair(f.measured, f.simulated, 4); });
  figure("Epochs with a fix, measured / simulated [%]", [](const Figures& f) {
    return share_of(f.measured.fixes, f.measured.epochs) + " / " +
           share_of(f.simulated.fixes, f.simulated.epochs);
  });
  return heading(2, "All models") + paragraph("\u2713 target reached, \u2717 not reached.") +
         table(head, rows);
}

std::string time_range(const Comparison& comparison, std::size_t first, std::size_t epochs) {
  if (epochs == 0 || first + epochs > comparison.epochs.size()) return "no epoch";
  return fmt::format("{} to {} GPST, {} epochs", clock_gpst(comparison.epochs[first].time),
                     clock_gpst(comparison.epochs[first + epochs - 1].time), epochs);
}

/// Metres towards a side: "3.2 m east".
std::string towards(double metres, const char* positive, const char* negative) {
  return fmt::format("{} m {}", number(std::abs(metres), 2), metres < 0 ? negative : positive);
}

std::string alignment_section(const ReportInput& input) {
  std::string html = heading(2, "Alignment of the city, and parts of the recording");
  const Comparison& comparison = *input.comparison;
  if (!input.alignment) {
    const Registration& r = comparison.registration;
    const bool moved = r.east_m != 0 || r.north_m != 0 || r.heading_rad != 0;
    html += paragraph(
        moved ? fmt::format(
                    "The city was moved by {} and {} and turned by {}\u00B0 as given; nothing was estimated.",
                    towards(r.east_m, "east", "west"), towards(r.north_m, "north", "south"),
                    number(geodesy::degrees(r.heading_rad), 2))
              : "The city is where the scenario puts it; no alignment was estimated.");
    html += paragraph(
        fmt::format("The figures are of epochs {}.", time_range(comparison, input.first, input.count)));
    return html;
  }
  const Alignment& a = *input.alignment;
  html += paragraph(
      "The city's horizontal place was estimated from one part of the recording, by telling LOS and NLOS "
      "apart; the "
      "figures are of another part. Uncertainties are one standard deviation, from blocks of time drawn "
      "anew.");
  std::vector<Row> rows{
      {"City moved east [m]", number(a.registration.east_m, 2), number(a.sigma_east_m, 2)},
      {"City moved north [m]", number(a.registration.north_m, 2), number(a.sigma_north_m, 2)},
  };
  if (a.registration.heading_rad != 0 || a.sigma_heading_rad != 0) {
    rows.push_back({"City turned counter-clockwise [\u00B0]",
                    number(geodesy::degrees(a.registration.heading_rad), 2),
                    number(geodesy::degrees(a.sigma_heading_rad), 2)});
  }
  html += table({"Estimate", "Value", "Uncertainty"}, rows);
  html += table({"Part", "Epochs"}, {{"Alignment", time_range(comparison, a.first, a.count)},
                                     {"Figures", time_range(comparison, input.first, input.count)}});
  html += paragraph(
      fmt::format("Mean of both AUC on the alignment's part: {} as aligned, {} as the scenario has it.",
                  number(a.score, 3), number(a.score_before, 3)));
  if (a.at_border) {
    html += paragraph("Caution: the best place is at the border of the search; search farther.");
  }
  const bool overlap = a.first < input.first + input.count && input.first < a.first + a.count;
  if (overlap)
    html += paragraph("Caution: both parts share epochs, so that the figures flatter the alignment.");
  return html;
}

std::string pictures(const std::vector<ReportFigure>& figures) {
  std::string html = heading(2, "Pictures");
  for (const ReportFigure& f : figures) {
    html += fmt::format(
        "<figure id=\"{0}\">\n<img alt=\"{1}\" src=\"data:image/png;base64,{2}\" />\n"
        "<figcaption>{3} Files: {0}.png, {0}.svg.</figcaption>\n</figure>\n",
        xml_escaped(f.name), xml_escaped(f.alt), base64(f.png), xml_escaped(f.caption));
  }
  return html;
}

std::string separation_tables(const Figures& f) {
  std::string html = heading(3, "LOS and NLOS separated");
  const auto interval = [](const std::optional<Interval>& i) {
    return i ? fmt::format("{} to {}", number(i->low, 3), number(i->high, 3)) : std::string(kNone);
  };
  const auto row = [&](const std::string& name, const std::optional<Separation>& s,
                       const std::optional<Interval>& i, const std::string& unit) {
    if (!s) return Row{name, kNone, kNone, kNone, kNone};
    const std::string threshold =
        std::isfinite(s->threshold) ? number(std::abs(s->threshold), 1) + " " + unit : std::string(kNone);
    return Row{name, number(s->auc, 3), interval(i), number(s->balanced_accuracy, 3), threshold};
  };
  html += table({"By", "AUC", "95 % interval", "Balanced accuracy", "at a threshold of"},
                {row("C/N0 (NLOS is weaker)", f.by_cn0, f.by_cn0_interval, "dB-Hz"),
                 row("Pseudorange error (NLOS is later)", f.by_error, f.by_error_interval, "m")});
  std::vector<Row> bands;
  for (const Band& b : f.bands) {
    bands.push_back({fmt::format("{:.0f}\u00B0 to {:.0f}\u00B0", b.low_deg, b.high_deg), count(b.los),
                     count(b.nlos), b.by_cn0 ? number(b.by_cn0->auc, 3) : kNone,
                     b.by_error ? number(b.by_error->auc, 3) : kNone});
  }
  if (!bands.empty()) html += table({"Elevation", "LOS", "NLOS", "AUC by C/N0", "AUC by error"}, bands);
  return html;
}

std::string shares_table(const TrackedShare& los, const TrackedShare& nlos) {
  const auto row = [](const std::string& name, const TrackedShare& t) {
    const bool any = t.satellites > 0;
    return Row{name, count(t.satellites), any ? percent(t.measured_ratio()) : kNone,
               any ? percent(t.simulated_ratio()) : kNone};
  };
  return table({"The city says", "Satellites", "Recorded [%]", "Simulated [%]"},
               {row("LOS", los), row("NLOS", nlos)});
}

std::string tracked_table(const Figures& f) {
  std::string html =
      heading(3, "Tracked satellites above the mask") + shares_table(f.tracked_los, f.tracked_nlos);
  if (!f.never_tracked.empty()) html += paragraph("Satellites " + never_tracked_text(f) + ".");
  return html;
}

std::string explained_table(const Figures& f) {
  std::vector<Row> rows;
  for (const Explained& e : f.explained) {
    rows.push_back({xml_escaped(e.kind), count(e.n), percent(e.share), number(e.median_difference_m, 1),
                    e.correlation ? number(e.correlation->rho, 2) : kNone,
                    e.correlation ? fmt::format("{} to {}", number(e.correlation->low, 2),
                                                number(e.correlation->high, 2))
                                  : kNone});
  }
  return heading(3, "NLOS observations that a modelled path explains") +
         table({"Path", "n", "Share [%]", "Median |difference| [m]", "Spearman", "95 % interval"}, rows);
}

void add_distribution(std::vector<Row>& rows, const std::string& name, const DistributionPair& d,
                      int decimals) {
  const auto row = [&](const std::string& who, std::size_t n, const std::array<double, 5>& q,
                       const std::string& ks) {
    Row cells{who, count(n)};
    for (const double value : q) cells.push_back(n > 0 ? number(value, decimals) : kNone);
    cells.push_back(ks);
    rows.push_back(cells);
  };
  row(name + ", measured", d.measured_n, d.measured, "");
  row(name + ", simulated", d.simulated_n, d.simulated, number(d.ks, 3));
}

std::string distribution_rows(const std::vector<Row>& rows) {
  return table({"Quantity", "n", "p5", "p25", "p50", "p75", "p95", "KS"}, rows);
}

/// Signals beyond the first, of which the other tables are.
std::string signals_tables(const Figures& f) {
  std::string html, one_sided;
  for (const SignalFigures& s : f.signals) {
    if (!s.judged()) {
      one_sided +=
          paragraph(s.name() + (s.recorded ? " was recorded, and the simulated receiver does not track it."
                                           : " was not recorded; the simulated receiver tracks it."));
      continue;
    }
    if (s.first()) continue;
    std::vector<Row> rows;
    add_distribution(rows, "LOS pseudorange error [m]", s.error_los_m, 1);
    add_distribution(rows, "NLOS pseudorange error [m]", s.error_nlos_m, 1);
    add_distribution(rows, "LOS C/N0 [dB-Hz]", s.cn0_los_dbhz, 1);
    add_distribution(rows, "NLOS C/N0 [dB-Hz]", s.cn0_nlos_dbhz, 1);
    html += heading(3, s.name()) + distribution_rows(rows) + shares_table(s.tracked_los, s.tracked_nlos);
  }
  return html + one_sided;
}

std::string phase_table(const Figures& f) {
  std::vector<Row> rows;
  for (const SignalFigures& s : f.signals) {
    const auto add = [&](const char* who, const PhaseFigures& p) {
      if (p.los.with_phase + p.nlos.with_phase == 0) return;
      const auto share = [](const PhaseView& v) { return v.share() ? percent(*v.share()) : kNone; };
      const auto mm = [](const PhaseView& v) { return v.noise_m ? number(1e3 * *v.noise_m, 1) : kNone; };
      rows.push_back({s.name() + who, share(p.los), share(p.nlos), number(p.time_between_slips_s(), 1),
                      count(p.slips), mm(p.los), mm(p.nlos)});
    };
    add(", measured", s.measured_phase);
    add(", simulated", s.simulated_phase);
  }
  if (rows.empty()) return "";
  return heading(3, "Carrier phase") +
         table({"Signal", "LOS with phase [%]", "NLOS with phase [%]", "Between cycle slips [s]",
                "Cycle slips", "LOS noise [mm]", "NLOS noise [mm]"},
               rows);
}

std::string distributions_table(const Figures& f) {
  std::vector<Row> rows;
  const auto add = [&rows](const std::string& name, const DistributionPair& d, int decimals) {
    add_distribution(rows, name, d, decimals);
  };
  add("LOS pseudorange error [m]", f.error_los_m, 1);
  add("NLOS pseudorange error [m]", f.error_nlos_m, 1);
  add("LOS C/N0 [dB-Hz]", f.cn0_los_dbhz, 1);
  add("NLOS C/N0 [dB-Hz]", f.cn0_nlos_dbhz, 1);
  add("Satellites used", f.used, 1);
  return heading(3, "Distributions") + distribution_rows(rows);
}

std::string position_table(const Figures& f) {
  std::vector<Row> rows;
  const auto row = [&](const std::string& name, const PositionFigures& p, const std::array<double, 5>& q) {
    Row cells{name};
    for (const double value : q) cells.push_back(p.fixes > 0 ? number(value, 1) : kNone);
    rows.push_back(cells);
  };
  row("Horizontal, measured", f.measured, f.measured.horizontal_m);
  row("Horizontal, simulated", f.simulated, f.simulated.horizontal_m);
  row("Vertical, measured", f.measured, f.measured.vertical_m);
  row("Vertical, simulated", f.simulated, f.simulated.vertical_m);
  const auto availability = [](const std::string& name, const PositionFigures& p) {
    return Row{name, count(p.epochs), count(p.fixes), share_of(p.fixes, p.epochs),
               p.fixes > 0 ? number(p.mean_used, 1) : kNone};
  };
  const Row head{"Error [m]", "p5", "p25", "p50", "p75", "p95"};
  std::string html = heading(3, "Position, by the same solver on both") + table(head, rows) +
                     table({"Fixes", "Epochs", "With a fix", "[%]", "Mean satellites used"},
                           {availability("Measured", f.measured), availability("Simulated", f.simulated)});
  if (!f.own_fixes) return html;
  rows.clear();
  row("Horizontal, the recorded receiver's own", f.own_fixes->own, f.own_fixes->own.horizontal_m);
  row("Horizontal, measured, position filter", f.own_fixes->measured, f.own_fixes->measured.horizontal_m);
  row("Horizontal, simulated, position filter", f.own_fixes->simulated, f.own_fixes->simulated.horizontal_m);
  return html + heading(3, "The recorded receiver's own fixes, and the position filter's") +
         table(head, rows);
}

std::string segments_table(const ReportInput& input) {
  const Figures& f = input.models.front();
  std::string html = heading(3, "By street");
  if (f.segments.empty()) return html + paragraph("No stretch of one street has enough epochs.");
  const auto& all = input.comparison->segments;
  std::vector<Row> rows;
  for (const SegmentFigures& s : f.segments) {
    // Numbered as in the picture of errors: by the whole drive's segments.
    const auto of = std::find_if(all.begin(), all.end(), [&](const Segment& whole) {
      return s.segment.first >= whole.first && s.segment.first < whole.first + whole.count;
    });
    const auto quantile_of = [](const PositionFigures& p, std::size_t q) {
      return p.fixes > 0 ? number(p.horizontal_m[q], 1) : kNone;
    };
    const auto both = [](const std::string& m, const std::string& simulated) {
      return m + " / " + simulated;
    };
    rows.push_back(
        {of == all.end() ? kNone : fmt::format("{}", of - all.begin() + 1),
         number(s.segment.heading_deg, 0) + "\u00B0", number(s.segment.length_m, 0), count(s.measured.epochs),
         both(share_of(s.measured.fixes, s.measured.epochs), share_of(s.simulated.fixes, s.simulated.epochs)),
         both(quantile_of(s.measured, 2), quantile_of(s.simulated, 2)),
         both(quantile_of(s.measured, 4), quantile_of(s.simulated, 4)),
         both(s.measured.fixes > 0 ? number(s.measured.mean_used, 1) : kNone,
              s.simulated.fixes > 0 ? number(s.simulated.mean_used, 1) : kNone)});
  }
  html += paragraph("Pairs are measured / simulated; errors are horizontal.");
  return html + table({"Street", "Heading", "Length [m]", "Epochs", "Fixes [%]", "p50 [m]", "p95 [m]",
                       "Satellites used"},
                      rows);
}

std::string notes(const std::vector<std::string>& lines) {
  if (lines.empty()) return "";
  std::string html = heading(2, "Notes") + "<ul>\n";
  for (const std::string& note : lines) html += fmt::format("<li>{}</li>\n", xml_escaped(note));
  return html + "</ul>\n";
}

}  // namespace

std::string overview_html(const std::string& title, const std::vector<RecordingRow>& rows,
                          const std::vector<std::string>& lines) {
  Row head{"Simulated (measured)"};
  for (const RecordingRow& row : rows) {
    const std::string name = xml_escaped(row.name);
    head.push_back(row.report.empty() ? name
                                      : fmt::format("<a href=\"{}\">{}</a>", xml_escaped(row.report), name));
  }
  std::vector<Row> cells;
  for (const std::string& headline : titles_of(rows)) {
    Row row{xml_escaped(headline)};
    for (const RecordingRow& of : rows) {
      const Headline* h = headline_of(of, headline);
      row.push_back(h == nullptr ? kNone
                                 : fmt::format("{}<br />[{}]", xml_escaped(value_text(*h)),
                                               xml_escaped(interval_text(*h))));
    }
    cells.push_back(std::move(row));
  }
  std::vector<std::string> all;
  for (const RecordingRow& row : rows) all.push_back(description_of(row));
  all.insert(all.end(), lines.begin(), lines.end());
  return page_head(title) +
         fmt::format("<h1>{}: recorded and simulated receivers</h1>\n", xml_escaped(title)) +
         paragraph(
             "In square brackets: 95 % intervals from blocks of time drawn anew. Each recording's own "
             "report follows its name.") +
         table(head, cells) + notes(all) + kPageEnd;
}

std::string report_html(const ReportInput& input, const std::vector<ReportFigure>& figures) {
  const Figures& own = input.models.front();
  std::string html = page_head(input.title);
  html += summary(input) + targets_table(input) + models_table(input) + alignment_section(input) +
          pictures(figures);
  html += heading(2, fmt::format("All figures of \u201C{}\u201D", own.model));
  html += separation_tables(own) + tracked_table(own) + explained_table(own) + distributions_table(own) +
          signals_tables(own) + phase_table(own) + position_table(own) + segments_table(input) +
          notes(input.notes);
  return html + kPageEnd;
}

}  // namespace canyon::validation
