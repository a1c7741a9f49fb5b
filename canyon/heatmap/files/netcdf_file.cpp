#include "canyon/heatmap/files/netcdf_file.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <mutex>
#include <system_error>
#include <utility>

#include "canyon/base/output_file.hpp"
#include "canyon/geodesy/unix_time.hpp"

namespace canyon::heatmap {
namespace {

std::mutex library;

/// Calls the library, alone.
template <typename Call>
int locked(const Call& call) {
  const std::lock_guard<std::mutex> lock(library);
  errno = 0;
  return call();
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
  // HDF5 reports a failed write, not why; the system's word is often still there.
  const int code = errno;
  const bool named = code == ENOSPC || code == EFBIG || code == EDQUOT || code == EIO;
  std::error_code unknown;
  const std::filesystem::path folder = shown_.has_parent_path() ? shown_.parent_path() : ".";
  const auto space = std::filesystem::space(folder, unknown);
  const bool full = code == ENOSPC || code == EDQUOT || (!unknown && space.available < (1U << 20));
  throw OutputError(
      shown_, 0, fmt::format("cannot be written: {}", named ? std::strerror(code) : nc_strerror(status)),
      full ? "free disk space and run again" : "choose a folder that exists and that you may write to");
}

void NetcdfFile::check_read(int status) const {
  if (status == NC_NOERR) return;
  throw InputError(shown_, 0, fmt::format("cannot be read: {}", nc_strerror(status)),
                   "write the map again with canyon heatmap");
}

NetcdfFile NetcdfFile::create(const std::filesystem::path& at, const std::filesystem::path& shown) {
  // A file that a full disk keeps HDF5 (1.10) from closing stays in its tables half released, and when the
  // program ends HDF5 falls over it. So HDF5 shall do nothing then: all files here are closed by hand. No
  // effect where the program has used HDF5 before. Looked up by name, since only libnetcdf links HDF5.
  static const bool left_alone = [] {
    using Function = int (*)();
    const auto leave = reinterpret_cast<Function>(dlsym(RTLD_DEFAULT, "H5dont_atexit"));
    return leave != nullptr && leave() >= 0;
  }();
  static_cast<void>(left_alone);
  NetcdfFile file(shown);
  file.check_written(locked([&] { return nc_create(at.c_str(), NC_CLOBBER | NC_NETCDF4, &file.id_); }));
  return file;
}

NetcdfFile NetcdfFile::open(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) throw InputError(path, 0, "no such file");
  if (std::filesystem::is_directory(path, ignored)) throw InputError(path, 0, "is a folder");
  NetcdfFile file(path);
  file.check_read(locked([&] { return nc_open(path.c_str(), NC_NOWRITE, &file.id_); }));
  return file;
}

NetcdfFile::~NetcdfFile() {
  if (id_ >= 0) locked([&] { return nc_close(id_); });
}

NetcdfFile::NetcdfFile(NetcdfFile&& other) noexcept
    : shown_(std::move(other.shown_)), id_(std::exchange(other.id_, -1)) {}

int NetcdfFile::define_dimension(const std::string& name, std::size_t size) {
  int id = 0;
  check_written(locked([&] { return nc_def_dim(id_, name.c_str(), size, &id); }));
  return id;
}

int NetcdfFile::define_variable(const std::string& name, nc_type type, const std::vector<int>& dimensions) {
  int id = 0;
  check_written(locked([&] {
    return nc_def_var(id_, name.c_str(), type, static_cast<int>(dimensions.size()), dimensions.data(), &id);
  }));
  return id;
}

void NetcdfFile::set_storage(int variable, const std::vector<std::size_t>& chunk, int deflate_level,
                             std::size_t cache_bytes) {
  check_written(locked([&] {
    int status = nc_def_var_chunking(id_, variable, NC_CHUNKED, chunk.data());
    if (status == NC_NOERR) status = nc_def_var_deflate(id_, variable, 1, 1, deflate_level);
    // HDF5 leaves chunks that do not shrink uncompressed, and then without zlib's checksum.
    if (status == NC_NOERR) status = nc_def_var_fletcher32(id_, variable, NC_FLETCHER32);
    // 521: prime, far more slots than chunks that fit.
    if (status == NC_NOERR) status = nc_set_var_chunk_cache(id_, variable, cache_bytes, 521, 1.0F);
    return status;
  }));
}

void NetcdfFile::put_text(int variable, const std::string& name, std::string_view text) {
  check_written(
      locked([&] { return nc_put_att_text(id_, variable, name.c_str(), text.size(), text.data()); }));
}

void NetcdfFile::put_number(int variable, const std::string& name, double value) {
  check_written(locked([&] { return nc_put_att_double(id_, variable, name.c_str(), NC_DOUBLE, 1, &value); }));
}

void NetcdfFile::put_integer(int variable, const std::string& name, int value) {
  check_written(locked([&] { return nc_put_att_int(id_, variable, name.c_str(), NC_INT, 1, &value); }));
}

void NetcdfFile::put_float(int variable, const std::string& name, float value) {
  check_written(locked([&] { return nc_put_att_float(id_, variable, name.c_str(), NC_FLOAT, 1, &value); }));
}

void NetcdfFile::put_long(int variable, const std::string& name, std::int64_t value) {
  check_written(locked([&] {
    const long long number = value;
    return nc_put_att_longlong(id_, variable, name.c_str(), NC_INT64, 1, &number);
  }));
}

void NetcdfFile::put_bytes(int variable, const std::string& name, const std::vector<signed char>& values) {
  check_written(locked(
      [&] { return nc_put_att_schar(id_, variable, name.c_str(), NC_BYTE, values.size(), values.data()); }));
}

void NetcdfFile::end_definitions() {
  check_written(locked([&] { return nc_enddef(id_); }));
}

void NetcdfFile::write(int variable, const Index& start, const Index& count, const float* values) {
  check_written(locked([&] { return nc_put_vara_float(id_, variable, start.data(), count.data(), values); }));
}

void NetcdfFile::write(int variable, const Index& start, const Index& count, const double* values) {
  check_written(
      locked([&] { return nc_put_vara_double(id_, variable, start.data(), count.data(), values); }));
}

void NetcdfFile::write(int variable, const Index& start, const Index& count, const signed char* values) {
  check_written(locked([&] { return nc_put_vara_schar(id_, variable, start.data(), count.data(), values); }));
}

void NetcdfFile::write(int variable, const Index& start, const Index& count, const std::int64_t* values) {
  static_assert(sizeof(long long) == sizeof(std::int64_t));
  check_written(locked([&] {
    return nc_put_vara_longlong(id_, variable, start.data(), count.data(),
                                reinterpret_cast<const long long*>(values));
  }));
}

void NetcdfFile::write(int variable, const Index& start, const Index& count, const char* characters) {
  check_written(
      locked([&] { return nc_put_vara_text(id_, variable, start.data(), count.data(), characters); }));
}

void NetcdfFile::close() {
  const int id = std::exchange(id_, -1);
  check_written(locked([&] { return nc_close(id); }));
}

std::optional<std::size_t> NetcdfFile::dimension(const std::string& name) const {
  int id = 0;
  std::size_t size = 0;
  const int status = locked([&] {
    const int found = nc_inq_dimid(id_, name.c_str(), &id);
    return found == NC_NOERR ? nc_inq_dimlen(id_, id, &size) : found;
  });
  if (status != NC_NOERR) return std::nullopt;
  return size;
}

std::optional<int> NetcdfFile::variable(const std::string& name) const {
  int id = 0;
  if (locked([&] { return nc_inq_varid(id_, name.c_str(), &id); }) != NC_NOERR) return std::nullopt;
  return id;
}

std::vector<std::string> NetcdfFile::variable_names() const {
  int count = 0;
  check_read(locked([&] { return nc_inq_nvars(id_, &count); }));
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) {
    char name[NC_MAX_NAME + 1] = {};
    check_read(locked([&] { return nc_inq_varname(id_, i, name); }));
    names.emplace_back(name);
  }
  return names;
}

std::vector<std::string> NetcdfFile::dimensions_of(int variable) const {
  int count = 0;
  int ids[NC_MAX_VAR_DIMS] = {};
  check_read(locked([&] {
    const int status = nc_inq_varndims(id_, variable, &count);
    return status == NC_NOERR ? nc_inq_vardimid(id_, variable, ids) : status;
  }));
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) {
    char name[NC_MAX_NAME + 1] = {};
    check_read(locked([&] { return nc_inq_dimname(id_, ids[i], name); }));
    names.emplace_back(name);
  }
  return names;
}

std::optional<double> NetcdfFile::number(int variable, const std::string& name) const {
  nc_type type = NC_NAT;
  std::size_t size = 0;
  double value = 0;
  const int status = locked([&] {
    int found = nc_inq_att(id_, variable, name.c_str(), &type, &size);
    if (found == NC_NOERR && (type == NC_CHAR || type == NC_STRING || size != 1)) found = NC_EBADTYPE;
    return found == NC_NOERR ? nc_get_att_double(id_, variable, name.c_str(), &value) : found;
  });
  if (status != NC_NOERR) return std::nullopt;
  return value;
}

std::optional<std::string> NetcdfFile::text(int variable, const std::string& name) const {
  nc_type type = NC_NAT;
  std::size_t size = 0;
  std::string value;
  const int status = locked([&] {
    int found = nc_inq_att(id_, variable, name.c_str(), &type, &size);
    if (found == NC_NOERR && type != NC_CHAR) found = NC_EBADTYPE;
    if (found != NC_NOERR) return found;
    value.resize(size);
    return nc_get_att_text(id_, variable, name.c_str(), value.data());
  });
  if (status != NC_NOERR) return std::nullopt;
  return value;
}

void NetcdfFile::set_cache(int variable, std::size_t bytes) const {
  check_read(locked([&] { return nc_set_var_chunk_cache(id_, variable, bytes, 521, 1.0F); }));
}

void NetcdfFile::read(int variable, const Index& start, const Index& count, float* values) const {
  check_read(locked([&] { return nc_get_vara_float(id_, variable, start.data(), count.data(), values); }));
}

void NetcdfFile::read(int variable, const Index& start, const Index& count, double* values) const {
  check_read(locked([&] { return nc_get_vara_double(id_, variable, start.data(), count.data(), values); }));
}

void NetcdfFile::read(int variable, const Index& start, const Index& count, signed char* values) const {
  check_read(locked([&] { return nc_get_vara_schar(id_, variable, start.data(), count.data(), values); }));
}

void NetcdfFile::read(int variable, const Index& start, const Index& count, std::int64_t* values) const {
  check_read(locked([&] {
    return nc_get_vara_longlong(id_, variable, start.data(), count.data(),
                                reinterpret_cast<long long*>(values));
  }));
}

namespace {

std::int64_t crc(const void* data, std::size_t bytes, std::int64_t before) {
  return static_cast<std::int64_t>(
      crc32_z(static_cast<uLong>(before), static_cast<const Bytef*>(data), bytes));
}

}  // namespace

std::int64_t NetcdfFile::checksum(std::span<const float> values, std::int64_t before) {
  return crc(values.data(), values.size_bytes(), before);
}

std::int64_t NetcdfFile::checksum(std::span<const signed char> values, std::int64_t before) {
  return crc(values.data(), values.size_bytes(), before);
}

}  // namespace canyon::heatmap
