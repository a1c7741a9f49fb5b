#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <string>

#include "tests/support/source_dir.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::test {

/// Expects `table` in docs/reference/PAGE between the marks of `what`. With CANYON_WRITE_REFERENCE in the
/// environment it is written there instead (tests/reference.py --write).
inline void expect_documented(const std::string& page, const std::string& what, const std::string& table) {
  const std::filesystem::path path = std::filesystem::path(canyon_source_dir) / "docs/reference" / page;
  std::string text = read_bytes(path);
  const std::string begin = "<!-- begin: " + what + " -->\n";
  const std::size_t mark = text.find(begin);
  ASSERT_NE(mark, std::string::npos) << path << " has no mark " << begin;
  const std::size_t from = mark + begin.size();
  const std::size_t to = text.find("<!-- end -->\n", from);
  ASSERT_NE(to, std::string::npos) << path << ": " << begin;
  if (text.substr(from, to - from) == table) return;
  if (std::getenv("CANYON_WRITE_REFERENCE") == nullptr) {
    FAIL() << path << " does not have this between the marks of " << what
           << " (tests/reference.py --write):\n"
           << table;
  }
  std::ofstream(path, std::ios::binary) << text.replace(from, to - from, table);
}

}  // namespace canyon::test
