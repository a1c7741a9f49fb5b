// Every message, in both directions, against npm's node-mavlink.
#include "tests/support/node_mavlink.hpp"

#include <cmath>
#include <type_traits>
#include <utility>

#include "canyon/base/mavlink/frames.hpp"

namespace canyon::mavlink {
namespace {

std::vector<WireField> fields_of(Message& message) {
  WireFields fields;
  std::visit([&](auto& m) { m.visit(fields); }, message);
  return {fields.all().begin(), fields.all().end()};
}

/// Distinct counts without symmetry, negative if the type has them.
double count_of(const WireField& field, std::size_t k) {
  const double step = static_cast<double>(k);
  switch (field.type) {
    case Wire::U8:
      return 3 + step;
    case Wire::I8:
      return -3 - step;
    case Wire::U16:
      return 40'000 + 7 * step;
    case Wire::I16:
      return -20'000 - 7 * step;
    case Wire::U32:
      return 3'000'000'001.0 + step;
    case Wire::I32:
      return -2'000'000'001.0 - step;
    case Wire::U64:
      return 1'556'456'283'250'001.0 + step;
    case Wire::F32:
      return -0.5 - 0.25 * step;
  }
  return 0;
}

template <typename Do>
void for_each_element(Message& message, const Do& action) {
  std::size_t k = 0;
  for (const WireField& field : fields_of(message)) {
    for (std::size_t i = 0; i < field.count; ++i, ++k) {
      std::visit([&](auto* member) { action(field, i, k, member[i]); }, field.member);
    }
  }
}

template <std::size_t... I>
std::vector<Message> filled(std::index_sequence<I...>) {
  std::vector<Message> all{std::variant_alternative_t<I, Message>()...};
  for (Message& message : all) {
    for_each_element(message, [](const WireField& field, std::size_t, std::size_t k, auto& value) {
      using Value = std::remove_reference_t<decltype(value)>;
      const double unit = std::is_same_v<Value, double> ? field.unit : 1;
      value = static_cast<Value>(count_of(field, k) * unit);
    });
  }
  return all;
}

void check(Version version) {
  std::vector<Message> sent = filled(std::make_index_sequence<std::variant_size_v<Message>>());
  // node-mavlink 2.3.0 has no MAVLink 1 frame of messages with ids beyond one byte.
  std::string bytes;
  std::uint8_t sequence = 250;
  for (const Message& message : sent) {
    if (version == Version::V1 && layouts()[message.index()].id > 255) continue;
    bytes += encode(message, sequence++, {42, 191}, version);
  }
  const test::Judgement theirs = test::judge_mavlink(bytes);
  std::size_t at = 0;
  for (Message& message : sent) {
    const FrameLayout& layout = layouts()[message.index()];
    if (version == Version::V1 && layout.id > 255) continue;
    ASSERT_LT(at, theirs.messages.size()) << layout.name;
    const test::JudgedMessage& seen = theirs.messages[at];
    EXPECT_EQ(seen.name, layout.name);
    EXPECT_EQ(seen.version, version == Version::V1 ? "V1" : "V2");
    EXPECT_EQ(seen.system, 42);
    EXPECT_EQ(seen.component, 191);
    EXPECT_EQ(seen.sequence, static_cast<std::uint8_t>(250 + at));
    for_each_element(message, [&](const WireField& field, std::size_t i, std::size_t k, auto&) {
      const auto found = seen.fields.find(std::string(field.name));
      if (found == seen.fields.end()) {
        EXPECT_TRUE(field.extension) << layout.name << ' ' << field.name;  // newer than the reference
        return;
      }
      ASSERT_LT(i, found->second.size()) << layout.name << ' ' << field.name;
      const double expected = version == Version::V1 && field.extension ? 0 : count_of(field, k);
      EXPECT_EQ(found->second[i], expected) << layout.name << ' ' << field.name;
    });
    ++at;
  }
  EXPECT_EQ(theirs.messages.size(), at);

  // The reverse direction: frames written by node-mavlink from its own reading.
  std::vector<Frame> back;
  MavlinkParser parser;
  parser.receive(theirs.again, [&](const Frame& frame) { back.push_back(frame); });
  ASSERT_EQ(back.size(), at);
  EXPECT_EQ(parser.passed_over(), 0U);
  for (std::size_t j = 0; j < back.size(); ++j) {
    for_each_element(back[j].message, [&](const WireField& field, std::size_t, std::size_t k, auto& value) {
      const bool absent = field.extension && (version == Version::V1 ||
                                              theirs.messages[j].fields.count(std::string(field.name)) == 0);
      using Value = std::remove_reference_t<decltype(value)>;
      if (absent) return;
      if constexpr (std::is_same_v<Value, double>) {
        EXPECT_NEAR(value, count_of(field, k) * field.unit, 1e-9 * std::abs(value)) << field.name;
      } else {
        EXPECT_EQ(static_cast<double>(value), count_of(field, k)) << field.name;
      }
    });
  }
}

TEST(NodeMavlink, ReadsAndWritesEveryMessageOfMavlink2AsWeDo) {
  CANYON_NEEDS_NODE_MAVLINK();
  check(Version::V2);
}

TEST(NodeMavlink, ReadsAndWritesEveryMessageOfMavlink1AsWeDo) {
  CANYON_NEEDS_NODE_MAVLINK();
  check(Version::V1);
}

}  // namespace
}  // namespace canyon::mavlink
