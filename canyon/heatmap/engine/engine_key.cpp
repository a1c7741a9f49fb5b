#include "canyon/heatmap/engine/engine_key.hpp"

#include <fmt/format.h>

#include <string_view>
#include <type_traits>

#include "canyon/base/text.hpp"
#include "canyon/options/values.hpp"
#include "canyon/simulation/scenario.hpp"

namespace canyon::heatmap {
namespace {

class Lines {
 public:
  template <class Value>
  Lines& operator()(std::string_view name, const Value& value) {
    if constexpr (std::is_enum_v<Value>) {
      text_ += fmt::format("{}: {}\n", name, static_cast<long long>(value));
    } else {
      text_ += fmt::format("{}: {}\n", name, value);  // the shortest digits that read back the same
    }
    return *this;
  }
  [[nodiscard]] std::string text() && { return std::move(text_); }

 private:
  std::string text_;
};

void add(Lines& line, const Request& request) {
  const Grid& grid = request.grid;
  line("grid.west_m", grid.west_m)("grid.south_m", grid.south_m)("grid.spacing_m", grid.spacing_m);
  line("grid.columns", grid.columns)("grid.rows", grid.rows)("grid.tile_size", grid.tile_size);
  if (request.area) {
    for (const std::vector<Eigen::Vector2d>& ring : request.area->rings) {
      line("ring", ring.size());
      for (const Eigen::Vector2d& point : ring) line("east_m", point.x())("north_m", point.y());
    }
  }
  line("altitude_kind", request.altitude_kind);
  for (const double altitude_m : request.altitudes_m) line("altitude_m", altitude_m);
  for (const geodesy::GpsTime time : request.times) line("time_ns", time.nanoseconds());
  for (const Layer layer : request.layers) line("layer", info(layer).name);
  line("draws", request.draws.draws)("seed", request.draws.seed);
}

}  // namespace

std::string canonical_text(const Request& request, const simulation::ReceiverConfig& receiver,
                           const std::map<gnss::System, gnss::Klobuchar>& klobuchar) {
  Lines lines;
  add(lines, request);
  lines("receiver", receiver.options.name);
  for (const disturbance::Source& source : receiver.disturbances) lines("disturbance", source.name);
  for (const auto& [system, coefficients] : klobuchar) {
    lines("klobuchar", system);
    for (const double alpha : coefficients.alpha) lines("alpha", alpha);
    for (const double beta : coefficients.beta) lines("beta", beta);
  }
  return std::move(lines).text() + options::exact_text(receiver.propagation) +
         options::exact_text(receiver.options);
}

std::string hash_text(const std::string& text) {
  return fmt::format("{:016x}{:016x}", fnv1a(text), fnv1a("heat map\n" + text));
}

}  // namespace canyon::heatmap
