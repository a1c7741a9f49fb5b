// Declared in canyon/buildings/sources/model_readers.hpp.
#include "canyon/buildings/sources/model_readers.hpp"

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdlib>
#include <set>
#include <string>
#include <vector>

#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/buildings/sources/gml_faces.hpp"

namespace canyon::buildings {
namespace {

constexpr int kMostPasses = 4;  // references to geometries that refer to others, and so on

/// Whether a file's envelope reaches the box; true where its place is not known.
bool reaches_box(const GmlEnvelope& envelope, CityModel& model) {
  if (!model.options().box || envelope.system == nullptr) return true;
  const std::size_t system = model.system(*envelope.system, false, envelope.line);
  std::vector<Eigen::Vector3d> corners;
  for (const double x : {envelope.lower.x(), envelope.upper.x()}) {
    for (const double y : {envelope.lower.y(), envelope.upper.y()})
      corners.push_back(model.east_first(system, {x, y, envelope.lower.z()}));
  }
  model.to_wgs84(system, corners);
  constexpr double kMargin_deg = 1e-3;
  Eigen::AlignedBox2d bounds;
  for (const Eigen::Vector3d& corner : corners) {
    if (!corner.allFinite()) return true;
    bounds.extend(LonLat(corner.head<2>() + LonLat::Constant(kMargin_deg)));
    bounds.extend(LonLat(corner.head<2>() - LonLat::Constant(kMargin_deg)));
  }
  const LonLatBox whole = model.options().box->unwrapped();
  return Eigen::AlignedBox2d(LonLat(whole.west, whole.south), LonLat(whole.east, whole.north))
      .intersects(bounds);
}

/// The handedness() of most of a file's first objects.
int handedness_of(const std::filesystem::path& file, const OpenBytes& open) {
  constexpr int kObjects = 100;
  int asked = 0, told = 0, sum = 0;
  GmlSink sink;
  sink.envelope = [](const GmlEnvelope&) { return true; };
  sink.member = [&](const GmlElement& object) {
    const int hand = handedness(object);
    told += std::abs(hand);
    sum += hand;
    return ++asked < kObjects;
  };
  read_gml(file, open(), sink);
  return 2 * std::abs(sum) > told ? (sum > 0 ? 1 : -1) : 0;
}

/// Copies the elements with those ids into the library.
void find_ids(const GmlElement& element, const std::set<std::string>& wanted, GmlLibrary& library) {
  if (!element.id.empty() && wanted.count(element.id) > 0) library.emplace(element.id, element);
  for (const GmlElement& child : element.children) find_ids(child, wanted, library);
}

/// Elements of a file to which its objects refer and which stand outside them.
class References {
 public:
  References(const std::filesystem::path& file, const OpenBytes& open) : file_(file), open_(open) {}

  /// Reads the file until each of these is found, with what they refer to themselves.
  [[nodiscard]] GmlLibrary find(std::set<std::string> wanted) const {
    GmlLibrary library;
    for (int pass = 0; pass < kMostPasses && !wanted.empty(); ++pass) {
      const std::size_t before = library.size();
      GmlSink sink;
      sink.envelope = [](const GmlEnvelope&) { return true; };
      sink.member = [&](const GmlElement& object) {
        find_ids(object, wanted, library);
        return true;
      };
      read_gml(file_, open_(), sink);
      if (library.size() == before) break;
      wanted.clear();
      for (const auto& [id, element] : library) {
        for (const std::string& missing : references_of(element)) {
          if (library.count(missing) == 0) wanted.insert(missing);
        }
      }
    }
    return library;
  }

 private:
  static std::set<std::string> references_of(const GmlElement& element) {
    std::set<std::string> ids;
    if (!element.href.empty()) ids.insert(element.href.substr(element.href.find('#') + 1));
    for (const GmlElement& child : element.children) ids.merge(references_of(child));
    return ids;
  }

  const std::filesystem::path& file_;
  const OpenBytes& open_;
};

}  // namespace

bool read_citygml(const std::filesystem::path& file, const OpenBytes& open, CityModel& model) {
  std::set<std::string> wanted;
  std::set<std::size_t> waiting;  // numbers of the objects that refer to others
  bool reached = true;
  std::size_t number = 0;
  const GmlLibrary none;
  model.ask_handedness([&] { return handedness_of(file, open); });
  GmlSink sink;
  sink.envelope = [&](const GmlEnvelope& envelope) { return reached = reaches_box(envelope, model); };
  sink.member = [&](const GmlElement& object) {
    const std::size_t own = number++;
    if (!is_gml_object(object.name)) {
      model.leave_out("city objects of type " + object.name, 1, ReadReport::Level::Remark);
      return true;
    }
    std::set<std::string> missing = missing_references(object, none);
    if (missing.empty()) {
      read_gml_object(object, none, model);
    } else {
      wanted.merge(missing);
      waiting.insert(own);
    }
    return true;
  };
  read_gml(file, open(), sink);
  if (!reached || waiting.empty()) return reached;
  const GmlLibrary library = References(file, open).find(wanted);
  number = 0;
  sink.envelope = [](const GmlEnvelope&) { return true; };
  sink.member = [&](const GmlElement& object) {
    if (waiting.count(number++) > 0) read_gml_object(object, library, model);
    return true;
  };
  read_gml(file, open(), sink);
  return true;
}

MapData read_citygml(const std::filesystem::path& path, const CityReadOptions& options) {
  CityModel model(options);
  model.begin_file(path);
  (void)read_citygml(
      path, [&path] { return file_bytes(path); }, model);
  return model.finish(path);
}

}  // namespace canyon::buildings
