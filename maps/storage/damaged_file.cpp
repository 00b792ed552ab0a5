// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/damaged_file.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <utility>

#include "engine/base/error.h"

// The numbers below are those of the file format; its integers are big-endian.
namespace docent::maps {

namespace {

constexpr std::uint8_t kInteriorPage = 0x05, kLeafPage = 0x0D;
constexpr std::size_t kFileHeaderBytes = 100, kLeafHeaderBytes = 8, kInteriorHeaderBytes = 12;
constexpr std::size_t kMostColumns = 16;  // The table with the most has 13.
constexpr std::uint64_t kMostPayloadBytes = 512u << 20;

std::uint32_t BigEndian(std::span<const std::uint8_t> bytes) {
  std::uint32_t number = 0;
  for (const std::uint8_t byte : bytes) number = number << 8 | byte;
  return number;
}

// Reads a variable-length integer of 1 to 9 bytes and moves `at` behind it; empty at the end of the bytes.
std::optional<std::uint64_t> TakeVarint(std::span<const std::uint8_t> bytes, std::size_t* at) {
  std::uint64_t number = 0;
  for (int i = 0; i < 9; ++i) {
    if (*at >= bytes.size()) return std::nullopt;
    const std::uint8_t byte = bytes[(*at)++];
    if (i == 8) return number << 8 | byte;
    number = number << 7 | (byte & 0x7F);
    if (byte < 0x80) return number;
  }
  return std::nullopt;
}

// The number of bytes of a value of this serial type; empty for the two types that are not used.
std::optional<std::uint64_t> BytesOfType(std::uint64_t type) {
  constexpr std::array<std::uint64_t, 10> kFixed = {0, 1, 2, 3, 4, 6, 8, 8, 0, 0};
  if (type < kFixed.size()) return kFixed[type];
  if (type < 12) return std::nullopt;
  return (type - 12) / 2;
}

bool IsInteger(std::uint64_t type) {
  return (type >= 1 && type <= 6) || type == 8 || type == 9;
}
bool IsText(std::uint64_t type) {
  return type >= 13 && type % 2 == 1;
}
bool IsBlob(std::uint64_t type) {
  return type >= 12 && type % 2 == 0;
}

std::int64_t IntegerOf(std::uint64_t type, std::span<const std::uint8_t> bytes) {
  if (type == 8 || type == 9) return type == 9 ? 1 : 0;
  std::uint64_t number = !bytes.empty() && bytes[0] >= 0x80 ? ~std::uint64_t{0} : 0;
  for (const std::uint8_t byte : bytes) number = number << 8 | byte;
  return std::bit_cast<std::int64_t>(number);
}

// The types at the begin of a record.
struct RecordHeader {
  std::vector<std::uint64_t> types;
  std::size_t bytes = 0;  // Of the header.
};

// `payload` begins with a record of `size` bytes, of which it may hold fewer. Empty when its header is not
// valid.
std::optional<RecordHeader> ReadRecordHeader(std::span<const std::uint8_t> payload, std::uint64_t size) {
  std::size_t at = 0;
  const auto length = TakeVarint(payload, &at);
  if (!length || *length < at || *length > payload.size()) return std::nullopt;
  RecordHeader header;
  header.bytes = static_cast<std::size_t>(*length);
  std::uint64_t sum = header.bytes;
  while (at < header.bytes) {
    const auto type = TakeVarint(payload.first(header.bytes), &at);
    const auto bytes = type ? BytesOfType(*type) : std::nullopt;
    if (!bytes || *bytes > size || header.types.size() == kMostColumns) return std::nullopt;
    sum += *bytes;
    header.types.push_back(*type);
  }
  if (sum != size) return std::nullopt;
  return header;
}

std::optional<SalvagedTable> TableOf(const std::vector<std::uint64_t>& types) {
  const auto has_shape = [&](std::string_view shape) {
    return types.size() == shape.size() &&
           std::equal(types.begin(), types.end(), shape.begin(), [](std::uint64_t type, char wanted) {
             switch (wanted) {
               case 'i':
                 return IsInteger(type);
               case 't':
                 return IsText(type);
               case 'b':
                 return IsBlob(type);
               case 'n':
                 return type == 0;
               default:
                 return type == 0 || IsBlob(type);  // '?'
             }
           });
  };
  if (has_shape("nttiiiiiiii?i")) return SalvagedTable::kMaps;
  if (has_shape("itb")) return SalvagedTable::kParts;
  if (has_shape("iib")) return SalvagedTable::kImages;
  if (has_shape("ttbi")) return SalvagedTable::kAssets;
  if (has_shape("tbi")) return SalvagedTable::kLenses;
  if (has_shape("ttibi")) return SalvagedTable::kTours;
  return std::nullopt;
}

// The record's values as far as `payload` holds them.
std::vector<SalvagedValue> ValuesOf(const RecordHeader& header, std::span<const std::uint8_t> payload) {
  std::vector<SalvagedValue> values;
  std::size_t at = header.bytes;
  for (const std::uint64_t type : header.types) {
    const auto size = static_cast<std::size_t>(*BytesOfType(type));
    if (size > payload.size() - at) break;
    const std::span<const std::uint8_t> bytes = payload.subspan(at, size);
    SalvagedValue& value = values.emplace_back();
    if (IsInteger(type)) {
      value.type = SalvagedValue::Type::kInteger;
      value.integer = IntegerOf(type, bytes);
    } else if (IsText(type) || IsBlob(type)) {
      value.type = IsText(type) ? SalvagedValue::Type::kText : SalvagedValue::Type::kBlob;
      value.bytes.assign(bytes.begin(), bytes.end());
    }
    at += size;
  }
  return values;
}

// Fills in by what the row is found; false when its first values are not possible.
bool Identify(std::uint64_t row_id, const std::vector<SalvagedValue>& values, RowPlace* place) {
  const auto text = [&](std::size_t i) {
    return i < values.size() ? std::string(values[i].bytes.begin(), values[i].bytes.end()) : std::string();
  };
  const auto number = [&](std::size_t i) { return i < values.size() ? values[i].integer : -1; };
  switch (place->table) {
    case SalvagedTable::kMaps:
      place->key = row_id;
      return row_id > 0 && row_id <= std::numeric_limits<std::int64_t>::max();
    case SalvagedTable::kParts:
      place->key = static_cast<std::uint64_t>(number(0));
      place->name = text(1);
      return number(0) > 0 && !place->name.empty();
    case SalvagedTable::kImages:
      place->key = static_cast<std::uint64_t>(number(0));
      place->keyframe = static_cast<std::uint32_t>(number(1));
      return number(0) > 0 && number(1) >= 0 && number(1) <= std::numeric_limits<std::uint32_t>::max();
    case SalvagedTable::kAssets:
    case SalvagedTable::kLenses:
    case SalvagedTable::kTours:
      place->name = text(0);
      return !place->name.empty();
  }
  return false;
}

// Where the cells of a table's page begin. Those outside of the page are left out, and `whole` becomes false
// if there are such.
std::vector<std::uint32_t> CellOffsets(std::span<const std::uint8_t> page, std::size_t begin,
                                       std::size_t header_bytes, bool* whole) {
  std::vector<std::uint32_t> offsets;
  const std::size_t count = BigEndian(page.subspan(begin + 3, 2)), first = begin + header_bytes;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = first + 2 * i;
    const std::uint32_t offset = at + 2 <= page.size() ? BigEndian(page.subspan(at, 2)) : 0;
    if (offset >= first && offset < page.size()) {
      offsets.push_back(offset);
    } else {
      *whole = false;
    }
  }
  return offsets;
}

}  // namespace

// A row's cell in a leaf page.
struct DamagedFile::Cell {
  std::uint64_t row_id = 0;
  std::uint64_t size = 0;               // Of the payload.
  std::span<const std::uint8_t> local;  // The part of the payload in this page.
  std::uint32_t overflow = 0;           // The page with the next part, if there is more.
};

DamagedFile::DamagedFile(const std::filesystem::path& path) : file_(path, std::ios::binary) {
  std::error_code error;
  size_ = std::filesystem::file_size(path, error);
  if (!file_ || error) throw Error(path.string() + " cannot be read");
  ReadHeader();
  ReadUnusedPages();
  FollowTrees();
}

void DamagedFile::ReadHeader() {
  std::array<std::uint8_t, kFileHeaderBytes> header{};
  file_.read(reinterpret_cast<char*>(header.data()), static_cast<std::streamsize>(header.size()));
  file_.clear();
  constexpr char kMagic[] = "SQLite format 3";
  if (std::memcmp(header.data(), kMagic, sizeof kMagic) != 0) return;  // Libraries have pages of 4096 bytes.
  const std::span<const std::uint8_t> bytes(header);
  const std::uint32_t page_size =
      BigEndian(bytes.subspan(16, 2)) == 1 ? 65536 : BigEndian(bytes.subspan(16, 2));
  if (page_size >= 512 && std::has_single_bit(page_size) && page_size <= std::max<std::uint64_t>(size_, 4096))
    page_size_ = page_size;
  usable_ = page_size_ - (page_size_ - header[20] >= 480 ? header[20] : 0);
  first_unused_ = BigEndian(bytes.subspan(32, 4));
  format_ = BigEndian(bytes.subspan(60, 4));
  application_id_ = BigEndian(bytes.subspan(68, 4));
}

// The last page may be cut off.
std::uint32_t DamagedFile::LargestPage() const {
  const std::uint64_t pages = (size_ + page_size_ - 1) / page_size_;
  return static_cast<std::uint32_t>(
      std::min<std::uint64_t>(pages, std::numeric_limits<std::uint32_t>::max()));
}

// A page that is cut off is filled with zeros.
std::optional<DamagedFile::Page> DamagedFile::ReadPage(std::uint32_t number) const {
  if (number == 0 || number > LargestPage()) return std::nullopt;
  Page page(page_size_);
  file_.clear();
  file_.seekg(static_cast<std::streamoff>(std::uint64_t{number - 1} * page_size_));
  file_.read(reinterpret_cast<char*>(page.data()), static_cast<std::streamsize>(page.size()));
  if (file_.gcount() == 0) return std::nullopt;
  page.resize(usable_);
  return page;
}

// A list of pages, each of which names the next one and others that are unused too.
void DamagedFile::ReadUnusedPages() {
  std::uint32_t trunk = first_unused_;
  while (trunk != 0 && unused_.insert(trunk).second) {
    const auto page = ReadPage(trunk);
    if (!page) return;
    const std::span<const std::uint8_t> bytes(*page);
    const std::uint32_t count = BigEndian(bytes.subspan(4, 4));
    for (std::uint32_t i = 0; i < count && 12 + 4 * std::size_t{i} <= bytes.size(); ++i)
      unused_.insert(BigEndian(bytes.subspan(8 + 4 * std::size_t{i}, 4)));
    trunk = BigEndian(bytes.first(4));
  }
}

// Collects the leaves of a table; returns false when a page on the way cannot be read.
bool DamagedFile::FollowTree(std::uint32_t root, std::set<std::uint32_t>* leaves) const {
  bool whole = true;
  std::set<std::uint32_t> seen;
  std::vector<std::uint32_t> open = {root};
  while (!open.empty()) {
    const std::uint32_t number = open.back();
    open.pop_back();
    const auto page = seen.insert(number).second ? ReadPage(number) : std::nullopt;
    const std::size_t begin = number == 1 ? kFileHeaderBytes : 0;
    if (!page || ((*page)[begin] != kLeafPage && (*page)[begin] != kInteriorPage)) {
      whole = false;
      continue;
    }
    const std::span<const std::uint8_t> bytes(*page);
    if (bytes[begin] == kLeafPage) {
      leaves->insert(number);
      for (const std::uint32_t offset : CellOffsets(bytes, begin, kLeafHeaderBytes, &whole)) {
        const auto cell = CellAt(*page, offset);
        whole = whole && cell && ReadRecordHeader(cell->local, cell->size);
      }
      continue;
    }
    open.push_back(BigEndian(bytes.subspan(begin + 8, 4)));
    for (const std::uint32_t offset : CellOffsets(bytes, begin, kInteriorHeaderBytes, &whole)) {
      if (offset + 4 <= bytes.size()) open.push_back(BigEndian(bytes.subspan(offset, 4)));
    }
  }
  return whole;
}

void DamagedFile::FollowTrees() {
  std::set<std::uint32_t> schema, reached;
  FollowTree(1, &schema);
  constexpr std::array<std::string_view, kSalvagedTables> kNames = {"maps",   "parts",  "pictures",
                                                                    "assets", "lenses", "tours"};
  for (const std::uint32_t number : schema) {
    const auto page = ReadPage(number);
    if (!page) continue;
    bool whole = true;
    for (const std::uint32_t offset :
         CellOffsets(*page, number == 1 ? kFileHeaderBytes : 0, kLeafHeaderBytes, &whole)) {
      const auto cell = CellAt(*page, offset);
      const auto header = cell ? ReadRecordHeader(cell->local, cell->size) : std::nullopt;
      if (!header || header->types.size() != 5) continue;
      const std::vector<SalvagedValue> values = ValuesOf(*header, cell->local);
      if (values.size() < 4 || values[3].integer <= 0) continue;
      const std::string_view kind(reinterpret_cast<const char*>(values[0].bytes.data()),
                                  values[0].bytes.size());
      const std::string_view name(reinterpret_cast<const char*>(values[1].bytes.data()),
                                  values[1].bytes.size());
      const auto table = std::find(kNames.begin(), kNames.end(), name);
      if (kind != "table" || table == kNames.end() || values[3].integer > LargestPage()) continue;
      complete_[static_cast<std::size_t>(table - kNames.begin())] =
          FollowTree(static_cast<std::uint32_t>(values[3].integer), &reached);
    }
  }
  for (std::uint32_t number = 1; number <= LargestPage() && number != 0; ++number) {
    const auto page = ReadPage(number);
    if (!page || (*page)[number == 1 ? kFileHeaderBytes : 0] != kLeafPage) continue;
    SearchPage(number, *page,
               reached.contains(number)   ? RowPlace::Page::kReached
               : unused_.contains(number) ? RowPlace::Page::kUnused
                                          : RowPlace::Page::kUnreached);
  }
  for (auto& rows : rows_) {
    std::stable_sort(rows.begin(), rows.end(),
                     [](const RowPlace& a, const RowPlace& b) { return a.found < b.found; });
  }
}

void DamagedFile::SearchPage(std::uint32_t number, const Page& page, RowPlace::Page found) {
  bool whole = true;
  for (const std::uint32_t offset :
       CellOffsets(page, number == 1 ? kFileHeaderBytes : 0, kLeafHeaderBytes, &whole)) {
    const auto cell = CellAt(page, offset);
    const auto header = cell ? ReadRecordHeader(cell->local, cell->size) : std::nullopt;
    const auto table = header ? TableOf(header->types) : std::nullopt;
    if (!table) continue;
    RowPlace place{.table = *table, .found = found, .name = {}, .page = number, .offset = offset};
    // The values by which a row is found lie before its large one and in the same page.
    std::vector<SalvagedValue> values;
    if (*table != SalvagedTable::kMaps) {
      RecordHeader leading = *header;
      leading.types.resize(*table == SalvagedTable::kParts || *table == SalvagedTable::kImages ? 2 : 1);
      values = ValuesOf(leading, cell->local);
    }
    // A library has far fewer rows; a file that is made to look as if it had more takes no more memory.
    if (++rows_found_ > size_ / sizeof(RowPlace)) return;
    if (Identify(cell->row_id, values, &place)) rows_[static_cast<std::size_t>(*table)].push_back(place);
  }
}

std::optional<DamagedFile::Cell> DamagedFile::CellAt(const Page& page, std::uint32_t offset) const {
  const std::span<const std::uint8_t> bytes(page);
  std::size_t at = offset;
  const auto size = TakeVarint(bytes, &at), row_id = size ? TakeVarint(bytes, &at) : std::nullopt;
  if (!row_id || *size > std::min(kMostPayloadBytes, size_)) return std::nullopt;
  // How much of the payload lies in the leaf page (file format, 1.6).
  const std::uint64_t most = usable_ - 35, least = (usable_ - 12) * 32 / 255 - 23;
  std::uint64_t local = *size;
  if (*size > most) {
    local = least + (*size - least) % (usable_ - 4);
    if (local > most) local = least;
  }
  const std::size_t end = at + static_cast<std::size_t>(local) + (*size > local ? 4 : 0);
  if (end > bytes.size()) return std::nullopt;
  Cell cell;
  cell.row_id = *row_id;
  cell.size = *size;
  cell.local = bytes.subspan(at, static_cast<std::size_t>(local));
  if (*size > local) cell.overflow = BigEndian(bytes.subspan(at + static_cast<std::size_t>(local), 4));
  return cell;
}

// Fills `rest` from a chain of pages, each of which begins with the number of the next. Returns false when
// one of them is lost.
bool DamagedFile::ReadOverflow(std::uint32_t first, std::span<std::uint8_t> rest) const {
  bool whole = true;
  std::set<std::uint32_t> seen;
  std::uint32_t number = first, previous = 0;
  while (!rest.empty()) {
    if (number < 2 || number > LargestPage() || seen.contains(number)) {
      whole = false;
      number = previous + 1;
      if (previous == 0 || number > LargestPage() || seen.contains(number)) return false;
    }
    seen.insert(number);
    const auto page = ReadPage(number);
    if (!page) return false;
    const std::size_t count = std::min<std::size_t>(rest.size(), usable_ - 4);
    std::copy_n(page->begin() + 4, count, rest.begin());
    rest = rest.subspan(count);
    previous = number;
    number = BigEndian(std::span<const std::uint8_t>(*page).first(4));
  }
  return whole;
}

std::optional<SalvagedRow> DamagedFile::ReadCell(const Cell& cell) const {
  SalvagedRow row;
  Bytes payload(static_cast<std::size_t>(cell.size));
  std::copy(cell.local.begin(), cell.local.end(), payload.begin());
  const auto rest = std::span(payload).subspan(cell.local.size());
  if (!rest.empty()) row.whole = ReadOverflow(cell.overflow, rest);
  const auto header = ReadRecordHeader(payload, cell.size);
  if (!header) return std::nullopt;
  row.values = ValuesOf(*header, payload);
  return row;
}

std::optional<SalvagedRow> DamagedFile::Read(const RowPlace& place) const {
  const auto page = ReadPage(place.page);
  const auto cell = page ? CellAt(*page, place.offset) : std::nullopt;
  const auto header = cell ? ReadRecordHeader(cell->local, cell->size) : std::nullopt;
  if (!header || TableOf(header->types) != place.table) return std::nullopt;
  auto row = ReadCell(*cell);
  if (row && place.table == SalvagedTable::kMaps) {
    row->values[0].type = SalvagedValue::Type::kInteger;
    row->values[0].integer = static_cast<std::int64_t>(cell->row_id);
  }
  return row;
}

}  // namespace docent::maps
