#include "canyon/validation/recording_list.hpp"

#include <fmt/format.h>

#include <set>
#include <string_view>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/options/describe.hpp"
#include "canyon/options/folder_name.hpp"
#include "canyon/options/read.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/profile.hpp"

namespace canyon::validation {
namespace {

constexpr std::size_t kMostRecordings = 50;
constexpr std::size_t kMaxBytes = std::size_t{1} << 20;
constexpr std::string_view kOneNeeded = "each recording names itself, a scenario and observations";

options::Document document_of(const std::filesystem::path& path) {
  options::Document document;
  document.file = path;
  document.kind = "list of recordings";
  document.page = "docs/methods.md";
  document.known = options::describe<RecordingList>().paths();
  return document;
}

}  // namespace

void visit(options::Visitor& v, ListedRecording& r) {
  for (const std::string_view key : {"name", "scenario", "obs"}) v.require(key, kOneNeeded);
  v.text({"name", "", "names it in tables, and the folder of its view"}, r.name);
  if (v.reads()) options::check_folder_name(v, "name", r.name);
  v.text({"class", "", "of its receiver: recordings of one class are pooled", "none"}, r.receiver_class);
  v.file({"scenario", "", "city, sky and first receiver"}, r.scenario);
  v.file({"obs", "", "recorded observations: RINEX 2, 3 or 4, or a log of Android's GnssLogger"}, r.obs);
  v.file({"truth", "", "true positions", "the scenario's trajectory file"}, r.truth);
  const std::vector<std::string>& formats = simulation::trajectory_formats();
  v.word({"truth_format", "", "of the true positions", "told by the file's content"},
         r.truth_format, std::vector<std::string_view>(formats.begin(), formats.end()));
  // A file's name is from the list's folder, as all are.
  if (v.reads() && v.has("profile")) {
    v.text({"profile", "", "its word"}, r.profile);
    if (simulation::is_profile_path(r.profile)) {
      std::optional<std::filesystem::path> file;
      v.file({"profile", "", "its file"}, file);
      r.profile = std::filesystem::absolute(*file).string();
    } else {
      try {
        (void)simulation::built_in_profile(r.profile);
      } catch (const InputError& e) {
        throw v.fault("profile", e.problem(), e.cure());
      }
    }
  } else if (!v.reads()) {
    v.text({"profile", "", "one of 'canyon profiles', or a profile file: of the scenario's first receiver",
            "the scenario's"},
           r.profile);
  }
  v.file({"nmea", "", "the recorded receiver's own fixes: GGA with RMC or ZDA"}, r.nmea);
  v.boolean({"align", "", "estimate the city's offset on the first part; figures are then of the rest"},
            r.align);
  v.boolean({"align_heading", "", "also estimate its heading"}, r.align_heading);
  v.number({"split", "", "share of epochs that is the first part", "0.5"}, r.split, {0, 1, true, true});
  if (v.reads() && r.align_heading && !r.align) {
    throw v.fault("align_heading", "there is nothing to align", "add align: true");
  }
}

void visit(options::Visitor& v, RecordingList& list) {
  v.require("recordings", kOneNeeded);
  std::set<std::string> names;
  v.list("recordings", list.recordings, [&](ListedRecording& r) {
    visit(v, r);
    if (v.reads() && !names.insert(r.name).second) {
      throw v.fault("name", fmt::format("'{}' names two recordings", r.name), "give each its own name");
    }
  });
  if (v.reads() && list.recordings.size() > kMostRecordings) {
    throw v.fault("recordings", fmt::format("{} recordings are too many", list.recordings.size()),
                  fmt::format("give {} at most", kMostRecordings));
  }
}

bool is_recording_list(const std::filesystem::path& path) {
  try {
    const TextFile file(path, kMaxBytes);
    const options::Node root = options::parse_yaml(std::string(file.text()), {}, "");
    return root.kind == options::Node::Kind::Mapping && root.find("recordings") != nullptr;
  } catch (const InputError&) {
    return false;  // what reads it as a scenario says what is wrong
  }
}

RecordingList read_recording_list(const std::filesystem::path& path) {
  const TextFile file(path, kMaxBytes);
  const options::Document document = document_of(path);
  RecordingList list;
  options::read(options::parse_yaml(std::string(file.text()), document, kOneNeeded), document, list);
  return list;
}

}  // namespace canyon::validation
