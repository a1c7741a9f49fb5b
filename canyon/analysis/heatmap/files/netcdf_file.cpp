#include "canyon/analysis/heatmap/files/netcdf_file.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <malloc.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <mutex>
#include <system_error>
#include <type_traits>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::heatmap {
namespace {

std::mutex library;
constexpr int kDeflateLevel = 4;
/// A prime, much larger than the number of cached chunks.
constexpr std::size_t kCacheSlots = 521;
/// Limits of a child process that reads.
constexpr rlim_t kMaxMemory = rlim_t{3} << 29, kMaxRead_s = 10;

/// Calls a function of the library under the lock.
template <typename Function, typename... Arguments>
int call(const Function& function, const Arguments&... arguments) {
  const std::lock_guard<std::mutex> lock(library);
  errno = 0;
  return function(arguments...);
}

// The library's read function for each type in memory.
static_assert(sizeof(long long) == sizeof(std::int64_t));
template <typename T>
using InLibrary = std::conditional_t<std::is_same_v<T, std::int64_t>, long long, T>;

template <typename T>
constexpr auto kGet = nc_get_vara_float;
template <>
constexpr auto kGet<double> = nc_get_vara_double;
template <>
constexpr auto kGet<signed char> = nc_get_vara_schar;
template <>
constexpr auto kGet<long long> = nc_get_vara_longlong;

// Written by close() after the end of the HDF5 content: readers ignore it, and any program that opens the
// file for writing removes it.
constexpr std::string_view kMark = "\ncanyon-crc32 ";
constexpr std::size_t kMarkAndSum = kMark.size() + 9;

/// kMark and the checksum of a file's first bytes.
std::string mark_of(const std::filesystem::path& path, std::uintmax_t size) {
  std::ifstream in(path, std::ios::binary);
  std::vector<char> bytes(std::size_t{1} << 20);
  std::int64_t sum = 0;
  for (std::streamsize got = 1; size > 0 && got > 0; size -= static_cast<std::uintmax_t>(got)) {
    in.read(bytes.data(), static_cast<std::streamsize>(std::min<std::uintmax_t>(size, bytes.size())));
    got = in.gcount();
    sum = NetcdfFile::checksum(std::as_bytes(std::span(bytes).first(static_cast<std::size_t>(got))), sum);
  }
  return fmt::format("{}{:08x}\n", kMark, sum);
}

InputError damaged(const std::filesystem::path& path) {
  return {path, 0, "is damaged", "copy it again, or write it again with Canyon"};
}

/// Whether the file is as written by close(); false for a file of another program. Throws if it is damaged.
bool is_as_closed(const std::filesystem::path& path) {
  const std::uintmax_t size = std::filesystem::file_size(path);
  std::string end(std::min<std::uintmax_t>(size, kMarkAndSum), '\0');
  std::ifstream in(path, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(size - end.size()));
  if (!in.read(end.data(), static_cast<std::streamsize>(end.size())) || !end.starts_with(kMark)) return false;
  if (end != mark_of(path, size - end.size())) throw damaged(path);
  return true;
}

/// Prepares a child process that may crash: no core dump, no output, limits on memory and CPU time.
void become_expendable() {
  prctl(PR_SET_DUMPABLE, 0);
  for (const int end : {SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGSEGV}) std::signal(end, SIG_DFL);
  const int unknown = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  for (const int out : {STDOUT_FILENO, STDERR_FILENO}) dup2(unknown, out);
  mallopt(M_PERTURB, 0xA5);  // reads beyond the end, or before the beginning, give no valid pointer
  const auto bound = [](auto resource, rlim_t maximum) {
    rlimit limit{};
    getrlimit(resource, &limit);
    limit.rlim_cur = std::min(limit.rlim_cur, maximum);
    setrlimit(resource, &limit);
  };
  rlim_t pages = 0;
  if (std::ifstream("/proc/self/statm") >> pages)
    bound(RLIMIT_AS, pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + kMaxMemory);
  bound(RLIMIT_CPU, kMaxRead_s);
}

/// Whether reads finish, or throw an InputError, in a child process.
bool end_well(const std::filesystem::path& path, const std::function<void()>& reads) {
  // No other thread is in the library while its state is copied. (glibc handles malloc.)
  std::unique_lock<std::mutex> lock(library);
  std::array<int, 2> ends{};
  const pid_t child = pipe2(ends.data(), O_CLOEXEC) == 0 ? fork() : -1;
  if (child == 0) {
    lock.unlock();
    try {
      become_expendable();
      reads();
      static_cast<void>(::write(ends[1], "", 1) == 1);
    } catch (...) {  // out of memory: failed
    }
    _exit(0);
  }
  if (child < 0)
    throw InputError(path, 0, fmt::format("cannot be tried in a process: {}", std::strerror(errno)));
  ::close(ends[1]);
  pollfd end{ends[0], POLLIN, 0};
  while (poll(&end, 1, static_cast<int>(kMaxRead_s) * 1000) < 0 && errno == EINTR) {
  }
  char reported = 0;
  const bool well = end.revents != 0 && ::read(ends[0], &reported, 1) == 1;
  ::close(ends[0]);
  if (end.revents == 0) kill(child, SIGKILL);
  while (waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
  }
  return well;
}

/// If HDF5 (1.10) cannot close a file, on a full disk or a damaged one, the file stays half released in its
/// tables, and HDF5 crashes at the end of the program. So its clean-up at exit is disabled: all files are
/// closed explicitly. This has no effect if the program has used HDF5 before. The function is looked up by
/// name, since only libnetcdf links HDF5.
void leave_exit_alone() {
  static const bool left_alone = [] {
    using Function = int (*)();
    const auto leave = reinterpret_cast<Function>(dlsym(RTLD_DEFAULT, "H5dont_atexit"));
    return leave != nullptr && leave() >= 0;
  }();
  static_cast<void>(left_alone);
}

}  // namespace

double unix_seconds(geodesy::GpsTime t) {
  constexpr std::int64_t kNanoseconds = geodesy::GpsTime::kNanosecondsPerSecond;
  const std::int64_t unix_ns = geodesy::unix_from_gps(t);
  std::int64_t seconds = unix_ns / kNanoseconds;
  std::int64_t rest = unix_ns % kNanoseconds;
  if (rest < 0) {
    --seconds;
    rest += kNanoseconds;
  }
  return static_cast<double>(seconds) + static_cast<double>(rest) / kNanoseconds;
}

void NetcdfFile::check_written(int status) const {
  if (status == NC_NOERR) return;
  // HDF5 reports that a write failed, but not why; errno often still has the reason.
  const int code = errno;
  const bool named = code == ENOSPC || code == EFBIG || code == EDQUOT || code == EIO;
  std::error_code unknown;
  const std::filesystem::path folder = shown_.has_parent_path() ? shown_.parent_path() : ".";
  const auto space = std::filesystem::space(folder, unknown);
  const bool full = code == ENOSPC || code == EDQUOT || (!unknown && space.available < (1U << 20));
  throw OutputError(shown_, 0,
                    fmt::format("cannot be written: {}", named ? std::strerror(code) : nc_strerror(status)),
                    full ? "free disk space and run again" : "choose an existing, writable folder");
}

void NetcdfFile::check_read(int status) const {
  if (status == NC_NOERR) return;
  throw InputError(shown_, 0, fmt::format("cannot be read: {}", nc_strerror(status)),
                   "write the map again with canyon heatmap");
}

NetcdfFile NetcdfFile::create(const std::filesystem::path& at, const std::filesystem::path& shown) {
  leave_exit_alone();
  NetcdfFile file(shown);
  file.at_ = at;
  file.check_written(call(nc_create, at.c_str(), NC_CLOBBER | NC_NETCDF4, &file.id_));
  return file;
}

NetcdfFile NetcdfFile::open(const std::filesystem::path& path) {
  check_input_file(path);
  leave_exit_alone();
  NetcdfFile file(path);
  file.is_as_closed_ = is_as_closed(path);
  file.first_in_child([&] { file.check_read(call(nc_open, path.c_str(), NC_NOWRITE, &file.id_)); });
  return file;
}

void NetcdfFile::first_in_child(const std::function<void()>& reads) const {
  const auto to_the_end = [&] {
    try {
      reads();
    } catch (const InputError&) {  // it is thrown again below
    }
    if (id_ >= 0) call(nc_close, id_);
  };
  if (!is_as_closed_ && !end_well(shown_, to_the_end)) throw damaged(shown_);
  reads();
}

NetcdfFile::~NetcdfFile() {
  if (id_ >= 0) call(nc_close, id_);
}

NetcdfFile::NetcdfFile(NetcdfFile&& other) noexcept
    : shown_(std::move(other.shown_)),
      at_(std::move(other.at_)),
      id_(std::exchange(other.id_, -1)),
      is_as_closed_(other.is_as_closed_) {}

int NetcdfFile::define_dimension(const std::string& name, std::size_t size) {
  int id = 0;
  check_written(call(nc_def_dim, id_, name.c_str(), size, &id));
  return id;
}

int NetcdfFile::define_variable(const std::string& name, nc_type type, const std::vector<int>& dimensions) {
  int id = 0;
  check_written(
      call(nc_def_var, id_, name.c_str(), type, static_cast<int>(dimensions.size()), dimensions.data(), &id));
  return id;
}

void NetcdfFile::set_storage(int variable, const std::vector<std::size_t>& chunk, std::size_t cache_bytes) {
  check_written(call(nc_def_var_chunking, id_, variable, NC_CHUNKED, chunk.data()));
  check_written(call(nc_def_var_deflate, id_, variable, 1, 1, kDeflateLevel));
  // HDF5 leaves incompressible chunks uncompressed, without zlib's checksum.
  check_written(call(nc_def_var_fletcher32, id_, variable, NC_FLETCHER32));
  check_written(call(nc_set_var_chunk_cache, id_, variable, cache_bytes, kCacheSlots, 1.0F));
}

void NetcdfFile::put(int variable, const std::string& name, nc_type type, std::size_t count,
                     const void* values) {
  check_written(call(nc_put_att, id_, variable, name.c_str(), type, count, values));
}

void NetcdfFile::end_definitions() {
  check_written(call(nc_enddef, id_));
}

void NetcdfFile::write(int variable, const Index& start, const Index& count, const void* values) {
  check_written(call(nc_put_vara, id_, variable, start.data(), count.data(), values));
}

void NetcdfFile::close() {
  check_written(call(nc_close, std::exchange(id_, -1)));
  const std::string mark = mark_of(at_, std::filesystem::file_size(at_));
  errno = 0;
  if (!(std::ofstream(at_, std::ios::binary | std::ios::app) << mark << std::flush)) check_written(EIO);
}

std::optional<std::size_t> NetcdfFile::dimension(const std::string& name) const {
  int id = 0;
  std::size_t size = 0;
  if (call(nc_inq_dimid, id_, name.c_str(), &id) != NC_NOERR) return std::nullopt;
  if (call(nc_inq_dimlen, id_, id, &size) != NC_NOERR) return std::nullopt;
  return size;
}

std::optional<int> NetcdfFile::variable(const std::string& name) const {
  int id = 0;
  if (call(nc_inq_varid, id_, name.c_str(), &id) != NC_NOERR) return std::nullopt;
  return id;
}

std::vector<std::string> NetcdfFile::variable_names() const {
  int count = 0;
  check_read(call(nc_inq_nvars, id_, &count));
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) {
    std::array<char, NC_MAX_NAME + 1> name{};
    check_read(call(nc_inq_varname, id_, i, name.data()));
    names.emplace_back(name.data());
  }
  return names;
}

std::vector<std::string> NetcdfFile::dimensions_of(int variable) const {
  int count = 0;
  std::array<int, NC_MAX_VAR_DIMS> ids{};
  check_read(call(nc_inq_varndims, id_, variable, &count));
  check_read(call(nc_inq_vardimid, id_, variable, ids.data()));
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) {
    std::array<char, NC_MAX_NAME + 1> name{};
    check_read(call(nc_inq_dimname, id_, ids[static_cast<std::size_t>(i)], name.data()));
    names.emplace_back(name.data());
  }
  return names;
}

std::optional<double> NetcdfFile::number(int variable, const std::string& name) const {
  nc_type type = NC_NAT;
  std::size_t size = 0;
  double value = 0;
  if (call(nc_inq_att, id_, variable, name.c_str(), &type, &size) != NC_NOERR) return std::nullopt;
  if (type == NC_CHAR || type == NC_STRING || size != 1) return std::nullopt;
  if (call(nc_get_att_double, id_, variable, name.c_str(), &value) != NC_NOERR) return std::nullopt;
  return value;
}

std::optional<std::string> NetcdfFile::text(int variable, const std::string& name) const {
  nc_type type = NC_NAT;
  std::size_t size = 0;
  if (call(nc_inq_att, id_, variable, name.c_str(), &type, &size) != NC_NOERR) return std::nullopt;
  if (type != NC_CHAR) return std::nullopt;
  std::string value(size, '\0');
  if (call(nc_get_att_text, id_, variable, name.c_str(), value.data()) != NC_NOERR) return std::nullopt;
  return value;
}

void NetcdfFile::set_cache(int variable, std::size_t bytes) const {
  check_read(call(nc_set_var_chunk_cache, id_, variable, bytes, kCacheSlots, 1.0F));
}

template <typename T>
void NetcdfFile::read(int variable, const Index& start, const Index& count, T* values) const {
  using InFile = InLibrary<T>;
  check_read(
      call(kGet<InFile>, id_, variable, start.data(), count.data(), reinterpret_cast<InFile*>(values)));
}
template void NetcdfFile::read(int, const Index&, const Index&, float*) const;
template void NetcdfFile::read(int, const Index&, const Index&, double*) const;
template void NetcdfFile::read(int, const Index&, const Index&, signed char*) const;
template void NetcdfFile::read(int, const Index&, const Index&, std::int64_t*) const;

std::int64_t NetcdfFile::checksum(std::span<const std::byte> values, std::int64_t before) {
  return static_cast<std::int64_t>(
      crc32_z(static_cast<uLong>(before), reinterpret_cast<const Bytef*>(values.data()), values.size()));
}

}  // namespace canyon::heatmap
