#include "canyon/heatmap/engine/mpi.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <exception>

#ifdef CANYON_WITH_MPI
// The C++ bindings of old are not used.
#define OMPI_SKIP_MPICXX 1
#define MPICH_SKIP_MPICXX 1
#include <mpi.h>
#endif

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon::heatmap {

#ifdef CANYON_WITH_MPI

/// A number at rank 0 that every rank can reach.
struct MpiProcesses::Counter {
  MPI_Win window = MPI_WIN_NULL;
  std::uint64_t* value = nullptr;

  explicit Counter(int rank) {
    MPI_Win_allocate(rank == 0 ? sizeof(std::uint64_t) : 0, sizeof(std::uint64_t), MPI_INFO_NULL,
                     MPI_COMM_WORLD, &value, &window);
    if (rank == 0) *value = 0;
    MPI_Barrier(MPI_COMM_WORLD);
    MPI_Win_lock_all(0, window);
  }
  void free() {
    MPI_Win_unlock_all(window);
    MPI_Win_free(&window);
  }
};

namespace {

/// Launchers give processes their number in these variables: Open MPI, PMIx, PMI (MPICH, Intel), Slurm.
/// Without them MPI is left alone: starting it takes a second, and fails where there is no network.
bool is_launched() {
  for (const char* name : {"OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK", "SLURM_PROCID"}) {
    if (std::getenv(name) != nullptr) return true;
  }
  return false;
}

}  // namespace

bool MpiProcesses::built_in() {
  return true;
}

MpiProcesses::MpiProcesses() : exceptions_(std::uncaught_exceptions()) {
  if (!is_launched()) return;
  // The library's own error handler stays: it ends the job and says why.
  int provided = MPI_THREAD_SINGLE;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &provided);
  if (provided < MPI_THREAD_SERIALIZED) {
    MPI_Finalize();
    throw InputError("the MPI library does not support threads", "use one that was built with threads");
  }
  joined_ = true;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks_);
}

MpiProcesses::~MpiProcesses() {
  if (!joined_) return;
  if (std::uncaught_exceptions() > exceptions_ && ranks_ > 1) MPI_Abort(MPI_COMM_WORLD, 1);
  if (counter_) counter_->free();
  MPI_Finalize();
}

void MpiProcesses::barrier() const {
  if (joined_) MPI_Barrier(MPI_COMM_WORLD);
}

void MpiProcesses::begin_queue() {
  next_ = 0;
  if (!joined_) return;
  if (counter_) counter_->free();
  counter_ = std::make_unique<Counter>(rank_);
}

std::size_t MpiProcesses::next() {
  if (!counter_) return next_++;
  const std::uint64_t one = 1;
  std::uint64_t mine = 0;
  MPI_Fetch_and_op(&one, &mine, MPI_UINT64_T, 0, 0, MPI_SUM, counter_->window);
  MPI_Win_flush(0, counter_->window);
  return mine;
}

std::uint64_t MpiProcesses::sum(std::uint64_t value) const {
  std::uint64_t total = value;
  if (joined_) MPI_Allreduce(&value, &total, 1, MPI_UINT64_T, MPI_SUM, MPI_COMM_WORLD);
  return total;
}

void MpiProcesses::abort(int status) const {
  if (joined_) MPI_Abort(MPI_COMM_WORLD, status);
  std::_Exit(status);
}

#else

struct MpiProcesses::Counter {};

bool MpiProcesses::built_in() {
  return false;
}
MpiProcesses::MpiProcesses() {
  // The number of processes, by Open MPI and by the PMI of MPICH and Slurm.
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"}) {
    const char* text = std::getenv(name);
    const auto size = text != nullptr ? parse_integer(text) : std::nullopt;
    if (!size) continue;
    if (*size <= 1) return;
    throw InputError(
        fmt::format("mpirun started {} processes, and this canyon cannot share work among them", *size),
        "build it with -DCANYON_BUILD_MPI=ON, or start one process");
  }
}
MpiProcesses::~MpiProcesses() = default;
void MpiProcesses::barrier() const {}
std::uint64_t MpiProcesses::sum(std::uint64_t value) const {
  return value;
}
void MpiProcesses::begin_queue() {
  next_ = 0;
}
std::size_t MpiProcesses::next() {
  return next_++;
}
void MpiProcesses::abort(int status) const {
  std::_Exit(status);
}

#endif

}  // namespace canyon::heatmap
