#include "cli/ranks.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <exception>

#include "canyon/base/text.hpp"
#include "cli/commands.hpp"

namespace canyon::cli {
namespace {

/// The number of processes that a launcher started, by the variables of Open MPI and of MPICH's and Slurm's
/// PMI.
long long launched() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"}) {
    const char* text = std::getenv(name);
    if (text == nullptr) continue;
    if (const auto size = parse_integer(text)) return *size;
  }
  return 1;
}

}  // namespace

Ranks::Ranks() {
  if (!heatmap::MpiProcesses::built_in() && launched() > 1) {
    throw InputError(
        fmt::format("mpirun started {} processes, and this canyon cannot share work among them", launched()),
        "build it with -DCANYON_BUILD_MPI=ON, or start one process");
  }
  processes_ = std::make_unique<heatmap::MpiProcesses>(nullptr, nullptr);
}

int Ranks::guard(const std::function<int()>& work) const {
  if (size() == 1) return work();
  try {
    return work();
  } catch (const InputError& error) {
    fmt::print(stderr, "canyon: {}\n", error.what());
    std::fflush(stderr);
    processes_->abort(exit_code(error));
  } catch (const std::exception& error) {
    fmt::print(stderr, "canyon: internal error on rank {}: {}\n", rank(), error.what());
    std::fflush(stderr);
    processes_->abort(kFailure);
  }
}

}  // namespace canyon::cli
