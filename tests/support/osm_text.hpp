#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace canyon::test {

/// A small OSM XML document, object by object.
class OsmText {
 public:
  using Tags = std::vector<std::pair<std::string, std::string>>;
  struct Member {
    std::string type;  ///< node, way, relation
    std::int64_t ref;
    std::string role;
  };

  OsmText& node(std::int64_t id, double lon, double lat, const Tags& tags = {}, int version = 1) {
    body_ += fmt::format(" <node id=\"{}\" version=\"{}\" lat=\"{:.7f}\" lon=\"{:.7f}\">\n", id, version, lat,
                         lon);
    return end("node", tags);
  }
  OsmText& osm_way(std::int64_t id, const std::vector<std::int64_t>& nodes, const Tags& tags = {},
                   int version = 1) {
    body_ += fmt::format(" <way id=\"{}\" version=\"{}\">\n", id, version);
    for (const std::int64_t node : nodes) body_ += fmt::format("  <nd ref=\"{}\"/>\n", node);
    return end("way", tags);
  }
  OsmText& relation(std::int64_t id, const std::vector<Member>& members, const Tags& tags, int version = 1) {
    body_ += fmt::format(" <relation id=\"{}\" version=\"{}\">\n", id, version);
    for (const Member& m : members) {
      body_ += fmt::format("  <member type=\"{}\" ref=\"{}\" role=\"{}\"/>\n", m.type, m.ref, m.role);
    }
    return end("relation", tags);
  }
  /// A square as nodes 10 id to 10 id + 3 and, with tags or not, closed way `id`; south-west corner and side
  /// [deg].
  OsmText& square(std::int64_t id, double lon, double lat, double side, const Tags& tags = {}) {
    const std::int64_t n = 10 * id;
    node(n, lon, lat)
        .node(n + 1, lon + side, lat)
        .node(n + 2, lon + side, lat + side)
        .node(n + 3, lon, lat + side);
    return osm_way(id, {n, n + 1, n + 2, n + 3, n}, tags);
  }

  /// Appends the objects of another document.
  OsmText& append(const OsmText& other) {
    body_ += other.body_;
    return *this;
  }

  [[nodiscard]] std::string text() const {
    return "<?xml version='1.0' encoding='UTF-8'?>\n<osm version=\"0.6\" generator=\"test\">\n" + body_ +
           "</osm>\n";
  }
  std::filesystem::path write(const std::filesystem::path& path) const {
    std::ofstream(path, std::ios::binary) << text();
    return path;
  }

 private:
  OsmText& end(const std::string& element, const Tags& tags) {
    for (const auto& [key, value] : tags) {
      body_ += fmt::format("  <tag k=\"{}\" v=\"{}\"/>\n", key, value);
    }
    body_ += " </" + element + ">\n";
    return *this;
  }

  std::string body_;
};

}  // namespace canyon::test
