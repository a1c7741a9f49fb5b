#include "canyon/positioning/residual.hpp"

#include <algorithm>

namespace canyon::positioning {

std::optional<double> residual_m(const Fix& fix, gnss::SatelliteId id) {
  const auto at = std::lower_bound(fix.used.begin(), fix.used.end(), id);
  const auto index = static_cast<std::size_t>(at - fix.used.begin());
  if (!fix.solved() || at == fix.used.end() || *at != id || index >= fix.residuals_m.size()) return {};
  return fix.residuals_m[index];
}

}  // namespace canyon::positioning
