#include "canyon/city/tiles/read_tiles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/city/tiles/tile_content.hpp"
#include "canyon/city/tiles/tile_mesh.hpp"
#include "canyon/city/tiles/tile_selection.hpp"
#include "canyon/city/tiles/tile_source.hpp"

namespace canyon::tiles {
namespace {

constexpr std::size_t kTilesAtATime = 64;
constexpr std::size_t kNamedGaps = 5;
constexpr double kMaxCity_m = 200e3;
constexpr double kGroundFraction = 0.05;

Eigen::Matrix4d enu_from_ecef(const geodesy::LocalFrame& frame) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = frame.ecef_from_local_rotation().transpose();
  matrix.topRightCorner<3, 1>() = frame.local_from_ecef(Eigen::Vector3d::Zero());
  return matrix;
}

std::string file_stem(const std::string& address) {
  const std::string bare = public_address(address);
  const std::size_t slash = bare.find_last_of('/');
  const std::string name = slash == std::string::npos ? bare : bare.substr(slash + 1);
  return name.substr(0, name.find_last_of('.'));
}

std::string counted(std::size_t count, const char* noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

class TilesReader {
 private:
  /// Adds the tileset to an error without a file name, without its keys.
  template <typename Read>
  auto name_root(const Read& read) {
    try {
      return read();
    } catch (const InputError& error) {
      throw InputError(public_address(source_.root()), 0, error.problem(), error.hint());
    } catch (const JsonError& error) {
      throw InputError(public_address(source_.root()), 0, fmt::format("is not valid JSON: {}", error.what()),
                       "get the tileset again");
    }
  }

 public:
  TilesReader(const TileOptions& options, const std::optional<geodesy::Geodetic>& origin)
      : options_(options), origin_(origin), source_(options) {}

  TilesCity read(const std::function<void(std::size_t, std::size_t)>& progress) {
    const TilesetRoot root = name_root([&] { return read_root(source_); });
    out_.georeferenced = root.on_earth;
    set_origin(root);
    const TileSelection selection = name_root([&] { return select_tiles(source_, area_, options_); });
    gaps_ = selection.gaps;
    read_contents(selection, progress);
    check_content(selection);
    finish(selection);
    return std::move(out_);
  }

 private:
  /// Sets the frame in which tiles are read, and the area.
  void set_origin(const TilesetRoot& root) {
    std::optional<geodesy::Geodetic> middle = origin_;
    if (options_.bbox_deg) {
      const auto& [west, south, east, north] = *options_.bbox_deg;
      middle = geodesy::Geodetic::from_degrees((south + north) / 2, (west + east) / 2,
                                               origin_ ? origin_->height_m : 0);
    } else if (root.on_earth && root.centre) {
      middle = geodesy::geodetic_from_ecef(*root.centre);
      middle->height_m = 0;
    }
    if (root.on_earth && !middle) {
      throw InputError(public_address(source_.root()), 0, "is larger than 200 km, and no area is given",
                       "give city.tiles.bbox: [west, south, east, north] in degrees");
    }
    if (!root.on_earth) {
      if (options_.bbox_deg && !origin_) {
        throw InputError(public_address(source_.root()), 0, "is not georeferenced, so a bbox cannot be used",
                         "give city.origin, the position of the tileset's zero");
      }
      frame_ = geodesy::LocalFrame(origin_.value_or(geodesy::Geodetic{}));
      if (options_.bbox_deg) area_ = TileArea(*options_.bbox_deg, frame_, true);
      return;
    }
    frame_ = geodesy::LocalFrame(*middle);
    enu_from_root_ = enu_from_ecef(frame_);
    if (options_.bbox_deg) area_ = TileArea(*options_.bbox_deg, frame_, false);
  }

  void read_contents(const TileSelection& selection,
                     const std::function<void(std::size_t, std::size_t)>& progress) {
    const std::vector<SelectedTile>& tiles = selection.tiles;
    for (std::size_t begin = 0; begin < tiles.size(); begin += kTilesAtATime) {
      const std::size_t end = std::min(tiles.size(), begin + kTilesAtATime);
      std::vector<std::string> addresses;
      for (std::size_t i = begin; i < end; ++i) addresses.push_back(tiles[i].address);
      source_.prefetch(addresses);
      for (std::size_t i = begin; i < end; ++i) {
        read_content_of(tiles[i]);
        if (progress) progress(i + 1, tiles.size());
      }
    }
  }

  void read_content_of(const SelectedTile& tile) {
    try {
      const std::string bytes = source_.read(tile.address);
      TileContent content = read_content(bytes, tile.up, [&](const std::string& uri) {
        return source_.read(source_.resolve(tile.address, uri));
      });
      for (const std::string& kind : content.left_out) ++left_out_[kind];
      for (const PosedModel& posed : content.models)
        if (!posed.model.copyright.empty()) copyrights_.insert(posed.model.copyright);
      mesh_.add(content, enu_from_root_ * tile.transform, file_stem(tile.address));
      ++out_.tiles;
    } catch (const InputError& error) {
      gaps_.push_back(gap_line(tile.address, error));
    } catch (const JsonError& error) {
      gaps_.push_back(gap_line(tile.address, error));
    }
  }

  void check_content(const TileSelection& selection) {
    if (mesh_.triangles() > 0) return;
    std::string problem = "has no triangle";
    if (!gaps_.empty())
      problem = fmt::format("no tile can be read; {}", gaps_.front());
    else if (selection.tiles.empty() && options_.bbox_deg)
      problem = "no tile touches the area";
    else if (selection.tiles.empty())
      problem = "no tile of it has content";
    else if (!left_out_.empty())
      problem = fmt::format("has no triangle, only {}", left_out_.begin()->first);
    throw InputError(
        public_address(source_.root()), 0, problem,
        options_.bbox_deg && gaps_.empty() ? "give a bbox in which the tileset has content" : "");
  }

  void finish(const TileSelection& selection) {
    city::City& city = out_.city;
    city.name = file_stem(source_.root());
    if (city.name == "tileset" && options_.file) {
      const std::filesystem::path& file = *options_.file;
      city.name = (is_archive(file) ? file.stem() : file.parent_path().filename()).string();
    }
    if (city.name.empty()) city.name = "tileset";
    city.mesh = std::move(mesh_.mesh());
    if (!mesh_.skin().triangles.empty()) skin_notes_ = append_skin(mesh_.skin(), city.mesh);
    city.frame = frame_;
    if (out_.georeferenced) resolve_origin(city);
    const city::Box box = city.bounds();
    const Eigen::Vector3d size = box.max - box.min;
    if (size.head<2>().maxCoeff() > kMaxCity_m) {
      throw InputError(public_address(source_.root()), 0,
                       fmt::format("the tiles extend over {:.0f} km", size.head<2>().maxCoeff() / 1000),
                       "the limit is 200 km: give a bbox");
    }
    const double farthest_m = std::max(box.min.cwiseAbs().maxCoeff(), box.max.cwiseAbs().maxCoeff());
    if (farthest_m > kMaxCity_m) {
      throw InputError(public_address(source_.root()), 0,
                       fmt::format("the tiles are {:.0f} km from city.origin", farthest_m / 1000),
                       "give the right origin, or leave it out");
    }
    city::check_mesh(city.mesh, city.name);
    write_notes(selection);
  }

  /// Moves the city to the frame about its origin.
  void resolve_origin(city::City& city) const {
    geodesy::Geodetic origin = frame_.origin();
    if (origin_) {
      origin = *origin_;
    } else {
      std::vector<double> heights;
      Eigen::Vector3d middle = Eigen::Vector3d::Zero();
      const city::Box box = city.bounds();
      middle.head<2>() = (box.min + box.max).head<2>() / 2;
      for (const Eigen::Vector3d& v : city.mesh.vertices) heights.push_back(v.z());
      const auto low = heights.begin() +
                       static_cast<std::ptrdiff_t>(kGroundFraction * static_cast<double>(heights.size()));
      std::nth_element(heights.begin(), low, heights.end());
      middle.z() = *low;
      origin = frame_.geodetic_from_local(middle);
      origin.height_m = std::round(origin.height_m * 10) / 10 + 0.0;
    }
    const geodesy::LocalFrame frame(origin);
    for (Eigen::Vector3d& v : city.mesh.vertices) v = frame.local_from_ecef(frame_.ecef_from_local(v));
    city.frame = frame;
  }

  void write_notes(const TileSelection& selection) {
    using Level = ReadReport::Level;
    ReadReport& notes = out_.city.notes;
    const auto remark = [&notes](const std::string& line) { notes.add_line(Level::Remark, line); };
    remark(fmt::format("3D Tiles {}: {} of {}{}, {} triangles; geometric errors to {:g} m (error_m {:g})",
                       selection.version, counted(out_.tiles, "tile"), counted(selection.tilesets, "tileset"),
                       selection.subtrees > 0 ? " and " + counted(selection.subtrees, "subtree") : "",
                       mesh_.triangles(), selection.coarsest_m, options_.error_m));
    if (options_.bbox_deg)
      remark(fmt::format("{} with all descendants are outside the area and are not read",
                         counted(selection.beyond, "tile")));
    if (source_.downloaded_files() > 0) {
      remark(fmt::format("{} files downloaded, {:.1f} MB", source_.downloaded_files(),
                         static_cast<double>(source_.downloaded_bytes()) / 1e6));
    }
    if (out_.georeferenced)
      remark("heights are ellipsoidal: 3D Tiles are earth-centred (EPSG:4978)");
    else if (origin_)
      remark("the tileset is not georeferenced: read as east, north, up in metres about the origin");
    else
      notes.add_line(Level::Guess,
                     "the tileset is not georeferenced; give city.origin, the position of its zero");
    notes.add_line(Level::Remark, mesh_.notes());
    notes.add_line(Level::Remark, skin_notes_);
    for (const auto& [kind, count] : left_out_)
      remark(fmt::format("{} with {}, which {} no surface to read, left out", counted(count, "tile"), kind,
                         "have"));
    std::size_t named = 0;
    for (const std::string& text : copyrights_)
      if (++named <= kNamedGaps) remark("copyright: " + text);
    if (copyrights_.size() > kNamedGaps)
      remark(fmt::format("copyright: {} more", copyrights_.size() - kNamedGaps));
    out_.gaps = gaps_.size();
    if (gaps_.empty()) return;
    notes.add_line(Level::Loss, fmt::format("{} could not be read; the city has gaps there",
                                            counted(gaps_.size(), "tile")));
    for (const std::string& gap : gaps_) notes.add_line(Level::Loss, "gap: " + gap);
  }

  TileOptions options_;
  std::optional<geodesy::Geodetic> origin_;
  TileSource source_;
  TileMesh mesh_;
  TileArea area_;
  geodesy::LocalFrame frame_;
  Eigen::Matrix4d enu_from_root_ = Eigen::Matrix4d::Identity();
  TilesCity out_;
  std::vector<std::string> gaps_, skin_notes_;
  std::map<std::string, std::size_t> left_out_;
  std::set<std::string> copyrights_;
};

}  // namespace

TilesCity read_tiles(const TileOptions& options, const std::optional<geodesy::Geodetic>& origin,
                     const std::function<void(std::size_t, std::size_t)>& progress) {
  options.validate();
  return TilesReader(options, origin).read(progress);
}

}  // namespace canyon::tiles
