#include "canyon/heatmap/cells/cell_solver.hpp"

#include <string_view>

#include "canyon/options/values.hpp"

namespace canyon::heatmap {

void DrawOptions::validate() const {
  options::check(*this, "map's noise");
}

void visit(options::Visitor& v, DrawOptions& o) {
  v.integer({"draws", "", "noise realizations, for layers over draws"}, o.draws, 1, 10'000);
  v.integer({"seed", "", "of the draws, the same at every cell"}, o.seed);
}

void CellReceiverOptions::validate() const {
  options::check(*this, "map's receivers");
}

void visit(options::Visitor& v, CellReceiverOptions& o) {
  // The name of steady_state was "settled": it is still read, and keys of stores keep it.
  static constexpr std::string_view kRead[]{"steady_state", "run", "settled"}, kInKeys[]{"settled", "run"};
  const std::span<const std::string_view> read(kRead), in_keys(kInKeys);
  v.choice({"model", "",
            "receivers with signal strength: steady_state (steady state of loops and fixes) or run (each "
            "cell's receiver runs, slow)"},
           o.model, v.purpose() == options::Purpose::Values ? in_keys : read.first(v.reads() ? 3 : 2));
  if (o.model == static_cast<ReceiverModel>(2)) o.model = ReceiverModel::SteadyState;
  v.number({"path_nodes_m", "m",
            "steady_state: distance between the points where paths are searched; between them paths are "
            "constructed; 0: search at every cell"},
           o.path_nodes_m, {0, 100});
}

}  // namespace canyon::heatmap
