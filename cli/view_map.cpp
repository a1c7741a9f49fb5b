#include "cli/view_map.hpp"

#include <fmt/format.h>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/heatmap/engine/map_source.hpp"
#include "canyon/view/map_view.hpp"
#include "cli/city_commands.hpp"

namespace canyon::cli {

ViewedMap::ViewedMap(const Wanted& wanted)
    : alone_(std::filesystem::path(wanted.input).extension() == ".nc") {
  if (alone_ && !wanted.map.empty()) {
    throw InputError("--map beside a map", "give the city or run that it is laid over, or no --map");
  }
  const std::string file = alone_ ? wanted.input : wanted.map;
  if (file.empty()) {
    if (!wanted.city.empty() && !(wanted.finished && is_scenario(wanted.city))) {
      throw InputError("--city without a heat map or a finished run",
                       "it is the city that a map (--map MAP.nc) is shown in, or a finished run's scenario");
    }
    return;
  }
  if (wanted.finished && wanted.city.empty()) {
    throw InputError("--map over a finished run needs its city", "give --city the run's scenario");
  }
  map_ = std::make_unique<heatmap::StoredMap>(file);
  name_ = fmt::format("{}, receiver {}", std::filesystem::path(file).stem().string(), map_->motion());
  const std::string city = !wanted.city.empty() ? wanted.city : alone_ ? "" : wanted.input;
  if (city.empty()) {
    city_.city = view::field_of(*map_);
  } else {
    city_ = read_city(city_config(city), "building the city", wanted.quiet);
  }
}

ViewedMap::~ViewedMap() = default;

geodesy::GpsTime ViewedMap::begin() const {
  return map_->times().front();
}

void ViewedMap::add_to(const std::filesystem::path& folder) const {
  view::add_map(*map_, name_, city_.city, folder);
}

void copy_view(const std::filesystem::path& from, const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::copy(
      from, folder,
      std::filesystem::copy_options::recursive | std::filesystem::copy_options::overwrite_existing, error);
  if (error) throw InputError(from, 0, "cannot be copied: " + error.message(), "give --out another folder");
}

}  // namespace canyon::cli
