#pragma once

#include <filesystem>
#include <string>

#include "tests/support/source_dir.hpp"

namespace canyon::test {

/// A file of tests/data/cases: the smallest input, with synthetic values, of a bug reported by users of other
/// programs.
inline std::filesystem::path case_file(const std::string& name) {
  return std::filesystem::path(canyon_source_dir) / "tests/data/cases" / name;
}

}  // namespace canyon::test
