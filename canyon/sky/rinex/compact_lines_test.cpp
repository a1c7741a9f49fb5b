#include "canyon/sky/rinex/compact_lines.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "canyon/base/text.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"
#include "tests/support/observation_text.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon::rinex {
namespace {

using test::header_line;
using testing::ElementsAre;
using testing::HasSubstr;

/// The compression, implemented from Hatanaka's paper: differences of each value up to the third, text as the
/// characters that change.
class Compressor {
 public:
  explicit Compressor(bool version2) : version2_(version2) {}

  /// @param text of an observation file; types by system's letter, ' ' in version 2
  std::string compress(const std::string& text, const std::map<char, std::size_t>& types) {
    lines_ = split(text, '\n');
    while (!lines_.empty() && lines_.back().empty()) lines_.pop_back();
    std::string out =
        header_line(std::string(version2_ ? "1.0" : "3.0") + "                 COMPACT RINEX FORMAT",
                    "CRINEX VERS   / TYPE") +
        header_line("this test", "CRINEX PROG / DATE");
    bool header = true;
    for (at_ = 0; at_ < lines_.size();) {
      const std::string line(lines_[at_++]);
      if (header) {
        out += line + "\n";
        header = trim(column(line, 60, 20)) != "END OF HEADER";
      } else {
        out += epoch(line, types);
      }
    }
    return out;
  }

 private:
  struct Arc {
    std::vector<long long> last;  ///< differences of the preceding value
  };

  static std::string changed(const std::string& before, std::string now) {
    const std::size_t n = std::max(before.size(), now.size());
    now.resize(n, ' ');
    std::string old = before;
    old.resize(n, ' ');
    for (std::size_t i = 0; i < n; ++i) now[i] = now[i] == old[i] ? ' ' : now[i] == ' ' ? '&' : now[i];
    now.resize(now.find_last_not_of(' ') + 1);
    return now;
  }

  /// A number without its point, as the next difference of its arc.
  static std::string difference(Arc& arc, std::string field) {
    field = std::string(trim(field));
    if (field.empty()) {
      arc.last.clear();
      return "";
    }
    field.erase(field.find('.'), 1);
    std::vector<long long> now{std::stoll(field)};
    for (std::size_t i = 0; i < std::min<std::size_t>(arc.last.size(), 3); ++i)
      now.push_back(now.back() - arc.last[i]);
    const bool begins = arc.last.empty();
    arc.last = now;
    return (begins ? "3&" : "") + std::to_string(now.back());
  }

  std::string epoch(const std::string& first, const std::map<char, std::size_t>& types) {
    const std::size_t flag_at = version2_ ? 28 : 31, clock_at = version2_ ? 68 : 41;
    const auto count = static_cast<std::size_t>(*parse_integer(column(first, flag_at + 1, 3)));
    std::string line(column(first, 0, version2_ ? 32 : 41));
    if (first[flag_at] > '1') {
      std::string out = line;
      if (version2_) out[0] = '&';
      out.resize(out.find_last_not_of(' ') + 1);
      out += "\n";
      for (std::size_t i = 0; i < count; ++i) out += std::string(lines_[at_++]) + "\n";
      epoch_.clear();
      satellites_.clear();
      clock_ = {};
      return out;
    }
    line.resize(version2_ ? 32 : 41, ' ');
    const std::string clock = difference(clock_, std::string(column(first, clock_at, 15)));
    std::vector<std::pair<std::string, std::string>> rows;  // names and fields
    if (version2_) {
      for (std::size_t i = 0; i < count; ++i) {
        const std::string_view names = i < 12 ? std::string_view(first) : lines_[at_ + i / 12 - 1];
        rows.emplace_back(column(names, 32 + 3 * (i % 12), 3), "");
      }
      at_ += count == 0 ? 0 : (count - 1) / 12;
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (!version2_) {
        rows.emplace_back(lines_[at_].substr(0, 3), lines_[at_].substr(3));
        ++at_;
        continue;
      }
      for (std::size_t n = 0; n < types.at(' '); n += 5) {
        std::string part(lines_[at_++]);
        part.resize(80, ' ');
        rows[i].second += part;
      }
    }
    for (const auto& [name, fields] : rows) line += name;
    std::string out = epoch_.empty() ? line : changed(epoch_, line);
    if (epoch_.empty() && version2_) out[0] = '&';
    epoch_ = line;
    out += "\n" + clock + "\n";
    std::map<std::string, std::pair<std::vector<Arc>, std::string>> now;
    for (const auto& [name, fields] : rows) {
      auto& [arcs, flags] = now[name];
      if (const auto before = satellites_.find(name); before != satellites_.end())
        std::tie(arcs, flags) = before->second;
      const std::size_t n = types.at(version2_ ? ' ' : name[0]);
      arcs.resize(n);
      std::string own;
      for (std::size_t i = 0; i < n; ++i) {
        std::string field(column(fields, 16 * i, 16));
        field.resize(16, ' ');
        out += difference(arcs[i], field.substr(0, 14)) + " ";
        own += field.substr(14);
      }
      out += changed(flags, own);
      flags = own;
      out.resize(out.find_last_not_of(' ') + 1);
      out += "\n";
    }
    satellites_ = std::move(now);
    return out;
  }

  bool version2_;
  std::vector<std::string_view> lines_;
  std::size_t at_ = 0;
  std::string epoch_;
  Arc clock_;
  std::map<std::string, std::pair<std::vector<Arc>, std::string>> satellites_;
};

std::vector<std::string> all_lines(const std::string& text, ReadReport& notes) {
  CompactLines source(TextFile::from_string(text, "some.crx"), notes);
  std::vector<std::string> lines;
  while (const auto line = source.next_line()) {
    lines.emplace_back(line->substr(0, line->find_last_not_of(' ') + 1));
  }
  return lines;
}
std::vector<std::string> all_lines(const std::string& text) {
  ReadReport notes;
  return all_lines(text, notes);
}

/// Twenty epochs of satellites that appear and disappear, with some missing values.
std::string sample(bool version2, unsigned seed) {
  std::mt19937 random(seed);
  const auto one_in = [&random](unsigned n) { return random() % n == 0; };
  std::string text = version2 ? test::observations2() : test::observations3();
  const std::map<char, int> types{{'G', 14}, {'R', 4}, {'E', 4}, {'C', 4}};
  for (int k = 0; k < 20; ++k) {
    std::vector<std::pair<std::string, std::string>> rows;
    for (int s = 1; s <= 16; ++s) {
      if (one_in(5)) continue;
      const char system = "GREC"[s % 4];
      std::string fields;
      for (int i = 0; i < (version2 ? 10 : types.at(system)); ++i) {
        const double value =
            2e7 + 1e5 * s + 1e3 * i - 700.125 * k + 0.4 * k * k - 0.001 * static_cast<double>(random() % 900);
        fields += one_in(6) ? test::blank_field()
                            : test::field(i % 4 == 2 ? -value / 1e4 : value, one_in(4) ? '1' : ' ',
                                          one_in(2) ? '7' : ' ');
      }
      rows.emplace_back(fmt::format("{}{:02}", system, s), fields);
    }
    if (k == 9)
      text += version2 ? "                            4  1\n" : ">                              4  1\n";
    if (k == 9) text += header_line("an event", "COMMENT");
    const std::string clock =
        one_in(3) ? "" : fmt::format("{:{}.{}f}", -1e-4 + 1e-7 * k, version2 ? 12 : 15, version2 ? 9 : 12);
    if (!version2) {
      std::string line = fmt::format("> 2019 04 28 12 44 {:2d}.0000000  0{:3d}", k, rows.size());
      if (!clock.empty()) line.resize(41, ' ');
      text += line + clock + "\n";
      for (const auto& [name, fields] : rows) text += name + fields + "\n";
      continue;
    }
    std::string line = fmt::format(" 19  4 28 12 44 {:2d}.0000000  0{:3d}", k, rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (i == 12) {
        if (!clock.empty()) line.resize(68, ' ');
        text += line + clock + "\n";
        line = std::string(32, ' ');
      }
      line += rows[i].first;
    }
    if (rows.size() <= 12 && !clock.empty()) line.resize(68, ' '), line += clock;
    text += line + "\n";
    for (const auto& [name, fields] : rows) {
      for (std::size_t at = 0; at < fields.size(); at += 80) text += fields.substr(at, 80) + "\n";
    }
  }
  return text;
}

TEST(CompactLines, GiveBackWhatWasCompressed) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    for (const bool version2 : {false, true}) {
      const std::string text = sample(version2, seed);
      const std::string compact =
          Compressor(version2).compress(text, {{' ', 10}, {'G', 14}, {'R', 4}, {'E', 4}, {'C', 4}});
      ASSERT_LT(compact.size(), text.size());
      ReadReport notes;
      ASSERT_EQ(all_lines(compact, notes), all_lines(text)) << version2 << seed;
      EXPECT_THAT(notes.lines(), testing::IsEmpty());
      // Concatenated files.
      ASSERT_EQ(all_lines(compact + compact, notes), all_lines(text + text)) << version2 << seed;
      EXPECT_THAT(notes.lines(), testing::IsEmpty());
    }
  }
}

/// RINEX 3 with one type of GPS, and these lines after the header of eleven lines.
std::string with(const std::string& body) {
  return header_line("3.0                 COMPACT RINEX FORMAT", "CRINEX VERS   / TYPE") +
         header_line("by hand", "CRINEX PROG / DATE") +
         header_line("     3.04           OBSERVATION DATA    G", "RINEX VERSION / TYPE") +
         header_line("G    2 C1C L1C", "SYS / # / OBS TYPES") + header_line("", "END OF HEADER") + body;
}

// By hand: 20000000.000, then differences of the first, second and third order.
TEST(CompactLines, DifferencesAddUp) {
  const std::string begin = "> 2019 04 28 12 44 30.0000000  0  1      G05\n\n3&20000000000 3&-5 17\n";
  EXPECT_THAT(all_lines(with(begin + "                    1\n\n1000 1  &\n                    2\n\n10  \n"
                                     "                    3\n\n-1 3&7\n")),
              ElementsAre(testing::_, testing::_, testing::_, "> 2019 04 28 12 44 30.0000000  0  1",
                          "G05  20000000.00017        -0.005", "> 2019 04 28 12 44 31.0000000  0  1",
                          "G05  20000001.0001         -0.004", "> 2019 04 28 12 44 32.0000000  0  1",
                          "G05  20000002.0101", "> 2019 04 28 12 44 33.0000000  0  1",
                          "G05  20000003.0291          0.007"));
}

TEST(CompactLines, DamageCostsAnArcOrTheEpochsToTheNextWholeOne) {
  const std::string begin = "> 2019 04 28 12 44 30.0000000  0  1      G05\n\n3&20000000000 3&50000\n";
  ReadReport notes("some.crx"), more("some.crx");
  EXPECT_THAT(
      all_lines(with(begin + "                    1\n\n1x00 10\n                    2\n\n10 20\n"), notes)
          .back(),
      "G05                        50.040");
  EXPECT_THAT(notes.lines(),
              ElementsAre("some.crx:11: a compressed value of G05 is damaged (the first of 2); left out"));
  EXPECT_EQ(all_lines(with(begin + "                                  9\n\n1\n" + begin), more).size(), 7U);
  EXPECT_THAT(more.lines(), ElementsAre(HasSubstr("epoch line is damaged")));
  const auto read_version = [](const std::string& version) {
    std::string text = with("");
    text.replace(0, 3, version);
    (void)all_lines(text);
  };
  EXPECT_THAT(test::refusal([&] { read_version("2.0"); }),
              HasSubstr("some.crx:1: version '2.0' of Hatanaka's compression is not supported"));
}

TEST(CompactLines, RealRecordingsComeBack) {
  for (const char* file : {"urbannav-tst-20190428/COM3_190428_124409.obs",
                           "berlin-potsdamer-platz/Berlin_Potsdamer_Platz.obs"}) {
    CANYON_SHARED_DATA(path, file);
    const TextFile whole(path);
    const RinexObservations plain = read_rinex_observations(path);
    std::map<char, std::size_t> types;
    for (const auto& [system, list] : plain.header.types) types[system] = list.size();
    std::string text(whole.text().substr(0, 600'000));
    std::erase(text, '\r');
    RinexObservationReader one(text.substr(0, text.rfind(plain.header.version < 3 ? "\n 16" : "\n>") + 1),
                               "plain.obs");
    RinexObservationReader other(
        Compressor(plain.header.version < 3)
            .compress(text.substr(0, text.rfind(plain.header.version < 3 ? "\n 16" : "\n>") + 1), types),
        "compact.crx");
    std::size_t compared = 0;
    while (const auto epoch = one.next()) {
      const auto again = other.next();
      ASSERT_TRUE(again);
      ASSERT_EQ(epoch->receiver_time, again->receiver_time);
      ASSERT_EQ(epoch->signals.size(), again->signals.size());
      for (std::size_t i = 0; i < epoch->signals.size(); ++i) {
        EXPECT_EQ(epoch->signals[i].pseudorange_m, again->signals[i].pseudorange_m);
        EXPECT_EQ(epoch->signals[i].carrier_phase_cycles, again->signals[i].carrier_phase_cycles);
        EXPECT_EQ(epoch->signals[i].loss_of_lock, again->signals[i].loss_of_lock);
        ++compared;
      }
    }
    EXPECT_FALSE(other.next());
    EXPECT_GT(compared, 1000U);
  }
}

}  // namespace
}  // namespace canyon::rinex
