// The only file that reads OSM formats: libosmium's readers, and their errors turned into InputError.
#include "canyon/buildings/sources/osm_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <new>
#include <osmium/io/any_compression.hpp>
#include <osmium/io/file.hpp>
#include <osmium/io/pbf_input.hpp>
#include <osmium/io/reader.hpp>
#include <osmium/io/xml_input.hpp>
#include <osmium/osm.hpp>
#include <stdexcept>
#include <string_view>

#include "canyon/base/archives.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/input_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/base/utf16.hpp"
#include "canyon/buildings/sources/osm_text.hpp"

namespace canyon::buildings {
namespace {

constexpr const char* kUtf16 = "utf-16";

/// libosmium's name of the format, or kUtf16, by content, since downloads lose their suffix.
std::string sniff_format(const std::filesystem::path& path) {
  check_input_file(path);
  if (!std::ifstream(path)) throw InputError(path, 0, "cannot be read");
  const std::string head = read_head(path, 512);
  if (head.empty()) throw InputError(path, 0, "is empty", "fetch the map again");
  const std::string_view view(head);
  if (is_gzip(view)) return "osm.gz";
  if (is_bzip2(view)) return "osm.bz2";
  if (is_unpacked_whole(view)) throw InputError(path, 0, "is a packed file", "unpack it first");
  refuse_foreign_bytes(path, view);
  // A PBF file begins with the length of a BlobHeader whose type is "OSMHeader".
  if (view[0] == '\0' && view.substr(0, 64).find("OSMHeader") != std::string_view::npos) return "pbf";
  if (Utf16Decoder::is_marked(view)) return kUtf16;
  std::size_t start = view.substr(0, 3) == "\xEF\xBB\xBF" ? 3 : 0;
  start = view.find_first_not_of(" \t\r\n", start);
  if (start != std::string_view::npos && view[start] == '<') return "osm";
  if (start != std::string_view::npos && view[start] == '{') return "json";
  throw InputError(path, 0, "is not an OpenStreetMap file",
                   "give an extract as .osm, .osm.gz, .osm.bz2, .osm.pbf or Overpass JSON");
}

/// Calls `use` with one piece of a file's text after the other, unpacked. Throws what libosmium throws.
template <typename Use>
void for_each_piece(const std::filesystem::path& path, const std::string& format, const Use& use) {
  const osmium::io::File file{std::filesystem::absolute(path).string(), format};
  const auto packed = osmium::io::CompressionFactory::instance().create_decompressor(
      file.compression(), osmium::io::detail::open_for_reading(file.filename()));
  for (std::string piece = packed->read(); !piece.empty(); piece = packed->read()) use(piece);
  packed->close();
}

bool has_error_remark(std::string_view text) {
  constexpr std::string_view kRemark = "<remark>";
  const std::size_t at = text.find(kRemark);
  return at != std::string_view::npos && trim(text.substr(at + kRemark.size())).starts_with("runtime error");
}

/// The text of an XML file that libosmium would not read as it is meant, made plain; empty for others, which
/// may be larger than memory, and for damaged ones, which the reader refuses.
std::optional<std::string> odd_xml(const std::filesystem::path& path, const std::string& format) {
  constexpr std::size_t kLongestTag = 4096;
  constexpr std::size_t kLargest = std::size_t{1} << 28;  // editors save no larger maps
  bool odd = false, gave_up = false;
  std::string text;
  try {
    for_each_piece(path, format, [&](const std::string& piece) {
      text.erase(0, text.size() - std::min(text.size(), kLongestTag));
      text += piece;
      odd = odd || needs_plain_xml(std::string_view(text).substr(0, text.rfind('<')));
      gave_up = gave_up || has_error_remark(text);
    });
    text.clear();
    if (odd && !gave_up) {
      for_each_piece(path, format, [&](const std::string& piece) {
        text += piece;
        if (text.size() > kLargest) throw std::length_error("not the work of an editor");
      });
    }
  } catch (const std::exception&) {
    return std::nullopt;
  }
  if (gave_up) {
    throw InputError(path, 0, "Overpass gave up: a part of the map is missing",
                     "fetch it again with more time, or in smaller pieces");
  }
  if (!odd) return std::nullopt;
  return plain_osm_xml(text);
}

/// Throws osmium::pbf_error for a blob without a type: libosmium compares it by a null pointer.
void check_blob_types(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::array<unsigned char, 4> length{};
  std::string header;
  while (in.read(reinterpret_cast<char*>(length.data()), length.size())) {
    const std::uint32_t size = std::uint32_t{length[0]} << 24 | std::uint32_t{length[1]} << 16 |
                               std::uint32_t{length[2]} << 8 | length[3];
    if (size > static_cast<std::uint32_t>(osmium::io::detail::max_blob_header_size))
      return;  // libosmium says so
    header.resize(size);
    if (!in.read(header.data(), size)) return;
    constexpr int kType = 1, kDataSize = 3;  // fileformat.proto
    bool typed = false;
    std::int32_t data_size = 0;
    for (protozero::pbf_reader blob(header); blob.next();) {
      if (blob.tag() == kType && blob.wire_type() == protozero::pbf_wire_type::length_delimited) {
        typed = blob.get_view().size() > 0;
      } else if (blob.tag() == kDataSize && blob.wire_type() == protozero::pbf_wire_type::varint) {
        data_size = blob.get_int32();
      } else {
        blob.skip();
      }
    }
    if (!typed) throw osmium::pbf_error("a blob has no type");
    if (data_size < 0) return;
    in.seekg(data_size, std::ios::cur);
  }
}

/// Throws osmium::pbf_error for tags with a zero byte within: libosmium looks for their ends, which may be
/// beyond the list.
void check_tags(const osmium::TagList& tags) {
  const auto* const bytes = reinterpret_cast<const unsigned char*>(&tags);
  const unsigned char* const begin = bytes + sizeof(osmium::TagList);
  const unsigned char* const end = bytes + tags.byte_size();
  if (begin == end) return;
  if (end[-1] != 0 || std::count(begin, end, 0) % 2 != 0) throw osmium::pbf_error("a tag has a zero byte");
}

}  // namespace

OsmFile open_osm_file(const std::filesystem::path& path) {
  OsmFile source{path, sniff_format(path), {}};
  if (source.format == "json") {
    source.text = osm_xml_from_overpass(path, TextFile(path).text());
  } else if (source.format == kUtf16) {
    source.text = plain_osm_xml(std::string(TextFile(path).text()));
  } else if (source.format != "pbf") {
    source.text = odd_xml(path, source.format);
  }
  if (source.text) source.format = "osm";
  return source;
}

void for_each_object(const std::vector<OsmFile>& files, osmium::osm_entity_bits::type bits,
                     const UseOsmObject& use) {
  for (const OsmFile& source : files) {
    const std::filesystem::path& path = source.path;
    try {
      if (source.format == "pbf") check_blob_types(path);
      // An absolute path, since libosmium reads "-" and "http:" as something else.
      const osmium::io::File file =
          source.text ? osmium::io::File{source.text->data(), source.text->size(), source.format}
                      : osmium::io::File{std::filesystem::absolute(path).string(), source.format};
      osmium::io::Reader reader{file, bits};
      while (const osmium::memory::Buffer buffer = reader.read()) {
        for (const auto& object : buffer.select<osmium::OSMObject>()) {
          check_tags(object.tags());
          use(object);
        }
      }
      reader.close();
    } catch (const InputError&) {
      throw;
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const osmium::xml_error& error) {
      const std::string_view what = error.what();
      if (what.find("top-level") != std::string_view::npos) {
        throw InputError(path, static_cast<int>(error.line), "is XML, but no OpenStreetMap data",
                         "give an extract whose first element is <osm>");
      }
      throw InputError(path, static_cast<int>(error.line), fmt::format("is cut short or damaged ({})", what),
                       "fetch it again");
    } catch (const osmium::format_version_error& error) {
      throw InputError(path, 0, fmt::format("is OpenStreetMap data of version '{}'", error.version),
                       "version 0.6 is read: fetch a new extract");
    } catch (const osmium::invalid_location& error) {
      throw InputError(
          path, 0,
          fmt::format("holds a coordinate that is not a number or beyond the Earth ({})", error.what()));
    } catch (const std::exception& error) {
      throw InputError(path, 0, fmt::format("is cut short or damaged ({})", error.what()), "fetch it again");
    }
  }
}

}  // namespace canyon::buildings
