#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon::test {

/// The result of reading a damaged file.
enum class Outcome {
  Same,      ///< the data of the undamaged file
  Noise,     ///< within the noise
  Remarked,  ///< other data, with a warning
  Refused    ///< an InputError
};

struct DamageCounts {
  int files = 0, same = 0, noise = 0, remarked = 0, refused = 0;
  std::vector<std::string> silent;  ///< other data without a warning

  [[nodiscard]] std::string text() const {
    return fmt::format("{} damages: same {}, within noise {}, said {}, refused {}, silent {}", files, same,
                       noise, remarked, refused, silent.size());
  }
};

/// Calls `read` with every `every`-th beginning of a text, and 300 times with two of its bytes replaced by
/// some of `bytes`, chosen by a seed. An InputError is a valid result; other exceptions are passed to the
/// caller.
template <typename Read>
void read_damaged(const std::string& good, std::size_t every, const std::string& bytes, const Read& read) {
  const auto survives = [&read](const std::string& text) {
    try {
      (void)read(text);
    } catch (const InputError&) {
    }
  };
  for (std::size_t n = 0; n < good.size(); n += every) survives(good.substr(0, n));
  std::uint32_t state = 12345;  // a linear congruential generator (Numerical Recipes): seeded damage
  for (int i = 0; i < 300; ++i) {
    std::string text = good;
    for (int k = 0; k < 2; ++k) {
      state = state * 1664525U + 1013904223U;
      const std::size_t at = (state >> 8) % text.size();
      state = state * 1664525U + 1013904223U;
      text[at] = bytes[(state >> 8) % bytes.size()];
    }
    survives(text);
  }
}

/// Distance of successively omitted bytes: `usual`, or the environment variable CANYON_DAMAGE_STRIDE. 1 tests
/// each byte, which takes hours for large texts.
inline std::size_t damage_stride(std::size_t usual) {
  const char* const set = std::getenv("CANYON_DAMAGE_STRIDE");
  const auto stride = parse_integer(set == nullptr ? "" : set);
  return stride && *stride > 0 ? static_cast<std::size_t>(*stride) : usual;
}

/// Damages a text successively: every `every`-th byte omitted; every line twice; and, with `lines_out`, every
/// line omitted. `judge` returns the outcome of a damaged text, or the silent change.
class Damages {
 public:
  struct Judgement {
    Outcome outcome = Outcome::Same;
    std::string silent;  ///< not empty: other data without a warning
  };
  using Assess = std::function<Judgement(const std::string& text)>;

  explicit Damages(std::string name, std::string text, std::size_t every = 1, bool lines_out = false)
      : name_(std::move(name)), text_(std::move(text)), every_(damage_stride(every)), lines_out_(lines_out) {}

  [[nodiscard]] DamageCounts run(const Assess& judge) const {
    DamageCounts counts;
    for (std::size_t at = 0; at < text_.size(); at += every_) {
      std::string text = text_;
      text.erase(at, 1);
      count(counts, judge, text,
            fmt::format("without byte {} ({})", at, text_.substr(at < 20 ? 0 : at - 20, 40)));
    }
    for (std::size_t at = 0; at < text_.size();) {
      const std::size_t end = std::min(text_.find('\n', at), text_.size() - 1) + 1;
      const std::string line = text_.substr(at, end - at);
      std::string text = text_;
      text.insert(at, line);
      count(counts, judge, text, fmt::format("with a line twice ({})", line));
      if (lines_out_) {
        text = text_;
        text.erase(at, line.size());
        count(counts, judge, text, fmt::format("without a line ({})", line));
      }
      at = end;
    }
    std::printf("%s, %zu bytes, every %zu: %s\n", name_.c_str(), text_.size(), every_, counts.text().c_str());
    return counts;
  }

 private:
  void count(DamageCounts& counts, const Assess& judge, const std::string& text, std::string what) const {
    ++counts.files;
    Judgement judgement;
    try {
      judgement = judge(text);
    } catch (const InputError&) {
      judgement.outcome = Outcome::Refused;
    }
    if (!judgement.silent.empty()) {
      std::replace(what.begin(), what.end(), '\n', '|');
      counts.silent.push_back(fmt::format("{} {}: {}", name_, what, judgement.silent));
      return;
    }
    counts.same += judgement.outcome == Outcome::Same ? 1 : 0;
    counts.noise += judgement.outcome == Outcome::Noise ? 1 : 0;
    counts.remarked += judgement.outcome == Outcome::Remarked ? 1 : 0;
    counts.refused += judgement.outcome == Outcome::Refused ? 1 : 0;
  }

  std::string name_, text_;
  std::size_t every_;
  bool lines_out_;
};

}  // namespace canyon::test
