#include "canyon/base/unpack.hpp"

#include <archive.h>
#include <archive_entry.h>

#include <algorithm>
#include <clocale>
#include <memory>

#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon {

namespace {

InputError damaged(const std::filesystem::path& path, const char* kind) {
  return {path, 0, std::string(kind) + " data are damaged or cut short", "fetch the file again"};
}

struct FreeArchive {
  void operator()(archive* reader) const { archive_read_free(reader); }
};
using Archive = std::unique_ptr<archive, FreeArchive>;

const char* kind_of(std::string_view packed) {
  return is_zip(packed) ? "zip" : is_bzip2(packed) ? "bzip2" : "compress";
}

/// During its lifetime libarchive reads names as UTF-8 on this thread, independent of the program's locale.
class Utf8Names {
 public:
  Utf8Names() : locale_(newlocale(LC_CTYPE_MASK, "C.UTF-8", nullptr)), before_(uselocale(locale_)) {}
  ~Utf8Names() {
    uselocale(before_);
    if (locale_ != nullptr) freelocale(locale_);
  }
  Utf8Names(const Utf8Names&) = delete;
  Utf8Names& operator=(const Utf8Names&) = delete;

 private:
  locale_t locale_, before_;
};

Archive opened(const std::filesystem::path& path, std::string_view packed) {
  Archive reader(archive_read_new());
  if (is_zip(packed)) {
    archive_read_support_format_zip_seekable(reader.get());
  } else {
    archive_read_support_filter_bzip2(reader.get());
    archive_read_support_filter_compress(reader.get());
    archive_read_support_format_raw(reader.get());
    archive_read_support_format_empty(reader.get());
  }
  const bool open = archive_read_open_memory(reader.get(), packed.data(), packed.size()) == ARCHIVE_OK;
  if (!open || (!is_zip(packed) && archive_filter_count(reader.get()) < 2))
    throw damaged(path, kind_of(packed));
  return reader;
}

std::string name_of(archive_entry* entry) {
  const char* const name = archive_entry_pathname(entry);
  return name == nullptr ? std::string() : std::string(name);
}

/// The next file of an archive, without folders and macOS metadata; for a KMZ file, which also has icons and
/// pictures, the KML file. Null after the last one.
archive_entry* next_file(const Archive& reader, const std::filesystem::path& path, std::string_view packed) {
  const bool kmz = lower_case(path.extension().string()) == ".kmz";
  archive_entry* entry = nullptr;
  int code = ARCHIVE_OK;
  while ((code = archive_read_next_header(reader.get(), &entry)) != ARCHIVE_EOF) {
    if (code < ARCHIVE_WARN) throw damaged(path, kind_of(packed));
    const std::string name = name_of(entry);
    const bool file = !name.empty() && name.back() != '/' && !name.starts_with("__MACOSX/");
    if (!is_zip(packed) || (file && (!kmz || lower_case(name).ends_with(".kml")))) return entry;
  }
  return nullptr;
}

/// Throws InputError for a zip archive with none or several files.
void require_one_file(const std::filesystem::path& path, std::string_view packed) {
  std::vector<std::string> names;
  const Archive reader = opened(path, packed);
  while (archive_entry* const entry = next_file(reader, path, packed)) names.push_back(name_of(entry));
  if (names.empty()) throw damaged(path, "zip");
  if (names.size() == 1) return;
  const bool spreadsheet = std::any_of(names.begin(), names.end(), [](const std::string& name) {
    return name == "xl/workbook.xml" || name == "content.xml";
  });
  if (spreadsheet) throw InputError(path, 0, "is a spreadsheet", "save it as CSV");
  throw InputError(path, 0, "is a zip archive of " + std::to_string(names.size()) + " files",
                   "unpack it and name one of them");
}

}  // namespace

std::string unpack(const std::filesystem::path& path, std::string_view packed) {
  const auto largest = static_cast<std::size_t>(std::min<std::uint64_t>(
      kMaxUnpacked, std::max<std::uint64_t>(kHarmlessSize, kMaxGrowth * packed.size())));
  const Utf8Names names;
  if (is_zip(packed)) require_one_file(path, packed);
  const Archive reader = opened(path, packed);
  archive_entry* const entry = next_file(reader, path, packed);
  std::string text;
  if (entry == nullptr) return text;
  if (archive_entry_is_data_encrypted(entry) != 0)
    throw InputError(path, 0, "is an encrypted zip archive", "unpack it first");
  std::string block(std::size_t{1} << 16, '\0');
  while (const la_ssize_t n = archive_read_data(reader.get(), block.data(), block.size())) {
    if (n < 0) {
      const char* const why = archive_error_string(reader.get());
      if (why != nullptr && std::string_view(why).starts_with("Unsupported"))
        throw InputError(path, 0, "is a zip archive with an unsupported method", "unpack it first");
      throw damaged(path, kind_of(packed));
    }
    text.append(block, 0, static_cast<std::size_t>(n));
    if (text.size() > largest) {
      throw InputError(path, 0, "unpacks to more than " + std::to_string(largest >> 20) + " MiB",
                       "is it the right file?");
    }
  }
  return text;
}

std::vector<std::string> zip_names(const std::filesystem::path& path) {
  const Utf8Names utf8;
  const Archive reader(archive_read_new());
  archive_read_support_format_zip_seekable(reader.get());
  constexpr std::size_t kBlock = std::size_t{1} << 16;
  std::vector<std::string> names;
  if (archive_read_open_filename(reader.get(), path.c_str(), kBlock) != ARCHIVE_OK) return names;
  archive_entry* entry = nullptr;
  for (int code = ARCHIVE_OK; code == ARCHIVE_OK || code == ARCHIVE_WARN;) {
    code = archive_read_next_header(reader.get(), &entry);
    if (code == ARCHIVE_OK || code == ARCHIVE_WARN) names.push_back(name_of(entry));
  }
  return names;
}

}  // namespace canyon
