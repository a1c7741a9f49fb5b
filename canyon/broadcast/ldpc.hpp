#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "canyon/broadcast/bits.hpp"

namespace canyon::broadcast {

/// Systematic LDPC codes of rate 1/2 by the messages that have them. Symbols of BeiDou have six bits and are
/// elements of GF(64) by x^6 + x + 1, the highest power first (BDS-SIS-ICD-B1C-1.0, 6.2.2.2).
enum class LdpcCode {
  Cnav2Subframe2,   ///< (1200, 600), bits
  Cnav2Subframe3,   ///< (548, 274), bits
  Bcnav1Subframe2,  ///< (200, 100)
  Bcnav1Subframe3,  ///< (88, 44)
  Bcnav2,           ///< (96, 48)
  Bcnav3,           ///< (162, 81)
};

/// A symbol of a parity check, counted from 0, and its factor.
struct LdpcTerm {
  std::size_t symbol;
  std::uint8_t factor;
};
/// The rows of the parity-check matrix H: of a code word each sum of symbols times factors is 0.
[[nodiscard]] std::vector<std::vector<LdpcTerm>> parity_checks(LdpcCode code);

/// `information`, then as many parity bits. Precondition: it has the size of the code.
[[nodiscard]] Bits ldpc_encoded(LdpcCode code, const Bits& information);

}  // namespace canyon::broadcast
