#include "canyon/view/header_extension.hpp"

#include <algorithm>

#include "canyon/base/input_error.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/view/header.hpp"

namespace canyon::view {

void extend_header(const std::filesystem::path& folder, const std::string& key, const Json& value,
                   const Json& chunks) {
  Json header = read_header(folder);
  if (!header.contains("chunks")) {
    throw InputError(folder / kHeaderFile, 0, "is not a view of Canyon's", "write it anew");
  }
  header[key] = value;
  Json all = Json::array();
  for (const Json& chunk : header["chunks"]) {
    const auto replaces = [&chunk](const Json& each) { return each["kind"] == chunk["kind"]; };
    if (std::none_of(chunks.begin(), chunks.end(), replaces)) all.push_back(chunk);
  }
  for (const Json& chunk : chunks) all.push_back(chunk);
  header["chunks"] = std::move(all);
  write_file(folder / kHeaderFile, header.dump() + "\n");
}

}  // namespace canyon::view
