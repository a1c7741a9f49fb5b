#include "canyon/validation/report/report.hpp"

#include <cassert>

#include "canyon/base/output_file.hpp"
#include "canyon/city/city.hpp"
#include "canyon/validation/report/report_html.hpp"
#include "canyon/validation/report/report_pictures.hpp"

namespace canyon::validation {
namespace {

struct ReportPicture {
  const char* name;
  drawing::Picture (*draw)(const ReportInput&);
  const char* alt;
  const char* caption;
};

constexpr ReportPicture kPictures[] = {
    {"track", draw_report_track,
     "Two maps of the city with the true track, one with measured, one with simulated fixes",
     "Fixes from above, each joined to the true place of the antenna; both by the same solver. Darker roofs "
     "are "
     "higher."},
    {"errors", draw_report_errors,
     "Horizontal error and number of satellites over time, measured and simulated",
     "Horizontal error and satellites in the fix over the whole recording; errors below the axis lie on its "
     "lower end. The numbers above are those of the streets in the table below."},
    {"error_cdf", draw_report_error_cdf,
     "Cumulative distributions of LOS and NLOS pseudorange errors and of horizontal errors, measured and "
     "simulated",
     "Cumulative distributions of errors. The KS distance is the largest vertical distance between both "
     "curves."},
    {"prediction", draw_report_prediction,
     "Measured NLOS pseudorange errors over predicted code delays, by kind of path, with the line of "
     "equality",
     "Each mark is one recorded NLOS observation; the predicted delay is that of the receiver model over all "
     "paths, "
     "without noise. Kinds are those of the path that explains the observation."},
    {"cn0", draw_report_cn0, "C/N0 by elevation for LOS and NLOS, measured and simulated",
     "Carrier to noise density by elevation, LOS and NLOS by the city's word."},
    {"sky", draw_report_sky, "Sky plot with the city's silhouette and satellites coloured by measured C/N0",
     "The sky over the antenna at the epoch with most recorded satellites, with what the city hides of it. A "
     "recorded "
     "satellite behind the silhouette arrives by reflection or diffraction, or the city's model is wrong "
     "there."},
};

}  // namespace

std::string report_subtitle(const ReportInput& input) {
  std::string text = input.title;
  for (const std::string& more : {input.comparison->name, input.models.front().part}) {
    if (!more.empty()) text += (text.empty() ? "" : "  \u00B7  ") + more;
  }
  return text;
}

void write_report(const std::filesystem::path& folder, const ReportInput& input) {
  assert(input.city != nullptr && input.environment != nullptr && input.comparison != nullptr);
  assert(!input.models.empty());
  assert(input.first + input.count <= input.comparison->epochs.size());
  // All names are taken first, so that a folder that cannot be written to is found before the work.
  std::vector<OutputFile> files;
  for (const ReportPicture& picture : kPictures) {
    files.emplace_back(folder / (std::string(picture.name) + ".png"));
    files.emplace_back(folder / (std::string(picture.name) + ".svg"));
  }
  files.emplace_back(folder / "report.html");

  std::vector<ReportFigure> figures;
  std::size_t next = 0;
  for (const ReportPicture& picture : kPictures) {
    drawing::Picture drawn = picture.draw(input);
    files[next++].write(drawn.png);
    files[next++].write(drawn.svg);
    figures.push_back({picture.name, std::move(drawn.png), picture.alt, picture.caption});
  }
  files[next].write(report_html(input, figures));
  for (OutputFile& file : files) file.commit();
}

void write_overview(const std::filesystem::path& folder, const std::string& title,
                    const std::vector<RecordingRow>& rows, const std::vector<std::string>& notes) {
  write_file(folder / "report.html", overview_html(title, rows, notes));
}

}  // namespace canyon::validation
