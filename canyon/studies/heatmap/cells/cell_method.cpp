#include "canyon/studies/heatmap/cells/cell_method.hpp"

#include <algorithm>
#include <span>
#include <string_view>

#include "canyon/base/options/values.hpp"
#include "canyon/studies/heatmap/cells/cell_receivers.hpp"
#include "canyon/studies/heatmap/cells/cell_values.hpp"
#include "canyon/studies/heatmap/cells/shared_cells.hpp"
#include "canyon/studies/heatmap/cells/steady_receivers.hpp"

namespace canyon::heatmap {
namespace {

/// Iterations that surely reach the fix that CellFix computes.
constexpr int kIterations = 20;

/// Whether the receiver has something switched on that cells cannot follow without running it.
bool must_run(const simulation::ReceiverConfig& receiver) {
  const receiver::ReceiverOptions& options = receiver.options;
  return !receiver.disturbances.empty() || receiver.streets.enabled ||
         options.fix_input.combination != receiver::Combination::First || !options.fix_input.uses.empty() ||
         options.fix.raim.enabled || options.fix.max_iterations < kIterations || options.filter.enabled ||
         options.dead_reckoning.enabled || options.rtk.enabled || options.fix_noise.any() ||
         !options.corrections.from.empty();
}

bool needs_protection(Layer layer) {
  return layer == Layer::ProtectionLevel || layer == Layer::ProtectedAvailability ||
         layer == Layer::MisleadingShare;
}

}  // namespace

CellMethod cell_method(const simulation::ReceiverConfig& receiver) {
  if (must_run(receiver)) return CellMethod::Run;
  const receiver::ReceiverOptions& options = receiver.options;
  if (options.signal.enabled) {
    const bool steady =
        !options.noise.drift_enabled && receiver.propagation.model == propagation::Model::Specular;
    return steady ? CellMethod::Steady : CellMethod::Run;
  }
  const bool by_cn0 = options.fix.weights.weighting == positioning::Weighting::Cn0;
  return by_cn0 ? CellMethod::Run : CellMethod::Shared;
}

std::vector<std::unique_ptr<const CellSolver>> cell_solvers(const simulation::Environment& environment,
                                                            const TileTracer& tracer,
                                                            const CellReceiver& receiver,
                                                            std::span<const Layer> layers) {
  std::vector<std::unique_ptr<const CellSolver>> solvers;
  const auto wants = [&](const auto& is) { return std::any_of(layers.begin(), layers.end(), is); };
  const simulation::ReceiverConfig& config = receiver.config;
  CellMethod method = cell_method(config);
  if (method == CellMethod::Steady && receiver.how.model == ReceiverModel::Run) method = CellMethod::Run;
  // Residuals differ between cells that receive the same satellites.
  if (method == CellMethod::Shared && config.options.fix.covariance_by_residuals && wants(needs_protection)) {
    method = CellMethod::Run;
  }
  if (!wants(needs_signals)) method = CellMethod::Shared;  // SatellitesLos needs no receiver
  if (wants(of_solver)) {
    if (method == CellMethod::Shared) {
      solvers.push_back(std::make_unique<SharedCells>(
          tracer, SharedReceiver{config.options, receiver.draws, environment.klobuchar(), receiver.limits}));
    } else if (method == CellMethod::Steady) {
      solvers.push_back(std::make_unique<SteadyReceivers>(environment, tracer.propagator(), config,
                                                          receiver.draws, receiver.limits,
                                                          receiver.how.path_nodes_m, receiver.movement));
    } else {
      solvers.push_back(std::make_unique<CellReceivers>(environment, tracer.propagator(), config,
                                                        receiver.draws, receiver.limits));
    }
  }
  if (wants(of_rtk)) {
    solvers.push_back(std::make_unique<CellRtk>(environment, tracer.propagator(), config, *receiver.base,
                                                receiver.draws, receiver.limits));
  }
  return solvers;
}

void DrawOptions::validate() const {
  options::check(*this, "map's noise");
}

void visit(options::Visitor& v, DrawOptions& o) {
  v.integer({"draws", "", "noise realizations, for layers over draws"}, o.draws, 1, 10'000);
  v.integer({"seed", "", "of the draws, the same at every cell"}, o.seed);
}

void visit(options::Visitor& v, CellReceiverOptions& o) {
  static constexpr std::string_view kModels[]{"steady_state", "run"};
  v.choice({"model", "",
            "receivers with signal strength: steady_state (steady state of loops and fixes) or run (each "
            "cell's receiver runs, slow)"},
           o.model, kModels);
  v.number({"path_nodes_m", "m",
            "steady_state: distance between the points where paths are searched; between them paths are "
            "constructed; 0: search at every cell"},
           o.path_nodes_m, {0, 100});
}

}  // namespace canyon::heatmap
