#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/read_report.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/sky/rinex/observation_fields.hpp"

namespace canyon::rinex {

/// The lines of an observation file, plain or expanded from Hatanaka's compression: "A Compression Format and
/// Tools for GNSS Observation Data" (Y. Hatanaka, Bulletin of the Geospatial Information Authority of Japan
/// 55, 2008), versions 1.0 (of RINEX 2) and 3.0 (of RINEX 3 and 4). Line numbers are those of the file. A
/// value whose difference has no preceding value is blank until its arc restarts, with a note.
class CompactLines {
 public:
  /// @param notes outlive this
  CompactLines(TextFile file, ReadReport& notes);

  /// As in TextFile; throws InputError for other versions of the compression.
  [[nodiscard]] std::optional<std::string_view> next_line();
  /// Precondition: the previous call was a next_line() that returned a line.
  void unread_line();
  [[nodiscard]] int line() const { return compact_ ? line_ : file_.line(); }
  [[nodiscard]] const std::filesystem::path& path() const { return file_.path(); }
  [[nodiscard]] const std::optional<InputError>& cut_warning() const { return file_.cut_warning(); }
  [[nodiscard]] InputError error(std::string_view problem, std::string_view hint = {}) const {
    return {path(), line(), problem, hint};
  }

 private:
  /// The successive values of one observation, as differences up to an order.
  struct Arc {
    int order = -1;  ///< -1: no value
    int known = 0;   ///< differences so far
    std::array<std::int64_t, 10> differences{};
    void begin(int highest, std::int64_t value);
    void go_on(std::int64_t difference);
  };
  struct Satellite {
    std::vector<Arc> arcs;
    std::string flags;
  };

  void begin();
  /// Whether the line is the first of a compressed file.
  bool begin_file(std::string_view first);
  void expand_header();
  void expand_epoch();
  void expand_event(int count);
  void expand_clock(std::string_view text);
  void expand_satellite(const std::string& name, std::string_view text);
  [[nodiscard]] bool read_arc(Arc& arc, std::string_view text) const;
  [[nodiscard]] std::size_t type_count(char system) const;
  [[nodiscard]] bool begins_epoch(std::string_view line) const;
  void put(std::string line);
  void put_epoch_line(std::string_view names, std::size_t count);
  void damaged(std::string_view what) { notes_.loss(file_.line(), what); }

  TextFile file_;
  ReadReport& notes_;
  bool started_ = false, compact_ = false, version2_ = false;
  HeaderRecords header_;
  bool in_header_ = true;
  std::string epoch_line_;  ///< empty: not known, until one starts again
  Arc clock_;
  std::map<std::string, Satellite> satellites_;  ///< of the preceding epoch
  struct Line {
    std::string text;
    int line = 0;
  };
  std::vector<Line> ready_;
  std::size_t next_ = 0;
  int line_ = 0;
};

}  // namespace canyon::rinex
