#pragma once

#include <netcdf.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"

namespace canyon::heatmap {

/// Seconds since 1970-01-01 00:00:00 UTC without leap seconds, as CF's standard calendar counts them.
[[nodiscard]] double unix_seconds(geodesy::GpsTime t);

/// An open NetCDF file. The library is not thread-safe: all calls for all files hold one lock. Failures are
/// InputErrors that name the file. Part of canyon::io.
class NetcdfFile {
 public:
  /// Creates or replaces `at`; `shown` is its name in messages.
  [[nodiscard]] static NetcdfFile create(const std::filesystem::path& at, const std::filesystem::path& shown);
  /// For reading: a file with the checksum of close() must match it, any other is opened by first_in_child().
  [[nodiscard]] static NetcdfFile open(const std::filesystem::path& path);
  /// Ignores write failures; close() reports them.
  ~NetcdfFile();
  NetcdfFile(NetcdfFile&& other) noexcept;
  NetcdfFile& operator=(NetcdfFile&&) = delete;
  NetcdfFile(const NetcdfFile&) = delete;
  NetcdfFile& operator=(const NetcdfFile&) = delete;

  // Definitions; NC_GLOBAL is the variable of global attributes.
  int define_dimension(const std::string& name, std::size_t size);
  int define_variable(const std::string& name, nc_type type, const std::vector<int>& dimensions);
  /// Chunked, shuffled, deflated and with a checksum. @param cache_bytes of chunks in memory while writing
  void set_storage(int variable, const std::vector<std::size_t>& chunk, std::size_t cache_bytes);
  void put(int variable, const std::string& name, nc_type type, std::size_t count, const void* values);
  void put_text(int variable, const std::string& name, std::string_view text) {
    put(variable, name, NC_CHAR, text.size(), text.data());
  }
  void put_number(int variable, const std::string& name, double value) {
    put(variable, name, NC_DOUBLE, 1, &value);
  }
  void put_integer(int variable, const std::string& name, int value) {
    put(variable, name, NC_INT, 1, &value);
  }
  void put_bytes(int variable, const std::string& name, const std::vector<signed char>& values) {
    put(variable, name, NC_BYTE, values.size(), values.data());
  }
  void end_definitions();

  // Values of a box [start, start + count).
  using Index = std::vector<std::size_t>;
  /// @param values of the type of the variable's definition
  void write(int variable, const Index& start, const Index& count, const void* values);
  /// Ends the file with a checksum over all of it, which is not part of its HDF5 content.
  void close();

  /// Calls `reads`. HDF5 may crash on damaged files, so those without a checksum are first read in a child
  /// process with limits; throws InputError if the child does not finish.
  void first_in_child(const std::function<void()>& reads) const;
  // Reading, within first_in_child(); empty if there is no such item (of that type).
  [[nodiscard]] std::optional<std::size_t> dimension(const std::string& name) const;
  [[nodiscard]] std::optional<int> variable(const std::string& name) const;
  [[nodiscard]] std::vector<std::string> variable_names() const;
  [[nodiscard]] std::vector<std::string> dimensions_of(int variable) const;
  [[nodiscard]] std::optional<double> number(int variable, const std::string& name) const;
  [[nodiscard]] std::optional<std::string> text(int variable, const std::string& name) const;
  void set_cache(int variable, std::size_t bytes) const;
  /// @param values float, double, signed char or std::int64_t, whatever the variable's type
  template <typename T>
  void read(int variable, const Index& start, const Index& count, T* values) const;

  /// CRC-32 (zlib's) of values in their memory layout, continuing that of `before`.
  [[nodiscard]] static std::int64_t checksum(std::span<const std::byte> values, std::int64_t before = 0);

  [[nodiscard]] const std::filesystem::path& path() const { return shown_; }

 private:
  explicit NetcdfFile(std::filesystem::path shown) : shown_(std::move(shown)) {}
  void check_written(int status) const;
  void check_read(int status) const;

  std::filesystem::path shown_, at_;
  int id_ = -1;
  bool is_as_closed_ = false;  ///< its checksum is valid
};

}  // namespace canyon::heatmap
