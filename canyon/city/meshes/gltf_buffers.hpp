#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/json.hpp"
#include "canyon/city/meshes/gltf_model.hpp"
#include "canyon/city/meshes/polygon.hpp"

namespace canyon::meshes {

/// "%41" as "A".
[[nodiscard]] std::string percent_decoded(std::string_view text);
/// The bytes of a data: URI (RFC 2397); empty for any other. Throws InputError for one without data.
[[nodiscard]] std::optional<std::string> data_of(std::string_view uri);

/// Numbers of an accessor, `width` per element.
struct AccessorValues {
  std::size_t count = 0;
  std::size_t width = 1;
  std::vector<double> values;
};

/// The buffers, views and accessors of a glTF asset (glTF 2.0, 3.6). All members throw InputError for values
/// out of bounds.
class GltfBuffers {
 public:
  /// Keeps references. @param binary the binary chunk of a GLB; empty without
  GltfBuffers(const Json& asset, std::string_view binary, const FetchBytes& fetch)
      : asset_(asset), binary_(binary), fetch_(fetch) {}

  /// Item `index` of the list `list` of the asset.
  [[nodiscard]] const Json& item(std::string_view list, std::uint64_t index) const;
  /// Bytes of a buffer view, decompressed if EXT_meshopt_compression is present.
  [[nodiscard]] std::string_view view(std::uint64_t index);
  /// An accessor's numbers with sparse values applied and normalised integers as fractions.
  [[nodiscard]] AccessorValues accessor(std::uint64_t index);

 private:
  std::string_view buffer(std::uint64_t index);
  std::string_view raw_view(const Json& view);
  void fill_sparse(const Json& sparse, const Json& accessor, AccessorValues& out);

  const Json& asset_;
  std::string_view binary_;
  const FetchBytes& fetch_;
  std::map<std::uint64_t, std::string> loaded_, unpacked_;
};

// The parts of compressed glTF that need other libraries. Builds without them name the package in an error.
/// The bytes of a buffer view packed by EXT_meshopt_compression: `count` elements of `stride` bytes. Throws
/// InputError for damaged data, over 1,024 bytes per packed byte, and without meshoptimizer.
[[nodiscard]] std::string unpack_meshopt(std::string_view packed, std::uint64_t count, std::uint64_t stride,
                                         const std::string& mode, const std::string& filter);

/// The attributes and triangles used from a Draco-compressed primitive.
struct DracoMesh {
  std::vector<Eigen::Vector3d> positions;
  std::vector<double> features;  ///< empty if not requested
  TriangleList triangles;
};
/// Attributes by their unique numbers in the packed data; -1: none. Throws InputError for damaged data, and
/// in builds without Draco.
[[nodiscard]] DracoMesh unpack_draco(std::string_view packed, int position, int feature);

}  // namespace canyon::meshes
