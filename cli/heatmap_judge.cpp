// Declared in cli/commands.hpp.
#include <fmt/format.h>

#include "canyon/base/output_file.hpp"
#include "canyon/city/city.hpp"
#include "canyon/heatmap/engine/map_source.hpp"
#include "canyon/validation/comparison.hpp"
#include "canyon/validation/map_judgement.hpp"
#include "canyon/validation/report/map_picture.hpp"
#include "cli/commands.hpp"
#include "cli/progress.hpp"
#include "cli/recorded_drive.hpp"

namespace canyon::cli {
namespace {

struct HeatmapJudgeArguments : DriveArguments {
  std::string map, out;
};

class MapComparison : public RecordedDrive {
 public:
  MapComparison(const HeatmapJudgeArguments& arguments, const validation::ListedRecording& recording)
      : RecordedDrive(arguments, recording, false), arguments_(arguments) {}

  int run() {
    const heatmap::StoredMap map(arguments_.map);
    load();
    validation::Comparison comparison;
    {
      Progress progress("solving the recorded fixes", arguments_.quiet);
      compare_.progress = progress_of(progress);
      comparison = simulate(scenario_.receivers.front(), *environment_, registration(), scenario_.seed);
    }
    const std::vector<validation::MapEpoch> epochs = validation::map_epochs(
        comparison, part_.first, part_.count, environment_->city().frame,
        [&map](const Eigen::Vector2d& enu, double altitude_m, geodesy::GpsTime time) {
          return map.at(enu, altitude_m, time);
        },
        map.frame(), map.layers(), altitude(map));
    const validation::MapJudgement figures = validation::judge_map(epochs);
    if (figures.known == 0) {
      throw InputError(arguments_.map, 0, "has no place of the drive at its times",
                       "map the drive's area and its times: --bbox, --times");
    }
    if (!arguments_.out.empty()) write(epochs);
    if (!arguments_.quiet) fmt::print("{}\n{}", part_.name, validation::to_text(figures));
    return kOk;
  }

 private:
  /// Maps above the terrain have no heights above the ellipsoid.
  [[nodiscard]] std::optional<double> altitude(const heatmap::StoredMap& map) const {
    if (map.altitude_kind() == heatmap::AltitudeKind::Ellipsoid) return std::nullopt;
    return scenario_.trajectory.height_above_terrain_m.value_or(map.altitudes_m().front());
  }

  void write(const std::vector<validation::MapEpoch>& epochs) const {
    make_output_folder(arguments_.out);
    const std::filesystem::path folder = arguments_.out;
    write_file(folder / "judged.csv", validation::to_csv(epochs));
    const drawing::Picture picture =
        validation::draw_map_judgement("A map beside " + scenario_.file.stem().string(), epochs);
    write_file(folder / "judged.png", picture.png);
    write_file(folder / "judged.svg", picture.svg);
    note(fmt::format("judged.csv, judged.png and judged.svg in {}", arguments_.out));
  }

  const HeatmapJudgeArguments& arguments_;
};

int run_heatmap_judge(const HeatmapJudgeArguments& arguments) {
  if (validation::is_recording_list(arguments.scenario)) {
    throw InputError(arguments.scenario, 0, "is a list of recordings, but a map belongs to one city",
                     "give the scenario of one recording, and --obs");
  }
  return unless_interrupted(
      [&] { return MapComparison(arguments, recordings_of(arguments, false).front()).run(); });
}

constexpr const char* kHeatmapJudgeFooter = R"(
Fixes are computed from the recorded pseudoranges, epoch by epoch, with the receiver's settings, as in a map. The map needs horizontal_error_p50 and _p95 at the drive's places, altitude and times.

Example:
  canyon heatmap drive.yaml --out out/map --altitude 2 --spacing 2 --times 0/480/60 --draws 32 \
      --layers horizontal_error_p50,horizontal_error_p95,availability --format netcdf
  canyon heatmap judge out/map/map.nc drive.yaml --obs drive.obs --align --part all --out out/judged)";

}  // namespace

void add_heatmap_judge(Command& heatmap) {
  Command& command =
      heatmap.add_command("judge", "compare a finished map with the errors of a recorded receiver");
  HeatmapJudgeArguments& arguments = command.run_with(run_heatmap_judge);
  command.add_option("map", arguments.map, "MAP.nc", "the map's NetCDF file").required();
  add_drive_options(command, arguments);
  // Own fixes come from a position filter, which a map's cells do not have.
  command.options.remove_if([](const Option& option) { return option.has_name("--nmea"); });
  command
      .add_option("--part", arguments.part, "PART",
                  "part of the recording: first, rest or all (with --align the rest, else all)")
      .one_of({"first", "rest", "all"});
  command.add_option("-o,--out", arguments.out, "DIR", "folder for judged.csv and a picture");
  command.add_flag("--quiet", arguments.quiet, "print warnings and errors only");
  command.footer = kHeatmapJudgeFooter;
}

}  // namespace canyon::cli
