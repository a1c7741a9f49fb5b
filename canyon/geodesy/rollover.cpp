#include "canyon/geodesy/rollover.hpp"

#include <fmt/format.h>

#include <cmath>

namespace canyon::geodesy {

std::string rollover_text(GpsTime stated, GpsTime expected) {
  constexpr double kRollover_days = 1024 * 7, kNear_days = 8;
  const double days = (expected - stated) / 86'400;
  const double rollovers = std::round(days / kRollover_days);
  if (rollovers == 0 || std::abs(days - rollovers * kRollover_days) > kNear_days) return {};
  return fmt::format("; {:.0f} weeks {} it would be near: has a receiver's GPS week rolled over?",
                     std::abs(rollovers) * 1024, rollovers > 0 ? "later" : "earlier");
}

}  // namespace canyon::geodesy
