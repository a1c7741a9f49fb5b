#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "canyon/base/text.hpp"
#include "tests/support/program.hpp"
#include "tests/support/source_dir.hpp"
#include "tests/support/temporary_folder.hpp"

// npm's node-mavlink (2.3.0), independently generated from MAVLink's definitions, to check Canyon's frames.

namespace canyon::test {

/// A message read by node-mavlink: raw values by the definition's field names.
struct JudgedMessage {
  std::string version, name;
  int system = 0, component = 0, sequence = 0;
  std::map<std::string, std::vector<double>> fields;

  [[nodiscard]] double count(const std::string& field) const { return fields.at(field).at(0); }
};

inline bool has_node_mavlink() {
  return run_program("node -e \"require('node-mavlink')\" 2>/dev/null").status == 0;
}

struct Judgement {
  std::vector<JudgedMessage> messages;
  std::string again;  ///< the same, framed by node-mavlink
};

inline Judgement judge_mavlink(const std::string& bytes) {
  const TemporaryFolder folder;
  std::ofstream(folder / "frames", std::ios::binary) << bytes;
  const ProgramResult result =
      run_program(std::string("timeout 60 node '") + canyon_source_dir + "/tests/cross_checks/mavlink.js' '" +
                  (folder / "again").string() + "' <'" + (folder / "frames").string() + "'");
  EXPECT_EQ(result.status, 0);
  Judgement judgement;
  for (const auto line : split(result.output, '\n')) {
    const auto cells = split_blanks(line);
    if (cells.size() < 5) continue;
    JudgedMessage message;
    message.version = cells[0];
    message.system = static_cast<int>(*parse_integer(cells[1]));
    message.component = static_cast<int>(*parse_integer(cells[2]));
    message.sequence = static_cast<int>(*parse_integer(cells[3]));
    message.name = cells[4];
    for (std::size_t i = 5; i < cells.size(); ++i) {
      const std::size_t sign = cells[i].find('=');
      auto& counts = message.fields[std::string(cells[i].substr(0, sign))];
      for (const auto count : split(cells[i].substr(sign + 1), ',')) {
        counts.push_back(parse_double(count).value_or(std::nan("")));
      }
    }
    judgement.messages.push_back(message);
  }
  judgement.again = read_bytes(folder / "again");
  return judgement;
}

}  // namespace canyon::test

#define CANYON_NEEDS_NODE_MAVLINK()                                                                 \
  if (!::canyon::test::has_node_mavlink()) {                                                        \
    GTEST_SKIP() << "SKIPPED: the judge node-mavlink is not here (npm install node-mavlink@2.3.0, " \
                    "and NODE_PATH naming its node_modules)";                                       \
  }                                                                                                 \
  static_assert(true, "needs a semicolon")
