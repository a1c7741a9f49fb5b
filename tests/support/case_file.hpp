#pragma once

#include <filesystem>
#include <string>

#include "tests/support/source_dir.hpp"

namespace canyon::test {

/// A file of tests/data/cases: the smallest input, with made-up values, of a fault that users of other
/// programs reported.
inline std::filesystem::path case_file(const std::string& name) {
  return std::filesystem::path(canyon_source_dir) / "tests/data/cases" / name;
}

}  // namespace canyon::test
