#include <fmt/format.h>

#include "canyon/analysis/inspection/inspect.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "cli/commands.hpp"

namespace canyon::cli {
namespace {

struct CheckArguments {
  std::vector<std::string> files;
  bool json = false;
};

Json json_of(const std::string& file, const inspection::FileReport& report) {
  Json contents, skipped = Json::array();
  for (const std::string& line : report.notes.lines()) skipped.push_back(hide_passwords(line));
  for (const auto& [name, value] : report.contents) contents[name] = value;
  return {{"file", file},
          {"usable", true},
          {"kind", report.kind},
          {"contents", std::move(contents)},
          {"skipped", std::move(skipped)},
          {"report", report_json(report.notes)},
          {"uses", report.uses}};
}

void print(const std::string& file, const inspection::FileReport& report) {
  fmt::print("{}\n  {:<14}{}\n", file, "kind", report.kind);
  for (const auto& [name, value] : report.contents) fmt::print("  {:<14}{}\n", name, value);
  for (const auto& [level, line] : report.notes.entries()) {
    const bool remark = level == ReadReport::Level::Remark;
    fmt::print("  {:<14}{}\n", remark ? "note" : ReadReport::name(level), hide_passwords(line));
  }
  for (const std::string& line : report.uses) fmt::print("  {:<14}{}\n", "good for", line);
}

int run_check(const CheckArguments& arguments) {
  ExitCode worst = kOk;
  Json all = Json::array();
  for (const std::string& path : arguments.files) {
    const std::string file = hide_passwords(path);
    try {
      const inspection::FileReport report = inspection::inspect_file(path);
      if (arguments.json)
        all.push_back(json_of(file, report));
      else
        print(file, report);
    } catch (const Error& error) {
      worst = exit_code(error);
      if (arguments.json)
        all.push_back({{"file", file}, {"usable", false}, {"problem", error.what()}});
      else
        fmt::print(stderr, "canyon: {}\n", error.what());
    }
  }
  if (arguments.json) fmt::print("{}\n", all.dump(2));
  return worst;
}

}  // namespace

void add_check(Command& app) {
  Command& command = app.add_command(
      "check", "print the kind and contents of files, what was left out, and which options use them");
  CheckArguments& arguments = command.run_with(run_check);
  command.add_option("files", arguments.files, "FILE...", "files of any kind that Canyon reads").required();
  command.add_flag("--json", arguments.json, "print JSON");
  command.footer = "Exit status 2 if a file cannot be used.";
}

}  // namespace canyon::cli
