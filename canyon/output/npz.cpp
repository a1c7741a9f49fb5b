#include "canyon/output/npz.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <bit>

#include "canyon/base/input_error.hpp"

namespace canyon::output {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are written as they lie in memory");

/// Numbers of ZIP, little-endian.
class Record {
 public:
  Record& u16(std::size_t value) {
    for (unsigned shift = 0; shift < 16; shift += 8) bytes_ += static_cast<char>(value >> shift);
    return *this;
  }
  Record& u32(std::size_t value) { return u16(value & 0xffff).u16(value >> 16); }
  Record& text(std::string_view value) {
    bytes_ += value;
    return *this;
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

constexpr std::size_t kVersion = 20, kStored = 0, kTime = 0,
                      kDate = 0x21;  // 1980-01-01: the same bytes always

/// What a local header and its entry in the list share.
void describe(Record& record, std::uint32_t crc, std::uint32_t size, std::size_t name_length) {
  record.u16(kVersion).u16(0).u16(kStored).u16(kTime).u16(kDate);
  record.u32(crc).u32(size).u32(size).u16(name_length).u16(0);
}

/// Magic, version, and the dictionary that describes the numbers, padded to 64 bytes.
std::string npy_header(std::size_t rows, std::size_t columns) {
  std::string text = fmt::format("{{'descr': '<f8', 'fortran_order': False, 'shape': ({},{}), }}", rows,
                                 columns == 1 ? "" : fmt::format(" {}", columns));
  constexpr std::size_t kBlock = 64, kBefore = 10;
  text.append(kBlock - (kBefore + text.size() + 1) % kBlock, ' ');
  text += '\n';
  return Record().text("\x93NUMPY").u16(1).u16(text.size()).bytes() + text;
}

}  // namespace

void NpzWriter::add(std::string_view name, const std::vector<double>& values, std::size_t columns) {
  const std::string header = npy_header(values.size() / columns, columns);
  const std::string_view data(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double));
  Member member{fmt::format("{}.npy", name)};
  constexpr std::uint64_t kMost = 4'200'000'000;  // leaves room for the list
  if (size_ + header.size() + data.size() > kMost) {
    throw InputError(fmt::format("array {} does not fit into a .npz file, whose limit is 4 GiB", name),
                     "simulate a shorter run or a lower rate, or write imu.csv");
  }
  const auto crc = [](std::uint32_t before, std::string_view bytes) {
    return static_cast<std::uint32_t>(
        crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
  };
  member.crc = crc(crc(0, header), data);
  member.size = static_cast<std::uint32_t>(header.size() + data.size());
  member.offset = static_cast<std::uint32_t>(size_);
  Record local;
  local.u32(0x04034b50);
  describe(local, member.crc, member.size, member.name.size());
  local.text(member.name);
  for (const std::string_view bytes : {std::string_view(local.bytes()), std::string_view(header), data}) {
    file_.write(bytes);
    size_ += bytes.size();
  }
  members_.push_back(std::move(member));
}

void NpzWriter::finish() {
  Record list;
  for (const Member& member : members_) {
    list.u32(0x02014b50).u16(kVersion);
    describe(list, member.crc, member.size, member.name.size());
    list.u16(0).u16(0).u16(0).u32(0).u32(member.offset).text(member.name);
  }
  const std::size_t length = list.bytes().size();
  list.u32(0x06054b50).u16(0).u16(0).u16(members_.size()).u16(members_.size());
  list.u32(length).u32(size_).u16(0);
  file_.write(list.bytes());
}

}  // namespace canyon::output
