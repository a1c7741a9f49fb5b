#pragma once

namespace canyon::broadcast {

/// User range accuracy index, 0 to 15, of the accuracy that a navigation file states [m]: the first whose
/// nominal value reaches it (IS-GPS-200 20.3.3.3.1.3: 2, 2.8, 4, 5.7, 8, 11.3, 16, 32 to 6144; also QZSS and
/// BeiDou, BDS-SIS-ICD-B1I 5.2.4.5; index 0 also 2.4). 15, no prediction, beyond.
[[nodiscard]] int accuracy_index(double accuracy_m);
/// Galileo's SISA index (OS SIS ICD 2.1, table 76); 255, no prediction, for negative values and above 6 m.
[[nodiscard]] int sisa_index(double accuracy_m);

}  // namespace canyon::broadcast
