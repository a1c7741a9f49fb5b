#include "canyon/heatmap/cells/cell_method.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <string_view>

#include "canyon/base/text.hpp"
#include "canyon/heatmap/cells/cell_solver.hpp"
#include "canyon/options/describe.hpp"
#include "canyon/options/values.hpp"

namespace canyon::heatmap {
namespace {

using receiver::ReceiverOptions;

/// Paths of fields as in options::exact_text(), with blanks between; one that ends in '.' is a whole section.
struct Fields {
  std::string_view follows;  ///< the method computes with them
  std::string_view skips;    ///< they change no first epoch of a receiver at rest
  std::string_view runs;     ///< only a receiver that runs follows them
};

// Without strength, signals have no carriers, thresholds and C/N0. Heatmap looks at covariance_by_residuals,
// TileTracer at what is tracked, fits() at the choice of weights.
constexpr Fields kShared{
    "elevation_mask_deg min_satellites max_pdop max_iterations convergence_m correct_ionosphere "
    "correct_troposphere weights.weighting weights.elevation_a_m weights.elevation_b_m ionosphere "
    "troposphere orbit_errors noise.enabled noise.theta_per_s noise.mu_m noise.sigma_m_per_sqrt_s "
    "noise.drift.",
    "own_draws tracks leaves_out at_once signal. cn0_mask_dbhz weights.cn0_floor_m2 weights.cn0_scale_m2_hz "
    "covariance_by_residuals clock. noise.doppler_sigma_hz spoofing_check. raim. position_filter.",
    "combination uses ionosphere_sigma_m sigma_factor smoothing. corrections. rtk. biases."};

// Options of later epochs, carriers, iterations, several signals in the fix and interference are skipped.
constexpr Fields kSteady{
    "tracks leaves_out sigma_factor elevation_mask_deg cn0_mask_dbhz min_satellites max_pdop "
    "correct_ionosphere correct_troposphere covariance_by_residuals weights.weighting "
    "weights.elevation_a_m weights.elevation_b_m weights.cn0_floor_m2 weights.cn0_scale_m2_hz "
    "ionosphere troposphere orbit_errors biases.code_m biases.glonass_channel_m biases.drift_sigma_m "
    "signal.enabled signal.antenna signal.antenna_rows signal.antenna_lower_rows signal.link. "
    "signal.offset_db signal.installation signal.installation_sigma_db signal.satellite_sigma_db "
    "signal.strength. signal.shadowing. "
    "signal.front_end_bandwidth_hz signal.wide_front_end_bandwidth_hz signal.dll.discriminator "
    "signal.dll.spacing_chips signal.dll.loop_bandwidth_hz signal.dll.integration_s "
    "signal.lock.acquisition_threshold_dbhz signal.lock.tracking_threshold_dbhz "
    "signal.cn0_sigma_db signal.cn0_step_db signal.loop_noise noise.enabled noise.theta_per_s "
    "noise.mu_m noise.sigma_m_per_sqrt_s",
    "own_draws at_once smoothing.method smoothing.window_s ionosphere_sigma_m max_iterations convergence_m "
    "biases.drift_time_s signal.dll.peak_check_s signal.pll.loop_bandwidth_hz signal.pll.integration_s "
    "signal.fll.loop_bandwidth_hz signal.fll.integration_s signal.fll.noise_factor "
    "signal.phase_threshold_dbhz signal.lock.cold_acquisition_s signal.lock.reacquisition_s "
    "signal.lock.hold_s signal.lock.memory_s signal.lock.warm_start noise.drift.below_speed_mps "
    "noise.drift.below_los noise.drift.mu_sigma_m signal.front_end_compression_dbm clock. "
    "noise.doppler_sigma_hz spoofing_check. raim. position_filter.",
    "combination uses corrections. rtk. noise.drift.enabled"};

const Fields& fields_of(CellMethod method) {
  return method == CellMethod::Shared ? kShared : kSteady;
}

int count_in(std::string_view list, std::string_view path) {
  const std::vector<std::string_view> names = split_blanks(list);
  return static_cast<int>(std::count_if(names.begin(), names.end(), [&](std::string_view name) {
    return name.back() == '.' ? path.starts_with(name) : path == name;
  }));
}

/// Paths of the fields that have not their default.
std::vector<std::string> changed_fields(const ReceiverOptions& options) {
  const std::string text = options::exact_text(options),
                    default_text = options::exact_text(ReceiverOptions());
  std::vector<std::string_view> lines = split(text, '\n'), defaults = split(default_text, '\n'), changed;
  std::sort(lines.begin(), lines.end());
  std::sort(defaults.begin(), defaults.end());
  std::set_symmetric_difference(lines.begin(), lines.end(), defaults.begin(), defaults.end(),
                                std::back_inserter(changed));
  std::vector<std::string> paths;
  for (const std::string_view line : changed) paths.emplace_back(line.substr(0, line.find(": ")));
  return paths;
}

bool fits_shared(const ReceiverOptions& o) {
  return !o.signal.enabled && !o.filter.enabled && !o.fix.raim.enabled &&
         o.fix.weights.weighting != positioning::Weighting::Cn0 &&
         o.fix.max_iterations >= CellSolver::kIterations && o.fix.convergence_m <= CellSolver::kConvergence_m;
}

bool fits_steady(const simulation::ReceiverConfig& receiver) {
  const ReceiverOptions& o = receiver.options;
  return o.signal.enabled && !o.fix.raim.enabled && !o.filter.enabled &&
         receiver.propagation.model == propagation::Model::Specular;
}

}  // namespace

bool fits(CellMethod method, const simulation::ReceiverConfig& receiver) {
  if (method == CellMethod::Run) return true;
  if (!receiver.disturbances.empty() || receiver.streets.enabled) return false;
  if (!(method == CellMethod::Shared ? fits_shared(receiver.options) : fits_steady(receiver))) return false;
  const Fields& fields = fields_of(method);
  const std::vector<std::string> changed = changed_fields(receiver.options);
  return std::all_of(changed.begin(), changed.end(), [&](const std::string& path) {
    return count_in(fields.follows, path) + count_in(fields.skips, path) > 0;
  });
}

std::vector<std::string> unlisted_fields(CellMethod method) {
  const Fields& fields = fields_of(method);
  std::vector<std::string> paths = options::describe(ReceiverOptions()).paths();
  std::erase_if(paths, [&](const std::string& path) {
    return count_in(fields.follows, path) + count_in(fields.skips, path) + count_in(fields.runs, path) == 1;
  });
  return paths;
}

}  // namespace canyon::heatmap
