// Declared in canyon/output/sinks.hpp.
#include <set>
#include <utility>

#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/output/sinks.hpp"
#include "canyon/output/stream.hpp"
#include "canyon/rinex/navigation_reader.hpp"
#include "canyon/samples/sample_file.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::output {
namespace {

/// The simulated sky, written once at the end.
class NavigationFile final : public simulation::EpochSink {
 public:
  NavigationFile(std::filesystem::path path, const gnss::NavigationData& data)
      : file_(std::move(path)), data_(data) {}
  void write(const simulation::Epoch&) override {}
  void finish() override {
    if (std::exchange(finished_, true)) return;
    file_.write(rinex::format_rinex_navigation(data_));
    file_.commit();
  }

 private:
  OutputFile file_;
  const gnss::NavigationData& data_;
  bool finished_ = false;
};

std::string safe_name(const std::string& name) {
  std::string safe;
  for (const char c : name.substr(0, 64)) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '-' || c == '_' || (c == '.' && !safe.empty());
    safe += plain ? c : '_';
  }
  return safe.empty() ? "receiver" : safe;
}

}  // namespace

std::vector<std::string> receiver_folder_names(const std::vector<std::string>& receiver_names) {
  // Letters of either case count as one name: not every file system distinguishes them.
  std::set<std::string> taken{"sky.nav",       "imu.csv",          "motion.csv", "wheels.csv",
                              "barometer.csv", "magnetometer.csv", "sensors.npz"};
  std::vector<std::string> folders;
  for (const std::string& name : receiver_names) {
    const std::string safe = safe_name(name);
    std::string folder = safe;
    for (int i = 2; !taken.insert(lower_case(folder)).second; ++i) folder = safe + '-' + std::to_string(i);
    folders.push_back(std::move(folder));
  }
  return folders;
}

std::filesystem::path receiver_folder(const simulation::Simulation& simulation,
                                      const std::filesystem::path& folder, std::size_t receiver) {
  const auto names = simulation::receiver_names(simulation.scenario().receivers);
  return names.size() == 1 ? folder : folder / receiver_folder_names(names).at(receiver);
}

std::vector<std::unique_ptr<simulation::EpochSink>> make_file_sinks(const simulation::Simulation& simulation,
                                                                    const std::filesystem::path& folder) {
  const simulation::OutputConfig& wanted = simulation.scenario().outputs;
  wanted.validate();
  std::vector<std::unique_ptr<simulation::EpochSink>> sinks;
  make_output_folder(folder);
  for (std::size_t i = 0; i < simulation.scenario().receivers.size(); ++i) {
    const std::filesystem::path at = receiver_folder(simulation, folder, i);
    if (at != folder) make_output_folder(at);
    ReceiverDescription description = describe_receiver(simulation, i);
    description.sensors = simulation.scenario().sensors.any();
    for (const Format& format : formats()) {
      if (wanted.has(format.name)) sinks.push_back(open_file(format.name, at / format.file, i, description));
    }
    if (!wanted.has("samples")) continue;
    for (auto& file : samples::make_sample_files(simulation, i, at / "samples.iq"))
      sinks.push_back(std::move(file));
  }
  if (wanted.has("rinex_navigation") && !simulation.navigation().empty()) {
    sinks.push_back(std::make_unique<NavigationFile>(folder / "sky.nav", simulation.navigation()));
  }
  if (simulation.scenario().sensors.any()) sinks.push_back(make_inertial_files(simulation, folder));
  return sinks;
}

}  // namespace canyon::output
