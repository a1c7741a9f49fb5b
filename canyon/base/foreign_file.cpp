#include "canyon/base/foreign_file.hpp"

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon {
namespace {

using namespace std::string_view_literals;

bool contains(std::string_view head, std::string_view word) {
  return head.find(word) != std::string_view::npos;
}

/// The two lines of a satellite's elements.
bool is_elements(std::string_view head) {
  constexpr std::size_t kLength = 69;
  const auto lines = split(head, '\n');
  for (std::size_t i = 0; i + 1 < lines.size(); ++i) {
    const std::string_view first = trim(lines[i]), second = trim(lines[i + 1]);
    if (first.size() == kLength && second.size() == kLength && first.starts_with("1 ") &&
        second.starts_with("2 "))
      return true;
  }
  return false;
}

/// Two frames of MAVLink 2, or of MAVLink 1, one behind the other.
bool is_mavlink(std::string_view head) {
  if (head.size() < 12 || (head[0] != '\xFD' && head[0] != '\xFE')) return false;
  const bool is_signed = head[0] == '\xFD' && (head[2] & 1) != 0;
  const std::size_t around = head[0] == '\xFE' ? 8 : is_signed ? 25 : 12;
  const std::size_t next = around + static_cast<unsigned char>(head[1]);
  return next == head.size() || (next < head.size() && head[next] == head[0]);
}

/// Microseconds since 1970 in eight bytes, the first one highest, before each frame of MAVLink.
bool is_tlog(std::string_view head) {
  constexpr std::size_t kTime = 8;
  if (head.size() < kTime + 2 || (head[kTime] != '\xFD' && head[kTime] != '\xFE')) return false;
  std::uint64_t us = 0;
  for (std::size_t i = 0; i < kTime; ++i) us = us << 8 | static_cast<unsigned char>(head[i]);
  constexpr std::uint64_t k2000_us = 946'684'800'000'000, k2100_us = 4'102'444'800'000'000;
  return us > k2000_us && us < k2100_us;
}

bool is_product(std::string_view head) {
  const std::string_view line = head.substr(0, head.find('\n'));
  return contains(line, "ANTEX VERSION") || contains(line, "IONEX VERSION") || line.starts_with("%=SNX") ||
         line.starts_with("%=BIA");
}

bool is_almanac(std::string_view head) {
  return head.starts_with("********") && contains(head, "almanac for PRN");
}

/// A glider's flight: the maker's record, then the headers.
bool is_flight(std::string_view head) {
  return head.starts_with('A') && contains(head, "\nHF");
}

bool is_svg(std::string_view head) {
  return trim(head).starts_with('<') && contains(head, "<svg");
}

bool is_sigmf(std::string_view head) {
  return trim(head).starts_with('{') && contains(head, "\"core:datatype\"");
}

/// Header lines of HTTP or NTRIP without binary data (frames of RTCM) behind them.
bool is_http_reply(std::string_view head) {
  return (head.starts_with("HTTP/1.") || head.starts_with("HTTP/2") || head.starts_with("ICY 200") ||
          head.starts_with("ERROR - ")) &&
         !contains(head, "\xD3");
}

bool is_plan(std::string_view head) {
  return head.starts_with("QGC WPL") || (trim(head).starts_with('{') && contains(head, "\"QGroundControl\""));
}

bool is_dataflash_text(std::string_view head) {
  return head.starts_with("FMT,") && contains(head.substr(0, head.find('\n')), ", FMT,");
}

/// NovAtel's ASCII logs: "#BESTPOSA,COM1,0,...;...*checksum", "%INSPVASA,2312,295218.000;...*checksum".
bool is_novatel_text(std::string_view head) {
  const std::string_view line = head.substr(0, head.find('\n'));
  const std::size_t comma = line.find(',');
  return (line.starts_with('#') || line.starts_with('%')) && comma != std::string_view::npos && comma > 2 &&
         line[comma - 1] == 'A' && line.find(';') != std::string_view::npos &&
         line.find('*') != std::string_view::npos;
}

bool is_gpsd(std::string_view head) {
  return trim(head).starts_with('{') &&
         (contains(head, R"("class":"TPV")") || contains(head, R"("class": "TPV")") ||
          contains(head, R"({"class":"VERSION")"));
}

bool is_takeout(std::string_view head) {
  return trim(head).starts_with('{') &&
         (contains(head, "\"timelineObjects\"") || contains(head, "\"latitudeE7\""));
}

bool is_urdf(std::string_view head) {
  return trim(head).starts_with('<') && contains(head, "<robot ");
}

/// A drawing begins with a group code 0 and "SECTION".
bool is_dxf(std::string_view head) {
  const auto lines = split(head.substr(0, 256), '\n');
  return lines.size() > 1 && trim(lines[0]) == "0" && trim(lines[1]) == "SECTION";
}

bool is_dwg(std::string_view head) {
  return head.size() > 6 && head.starts_with("AC10") && head[6] == '\0';
}

bool is_riff_wave(std::string_view head) {
  return head.size() > 12 && head.starts_with("RIFF") && head.substr(8, 4) == "WAVE";
}

/// A kind by bytes at a place, or by a look at the head.
struct ForeignRow {
  constexpr ForeignRow(const ForeignFile& kind, std::string_view bytes, std::size_t place = 0)
      : file(kind), mark(bytes), at(place) {}
  constexpr ForeignRow(const ForeignFile& kind, bool (*look)(std::string_view head)) : file(kind), is(look) {}

  ForeignFile file;
  std::string_view mark;
  std::size_t at = 0;
  bool (*is)(std::string_view head) = nullptr;
};

constexpr std::string_view kToRinex = "convert it to RINEX, for instance by RTKLIB's convbin";
constexpr std::string_view kToGpx = "convert it to GPX, for instance by gpsbabel";
constexpr std::string_view kNotUsed = "Canyon does not use it";
constexpr std::string_view kToMesh = "export it as glTF, OBJ, PLY or COLLADA";
constexpr std::string_view kPicture = "Canyon does not use pictures";
constexpr ForeignFile kCapture{"a capture of network packets (PCAP)",
                               "save what the receiver sent: tshark -q -z follow,tcp,raw,0 or `nc` prints "
                               "it; NMEA, RTCM 3 and RINEX are read"};
constexpr ForeignFile kSamples{"a recording of radio samples (SigMF)",
                               "Canyon writes such files (canyon iq) and does not read them: a software "
                               "receiver such as GNSS-SDR makes RINEX of them"};
constexpr ForeignFile kTable{"a table in a binary format", "export it as CSV with a header"};
constexpr ForeignFile kShape{"a part of an Esri shapefile",
                             "convert it by ogr2ogr: a path to GPX or CSV, buildings to CityJSON or "
                             "OpenStreetMap"};
constexpr ForeignFile kRos2Bag{"a bag of ROS 2",
                               "play it, and write `ros2 topic echo --csv /TOPIC` to a file; put a line of "
                               "the columns' names above it"};
constexpr ForeignFile kMake{"a raw log of a receiver's maker", kToRinex};

constexpr ForeignRow kForeignRows[] = {
    {{"a log of a u-blox receiver (UBX)", kToRinex}, "\xB5\x62"},
    {{"a log of a Septentrio receiver (SBF)",
      "convert it to RINEX or NMEA, for instance by RTKLIB's convbin"},
     "$@"},
    {{"a log of a NovAtel receiver", kToRinex}, "\xAA\x44\x12"},
    {{"a log of a NovAtel receiver", kToRinex}, "\xAA\x44\x13"},
    {{"a text log of a NovAtel or Unicore receiver", "the maker's tool makes RINEX of it"}, is_novatel_text},
    {{"an NTRIP caster's list of streams",
      "the address has no mount point, or one that the caster has not: take one of the lines that begin "
      "STR;"},
     "SOURCETABLE "},
    {{"a server's answer with its header lines (HTTP, NTRIP)",
      "if it is not an error, save what follows its first empty line, for instance by curl without -i"},
     is_http_reply},
    {{"a plan of a flight (QGroundControl, Mission Planner)",
      "write its places as waypoints of trajectory, or fly it in PX4's or ArduPilot's SITL"},
     is_plan},
    {{"a log of ArduPilot as text (DataFlash)",
      "mavlogdump.py --format csv --types GPS FILE.bin writes a path of format csv"},
     is_dataflash_text},
    {{"a log of PX4 (ULog)",
      "ulog2csv of pyulog writes the table vehicle_gps_position, which is a path of format csv"},
     "ULog\x01"},
    {{"a log of ArduPilot (DataFlash)", "mavlogdump.py --format csv --types GPS writes a path of format csv"},
     "\xA3\x95"},
    {{"a telemetry log of MAVLink (tlog)",
      "mavlogdump.py --format csv --types GLOBAL_POSITION_INT writes its places"},
     is_tlog},
    {{"a stream of MAVLink",
      "canyon live takes poses from such a line (live.poses, format: mavlink), not from a file"},
     is_mavlink},
    {{"a file of Garmin's FIT", kToGpx}, ".FIT", 8},
    {{"a file of antennas, ionosphere, biases or stations (ANTEX, IONEX, SINEX)", kNotUsed}, is_product},
    {{"an almanac (YUMA)", "it is not read: give RINEX navigation files or SP3 files of the day"},
     is_almanac},
    {{"a bag of ROS", "rostopic echo -b FILE -p /TOPIC writes a path of format csv"}, "#ROSBAG"},
    {kRos2Bag, "\x89MCAP"},
    {{"a database (SQLite)",
      "export its table as CSV, or its layer as GPX by ogr2ogr; a bag of ROS 2: play "
      "it, and write `ros2 topic echo --csv /TOPIC` to a file"},
     "SQLite format 3"},
    {kCapture, "\xd4\xc3\xb2\xa1"sv},
    {kCapture, "\xa1\xb2\xc3\xd4"sv},
    {kCapture, "\x4d\x3c\xb2\xa1"sv},
    {kCapture, "\xa1\xb2\x3c\x4d"sv},
    {kCapture, "\x0a\x0d\x0d\x0a"sv},
    {kSamples, is_sigmf},
    {{"a list of orbital elements (TLE)",
      "they are not read: give RINEX navigation files or SP3 files of the day"},
     is_elements},
    {{"a cloud of points (LAS)",
      "make a height raster of its ground, for instance by PDAL: terrain takes it"},
     "LASF"},
    {kShape, "\0\0\x27\x0a"sv},
    {{"a GeoTIFF or another picture (TIFF)", "heights are city.terrain, beside a map"}, "II*\0"sv},
    {{"a GeoTIFF or another picture (TIFF)", "heights are city.terrain, beside a map"}, "MM\0*"sv},
    {{"a picture (PNG)", kPicture}, "\x89PNG"},
    {{"a picture (JPEG)", kPicture}, "\xff\xd8\xff"},
    {{"a picture (SVG)", kPicture}, is_svg},
    {{"a document (PDF)", "Canyon reads data alone"}, "%PDF-"},
    {{"a program", "Canyon reads data alone"},
     "\x7f"
     "ELF"},
    {kTable, "MATLAB 5.0"},
    {kTable, "\x89HDF"},
    {kTable, "PAR1"},
    {kTable, "\x93NUMPY"},
    {{"a sound file (WAV)", "Canyon does not read samples; it writes them (canyon iq)"}, is_riff_wave},
    {{"a mesh of Autodesk's FBX", kToMesh}, "Kaydara FBX"},
    {{"a file of Blender", kToMesh}, "BLENDER"},
    {{"a drawing (DWG)", kToMesh}, is_dwg},
    {{"a drawing (DXF)", kToMesh}, is_dxf},
    {{"a building model (IFC)", "convert it to glTF by IfcConvert, or to CityJSON"}, "ISO-10303-21"},
    {{"a robot (URDF)", "gz sdf -p FILE writes SDF"}, is_urdf},
    {kMake, "RT27"},
    {kMake, "\xA0\xA1"},
    {kMake, "\xA0\xA2"},
    {{"a log of gpsd (JSON)", "gpspipe -r writes NMEA, gpxlogger GPX"}, is_gpsd},
    {{"the places of a Google account (Takeout)", "convert it to GPX, for instance by gpsbabel"}, is_takeout},
    {{"a flight log (IGC)", kToGpx}, is_flight},
};

/// Overpass's pages of errors are XHTML.
bool is_web_page(std::string_view head) {
  std::string text = lower_case(trim(head.substr(0, 256)));
  if (text.starts_with("<?xml")) text = trim(text.substr(std::min(text.find("?>"), text.size() - 2) + 2));
  return text.starts_with("<!doctype html") || text.starts_with("<html");
}

/// What refuse_foreign_bytes() refuses.
constexpr ForeignRow kRefusedRows[] = {
    {{"packed by xz", "unpack it first (unxz)"},
     "\xfd"
     "7zXZ\0"sv},
    {{"packed by Zstandard", "unpack it first (unzstd)"}, "\x28\xb5\x2f\xfd"},
    {{"packed by 7-Zip", "unpack it first (7z x)"}, "7z\xbc\xaf\x27\x1c"},
    {{"packed by RAR", "unpack it first (unrar)"}, "Rar!\x1a\x07"},
    {{"a tar archive", "unpack it and name one of its files"}, "ustar", 257},
    {{"a pointer of Git LFS, not the data", "run git lfs pull in its repository"}, "version https://git-lfs"},
    {{"a web page (HTML), not data",
      "the server may want you to sign in: open the address in a browser, then fetch it again"},
     is_web_page},
};

/// Endings of files whose bytes have no mark.
struct EndingRow {
  std::string_view endings;  ///< with blanks between
  ForeignFile file;
};
constexpr EndingRow kEndings[] = {
    {".sigmf-data", kSamples},
    {".iq .cfile .cf32 .cs16 .cs8 .c16 .c8 .fc32 .sc16",
     {"by its name a recording of radio samples",
      "Canyon writes samples (canyon iq) and does not read them: a software receiver such as GNSS-SDR makes "
      "RINEX of them"}},
    {".dbf .shx .prj .cpg", kShape},
    {".t02 .t04 .tps .jps .sbf .rt17 .stq .bnx .m00", kMake},
    {".rtcm2", {"by its name a stream of RTCM 2", "have the base send RTCM 3"}},
    {".erp .clk .dcb .atx .blq", {"by its name a file of the IGS's other products", kNotUsed}},
    {".xlsx .xls .ods", {"a spreadsheet", "save it as CSV"}},
};

const ForeignFile* first_of(std::span<const ForeignRow> rows, std::string_view head) {
  for (const ForeignRow& row : rows) {
    const bool is = row.is != nullptr
                        ? row.is(head)
                        : head.size() > row.at && head.substr(row.at, row.mark.size()) == row.mark;
    if (is) return &row.file;
  }
  return nullptr;
}

}  // namespace

const ForeignFile* foreign_file(std::string_view head) {
  return first_of(kForeignRows, head);
}

void refuse_foreign_bytes(const std::filesystem::path& path, std::string_view head) {
  if (const ForeignFile* const file = first_of(kRefusedRows, head))
    throw InputError(path, 0, "is " + std::string(file->name), std::string(file->use));
}

const ForeignFile* foreign_ending(std::string_view ending) {
  const std::string wanted = lower_case(ending);
  for (const EndingRow& row : kEndings) {
    const auto known = split_blanks(row.endings);
    if (std::find(known.begin(), known.end(), wanted) != known.end()) return &row.file;
  }
  return nullptr;
}

}  // namespace canyon
