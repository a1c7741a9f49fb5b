#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace canyon::fuzz {

/// One parser of external files. For any bytes it ends with a value or one InputError.
struct Target {
  std::string name;  ///< as used in ./run fuzz and as folders of findings/
  std::string file_name;
  std::function<void(const std::filesystem::path&)> read;
  std::vector<std::string> seeds;  ///< small files that it reads without an error
};
[[nodiscard]] const std::vector<Target>& targets();

/// Makes the target read these bytes from a file. InputError is allowed.
void read_bytes(const Target& target, std::string_view bytes);

}  // namespace canyon::fuzz
