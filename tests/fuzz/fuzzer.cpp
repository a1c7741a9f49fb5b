// libFuzzer's entry for all targets: CANYON_FUZZ_TARGET selects one. If CANYON_FUZZ_SEEDS is set, the
// target's seeds are written there first.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "tests/fuzz/targets.hpp"
#include "tests/support/source_dir.hpp"

const char* const canyon_source_dir = CANYON_SOURCE_DIR;

namespace {

const canyon::fuzz::Target& chosen() {
  static const canyon::fuzz::Target* const target = [] {
    const char* name = std::getenv("CANYON_FUZZ_TARGET");
    for (const canyon::fuzz::Target& each : canyon::fuzz::targets()) {
      if (name != nullptr && each.name == name) return &each;
    }
    std::fputs("CANYON_FUZZ_TARGET must be one of:", stderr);
    for (const canyon::fuzz::Target& each : canyon::fuzz::targets())
      std::fprintf(stderr, " %s", each.name.c_str());
    std::fputs("\n", stderr);
    std::exit(2);
  }();
  return *target;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  const canyon::fuzz::Target& target = chosen();
  if (const char* folder = std::getenv("CANYON_FUZZ_SEEDS")) {
    int number = 0;
    for (const std::string& seed : target.seeds) {
      std::ofstream(std::string(folder) + "/seed_" + std::to_string(++number), std::ios::binary) << seed;
    }
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  canyon::fuzz::read_bytes(chosen(), {reinterpret_cast<const char*>(data), size});
  return 0;
}
