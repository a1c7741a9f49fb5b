#include "canyon/validation/report/report_html.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "canyon/base/utf8.hpp"
#include "canyon/city/city.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/output/number.hpp"
#include "canyon/output/track.hpp"
#include "canyon/validation/report/report_samples.hpp"

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
std::string share_of(std::size_t part, std::size_t all) {
  return all > 0 ? number(100 * (static_cast<double>(part) / static_cast<double>(all)), 1) : kNone;
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
    rows.push_back({xml_escaped(std::string(t.info->target)), xml_escaped(t.wanted()),
                    xml_escaped(t.value_text()), verdict(t)});
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
    Row row{xml_escaped(std::string(all.front()[k].info->target)), xml_escaped(all.front()[k].wanted())};
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

std::string html_of(const FigureTable& figures) {
  std::vector<Row> rows{figures.head};
  rows.insert(rows.end(), figures.rows.begin(), figures.rows.end());
  for (Row& row : rows) {
    for (std::string& cell : row) cell = cell == "-" ? kNone : xml_escaped(cell);
  }
  std::string html = figures.title.empty() ? "" : heading(3, figures.title);
  if (!figures.rows.empty()) html += table(rows.front(), {rows.begin() + 1, rows.end()});
  return figures.note.empty() ? html : html + paragraph(figures.note);
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
  for (const Headline& headline : headlines_of(rows)) {
    Row row{xml_escaped(headline.title)};
    for (const RecordingRow& of : rows) {
      const Headline* h = headline_with(of.headlines, headline.key);
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
  for (const FigureTable& figures_of : figure_tables(own)) html += html_of(figures_of);
  return html + notes(input.notes) + kPageEnd;
}

}  // namespace canyon::validation
