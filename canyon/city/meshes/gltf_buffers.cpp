#include "canyon/city/meshes/gltf_buffers.hpp"

#include <fmt/format.h>

#include <array>

#include "canyon/base/input_error.hpp"
#include "canyon/base/payload.hpp"
#include "canyon/city/meshes/json_values.hpp"

namespace canyon::meshes {
namespace {

/// Numbers of an accessor whose bytes are not stored: all zero but for its sparse values.
constexpr std::uint64_t kMostZeros = std::uint64_t{1} << 20;

template <typename Stored>
double number_at(std::string_view bytes, std::size_t offset) {
  return static_cast<double>(little<Stored>(bytes, offset));
}

/// How accessors store numbers (glTF 2.0, 3.6.2.2).
struct Component {
  std::uint64_t type;
  std::size_t size;
  double full_scale;  ///< the largest value of a normalised integer; 1 of those that are not normalised
  double (*at)(std::string_view bytes, std::size_t offset);
};
constexpr std::array kComponents{
    Component{5120, 1, 127, number_at<std::int8_t>},    Component{5121, 1, 255, number_at<std::uint8_t>},
    Component{5122, 2, 32767, number_at<std::int16_t>}, Component{5123, 2, 65535, number_at<std::uint16_t>},
    Component{5125, 4, 1, number_at<std::uint32_t>},    Component{5126, 4, 1, number_at<float>}};

const Component& component_of(const Json& accessor) {
  const std::uint64_t type = count_member(accessor, "componentType");
  const auto* const found = std::find_if(kComponents.begin(), kComponents.end(),
                                         [&](const Component& each) { return each.type == type; });
  if (found == kComponents.end()) {
    throw InputError(fmt::format("accessors of component type {} do not exist", type));
  }
  return *found;
}

std::size_t width_of(const std::string& type) {
  static constexpr std::array<std::pair<std::string_view, std::size_t>, 7> kTypes{
      {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}}};
  for (const auto& [name, width] : kTypes) {
    if (type == name) return width;
  }
  throw InputError(fmt::format("accessors of type '{}' do not exist", type));
}

void read_elements(std::string_view bytes, std::size_t stride, const Component& component,
                   AccessorValues& out) {
  const std::size_t element = component.size * out.width;
  if (stride == 0) stride = element;
  if (stride < element) throw InputError("the elements of an accessor overlap");
  if (out.count > 0) {
    if (out.count - 1 > bytes.size() / stride) throw InputError("an accessor reaches beyond its buffer view");
    (void)piece(bytes, (out.count - 1) * stride, element);
  }
  out.values.resize(out.count * out.width);
  for (std::size_t i = 0; i < out.count; ++i) {
    for (std::size_t c = 0; c < out.width; ++c) {
      out.values[i * out.width + c] = component.at(bytes, i * stride + c * component.size);
    }
  }
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

std::string_view from_offset(std::string_view bytes, std::uint64_t offset) {
  return piece(bytes, offset, bytes.size() - std::min<std::uint64_t>(offset, bytes.size()));
}

}  // namespace

std::string percent_decoded(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool escape = text[i] == '%' && i + 2 < text.size();
    const int high = escape ? hex_digit(text[i + 1]) : -1, low = escape ? hex_digit(text[i + 2]) : -1;
    if (high >= 0 && low >= 0) {
      out += static_cast<char>(high * 16 + low);
      i += 2;
    } else {
      out += text[i];
    }
  }
  return out;
}

std::optional<std::string> data_of(std::string_view uri) {
  if (!uri.starts_with("data:")) return std::nullopt;
  const std::size_t comma = uri.find(',');
  if (comma == std::string_view::npos) throw InputError("a data: URI has no data");
  const std::string_view data = uri.substr(comma + 1);
  if (uri.substr(0, comma).find(";base64") == std::string_view::npos) return percent_decoded(data);
  std::optional<std::string> bytes = from_base64(data);
  if (!bytes) throw InputError("a data: URI is not base64");
  return bytes;
}

const Json& GltfBuffers::item(std::string_view list, std::uint64_t index) const {
  const Json* found = asset_.find(list);
  if (found == nullptr || !found->is_array() || index >= found->size()) {
    throw InputError(fmt::format("{} {} does not exist", list, index));
  }
  return (*found)[static_cast<std::size_t>(index)];
}

std::string_view GltfBuffers::buffer(std::uint64_t index) {
  const Json& buffer = item("buffers", index);
  const std::string uri = text_member(buffer, "uri");
  const std::uint64_t length = count_member(buffer, "byteLength");
  if (uri.empty()) return piece(binary_, 0, length);
  const auto [found, added] = loaded_.try_emplace(index);
  if (added) {
    auto data = data_of(uri);
    found->second = data ? std::move(*data) : fetch_(uri);
  }
  return piece(found->second, 0, length);
}

std::string_view GltfBuffers::raw_view(const Json& view) {
  return piece(buffer(count_member(view, "buffer")), count_member(view, "byteOffset", 0),
               count_member(view, "byteLength"));
}

std::string_view GltfBuffers::view(std::uint64_t index) {
  const Json& view = item("bufferViews", index);
  const Json& packed = extension(view, "EXT_meshopt_compression");
  if (!packed.is_object()) return raw_view(view);
  const auto [found, added] = unpacked_.try_emplace(index);
  if (added) {
    found->second =
        unpack_meshopt(raw_view(packed), count_member(packed, "count"), count_member(packed, "byteStride"),
                       text_member(packed, "mode"), text_member(packed, "filter"));
  }
  return found->second;
}

void GltfBuffers::fill_sparse(const Json& sparse, const Json& accessor, AccessorValues& out) {
  AccessorValues places, values;
  places.count = values.count = count_member(sparse, "count");
  if (places.count > out.count) throw InputError("a sparse accessor has more values than elements");
  values.width = out.width;
  const Json& at = sparse.at("indices");
  const Json& data = sparse.at("values");
  read_elements(from_offset(view(count_member(at, "bufferView")), count_member(at, "byteOffset", 0)), 0,
                component_of(at), places);
  read_elements(from_offset(view(count_member(data, "bufferView")), count_member(data, "byteOffset", 0)), 0,
                component_of(accessor), values);
  for (std::size_t i = 0; i < places.count; ++i) {
    const double place = places.values[i];
    if (!(place >= 0 && place < static_cast<double>(out.count))) {
      throw InputError("a sparse accessor reaches beyond its elements");
    }
    std::copy_n(
        values.values.begin() + static_cast<std::ptrdiff_t>(i * out.width), out.width,
        out.values.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(place) * out.width));
  }
}

AccessorValues GltfBuffers::accessor(std::uint64_t index) {
  const Json& of = item("accessors", index);
  const Component& component = component_of(of);
  AccessorValues out;
  const std::uint64_t count = count_member(of, "count");
  out.width = width_of(text_member(of, "type"));
  std::string_view bytes;
  std::size_t stride = 0;
  const bool stored = of.contains("bufferView");
  if (stored) {
    const std::uint64_t number = count_member(of, "bufferView");
    bytes = from_offset(view(number), count_member(of, "byteOffset", 0));
    stride = static_cast<std::size_t>(count_member(item("bufferViews", number), "byteStride", 0));
    if (stride > 252) throw InputError("a buffer view has a stride above 252 bytes");
  }
  if (count > (stored ? bytes.size() : kMostZeros / out.width)) {
    throw InputError(fmt::format("an accessor has {} elements, more than its bytes hold", count));
  }
  out.count = static_cast<std::size_t>(count);
  if (stored) {
    read_elements(bytes, stride, component, out);
  } else {
    out.values.resize(out.count * out.width);
  }
  const Json* sparse = of.find("sparse");
  if (sparse != nullptr && sparse->is_object()) fill_sparse(*sparse, of, out);
  const Json* normalised = of.find("normalized");
  if (normalised != nullptr && normalised->is_boolean() && normalised->get<bool>()) {
    for (double& value : out.values) value = std::max(-1.0, value / component.full_scale);
  }
  return out;
}

}  // namespace canyon::meshes
