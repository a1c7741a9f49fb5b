#include <fmt/format.h>

#include <chrono>
#include <cstdio>

#include "canyon/analysis/heatmap/engine/mpi.hpp"
#include "canyon/analysis/study/along.hpp"
#include "canyon/analysis/study/compare.hpp"
#include "canyon/analysis/study/netcdf.hpp"
#include "canyon/analysis/study/pictures.hpp"
#include "canyon/analysis/study/runner.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "cli/commands.hpp"
#include "cli/progress.hpp"
#include "cli/scenario_run.hpp"

namespace canyon::cli {
namespace {

namespace fs = std::filesystem;

struct StudyArguments {
  std::string study, out, shard;
  std::vector<std::string> folders;  ///< of merge
  std::optional<std::size_t> print_run;
  int threads = 0;
  bool dry_run = false, no_pictures = false, quiet = false;
};

struct Shard {
  std::size_t index = 0, count = 1;
};

Shard parse_shard(const std::string& text) {
  if (text.empty()) return {};
  const std::vector<std::string_view> parts = split(text, '/');
  const long long index = parse_integer(parts.front()).value_or(0);
  const long long count = parts.size() == 2 ? parse_integer(parts.back()).value_or(0) : 0;
  if (index < 1 || count < index || count > 1'000'000) {
    throw InputError(fmt::format("--shard '{}' is not a part of a study", text),
                     "give K/N, K from 1 to N: 3/8");
  }
  return {static_cast<std::size_t>(index - 1), static_cast<std::size_t>(count)};
}

std::string list_of(const std::vector<std::size_t>& numbers) {
  constexpr std::size_t kMax = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMax, numbers.size()); ++i)
    text += fmt::format("{}{}", i > 0 ? ", " : "", numbers[i]);
  if (numbers.size() > kMax) text += fmt::format(" and {} more", numbers.size() - kMax);
  return text;
}

void report_plan(const study::StudyPlan& plan) {
  std::vector<TextRow> rows;
  for (const study::Axis& axis : plan.study().axes) {
    const std::size_t n = axis.size();
    const std::string first = study::value_at(axis, {0, 0}).label;
    const std::string last = study::value_at(axis, {n > 0 ? n - 1 : 0, 1 - 1e-12}).label;
    rows.push_back({axis.name, axis.key.empty() ? "-" : axis.key, n > 0 ? fmt::format("{}", n) : "continuous",
                    first, last, axis.realization ? "realization" : "setting"});
  }
  print_table({"axis", "key", "values", "first", "last", ""}, rows);
  fmt::print("\n{} runs of {} receivers ({}), about {:.0f} epochs each; about {}B of results\n", plan.size(),
             plan.receivers().size(), fmt::join(plan.receivers(), ", "), plan.epochs_per_run(),
             short_count(plan.estimated_bytes()));
}

/// Throws InputError if a result has the name of a user's file, or of an input, read already or later.
void refuse_results(const fs::path& folder) {
  for (const char* name : {"study.nc", "table.csv", "along.csv", "report.txt"}) {
    ResultFiles::refuse(folder / name);
    InputFiles::current().add_output(folder / name);
  }
}

/// The report of all runs in the folder, also printed.
void write_report(const fs::path& folder, const std::vector<std::optional<study::RunRecord>>& records) {
  const ReadReport report = study::report_of(records);
  report.write(folder);
  print_report(report, (folder / "report.txt").string());
}

/// NetCDF, table and pictures of a folder with all runs finished.
void write_results(const StudyArguments& arguments, const study::Manifest& manifest, const fs::path& folder,
                   std::vector<std::optional<study::RunRecord>>& records) {
  std::vector<std::size_t> failed;
  for (const auto& record : records)
    if (!record->problem.empty()) failed.push_back(record->number);
  const std::string failure =
      failed.empty() ? ""
                     : fmt::format("{} of {} runs have no metrics (runs {}); the first: {}", failed.size(),
                                   records.size(), list_of(failed), records[failed.front()]->problem);
  if (!failed.empty() && failed.size() == records.size()) throw InputError(failure);
  study::write_study_netcdf(folder / "study.nc", manifest, records, folder);
  const study::GroupComparison comparison = study::compare(manifest, records);
  write_file(folder / "table.csv", study::comparison_csv(comparison));
  std::size_t pictures = 0;
  if (!arguments.no_pictures) pictures = study::write_study_pictures(folder, manifest, comparison).size();
  if (manifest.along_m) {
    const auto along = study::errors_along(manifest, comparison, records, folder);
    write_file(folder / "along.csv", study::along_csv(comparison, along));
    if (!arguments.no_pictures)
      pictures += study::write_along_pictures(folder, manifest, comparison, along).size();
  }
  if (!arguments.quiet) fmt::print("\n{}\n", study::comparison_text(manifest, comparison));
  if (!failed.empty()) print_warnings({failure});
  note(arguments.quiet,
       fmt::format("study.nc, table.csv{}{} in {}", manifest.along_m ? ", along.csv" : "",
                   pictures > 0 ? fmt::format(" and {} pictures", pictures) : "", folder.string()));
}

std::vector<std::size_t> unfinished(const std::vector<std::optional<study::RunRecord>>& records,
                                    const Shard& shard = {}) {
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < records.size(); ++i)
    if (!records[i] && study::shard_of(i, shard.count) == shard.index) numbers.push_back(i);
  return numbers;
}

int compute(const StudyArguments& arguments, heatmap::MpiProcesses& ranks) {
  const Shard shard = parse_shard(arguments.shard);
  const study::StudyPlan plan = study::StudyPlan::read(arguments.study);
  if (ranks.rank() == 0 && (arguments.print_run || arguments.dry_run))
    print_report(plan.report(), "canyon check of the trajectory's file");
  if (arguments.print_run) {
    if (*arguments.print_run >= plan.size()) {
      throw InputError(
          fmt::format("--print-run {}: the study has runs 0 to {}", *arguments.print_run, plan.size() - 1));
    }
    print_scenario(study::RunMaker(plan).scenario(*arguments.print_run));
    return kOk;
  }
  if (arguments.dry_run) {
    if (ranks.rank() == 0) report_plan(plan);
    return kOk;
  }
  if (arguments.out.empty()) throw InputError("--out is missing", "give the folder for the results");
  if (ranks.sum(shard.index) != shard.index * static_cast<std::size_t>(ranks.ranks())) {
    throw InputError("the ranks of a job have different --shard",
                     "start shards without MPI: srun --mpi=none, or an array of jobs");
  }
  const study::Manifest manifest = study::manifest_of(plan);
  // Rank 0 creates the folder; all read existing records before any process adds some.
  std::optional<ResultFiles> files;
  std::optional<study::RunStore> store;
  if (ranks.rank() == 0) {
    files.emplace(arguments.out, "study", "runs", shard.count > 1);
    refuse_results(arguments.out);
    store.emplace(arguments.out, manifest);
  }
  ranks.barrier();
  if (ranks.rank() != 0) store.emplace(arguments.out, manifest);
  const std::vector<std::size_t> todo = unfinished(study::read_records(arguments.out, plan.size()), shard);
  ranks.barrier();

  const std::atomic<bool>& stop = catch_interrupts();
  const auto begin = std::chrono::steady_clock::now();
  std::size_t done = 0;
  const study::RunMaker maker(plan);
  {
    ProgressLine bar("running", arguments.quiet || ranks.rank() != 0, "runs");
    bar.update(0, todo.size());
    study::RunnerOptions options;
    options.threads = arguments.threads;
    options.stop = &stop;
    options.progress = [&](std::size_t runs) {
      done = runs;
      bar.update(runs, ranks.ranks() > 1 ? std::max<std::size_t>(
                                               runs, todo.size() / static_cast<std::size_t>(ranks.ranks()))
                                         : todo.size());
    };
    if (ranks.ranks() > 1) {
      ranks.begin_queue();
      options.next = [&ranks] { return ranks.next(); };
    }
    study::run_all(maker, *store, todo, options);
  }
  const std::size_t computed = ranks.sum(done);
  const bool interrupted = ranks.sum(stop.load() ? 1 : 0) > 0;
  if (ranks.rank() != 0) return interrupted ? kInterrupted : kOk;
  note(arguments.quiet, fmt::format("{} runs in {:.2f} s", computed, seconds_since(begin)));

  std::vector<std::optional<study::RunRecord>> records = study::read_records(arguments.out, plan.size());
  const std::vector<std::size_t> missing = unfinished(records);
  write_report(arguments.out, records);
  if (interrupted) {
    fmt::print(stderr,
               "canyon: interrupted: {} of {} runs are finished and kept in {}; the same command continues\n",
               records.size() - missing.size(), records.size(), arguments.out);
    return kInterrupted;
  }
  if (!missing.empty()) {
    note(arguments.quiet,
         fmt::format("shard {} is complete; 'canyon study merge' joins the folders of all shards",
                     arguments.shard));
    return kOk;
  }
  write_results(arguments, manifest, arguments.out, records);
  return kOk;
}

int merge(const StudyArguments& arguments) {
  if (arguments.out.empty()) throw InputError("--out is missing", "give the folder for the whole study");
  const ResultFiles files(arguments.out, "study", "runs");
  refuse_results(arguments.out);
  const study::Manifest manifest = study::read_manifest(arguments.folders.front());
  std::vector<std::optional<study::RunRecord>> records(manifest.runs);
  std::vector<const std::string*> origin(manifest.runs, nullptr);
  for (const std::string& folder : arguments.folders) {
    const study::Manifest of = study::read_manifest(folder);
    if (of.key != manifest.key) {
      throw InputError(folder, 0,
                       fmt::format("is a shard of another study ('{}') than {} ('{}')", of.title,
                                   arguments.folders.front(), manifest.title),
                       "merge folders of one study, with the same options and files");
    }
    std::vector<std::optional<study::RunRecord>> some = study::read_records(folder, manifest.runs);
    for (std::size_t i = 0; i < some.size(); ++i)
      if (some[i] && !records[i]) records[i] = std::move(some[i]), origin[i] = &folder;
  }
  const std::vector<std::size_t> missing = unfinished(records);
  if (!missing.empty()) {
    throw InputError(
        fmt::format("{} of {} runs are missing: {}", missing.size(), records.size(), list_of(missing)),
        "give the folders of all shards, and run again the interrupted ones");
  }
  study::RunStore store(arguments.out, manifest);
  const std::vector<std::size_t> todo = unfinished(study::read_records(arguments.out, manifest.runs));
  for (const std::size_t i : todo) {
    if (manifest.epochs && !records[i]->receivers.empty()) study::read_epochs(*origin[i], *records[i]);
    store.add(*records[i]);
    for (study::ReceiverRecord& receiver : records[i]->receivers) receiver.kept = {};
  }
  write_report(arguments.out, records);
  write_results(arguments, manifest, arguments.out, records);
  return kOk;
}

constexpr const char* kStudyFooter =
    R"(DIR/runs keeps finished runs: after Ctrl-C, a crash or a full disk the same command continues from there.
When all runs are finished, the results are study.nc (NetCDF, for xarray), table.csv, and pictures.

Examples:
  canyon study examples/studies/receivers.yaml --dry-run
  canyon study examples/studies/receivers.yaml --out out/receivers
  canyon study big.yaml --out out/part3 --shard 3/8        (one of eight machines)
  canyon study big.yaml --out /shared/big --shard "$SLURM_ARRAY_TASK_ID/8"     (a job of an array 1-8)
  canyon study merge out/part1 out/part2 ... --out out/big
  canyon study big.yaml --print-run 17 > run17.yaml        (for canyon simulate)
  mpirun --bind-to none -n 8 canyon study big.yaml --out /shared/big

docs/study.md explains them. Keys of a study:

)";

}  // namespace

void add_study(Command& app) {
  auto arguments = std::make_shared<StudyArguments>();
  Command& command = app.add_command("study", "run a scenario many times over axes, and summarize the runs");
  command.add_option("study", arguments->study, "STUDY", "study file (YAML)");
  command.add_option("-o,--out", arguments->out, "DIR", "folder for the results, created if missing");
  command.add_flag("--dry-run", arguments->dry_run, "print runs, axes and estimated size; run nothing");
  command.add_option("--shard", arguments->shard, "K/N", "run only part K of N, on one of N machines");
  command.add_option("--print-run", arguments->print_run, "N", "print the scenario of a run; run nothing");
  command.add_flag("--no-pictures", arguments->no_pictures, "write no pictures");
  add_threads(command, arguments->threads);
  command.add_flag("--quiet", arguments->quiet, "print warnings and errors only");
  command.footer = kStudyFooter + options::plain_text(study::study_description().keys);
  command.action = [arguments] {
    if (arguments->study.empty()) throw InputError("STUDY is missing", "canyon study STUDY --out DIR");
    heatmap::MpiProcesses ranks;
    return guarded(ranks, [&] { return compute(*arguments, ranks); });
  };
  Command& merged = command.add_command("merge", "join the folders of shards into one study");
  merged.add_option("folders", arguments->folders, "DIR", "folders of shards").required();
  merged.add_option("-o,--out", arguments->out, "DIR", "folder for the whole study");
  merged.add_flag("--no-pictures", arguments->no_pictures, "write no pictures");
  merged.add_flag("--quiet", arguments->quiet, "print warnings and errors only");
  merged.action = [arguments] { return merge(*arguments); };
}

}  // namespace canyon::cli
