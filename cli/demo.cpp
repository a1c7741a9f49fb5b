#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <vector>

#include "canyon/base/output_file.hpp"
#include "canyon/outputs/view/page.hpp"
#include "cli/commands.hpp"
#include "cli/program.hpp"
#include "cli/view_serve.hpp"

namespace canyon::cli {

/// examples/synthetic_drive.yaml; cli/CMakeLists.txt defines it.
extern const char* const demo_scenario;

namespace {

bool has_page() {
  try {
    return !view::find_page().empty();
  } catch (const InputError&) {
    return false;
  }
}

struct DemoArguments {
  std::string out = "canyon-demo";
  bool quiet = false;
};

int run_demo(const DemoArguments& arguments) {
  const std::string& out = arguments.out;
  const std::filesystem::path folder = out;
  std::optional<FolderLock> lock(folder);
  const std::string scenario = (folder / "demo.yaml").string();
  const std::string map = (folder / "heatmap").string();
  const std::string page = (folder / "demo.html").string();
  if (std::filesystem::exists(scenario) && view::read_bytes(scenario) != demo_scenario) {
    throw InputError(
        scenario, 0, "already exists and is not the demo's scenario",
        fmt::format("run it with `canyon simulate {} --out DIR`, or choose another folder for the demo",
                    scenario));
  }
  write_file(scenario, demo_scenario);
  lock.reset();  // each step has its own lock
  const std::string self = std::filesystem::read_symlink("/proc/self/exe").string();
  std::vector<std::vector<std::string>> steps{{self, "simulate", scenario, "--out", out},
                                              {self, "heatmap", scenario, "--spacing", "6", "--out", map}};
  const bool with_page = has_page();
  if (with_page) steps.push_back({self, "view", scenario, "--export", page});
  for (std::vector<std::string>& step : steps) {
    if (arguments.quiet) step.emplace_back("--quiet");
    if (const int status = run_program(step); status != kOk) return status;
  }
  if (arguments.quiet) return kOk;
  fmt::print("\nPictures: {0}/track.png, {0}/timeline.png, {0}/skyplot.png and those in {1}.\n", out, map);
  if (with_page)
    fmt::print("In three dimensions: open {} in a browser.\n", page);
  else
    fmt::print("In three dimensions: `./run view` builds the viewer's page, which is missing.\n");
  fmt::print(
      "\nTry next:\n"
      "  {0} contains the city, the sky, the drive and the receiver. Change `profile`, `systems` or `seed`, "
      "and\n"
      "    canyon simulate {0} --out {1}/mine\n"
      "  your own city:       canyon city build extract.osm.pbf -o city.canyon\n"
      "  other receivers:     canyon profiles\n"
      "  all commands:        canyon --help\n",
      scenario, out);
  return kOk;
}

}  // namespace

void add_demo(Command& app) {
  Command& command = app.add_command(
      "demo", "simulate a car in a synthetic downtown: a drive, a heat map, pictures, a page for browsers");
  DemoArguments& arguments = command.run_with(run_demo);
  command.add_option("-o,--out", arguments.out, "DIR", "folder for the results (canyon-demo)");
  command.add_flag("--quiet", arguments.quiet, "print warnings and errors only");
}

}  // namespace canyon::cli
