#pragma once

#include <string>
#include <vector>

#include "canyon/receiver/rtk/recorded_pair.hpp"

namespace canyon::encoding {

/// Writes RTKLIB's format of solutions (".pos", GPST, degrees, ellipsoidal heights), which rtkplot reads: a
/// header with `program`, a line for each solved epoch, quality 1 fixed, 2 float, 4 differential, 5 single
/// (RTKLIB 2.4.2 manual, appendix B.1).
[[nodiscard]] std::string rtklib_solutions(const std::vector<rtk::PairEpoch>& epochs,
                                           const std::string& program);

}  // namespace canyon::encoding
