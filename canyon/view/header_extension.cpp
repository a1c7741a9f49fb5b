#include "canyon/view/header_extension.hpp"

#include <set>

#include "canyon/base/input_error.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/view/header.hpp"
#include "canyon/view/page.hpp"

namespace canyon::view {

void extend_header(const std::filesystem::path& folder, const std::string& key,
                   const nlohmann::ordered_json& value, const nlohmann::ordered_json& chunks) {
  using OrderedJson = nlohmann::ordered_json;
  OrderedJson header = OrderedJson::parse(read_bytes(folder / kHeaderFile), nullptr, false);
  if (header.is_discarded() || !header.contains("chunks")) {
    throw InputError(folder / kHeaderFile, 0, "is no view of Canyon's", "write it anew");
  }
  header[key] = value;
  std::set<OrderedJson> kinds;
  for (const OrderedJson& chunk : chunks) kinds.insert(chunk["kind"]);
  OrderedJson all = OrderedJson::array();
  for (const OrderedJson& chunk : header["chunks"]) {
    if (!kinds.contains(chunk["kind"])) all.push_back(chunk);
  }
  for (const OrderedJson& chunk : chunks) all.push_back(chunk);
  header["chunks"] = std::move(all);
  OutputFile file(folder / kHeaderFile);
  file.write(header.dump() + "\n");
  file.commit();
}

}  // namespace canyon::view
