#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "canyon/buildings/city_builder.hpp"
#include "canyon/geodesy/gps_time.hpp"

namespace canyon::heatmap {
class StoredMap;
}

namespace canyon::cli {

/// The heat map of `canyon view`, alone or over a city.
class ViewedMap {
 public:
  struct Wanted {
    std::string input;      ///< what is viewed
    std::string map;        ///< --map; empty: none
    std::string city;       ///< --city; empty: none
    bool finished = false;  ///< `input` is a finished view: its city is a picture, no city to stand on
    bool quiet = false;
  };
  /// Reads the map and loads its city. Throws InputError for options that do not go together.
  explicit ViewedMap(const Wanted& wanted);
  ~ViewedMap();
  ViewedMap(const ViewedMap&) = delete;
  ViewedMap& operator=(const ViewedMap&) = delete;

  /// Whether there is a map.
  explicit operator bool() const { return map_ != nullptr; }
  /// The map is all that is viewed.
  [[nodiscard]] bool alone() const { return alone_; }
  /// The city of --city, else an empty field about the map.
  [[nodiscard]] const buildings::BuiltCity& city() const { return city_; }
  /// Its first time. Precondition: there is a map.
  [[nodiscard]] geodesy::GpsTime begin() const;
  /// Precondition: there is a map.
  void add_to(const std::filesystem::path& folder) const;

 private:
  std::unique_ptr<heatmap::StoredMap> map_;
  std::string name_;
  bool alone_ = false;
  buildings::BuiltCity city_;
};

/// Copies the files of a view to another folder.
void copy_view(const std::filesystem::path& from, const std::filesystem::path& folder);

}  // namespace canyon::cli
