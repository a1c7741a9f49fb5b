#include "canyon/base/archives.hpp"

#include <bzlib.h>
#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon {
namespace {

using namespace std::string_view_literals;

InputError damaged(const std::filesystem::path& path, const char* kind) {
  return {path, 0, std::string(kind) + " data are damaged or cut short", "fetch the file again"};
}

InputError too_large(const std::filesystem::path& path, std::size_t largest) {
  return {path, 0, "unpacks to more than " + std::to_string(largest >> 20) + " MiB", "is it the right file?"};
}

/// The strings of an LZW table, each an earlier one and a byte.
class LzwTable {
 public:
  explicit LzwTable(std::size_t first_free) : first_free_(first_free) { clear(); }
  void clear() { entries_.assign(first_free_, {}); }
  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  void add(unsigned prefix, char last) { entries_.push_back({prefix, last}); }
  /// Appends the string of a code; returns its first byte.
  char append(unsigned code, std::string& to) const {
    const std::size_t begin = to.size();
    for (; code > 255; code = entries_[code].prefix) to += entries_[code].last;
    to += static_cast<char>(code);
    std::reverse(to.begin() + static_cast<std::ptrdiff_t>(begin), to.end());
    return static_cast<char>(code);
  }

 private:
  struct Entry {
    unsigned prefix = 0;
    char last = 0;
  };
  std::size_t first_free_;
  std::vector<Entry> entries_;
};

unsigned bits_at(std::string_view bytes, std::size_t bit, unsigned count) {
  unsigned value = 0;
  for (unsigned k = 0; k < count; ++k) {
    const auto byte = static_cast<unsigned char>(bytes[(bit + k) / 8]);
    value |= (byte >> ((bit + k) % 8) & 1U) << k;
  }
  return value;
}

std::uint32_t little_endian(std::string_view bytes, std::size_t at, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < count && at + k < bytes.size(); ++k)
    value |= std::uint32_t{static_cast<unsigned char>(bytes[at + k])} << (8 * k);
  return value;
}

/// An entry of a zip archive's central directory.
struct ZipEntry {
  std::string_view name;
  std::uint32_t flags = 0, method = 0, packed_size = 0, size = 0, header = 0;
};

/// The files of an archive, without folders and what macOS adds.
std::vector<ZipEntry> zip_entries(std::string_view archive) {
  const std::size_t end = archive.rfind("PK\x05\x06"sv);
  std::vector<ZipEntry> entries;
  if (end == std::string_view::npos) return entries;
  std::size_t at = little_endian(archive, end + 16, 4);
  constexpr std::size_t kFixed = 46;
  while (at + kFixed <= archive.size() && archive.substr(at, 4) == "PK\x01\x02"sv) {
    const std::size_t name_length = little_endian(archive, at + 28, 2);
    ZipEntry entry{archive.substr(at + kFixed, name_length), little_endian(archive, at + 8, 2),
                   little_endian(archive, at + 10, 2),       little_endian(archive, at + 20, 4),
                   little_endian(archive, at + 24, 4),       little_endian(archive, at + 42, 4)};
    if (!entry.name.empty() && entry.name.back() != '/' && entry.name.substr(0, 9) != "__MACOSX/")
      entries.push_back(entry);
    at += kFixed + name_length + little_endian(archive, at + 30, 2) + little_endian(archive, at + 32, 2);
  }
  return entries;
}

/// Unpacks raw deflate to `size` bytes; empty where it is damaged.
std::optional<std::string> inflated(std::string_view packed, std::size_t size) {
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) return std::nullopt;
  std::string unpacked(size, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(unpacked.data());
  stream.avail_out = static_cast<uInt>(size);
  const int code = inflate(&stream, Z_FINISH);
  const bool whole = code == Z_STREAM_END && stream.total_out == size;
  inflateEnd(&stream);
  return whole ? std::optional(std::move(unpacked)) : std::nullopt;
}

}  // namespace

bool is_gzip(std::string_view head) {
  return head.substr(0, 2) == "\x1f\x8b"sv;
}
bool is_bzip2(std::string_view head) {
  return head.size() > 3 && head.substr(0, 3) == "BZh" && head[3] >= '1' && head[3] <= '9';
}
bool is_compress(std::string_view head) {
  return head.substr(0, 2) == "\x1f\x9d"sv;
}
bool is_zip(std::string_view head) {
  return head.substr(0, 4) == "PK\x03\x04"sv;
}

bool is_unpacked_whole(std::string_view head) {
  return is_bzip2(head) || is_compress(head) || is_zip(head);
}

std::string unpack(const std::filesystem::path& path, std::string_view packed) {
  const auto largest = static_cast<std::size_t>(std::min<std::uint64_t>(
      kLargestUnpacked, std::max<std::uint64_t>(kHarmlessSize, kMostGrowth * packed.size())));
  if (is_zip(packed)) return unpack_zip(path, packed, largest);
  return is_bzip2(packed) ? unpack_bzip2(path, packed, largest) : unpack_compress(path, packed, largest);
}

std::string unpack_bzip2(const std::filesystem::path& path, std::string_view packed, std::size_t largest) {
  std::string text;
  std::string block(std::size_t{1} << 16, '\0');
  do {
    bz_stream stream{};
    if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) throw damaged(path, "bzip2");
    stream.next_in = const_cast<char*>(packed.data());
    stream.avail_in = static_cast<unsigned>(packed.size());
    int code = BZ_OK;
    bool goes_on = true;
    while (code == BZ_OK && goes_on && text.size() <= largest) {
      stream.next_out = block.data();
      stream.avail_out = static_cast<unsigned>(block.size());
      code = BZ2_bzDecompress(&stream);
      // Data without an end mark are cut short: nothing comes any more.
      goes_on = stream.avail_in > 0 || stream.avail_out == 0;
      text.append(block, 0, block.size() - stream.avail_out);
    }
    packed.remove_prefix(packed.size() - stream.avail_in);
    BZ2_bzDecompressEnd(&stream);
    if (text.size() > largest) throw too_large(path, largest);
    if (code != BZ_STREAM_END) throw damaged(path, "bzip2");
  } while (is_bzip2(packed));
  return text;
}

std::string unpack_compress(const std::filesystem::path& path, std::string_view packed, std::size_t largest) {
  constexpr unsigned kFewestBits = 9, kMostBits = 16, kClear = 256;
  const unsigned flags = packed.size() > 2 ? static_cast<unsigned char>(packed[2]) : 0;
  const unsigned most_bits = flags & 31U;
  const bool clears = (flags & 128U) != 0;
  if (most_bits < kFewestBits || most_bits > kMostBits) throw damaged(path, "compress");
  LzwTable table(clears ? kClear + 1 : kClear);
  std::string text;
  unsigned bits = kFewestBits;
  std::int64_t last = -1;  // code before; none yet
  for (std::size_t at = 3, length = bits; at < packed.size(); at += length) {
    // Codes of equal length come in groups of eight. Where the length changes, the rest of a group is unused.
    length = bits;
    const std::string_view group = packed.substr(at, length);
    bool next_group = false;
    for (std::size_t k = 0; (k + 1) * length <= group.size() * 8 && !next_group; ++k) {
      const unsigned code = bits_at(group, k * length, static_cast<unsigned>(length));
      if (clears && code == kClear) {
        table.clear();
        last = -1;
        bits = kFewestBits;
        next_group = true;
        continue;
      }
      if (code > table.size() || (last < 0 && code > 255)) throw damaged(path, "compress");
      if (last >= 0 && table.size() < std::size_t{1} << most_bits) {
        std::string first;
        const auto prefix = static_cast<unsigned>(last);
        table.add(prefix, table.append(code == table.size() ? prefix : code, first));
      }
      if (code >= table.size()) throw damaged(path, "compress");
      table.append(code, text);
      if (text.size() > largest) throw too_large(path, largest);
      last = code;
      if (table.size() == std::size_t{1} << bits && bits < most_bits) {
        ++bits;
        next_group = true;
      }
    }
  }
  return text;
}

std::string unpack_zip(const std::filesystem::path& path, std::string_view archive, std::size_t largest) {
  std::vector<ZipEntry> entries = zip_entries(archive);
  // A KMZ file has its icons and pictures beside the KML file.
  if (lower_case(path.extension().string()) == ".kmz") {
    std::erase_if(entries, [](const ZipEntry& entry) { return !lower_case(entry.name).ends_with(".kml"); });
  }
  if (entries.empty()) throw damaged(path, "zip");
  if (entries.size() > 1) {
    const bool spreadsheet = std::any_of(entries.begin(), entries.end(), [](const ZipEntry& entry) {
      return entry.name == "xl/workbook.xml" || entry.name == "content.xml";
    });
    if (spreadsheet) throw InputError(path, 0, "is a spreadsheet", "save it as CSV");
    throw InputError(path, 0, "is a zip archive of " + std::to_string(entries.size()) + " files",
                     "unpack it and name one of them");
  }
  const ZipEntry& entry = entries.front();
  if ((entry.flags & 1U) != 0) throw InputError(path, 0, "is an encrypted zip archive", "unpack it first");
  if (entry.size > largest) throw too_large(path, largest);
  constexpr std::size_t kFixed = 30;
  const std::size_t begin = entry.header + kFixed + little_endian(archive, entry.header + 26, 2) +
                            little_endian(archive, entry.header + 28, 2);
  if (begin + entry.packed_size > archive.size()) throw damaged(path, "zip");
  const std::string_view packed = archive.substr(begin, entry.packed_size);
  constexpr std::uint32_t kStored = 0, kDeflated = 8;
  if (entry.method == kStored) return std::string(packed);
  if (entry.method != kDeflated) {
    throw InputError(path, 0, "is a zip archive of a method that is not known here", "unpack it first");
  }
  auto unpacked = inflated(packed, entry.size);
  if (!unpacked) throw damaged(path, "zip");
  return std::move(*unpacked);
}

void refuse_foreign_bytes(const std::filesystem::path& path, std::string_view head) {
  const std::pair<std::string_view, const char*> archives[] = {{"\xfd"
                                                                "7zXZ\0"sv,
                                                                "xz; unxz"},
                                                               {"\x28\xb5\x2f\xfd"sv, "Zstandard; unzstd"},
                                                               {"7z\xbc\xaf\x27\x1c"sv, "7-Zip; 7z x"},
                                                               {"Rar!\x1a\x07"sv, "RAR; unrar"}};
  for (const auto& [mark, names] : archives) {
    if (head.substr(0, mark.size()) != mark) continue;
    const auto pieces = split(names, ';');
    throw InputError(path, 0, "is packed by " + std::string(pieces[0]),
                     "unpack it first (" + std::string(trim(pieces[1])) + ")");
  }
  if (head.size() > 262 && head.substr(257, 5) == "ustar")
    throw InputError(path, 0, "is a tar archive", "unpack it and name one of its files");
  if (head.starts_with("version https://git-lfs"))
    throw InputError(path, 0, "is a pointer of Git LFS, not the data", "run git lfs pull in its repository");
  std::string text = lower_case(trim(head.substr(0, 256)));
  // Overpass's pages of errors are XHTML.
  if (text.starts_with("<?xml")) text = trim(text.substr(std::min(text.find("?>"), text.size() - 2) + 2));
  if (text.starts_with("<!doctype html") || text.starts_with("<html"))
    throw InputError(
        path, 0, "is a web page (HTML), not data",
        "the server may want you to sign in: open the address in a browser, then fetch it again");
}

}  // namespace canyon
