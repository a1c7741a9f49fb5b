#include "canyon/base/input_file.hpp"

#include <fstream>
#include <system_error>

#include "canyon/base/input_error.hpp"

namespace canyon {

void check_input_file(const std::filesystem::path& path, std::uint64_t largest) {
  std::error_code code;
  const std::filesystem::file_status status = std::filesystem::status(path, code);
  if (status.type() == std::filesystem::file_type::not_found) {
    throw InputError(path, 0, "no such file", "check the path (paths in a file start at that file's folder)");
  }
  if (status.type() == std::filesystem::file_type::none) {
    throw InputError(path, 0, "cannot be opened: " + code.message());
  }
  if (std::filesystem::is_directory(status)) throw InputError(path, 0, "is a folder, not a file");
  if (!std::filesystem::is_regular_file(status)) {
    throw InputError(path, 0, "is a pipe or a device, not a regular file", "save what it gives to a file");
  }
  const std::uintmax_t size = std::filesystem::file_size(path, code);
  if (!code && size > largest) {
    throw InputError(path, 0, "is larger than " + std::to_string(largest >> 20) + " MiB",
                     "is it the right file?");
  }
}

std::string read_head(const std::filesystem::path& path, std::size_t bytes) {
  std::ifstream in(path, std::ios::binary);
  std::string head(bytes, '\0');
  in.read(head.data(), static_cast<std::streamsize>(bytes));
  head.resize(static_cast<std::size_t>(in.gcount()));
  return head;
}

}  // namespace canyon
