#include "canyon/city/meshes/gltf_buffers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/payload.hpp"
#include "canyon/city/meshes/json_values.hpp"

#ifdef CANYON_DRACO
#include <draco/compression/decode.h>
#include <draco/compression/point_cloud/point_cloud_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/metadata_decoder.h>
#endif
#ifdef CANYON_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

namespace canyon::meshes {
namespace {

/// Limit for accessors without stored bytes: all zero except for sparse values.
constexpr std::uint64_t kMaxZeros = std::uint64_t{1} << 20;

template <typename Stored>
double number_at(std::string_view bytes, std::size_t offset) {
  return static_cast<double>(little<Stored>(bytes, offset));
}

/// Storage of an accessor's numbers (glTF 2.0, 3.6.2.2).
struct Component {
  std::uint64_t type;
  std::size_t size;
  double full_scale;  ///< the largest value of a normalised integer; 1 if not normalised
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
  if (found == kComponents.end())
    throw InputError(fmt::format("accessors of component type {} do not exist", type));
  return *found;
}

std::size_t width_of(const std::string& type) {
  static constexpr std::array<std::pair<std::string_view, std::size_t>, 7> kTypes{
      {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}}};
  for (const auto& [name, width] : kTypes)
    if (type == name) return width;
  throw InputError(fmt::format("accessors of type '{}' do not exist", type));
}

void read_elements(std::string_view bytes, std::size_t stride, const Component& component,
                   AccessorValues& out) {
  const std::size_t element = component.size * out.width;
  if (stride == 0) stride = element;
  if (stride < element) throw InputError("the elements of an accessor overlap");
  if (out.count > 0) {
    if (out.count - 1 > bytes.size() / stride) throw InputError("an accessor extends beyond its buffer view");
    (void)piece(bytes, (out.count - 1) * stride, element);
  }
  out.values.resize(out.count * out.width);
  for (std::size_t i = 0; i < out.count; ++i)
    for (std::size_t c = 0; c < out.width; ++c)
      out.values[i * out.width + c] = component.at(bytes, i * stride + c * component.size);
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
  if (found == nullptr || !found->is_array() || index >= found->size())
    throw InputError(fmt::format("{} {} does not exist", list, index));
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
  AccessorValues points, values;
  points.count = values.count = count_member(sparse, "count");
  if (points.count > out.count) throw InputError("a sparse accessor has more values than elements");
  values.width = out.width;
  const Json& at = sparse.at("indices");
  const Json& data = sparse.at("values");
  read_elements(from_offset(view(count_member(at, "bufferView")), count_member(at, "byteOffset", 0)), 0,
                component_of(at), points);
  read_elements(from_offset(view(count_member(data, "bufferView")), count_member(data, "byteOffset", 0)), 0,
                component_of(accessor), values);
  for (std::size_t i = 0; i < points.count; ++i) {
    const double position = points.values[i];
    if (!(position >= 0 && position < static_cast<double>(out.count)))
      throw InputError("a sparse accessor extends beyond its elements");
    std::copy_n(
        values.values.begin() + static_cast<std::ptrdiff_t>(i * out.width), out.width,
        out.values.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(position) * out.width));
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
  if (count > (stored ? bytes.size() : kMaxZeros / out.width))
    throw InputError(fmt::format("an accessor has {} elements, too many for its bytes", count));
  out.count = static_cast<std::size_t>(count);
  if (stored)
    read_elements(bytes, stride, component, out);
  else
    out.values.resize(out.count * out.width);
  const Json* sparse = of.find("sparse");
  if (sparse != nullptr && sparse->is_object()) fill_sparse(*sparse, of, out);
  const Json* normalised = of.find("normalized");
  if (normalised != nullptr && normalised->is_boolean() && normalised->get<bool>())
    for (double& value : out.values) value = std::max(-1.0, value / component.full_scale);
  return out;
}

#ifdef CANYON_MESHOPTIMIZER
namespace {
constexpr std::uint64_t kMaxUnpacked = std::uint64_t{1} << 30;
}
#endif

#ifdef CANYON_MESHOPTIMIZER

std::string unpack_meshopt(std::string_view packed, std::uint64_t count, std::uint64_t stride,
                           const std::string& mode, const std::string& filter) {
  // 256 vertices need at least two bits for each of their bytes, an index needs a byte.
  const bool vertices = mode == "ATTRIBUTES";
  const bool stride_fits =
      vertices ? stride > 0 && stride <= 256 && stride % 4 == 0 : stride == 2 || stride == 4;
  if (!stride_fits || count > kMaxUnpacked / std::max<std::uint64_t>(stride, 1) ||
      count * stride / 1024 > packed.size())
    throw InputError(fmt::format("meshopt data of {} elements of {} bytes are impossible", count, stride));
  std::string out(static_cast<std::size_t>(count * stride), '\0');
  const auto* in = reinterpret_cast<const unsigned char*>(packed.data());
  const auto n = static_cast<std::size_t>(count), size = static_cast<std::size_t>(stride);
  int fault = 1;
  if (vertices)
    fault = meshopt_decodeVertexBuffer(out.data(), n, size, in, packed.size());
  else if (mode == "TRIANGLES" && n % 3 == 0)
    fault = meshopt_decodeIndexBuffer(out.data(), n, size, in, packed.size());
  else if (mode == "INDICES")
    fault = meshopt_decodeIndexSequence(out.data(), n, size, in, packed.size());
  if (fault != 0) throw InputError("the meshopt data are damaged", "get the file again");
  if (filter == "OCTAHEDRAL" && (size == 4 || size == 8))
    meshopt_decodeFilterOct(out.data(), n, size);
  else if (filter == "QUATERNION" && size == 8)
    meshopt_decodeFilterQuat(out.data(), n, size);
  else if (filter == "EXPONENTIAL")
    meshopt_decodeFilterExp(out.data(), n, size);
  else if (!filter.empty() && filter != "NONE")
    throw InputError(fmt::format("meshopt data have the filter '{}', which does not exist", filter));
  return out;
}

#else

std::string unpack_meshopt(std::string_view, std::uint64_t, std::uint64_t, const std::string&,
                           const std::string&) {
  throw InputError("is compressed by EXT_meshopt_compression, and this build has no meshoptimizer",
                   "install libmeshoptimizer-dev and build Canyon again");
}

#endif

#ifdef CANYON_DRACO

namespace {

const draco::PointAttribute* draco_attribute(const draco::Mesh& mesh, int number) {
  return number < 0 ? nullptr : mesh.GetAttributeByUniqueId(static_cast<std::uint32_t>(number));
}

/// Throws if the data are too short for their declared faces or points, because Draco allocates memory for
/// the declared counts. (Bitstream 2.2, as in glTF.)
void check_draco_counts(std::string_view packed) {
  draco::DecoderBuffer in;
  in.Init(packed.data(), packed.size());
  draco::DracoHeader header{};
  std::uint8_t traversal = 0;
  std::uint32_t first = 0, second = 0;
  bool good = draco::PointCloudDecoder::DecodeHeader(&in, &header).ok();
  if (good && (header.flags & METADATA_FLAG_MASK) != 0) {
    draco::GeometryMetadata metadata;
    good = draco::MetadataDecoder().DecodeGeometryMetadata(&in, &metadata);
  }
  if (header.encoder_method == draco::MESH_EDGEBREAKER_ENCODING) good = good && in.Decode(&traversal);
  good = good && draco::DecodeVarint(&first, &in) && draco::DecodeVarint(&second, &in);
  if (!good || header.version_major != 2 || header.version_minor != 2 ||
      std::max(first, second) / 1000 > packed.size())
    throw InputError("the Draco data are damaged, or not of version 2.2", "get the file again");
}

}  // namespace

DracoMesh unpack_draco(std::string_view packed, int position, int feature) {
  check_draco_counts(packed);
  draco::DecoderBuffer buffer;
  buffer.Init(packed.data(), packed.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) {
    throw InputError(fmt::format("the Draco data are damaged: {}", decoded.status().error_msg()),
                     "get the file again");
  }
  const std::unique_ptr<draco::Mesh> mesh = std::move(decoded).value();
  const draco::PointAttribute* locations = draco_attribute(*mesh, position);
  if (locations == nullptr) throw InputError("the Draco data have no positions");
  const draco::PointAttribute* features = draco_attribute(*mesh, feature);
  DracoMesh out;
  const std::uint32_t points = mesh->num_points();
  out.positions.reserve(points);
  for (draco::PointIndex i(0); i < points; ++i) {
    std::array<double, 3> point{};
    std::array<double, 1> id{};
    if (!locations->ConvertValue<double, 3>(locations->mapped_index(i), point.data()))
      throw InputError("the Draco data are damaged", "get the file again");
    out.positions.emplace_back(point[0], point[1], point[2]);
    if (features != nullptr && features->ConvertValue<double, 1>(features->mapped_index(i), id.data()))
      out.features.push_back(id[0]);
  }
  if (out.features.size() != points) out.features.clear();
  for (draco::FaceIndex f(0); f < mesh->num_faces(); ++f) {
    const draco::Mesh::Face& face = mesh->face(f);
    out.triangles.push_back({face[0].value(), face[1].value(), face[2].value()});
  }
  return out;
}

#else

DracoMesh unpack_draco(std::string_view, int, int) {
  throw InputError("is compressed by KHR_draco_mesh_compression, and this build has no Draco",
                   "install libdraco-dev and build Canyon again");
}

#endif

}  // namespace canyon::meshes
