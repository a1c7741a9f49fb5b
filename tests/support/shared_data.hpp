#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/support/source_dir.hpp"

namespace canyon::test {

/// The folder of real recordings next to the checkout.
inline std::filesystem::path shared_data(const std::string& name) {
  return std::filesystem::path(canyon_source_dir) / ".." / "shared" / "data" / name;
}

/// Broadcast ephemerides of real days: RINEX 3 mixed, 2 GPS, and GPS and BeiDou of one receiver.
inline constexpr const char* kRealDays[] = {"orbits/ESBC00DNK_R_20201770000_01D_MN.rnx.gz",
                                            "orbits/brdc3050.12n", "urbannav-tst-20190428/hksc1180.19n",
                                            "urbannav-tst-20190428/hksc1180.19b"};

}  // namespace canyon::test

/// Defines `variable` as the path of a shared file, or skips the test with a message if it is absent.
#define CANYON_SHARED_DATA(variable, name)                                  \
  const std::filesystem::path variable = ::canyon::test::shared_data(name); \
  if (!std::filesystem::exists(variable)) {                                 \
    GTEST_SKIP() << "SKIPPED: real data " << variable << " is not here";    \
  }                                                                         \
  static_assert(true, "needs a semicolon")
