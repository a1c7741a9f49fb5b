#include "canyon/sky/rinex/navigation_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/read_report.hpp"
#include "canyon/base/text.hpp"
#include "canyon/sky/rinex/fields.hpp"
#include "canyon/sky/rinex/navigation_record.hpp"

namespace canyon::rinex {
namespace {

bool is_upper(char c) {
  return c >= 'A' && c <= 'Z';
}

/// Lines of one record, with the line number of the first.
struct RawRecord {
  int line = 0;
  std::string_view tag;  ///< RINEX 4: the text after '>'
  std::vector<std::string_view> lines;
};

class Reader {
 public:
  Reader(TextFile file, std::set<gnss::System> wanted) : file_(std::move(file)), wanted_(std::move(wanted)) {}

  gnss::NavigationData read() {
    data_.sources.push_back(file_.path().filename().string());
    if (file_.cut_warning()) report_.loss(*file_.cut_warning(), 1, file_.cut_warning()->hint());
    read_header(file_.next_line());
    read_records();
    finish();
    return std::move(data_);
  }

 private:
  // --- header
  // -----------------------------------------------------------------------------------------------

  static bool is_first_line(std::string_view line) {
    return trim(column(line, 60, 20)) == "RINEX VERSION / TYPE";
  }

  /// teqc writes comments between and inside records.
  static bool is_comment(std::string_view line) { return trim(column(line, 60, 20)) == "COMMENT"; }

  void read_header(std::optional<std::string_view> first) {
    if (!first || !is_first_line(*first)) {
      throw file_.error("is not a RINEX file: the first line is not 'RINEX VERSION / TYPE'",
                        "give a RINEX navigation file, plain or gzip");
    }
    const auto version = parse_double(column(*first, 0, 9));
    if (!version || *version < 2 || *version >= 5) {
      throw file_.error(fmt::format("RINEX version '{}' is not supported", trim(column(*first, 0, 9))),
                        "give version 2.x, 3.x or 4.x");
    }
    version_ = static_cast<int>(*version);
    layout_ = version_ == 2 ? RecordLayout::kVersion2 : RecordLayout::kVersion3;
    const char type = first->size() > 20 ? (*first)[20] : ' ';
    const std::optional<gnss::System> of_type = version2_system(type);
    const bool known = type == 'N' || (version_ == 2 && of_type);
    if (!known) {
      throw file_.error(
          fmt::format("is not a navigation file of a supported system (RINEX type '{}')",
                      trim(column(*first, 20, 20))),
          type == 'O' ? "this is an observation file; give the navigation file of that day"
                      : "give type N (any version), G, H, E or J (version 2: GLONASS, SBAS, Galileo, QZSS)");
    }
    version2_system_ = of_type.value_or(gnss::System::GPS);
    beidou_only_ = version_ == 3 && first->size() > 40 && (*first)[40] == 'C';

    read_header_lines();
    // RTKLIB writes 2.12 for Galileo and QZSS with version 3's records.
    if (const auto record = file_.peek_line(); record && gnss::parse_satellite(column(*record, 0, 3)))
      layout_ = RecordLayout::kVersion3;
  }

  void read_header_lines() {
    while (const auto line = file_.next_line()) {
      const std::string_view label = trim(column(*line, 60, 20));
      if (label == "END OF HEADER") return;
      if (label == "IONOSPHERIC CORR")
        read_ionosphere(*line);
      else if (label == "ION ALPHA")
        read_coefficients(gnss::System::GPS, true, *line, 2);
      else if (label == "ION BETA")
        read_coefficients(gnss::System::GPS, false, *line, 2);
      else if (label == "LEAP SECONDS")
        read_leap_seconds(*line);
    }
    throw InputError(file_.path(), 0, "RINEX header has no END OF HEADER",
                     "the file is cut short: fetch it again");
  }

  /// 2.11, tables A3, A10 and A15; 2.12: E, or L as in file names, and J.
  static std::optional<gnss::System> version2_system(char type) {
    switch (type) {
      case 'G':
        return gnss::System::GLONASS;
      case 'H':
        return gnss::System::SBAS;
      case 'E':
      case 'L':
        return gnss::System::Galileo;
      case 'J':
        return gnss::System::QZSS;
      default:
        return std::nullopt;
    }
  }

  void read_ionosphere(std::string_view line) {
    const std::string_view key = trim(column(line, 0, 4));
    if (key == "GAL") {
      std::array<double, 3> a{};
      for (std::size_t i = 0; i < 3; ++i) {
        const auto value = parse_double(column(line, 5 + 12 * i, 12));
        if (!value) return warn("damaged GAL ionosphere line");
        a[i] = *value;
      }
      data_.galileo_nequick = a;
      return;
    }
    const bool alpha = !key.empty() && key.back() == 'A';
    const std::string_view system = key.substr(0, key.empty() ? 0 : key.size() - 1);
    if (!alpha && (key.empty() || key.back() != 'B')) return;
    if (system == "GPS") read_coefficients(gnss::System::GPS, alpha, line, 5);
    if (system == "BDS") read_coefficients(gnss::System::BeiDou, alpha, line, 5);
    if (system == "QZS") read_coefficients(gnss::System::QZSS, alpha, line, 5);
  }

  void read_coefficients(gnss::System system, bool alpha, std::string_view line, std::size_t begin) {
    std::array<double, 4> values{};
    for (std::size_t i = 0; i < 4; ++i) {
      const auto value = parse_double(column(line, begin + 12 * i, 12));
      if (!value) return warn("damaged ionosphere line");
      values[i] = *value;
    }
    (alpha ? alpha_ : beta_)[system] = values;
  }

  void read_leap_seconds(std::string_view line) {
    const auto value = parse_integer(column(line, 0, 6));
    if (!value || *value < 0 || *value > 99) return warn("damaged LEAP SECONDS line");
    int leap = static_cast<int>(*value);
    // BeiDou files count from 2006 (BDT minus UTC): RINEX 3.04 marks them with BDS; older ones are recognised
    // only because all records are BeiDou's.
    if (trim(column(line, 24, 3)) == "BDS" || (beidou_only_ && leap < geodesy::kBdtSecondsOffset))
      leap += geodesy::kBdtSecondsOffset;
    data_.leap_seconds = leap;
  }

  // --- records
  // ----------------------------------------------------------------------------------------------

  /// Whether a line begins a record: RINEX 3 "G01", RINEX 2 a number in columns 1, 2; RINEX 4 also '>'.
  [[nodiscard]] bool begins_record(std::string_view line) const {
    if (version_ == 4 && !line.empty() && line[0] == '>') return true;
    return begins_satellite(line);
  }
  [[nodiscard]] bool begins_satellite(std::string_view line) const {
    return layout_ == RecordLayout::kVersion2 ? !trim(column(line, 0, 2)).empty()
                                              : !line.empty() && line[0] != ' ' && line[0] != '>';
  }

  void read_records() {
    while (auto line = file_.next_line()) {
      if (trim(*line).empty() || is_comment(*line)) continue;
      if (is_first_line(*line)) {  // files joined by cat
        read_header(line);
        continue;
      }
      RawRecord record;
      record.line = file_.line();
      if (!begins_record(*line)) {
        report_.loss(record.line, "lines that belong to no record", kHint);
        skip_rest();
        continue;
      }
      bool tagged = false;
      if (version_ == 4) {
        if (line->front() == '>') {
          tagged = true;
          record.tag = trim(line->substr(1));
        } else {
          record.lines.push_back(*line);
        }
      } else {
        record.lines.push_back(*line);
      }
      while (const auto next = file_.peek_line()) {
        // The satellite's line directly after '>' is part of the record.
        const bool own = tagged && record.lines.empty() && begins_satellite(*next);
        const bool comment = is_comment(*next);
        if (!comment && ((begins_record(*next) && !own) || is_first_line(*next))) break;
        (void)file_.next_line();
        if (!comment) record.lines.push_back(*next);
      }
      while (!record.lines.empty() && trim(record.lines.back()).empty()) record.lines.pop_back();
      try {
        if (version_ == 4)
          take_version4(record, tagged);
        else
          take_version2_or_3(record);
      } catch (const DamagedRecord& reason) {
        if (is_wanted(record))
          report_.loss(record.line, reason.reason, kHint);
        else
          pass_over_record("{} damaged records of systems that are not requested");
      }
    }
  }

  void skip_rest() {
    while (const auto next = file_.peek_line()) {
      if (begins_record(*next) || is_first_line(*next)) return;
      (void)file_.next_line();
    }
  }

  void take_version2_or_3(const RawRecord& record) {
    const std::string_view first = record.lines.front();
    if (layout_ == RecordLayout::kVersion2) {
      const auto number = parse_integer(column(first, 0, 2));
      if (!number || *number < 1)
        throw DamagedRecord{fmt::format("'{}' is not a satellite number", trim(column(first, 0, 2)))};
      take(gnss::SatelliteId{version2_system_, static_cast<std::uint8_t>(*number)}, record,
           MessageName::kUnnamed);
      return;
    }
    if (other_system(first.substr(0, 3))) return pass_over_navic();
    take(satellite(first), record, MessageName::kUnnamed);
  }

  void take_version4(const RawRecord& record, bool tagged) {
    if (!tagged) throw DamagedRecord{"record without its '>' line"};
    const auto words = split_blanks(record.tag);
    const std::string_view kind = words.empty() ? std::string_view() : words[0];
    if (words.size() < 3 || (kind != "EPH" && kind != "ION" && kind != "STO" && kind != "EOP"))
      throw DamagedRecord{fmt::format("'> {}' is not a record type", record.tag)};
    const std::string_view type = words[2];
    const char system = words[1].front();
    const auto pass_over = [&] {
      pass_over_record(fmt::format("{{}} {} records that Canyon does not use", kind));
    };
    if (kind == "ION") {
      if (!take_ionosphere(record, system, type)) pass_over();
      return;
    }
    if (kind != "EPH") return pass_over();
    if (system == 'I') return pass_over_navic();
    const bool usable = ((system == 'G' || system == 'J') && type == "LNAV") ||
                        (system == 'E' && (type == "INAV" || type == "FNAV")) ||
                        (system == 'C' && (type == "D1" || type == "D2" || type == "D1D2")) ||
                        (system == 'R' && type == "FDMA") || (system == 'S' && type == "SBAS");
    const bool delays = ((system == 'G' || system == 'J') && (type == "CNAV" || type == "CNV2")) ||
                        (system == 'C' && (type == "CNV1" || type == "CNV2" || type == "CNV3"));
    if (!usable && !delays) {
      if (!is_upper(system)) throw DamagedRecord{fmt::format("'> {}' is not a record type", record.tag)};
      return pass_over();
    }
    if (record.lines.empty()) throw rinex::DamagedRecord{"record has no lines"};
    const gnss::SatelliteId id = satellite(record.lines.front());
    if (gnss::parse_satellite(words[1]) != id) {
      throw rinex::DamagedRecord{fmt::format("'> {}' and '{}' name different satellites", record.tag,
                                             column(record.lines.front(), 0, 3))};
    }
    if (delays) {
      // More precise delays: without them signals have those of the ephemerides.
      try {
        data_.signal_delays.push_back(decode_signal_delays(id, record.lines, type));
      } catch (const DamagedRecord& reason) {
        report_.remark(record.line, reason.reason, kHint);
      }
      return;
    }
    take(id, record,
         type == "INAV"   ? MessageName::kInav
         : type == "FNAV" ? MessageName::kFnav
                          : MessageName::kUnnamed);
  }

  /// RINEX 4 ION: Klobuchar (LNAV, D1D2) and NeQuick-G (IFNV). False for models that are not stored.
  bool take_ionosphere(const RawRecord& record, char system_letter, std::string_view type) {
    const auto system = gnss::system_from_letter(system_letter);
    const bool klobuchar = type == "LNAV" || type == "D1D2" || type == "D1" || type == "D2";
    const bool nequick = type == "IFNV" && system == gnss::System::Galileo;
    if (!system || system == gnss::System::SBAS || (!klobuchar && !nequick)) return false;
    if (record.lines.empty()) throw DamagedRecord{"record has no lines"};
    const RecordFields fields(record.lines, RecordLayout::kVersion3);
    const auto value = [&fields](std::size_t i) {
      const auto coefficient = fields.at(i);
      if (!coefficient) throw DamagedRecord{"ionosphere coefficient is missing"};
      return *coefficient;
    };
    if (nequick) {
      data_.galileo_nequick = {value(0), value(1), value(2)};
    } else {
      alpha_[*system] = {value(0), value(1), value(2), value(3)};
      beta_[*system] = {value(4), value(5), value(6), value(7)};
    }
    return true;
  }

  [[nodiscard]] static gnss::SatelliteId satellite(std::string_view line) {
    const std::string_view name = column(line, 0, 3);
    const auto id = name.empty() || !is_upper(name.front()) ? std::nullopt : gnss::parse_satellite(name);
    if (!id) throw DamagedRecord{fmt::format("'{}' is not a satellite", name)};
    return *id;
  }

  void take(gnss::SatelliteId id, const RawRecord& record, MessageName message) {
    const std::vector<std::string_view>& lines = record.lines;
    const auto [first, last] = satellite_numbers(id.system);
    if (id.number < first || id.number > last) {
      throw DamagedRecord{fmt::format("there is no {}: {} numbers are {} to {}", to_string(id),
                                      name(id.system), first, last)};
    }
    const bool glonass = id.system == gnss::System::GLONASS;
    const std::size_t needed = line_count(id.system);
    const std::size_t allowed = glonass && version_ >= 3 ? needed + 1 : needed;
    if (lines.size() < needed || lines.size() > allowed) {
      throw DamagedRecord{
          fmt::format("record of {} has {} lines instead of {}", to_string(id), lines.size(), needed)};
    }
    require_indentation(lines, layout_);
    if (glonass) {
      data_.glonass.push_back(decode_glonass(id, lines, layout_));
      data_.glonass.back().line = record.line;
    } else if (id.system == gnss::System::SBAS) {
      data_.sbas.push_back(decode_sbas(id, lines, layout_));
      data_.sbas.back().line = record.line;
    } else {
      data_.kepler.push_back(decode_kepler(id, lines, layout_, message));
      data_.kepler.back().line = record.line;
    }
  }

  // --- end
  // --------------------------------------------------------------------------------------------------

  void pass_over_record(const std::string& what) {
    report_.add_counted(ReadReport::Level::Remark, what + ", left out");
  }
  void pass_over_navic() {
    ++navic_;
    pass_over_record("{} records of NavIC, which Canyon does not simulate");
  }
  /// Whether a damaged record is of a requested system, or of an unknown one.
  [[nodiscard]] bool is_wanted(const RawRecord& record) const {
    std::optional<gnss::System> system = version2_system_;
    if (layout_ == RecordLayout::kVersion3) {
      const auto words = split_blanks(record.tag);
      const std::string_view satellite = words.size() > 1       ? words[1]
                                         : record.lines.empty() ? std::string_view()
                                                                : std::string_view(record.lines.front());
      system = satellite.empty() ? std::nullopt : gnss::system_from_letter(satellite.front());
    }
    return wanted_.empty() || !system || wanted_.count(*system) > 0;
  }
  void warn(std::string_view what) { report_.loss(file_.line(), what); }

  void finish() {
    if (data_.empty()) {
      const std::optional<InputError>& bad = report_.first_loss();
      throw InputError(
          file_.path(), bad ? bad->line() : 0,
          bad ? fmt::format("no usable ephemeris: {}", bad->problem())
              : fmt::format("has {}no ephemeris of GPS, GLONASS, Galileo, BeiDou, QZSS or SBAS",
                            navic_ > 0 ? fmt::format("{} records of NavIC and ", navic_) : ""),
          navic_ > 0
              ? "Canyon does not simulate NavIC: give a navigation file of that day with another system"
              : "fetch the file again or give another");
    }
    for (const auto& [system, alpha] : alpha_) {
      const auto beta = beta_.find(system);
      if (beta != beta_.end()) data_.klobuchar[system] = gnss::Klobuchar{alpha, beta->second};
    }
    data_.report = std::move(report_);
    // Sorts the records and drops duplicates within the file.
    gnss::NavigationData ordered;
    ordered.merge(std::move(data_));
    data_ = std::move(ordered);
  }

  static constexpr const char* kHint = "record left out";

  TextFile file_;
  std::set<gnss::System> wanted_;
  ReadReport report_{file_.path()};
  gnss::NavigationData data_;
  int version_ = 0;
  std::size_t navic_ = 0;  ///< records
  RecordLayout layout_ = RecordLayout::kVersion3;
  gnss::System version2_system_ = gnss::System::GPS;
  bool beidou_only_ = false;
  std::map<gnss::System, std::array<double, 4>> alpha_;
  std::map<gnss::System, std::array<double, 4>> beta_;
};

/// Notes the messages of two issues that are used: no other one has their toe.
void report_mixed(gnss::NavigationData& data) {
  for (const gnss::KeplerEphemeris& e : data.kepler) {
    if (e.toc == e.toe) continue;
    data.report.add_counted(
        ReadReport::Level::Guess,
        "{} messages whose clock (toc) and orbit (toe) have different times, as from two issues, "
        "are used: errors can be thousands of kilometres",
        fmt::format("{} at {}", to_string(e.id), geodesy::format_gpst(e.toe, 0)));
  }
}

}  // namespace

gnss::NavigationData read_rinex_navigation(TextFile file, const std::set<gnss::System>& wanted) {
  gnss::NavigationData data = Reader(std::move(file), wanted).read();
  report_mixed(data);
  return data;
}

gnss::NavigationData read_rinex_navigation(const std::filesystem::path& path,
                                           const std::set<gnss::System>& wanted) {
  return read_rinex_navigation(std::vector{path}, wanted);
}

gnss::NavigationData read_rinex_navigation(const std::vector<std::filesystem::path>& paths,
                                           const std::set<gnss::System>& wanted) {
  if (paths.empty()) throw InputError("no navigation file given");
  gnss::NavigationData all;
  for (const std::filesystem::path& path : paths) {
    all.merge(read_as(FileKind::RinexNavigation, path, [&] {
      return Reader(TextFile(path, std::size_t{1} << 31, CutGzip::ReadToCut), wanted).read();
    }));
  }
  report_mixed(all);
  return all;
}

}  // namespace canyon::rinex
