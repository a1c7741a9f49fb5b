// Declared in canyon/city/meshes/gltf_buffers.hpp.
#include "canyon/city/meshes/gltf_buffers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "canyon/base/input_error.hpp"

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

#ifdef CANYON_MESHOPTIMIZER
namespace {
constexpr std::uint64_t kMostUnpacked = std::uint64_t{1} << 30;
}
#endif

#ifdef CANYON_MESHOPTIMIZER

std::string unpack_meshopt(std::string_view packed, std::uint64_t count, std::uint64_t stride,
                           const std::string& mode, const std::string& filter) {
  // 256 vertices take at least two bits for each of their bytes, an index takes a byte.
  const bool vertices = mode == "ATTRIBUTES";
  const bool stride_fits =
      vertices ? stride > 0 && stride <= 256 && stride % 4 == 0 : stride == 2 || stride == 4;
  if (!stride_fits || count > kMostUnpacked / std::max<std::uint64_t>(stride, 1) ||
      count * stride / 1024 > packed.size()) {
    throw InputError(fmt::format("meshopt data of {} elements of {} bytes are not possible", count, stride));
  }
  std::string out(static_cast<std::size_t>(count * stride), '\0');
  const auto* in = reinterpret_cast<const unsigned char*>(packed.data());
  const auto n = static_cast<std::size_t>(count), size = static_cast<std::size_t>(stride);
  int fault = 1;
  if (vertices) {
    fault = meshopt_decodeVertexBuffer(out.data(), n, size, in, packed.size());
  } else if (mode == "TRIANGLES" && n % 3 == 0) {
    fault = meshopt_decodeIndexBuffer(out.data(), n, size, in, packed.size());
  } else if (mode == "INDICES") {
    fault = meshopt_decodeIndexSequence(out.data(), n, size, in, packed.size());
  }
  if (fault != 0) throw InputError("the meshopt data are damaged", "get the file again");
  if (filter == "OCTAHEDRAL" && (size == 4 || size == 8)) {
    meshopt_decodeFilterOct(out.data(), n, size);
  } else if (filter == "QUATERNION" && size == 8) {
    meshopt_decodeFilterQuat(out.data(), n, size);
  } else if (filter == "EXPONENTIAL") {
    meshopt_decodeFilterExp(out.data(), n, size);
  } else if (!filter.empty() && filter != "NONE") {
    throw InputError(fmt::format("meshopt data have the filter '{}', which does not exist", filter));
  }
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

/// Throws for more faces or points than so few bytes hold: Draco takes memory for what the data say. (Its
/// bitstream 2.2, the one of glTF.)
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
  const draco::PointAttribute* places = draco_attribute(*mesh, position);
  if (places == nullptr) throw InputError("the Draco data have no positions");
  const draco::PointAttribute* features = draco_attribute(*mesh, feature);
  DracoMesh out;
  const std::uint32_t points = mesh->num_points();
  out.positions.reserve(points);
  for (draco::PointIndex i(0); i < points; ++i) {
    std::array<double, 3> place{};
    std::array<double, 1> id{};
    if (!places->ConvertValue<double, 3>(places->mapped_index(i), place.data()))
      throw InputError("the Draco data are damaged", "get the file again");
    out.positions.emplace_back(place[0], place[1], place[2]);
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
