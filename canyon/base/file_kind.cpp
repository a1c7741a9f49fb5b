#include "canyon/base/file_kind.hpp"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <string>

#include "canyon/base/gzip_file.hpp"
#include "canyon/base/text.hpp"

namespace canyon {
namespace {

bool has(std::string_view head, std::string_view word) {
  return head.find(word) != std::string_view::npos;
}

std::string_view first_line(std::string_view head) {
  return head.substr(0, head.find('\n'));
}

/// The type in a RINEX header's first line; 0 for another text.
char rinex_type(std::string_view head) {
  const std::string_view line = first_line(head);
  if (has(line, "CRINEX VERS")) return 'O';
  return line.size() > 20 && has(line, "RINEX VERSION / TYPE") ? line[20] : '\0';
}

bool is_navigation(std::string_view head) {
  return std::string_view("\0OCM", 4).find(rinex_type(head)) == std::string_view::npos;
}

/// A comment with the column names of "Raw", "Fix" or "Status", or a line of "Raw".
bool is_gnss_logger(std::string_view head) {
  const auto lines = split(head, '\n');
  return std::any_of(lines.begin(), lines.end(), [](std::string_view line) {
    line = trim(line);
    if (line.starts_with("Raw,")) return true;
    if (!line.starts_with('#')) return false;
    const std::string_view comment = trim(line.substr(1));
    return comment.starts_with("Raw,") || comment.starts_with("Fix,") || comment.starts_with("Status,");
  });
}

bool is_sp3(std::string_view head) {
  return head.size() > 2 && head[0] == '#' && head[1] >= 'a' && head[1] <= 'd' &&
         (head[2] == 'P' || head[2] == 'V');
}

/// " # 1991  2  3 ...": the first line of the format before SP3, columns 2 to 80.
bool is_sp1(std::string_view head) {
  const std::string_view line = first_line(head);
  return line.starts_with(" # ") && parse_integer(column(line, 3, 5)).value_or(0) > 1980 &&
         split_blanks(line).size() > 8;
}

/// The preamble, its six zero bits, the message number; and after the message another one, an NMEA sentence,
/// a UBX message or the end. Other data match the first three now and then.
bool is_rtcm(std::string_view head) {
  if (head.starts_with("\xB5\x62")) return false;
  const auto byte = [head](std::size_t at) { return static_cast<unsigned char>(head[at]); };
  for (std::size_t at = head.find('\xD3'); at != std::string_view::npos; at = head.find('\xD3', at + 1)) {
    if (at + 1 >= head.size() || byte(at + 1) > 3) continue;
    if (at + 4 >= head.size()) return true;
    const int number = byte(at + 3) << 4 | byte(at + 4) >> 4;
    if (!((number > 1000 && number < 1305) || (number > 4000 && number < 4096))) continue;
    const std::size_t next = at + 6 + static_cast<std::size_t>(byte(at + 1) << 8 | byte(at + 2));
    if (next >= head.size() || std::string_view("\xD3\xB5$\r\n").find(head[next]) != std::string_view::npos)
      return true;
  }
  return false;
}

/// Whether the text has "$GPGGA," or another address of letters.
bool is_nmea(std::string_view head) {
  for (std::size_t at = head.find('$'); at != std::string_view::npos; at = head.find('$', at + 1)) {
    const std::size_t end = head.find_first_of(",\n", at);
    if (end == std::string_view::npos || head[end] != ',') continue;
    const std::string_view address = head.substr(at + 1, end - at - 1);
    if (address.size() >= 4 && address.size() <= 8 &&
        std::all_of(address.begin(), address.end(), [](unsigned char c) { return std::isupper(c) != 0; }))
      return true;
  }
  return false;
}

/// A line of four or more numbers separated by blanks, optionally after a date.
bool is_blank_separated(std::string_view line) {
  const auto words = split_blanks(line);
  return std::count_if(words.begin(), words.end(), [](auto word) { return parse_double(word).has_value(); }) >
         3;
}

bool is_columns(std::string_view head) {
  const std::string_view text = trim(head);
  if (has(head, std::string_view("\0", 1)) || text.starts_with('<') || text.starts_with('{')) return false;
  const auto lines = split(head, '\n');
  return head.find_first_of(",;\t") != std::string_view::npos ||
         std::any_of(lines.begin(), lines.end(), is_blank_separated);
}

/// MAVLink 1 or 2 after a time from 1996 to 2103, in microseconds, big-endian.
bool is_tlog(std::string_view head) {
  return head.size() > 9 && head[0] == 0 && head[1] > 2 && head[1] < 16 &&
         (head[8] == '\xFD' || head[8] == '\xFE');
}

/// Conversion of a bag to a track.
constexpr std::string_view kBagUse =
    "it is not read: convert the fixes of its topic /fix to CSV: play it (ros2 bag play BAG) and run "
    "ros2 topic echo --csv /fix > fix.csv; name the columns in trajectory.columns";

/// The kinds in the order of detection; a text of one kind may contain another kind.
struct Row {
  FileKind kind;
  bool (*is)(std::string_view head);
  std::string_view name, format, use;
};
constexpr Row kKinds[] = {
    {FileKind::Foreign, [](auto head) { return head.starts_with("ULog\x01\x12\x35"); },
     "a flight log of PX4 (ULog)", "",
     "it is not read: convert its fixes to CSV with ulog2csv -m vehicle_gps_position FILE (of pyulog); read "
     "this with trajectory.columns: {unix_time: \"time_utc_usec [us]\", latitude: \"latitude_deg [deg]\", "
     "longitude: \"longitude_deg [deg]\", height: \"altitude_ellipsoid_m [m]\"}"},
    {FileKind::Foreign, [](auto head) { return head.starts_with("\xA3\x95\x80"); },
     "a flight log of ArduPilot (DataFlash)", "",
     "it is not read: convert its fixes to CSV with mavlogdump.py --format csv --types GPS FILE > gps.csv "
     "(of pymavlink); read this with trajectory.columns: {unix_time: \"timestamp [s]\", latitude: \"Lat "
     "[deg]\", longitude: \"Lng [deg]\", height_msl: \"Alt [m]\"}"},
    {FileKind::Foreign, is_tlog, "a telemetry log of MAVLink (tlog)", "",
     "it is not read: convert its positions to CSV with mavlogdump.py --format csv --types "
     "GLOBAL_POSITION_INT FILE > gps.csv (of pymavlink); read this with trajectory.columns: {unix_time: "
     "\"timestamp [s]\", latitude: \"lat [e7]\", longitude: \"lon [e7]\", height_msl: \"alt [mm]\"}"},
    {FileKind::Foreign, [](auto head) { return head.starts_with("#ROSBAG V"); }, "a bag of ROS 1", "",
     "it is not read: convert the fixes of its topic /fix to CSV with rostopic echo -b FILE -p /fix > "
     "fix.csv; name the columns in trajectory.columns"},
    {FileKind::Foreign, [](auto head) { return head.starts_with("\x89MCAP0\r\n"); }, "a bag of ROS 2 (MCAP)",
     "", kBagUse},
    {FileKind::Foreign,
     [](auto head) { return head.starts_with("SQLite format 3") && column(head, 68, 4) != "GPKG"; },
     "an SQLite database, perhaps a bag of ROS 2", "", kBagUse},
    {FileKind::Foreign, [](auto head) { return has(head, "rosbag2_bagfile_information"); }, "a bag of ROS 2",
     "", kBagUse},
    {FileKind::RinexObservation, [](auto head) { return rinex_type(head) == 'O'; },
     "a RINEX observation file", "", "give it to canyon validate --obs or canyon rtk"},
    {FileKind::RinexNavigation, is_navigation, "a RINEX navigation file", "",
     "use it in a scenario's sky: sky: {navigation: [FILE]}"},
    {FileKind::GnssLogger, is_gnss_logger, "a log of Android's GnssLogger", "gnsslogger",
     "give it to canyon validate --obs, or use it as a trajectory of format gnsslogger"},
    {FileKind::Sp3, is_sp3, "an SP3 file", "", "use it in a scenario's sky: sky: {sp3: [FILE]}"},
    {FileKind::Gpx, [](auto head) { return has(head, "<gpx") || has(head, ":gpx "); }, "a GPX file", "gpx",
     "use it as a trajectory of format gpx"},
    {FileKind::Kml, [](auto head) { return has(head, "<kml") || has(head, ":kml "); }, "a KML file", "kml",
     "use it as a trajectory of format kml"},
    {FileKind::Rtcm, is_rtcm, "a stream of RTCM 3", "", "give it to canyon rtk as the base"},
    {FileKind::Foreign, [](auto head) { return rinex_type(head) == 'C'; }, "a RINEX clock file", "",
     "it is not read: use the clocks in the orbits of sky: {sp3: [FILE]}"},
    {FileKind::Foreign, [](auto head) { return rinex_type(head) == 'M'; }, "a RINEX meteorological file", "",
     "it is not read"},
    {FileKind::Foreign, [](auto head) { return has(first_line(head), "IONEX VERSION / TYPE"); },
     "an ionosphere map (IONEX)", "", "it is not read"},
    {FileKind::Foreign, [](auto head) { return has(first_line(head), "ANTEX VERSION / SYST"); },
     "an antenna file (ANTEX)", "", "it is not read"},
    {FileKind::Foreign, is_sp1, "an orbit file in format SP1", "", "it is not read: give SP3-c or SP3-d"},
    {FileKind::Foreign, [](auto head) { return has(first_line(trim(head)), "almanac for PRN"); },
     "an almanac (YUMA)", "", "it is not read: give a RINEX navigation file of that day"},
    {FileKind::Foreign, [](auto head) { return has(head, "<osmChange"); },
     "an OpenStreetMap change file (.osc)", "",
     "apply it to a map (osmium apply-changes) and give the new map"},
    {FileKind::Foreign,
     [](auto head) { return has(head, "<osm") || (head.starts_with('\0') && has(head, "OSMHeader")); },
     "a map of OpenStreetMap", "", "use it in a scenario's city: city: {osm: FILE}"},
    {FileKind::Nmea, is_nmea, "a log of NMEA sentences", "nmea",
     "use it as a trajectory of format nmea; convert other contents to RINEX with RTKLIB's convbin"},
    {FileKind::Foreign, [](auto head) { return head.starts_with("\xB5\x62"); }, "a log of UBX", "",
     "it is not read: convert its RXM-RAWX to RINEX observations with RTKLIB's convbin -r ubx"},
    {FileKind::Foreign, [](auto head) { return head.starts_with("$@"); }, "a log of SBF", "",
     "it is not read: convert it to RINEX observations and navigation with RTKLIB's convbin -r sbf"},
    {FileKind::Columns, is_columns, "a text of columns", "", ""},
};

/// The unpacked beginning of a file.
std::string head_of(const std::filesystem::path& path) {
  const std::filesystem::path bag = path / "metadata.yaml";  // a bag of ROS 2 is a folder
  std::error_code ignored;
  GzipFile file(std::filesystem::exists(bag, ignored) ? bag : path);
  std::string head(std::size_t{1} << 14, '\0');
  std::size_t size = 0;
  while (const std::size_t n = file.read(head.data() + size, head.size() - size, 0)) size += n;
  head.resize(size);
  return head;
}

/// The first row for which `holds` is true; null if there is none.
template <typename Holds>
const Row* row_where(const Holds& holds) {
  const auto* const at = std::find_if(std::begin(kKinds), std::end(kKinds), holds);
  return at == std::end(kKinds) ? nullptr : at;
}
const Row* row_of(FileKind kind) {
  return row_where([kind](const Row& row) { return row.kind == kind; });
}
const Row* row_of_head(std::string_view head) {
  return row_where([head](const Row& row) { return row.is(head); });
}

}  // namespace

bool is_scenario(const std::filesystem::path& path) {
  return path.extension() == ".yaml" || path.extension() == ".yml";
}

FileKind kind_of_head(std::string_view head) {
  const Row* row = row_of_head(head);
  return row == nullptr ? FileKind::Other : row->kind;
}

FileKind file_kind(const std::filesystem::path& path) {
  return kind_of_head(head_of(path));
}

std::string_view name(FileKind kind) {
  const Row* row = row_of(kind);
  return row == nullptr ? "a file of another kind" : row->name;
}

std::string_view trajectory_format(FileKind kind) {
  const Row* row = row_of(kind);
  return row == nullptr ? std::string_view() : row->format;
}

FileKind kind_of_trajectory(std::string_view format) {
  const Row* row = row_where([format](const Row& each) { return each.format == format; });
  return row == nullptr ? FileKind::Columns : row->kind;
}

std::optional<InputError> wrong_kind_error(std::string_view head, const std::filesystem::path& path,
                                           std::string_view wanted) {
  const Row* row = row_of_head(head);
  if (row == nullptr || row->kind == FileKind::Columns || row->name == wanted) return std::nullopt;
  return InputError(path, 0, "is " + std::string(row->name) + ", not " + std::string(wanted), row->use);
}

InputError explained(const InputError& fault, const std::filesystem::path& path, std::string_view wanted) {
  try {
    return wrong_kind_error(head_of(path), path, wanted).value_or(fault);
  } catch (const InputError& unread) {
    std::error_code ignored;
    return std::filesystem::exists(path, ignored) ? fault : unread;
  }
}

InputError explained(const InputError& fault, const std::filesystem::path& path, FileKind wanted) {
  std::string head;
  try {
    head = head_of(path);
  } catch (const InputError&) {
    return fault;
  }
  if (head.empty()) return {path, 0, "is empty", "fetch the file again"};
  if (wanted != FileKind::Columns && row_of(wanted)->is(head)) return fault;
  return wrong_kind_error(head, path, name(wanted)).value_or(fault);
}

}  // namespace canyon
