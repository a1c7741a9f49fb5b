#pragma once

#include "canyon/output/encoder.hpp"

// The encoders behind formats(): encode_NAME() of each format in canyon/simulation/scenario/outputs.def.

namespace canyon::output {

#define CANYON_FORMAT(name, file, live, wanted, help) \
  [[nodiscard]] std::unique_ptr<Encoder> encode_##name(const ReceiverDescription& receiver);
#define CANYON_STREAM_FORMAT(name, file) CANYON_FORMAT(name, file, true, false, "")
#define CANYON_RUN_OUTPUT(name, wanted, help)
#include "canyon/simulation/scenario/outputs.def"

}  // namespace canyon::output
