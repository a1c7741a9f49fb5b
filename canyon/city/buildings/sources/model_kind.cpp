#include "canyon/city/buildings/sources/model_kind.hpp"

#include <algorithm>

#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/unpack.hpp"

namespace canyon::buildings {

std::string first_bytes(const ByteReader& bytes, std::size_t maximum) {
  std::string all, block(std::min(maximum, std::size_t{1} << 18), '\0');
  while (const std::size_t n = bytes(block.data(), std::min(block.size(), maximum - all.size())))
    all.append(block, 0, n);
  return all;
}

namespace {

constexpr std::size_t kHeadBytes = std::size_t{1} << 16;

/// The name of the first element, with its namespace's prefix; empty if there is none.
std::string_view root_name(std::string_view text) {
  for (std::size_t at = text.find('<'); at != std::string_view::npos; at = text.find('<', at)) {
    const std::string_view rest = text.substr(at);
    std::string_view end;
    if (rest.substr(0, 4) == "<!--")
      end = "-->";
    else if (rest.substr(0, 2) == "<?")
      end = "?>";
    else if (rest.substr(0, 2) == "<!")
      end = ">";
    else
      return rest.substr(1, rest.find_first_of(" \t\r\n/>") - 1);
    at = text.find(end, at);
    if (at == std::string_view::npos) break;
  }
  return {};
}

std::string unpacked_head(const std::filesystem::path& path) {
  try {
    GzipFile file(path);
    return first_bytes([&file](char* to, std::size_t size) { return file.read(to, size, 0); }, kHeadBytes);
  } catch (const InputError&) {  // the reader reports the error
    return {};
  }
}

bool names_city_models(const std::filesystem::path& archive) {
  const std::vector<std::string> names = zip_names(archive);
  return std::any_of(names.begin(), names.end(), [](const std::string& name) {
    return has_ending(name, {".gml", ".citygml", ".xml", ".city.json", ".json", ".jsonl", ".gml.gz"});
  });
}

bool holds_city_models(const std::filesystem::path& folder) {
  constexpr int kMaxFiles = 5000;
  std::error_code error;
  if (std::filesystem::exists(folder / "model.sdf", error)) return false;
  int looked = 0;
  const auto options = std::filesystem::directory_options::skip_permission_denied;
  for (auto it = std::filesystem::recursive_directory_iterator(folder, options, error);
       !error && it != std::filesystem::recursive_directory_iterator(); it.increment(error)) {
    if (!it->is_regular_file(error) || error) continue;
    if (++looked > kMaxFiles) break;
    const std::filesystem::path& file = it->path();
    if (!has_ending(file, {".gml", ".citygml", ".xml", ".json", ".jsonl", ".gz", ".zip"})) continue;
    const ModelKind kind = model_kind_of_text(read_head(file, kHeadBytes));
    if (kind != ModelKind::None) return true;
    if (has_ending(file, {".gz", ".zip"}) && model_kind(file) != ModelKind::None) return true;
  }
  return false;
}

}  // namespace

bool has_ending(const std::filesystem::path& path, std::initializer_list<std::string_view> endings) {
  const std::string name = lower_case(path.filename().string());
  return std::any_of(endings.begin(), endings.end(), [&name](std::string_view end) {
    return name.size() > end.size() && name.ends_with(end);
  });
}

ModelKind model_kind_of_text(std::string_view head) {
  if (Utf16Decoder::is_marked(head)) return model_kind_of_text(utf8_of_marked(std::string(head)));
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (head.substr(0, kByteOrderMark.size()) == kByteOrderMark) head.remove_prefix(kByteOrderMark.size());
  head = trim(head);
  if (head.empty()) return ModelKind::None;
  if (head.front() == '{')
    return head.find("\"CityJSON") != std::string_view::npos ? ModelKind::CityJson : ModelKind::None;
  if (head.front() != '<') return ModelKind::None;
  std::string_view root = root_name(head);
  root = root.substr(root.find(':') + 1);  // the whole name if there is no prefix
  const bool collection =
      root == "FeatureCollection" && lower_case(head).find("opengis.net/citygml") != std::string::npos;
  return root == "CityModel" || collection ? ModelKind::CityGml : ModelKind::None;
}

ModelKind model_kind(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error))
    return holds_city_models(path) ? ModelKind::Folder : ModelKind::None;
  std::string head =
      std::filesystem::is_regular_file(path, error) ? read_head(path, kHeadBytes) : std::string();
  if (is_zip(head)) return names_city_models(path) ? ModelKind::Archive : ModelKind::None;
  if (is_gzip(head)) head = unpacked_head(path);
  const ModelKind kind = model_kind_of_text(head);
  if (kind != ModelKind::None) return kind;
  const bool overpass =
      head.find("\"elements\"") != std::string::npos || head.find("Overpass API") != std::string::npos;
  return has_ending(path, {".json", ".jsonl", ".json.gz", ".jsonl.gz"}) && !overpass ? ModelKind::CityJson
                                                                                     : ModelKind::None;
}

}  // namespace canyon::buildings
