#include "canyon/analysis/heatmap/engine/mpi.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <exception>
#include <string>

#ifdef CANYON_MPI_LIBRARY
#include <dlfcn.h>
// The obsolete C++ bindings are not used; Open MPI's constants are addresses in its library.
#define OMPI_SKIP_MPICXX 1
#define MPICH_SKIP_MPICXX 1
#include <mpi.h>
#undef OMPI_PREDEFINED_GLOBAL
#define OMPI_PREDEFINED_GLOBAL(type, global) static_cast<type>(mpi_symbol(#global))
#define CANYON_MPI(name) reinterpret_cast<decltype(&::MPI_##name)>(mpi_symbol("MPI_" #name))
#endif

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon::heatmap {
namespace {

/// Whether a launcher sets its variables: Open MPI's, one of PMIx or of PMI (MPICH, Intel, Slurm). A single
/// process does not use MPI: starting it takes a second, and fails without a network.
bool is_one_of_several() {
  const auto value = [](const char* name) { return std::getenv(name); };
  const std::array ranks{"OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK"};
  if (std::none_of(ranks.begin(), ranks.end(), value)) return false;
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"}) {
    const char* const size = value(name);
    if (size != nullptr) return parse_integer(size) != 1;
  }
  return true;
}

[[noreturn]] void refuse(const std::string& reason) {
  throw InputError("mpirun started several processes, and " + reason,
                   "install Open MPI (Debian, Ubuntu: openmpi-bin), start one process, or compute a study in "
                   "parts, --shard K/N");
}

#ifdef CANYON_MPI_LIBRARY
/// A function or constant of the library, which is loaded at the first call.
void* mpi_symbol(const char* name) {
  // Open MPI's plugins look for its functions in the whole process.
  static void* const library = dlopen(CANYON_MPI_LIBRARY, RTLD_LAZY | RTLD_GLOBAL);
  void* const symbol = library != nullptr ? dlsym(library, name) : nullptr;
  if (symbol == nullptr) refuse(fmt::format("{} cannot be loaded ({})", CANYON_MPI_LIBRARY, dlerror()));
  return symbol;
}
#else
#define CANYON_MPI(name) [](auto&&...) { refuse("this canyon was built without MPI"); }
using MPI_Win = int;
constexpr int MPI_WIN_NULL = 0, MPI_INFO_NULL = 0, MPI_COMM_WORLD = 0, MPI_UINT64_T = 0, MPI_SUM = 0,
              MPI_THREAD_SINGLE = 0, MPI_THREAD_SERIALIZED = 0;
#endif

}  // namespace

/// A number at rank 0 that every rank can access.
struct MpiProcesses::Counter {
  MPI_Win window = MPI_WIN_NULL;
  std::uint64_t* value = nullptr;

  explicit Counter(int rank) {
    CANYON_MPI(Win_allocate)
    (rank == 0 ? sizeof(std::uint64_t) : 0, sizeof(std::uint64_t), MPI_INFO_NULL, MPI_COMM_WORLD, &value,
     &window);
    if (rank == 0) *value = 0;
    CANYON_MPI(Barrier)(MPI_COMM_WORLD);
    CANYON_MPI(Win_lock_all)(0, window);
  }
  void free() {
    CANYON_MPI(Win_unlock_all)(window);
    CANYON_MPI(Win_free)(&window);
  }
};

MpiProcesses::MpiProcesses() : exceptions_(std::uncaught_exceptions()) {
  if (!is_one_of_several()) return;
  // The library's own error handler is kept: it ends the job and prints the reason.
  int provided = MPI_THREAD_SINGLE;
  CANYON_MPI(Init_thread)(nullptr, nullptr, MPI_THREAD_SERIALIZED, &provided);
  if (provided < MPI_THREAD_SERIALIZED) {
    CANYON_MPI(Finalize)();
    throw InputError("the MPI library does not support threads", "use a library that was built with threads");
  }
  joined_ = true;
  CANYON_MPI(Comm_rank)(MPI_COMM_WORLD, &rank_);
  CANYON_MPI(Comm_size)(MPI_COMM_WORLD, &ranks_);
}

MpiProcesses::~MpiProcesses() {
  if (!joined_) return;
  if (std::uncaught_exceptions() > exceptions_ && ranks_ > 1) CANYON_MPI(Abort)(MPI_COMM_WORLD, 1);
  if (counter_) counter_->free();
  CANYON_MPI(Finalize)();
}

void MpiProcesses::barrier() const {
  if (joined_) CANYON_MPI(Barrier)(MPI_COMM_WORLD);
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
  CANYON_MPI(Fetch_and_op)(&one, &mine, MPI_UINT64_T, 0, 0, MPI_SUM, counter_->window);
  CANYON_MPI(Win_flush)(0, counter_->window);
  return mine;
}

std::uint64_t MpiProcesses::sum(std::uint64_t value) const {
  std::uint64_t total = value;
  if (joined_) CANYON_MPI(Allreduce)(&value, &total, 1, MPI_UINT64_T, MPI_SUM, MPI_COMM_WORLD);
  return total;
}

void MpiProcesses::abort(int status) const {
  if (joined_) CANYON_MPI(Abort)(MPI_COMM_WORLD, status);
  std::_Exit(status);
}

}  // namespace canyon::heatmap
