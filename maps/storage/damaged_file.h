// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "maps/storage/byte_stream.h"

// Finds the rows of a library in the pages of its file, without SQLite, which gives up a whole table when one
// page on the way to its rows is lost. The pages are read as https://sqlite.org/fileformat2.html describes
// them: every leaf page of a table is searched, whether or not the pages that lead to it can be read.
//
// Nothing in the file is trusted: every offset, size and page number is checked, and a row that does not fit
// its page is left out. What a row contains is not checked here; the rows' own checksums do that. One thread.
namespace docent::maps {

// The tables whose rows cannot be computed from others.
enum class SalvagedTable : std::uint8_t { kMaps, kParts, kImages, kAssets, kLenses, kTours };
inline constexpr std::size_t kSalvagedTables = 6;

// Where a row lies, and by what it is found.
struct RowPlace {
  SalvagedTable table = SalvagedTable::kMaps;
  // How the page was found: by the pages that lead to it; by itself, because one of those is lost; or among
  // the pages that the file lists as unused, so that the row was replaced or removed.
  enum class Page : std::uint8_t { kReached, kUnreached, kUnused };
  Page found = Page::kReached;
  std::uint64_t key = 0;       // Of the map; of kMaps, kParts and kImages.
  std::uint32_t keyframe = 0;  // Of kImages.
  std::string name;  // The part of kParts, the id of kAssets, the camera of kLenses, the name of kTours.
  std::uint32_t page = 0;    // From 1, as in the file format.
  std::uint32_t offset = 0;  // Of the cell in the page.
};

// One value of a row.
struct SalvagedValue {
  enum class Type : std::uint8_t { kNull, kInteger, kText, kBlob };
  Type type = Type::kNull;
  std::int64_t integer = 0;
  Bytes bytes;  // Of a text or blob.
};

struct SalvagedRow {
  std::vector<SalvagedValue> values;  // In the order of the table's columns; the key of kMaps is one of them.
  // Whether all pages of the row are there. The bytes of a lost page are zero. If a page does not say which
  // one continues it, the next one of the file is taken, which is the right one in most files.
  bool whole = true;
};

class DamagedFile {
 public:
  // Searches all pages. Throws docent::Error when the file cannot be read.
  explicit DamagedFile(const std::filesystem::path& path);

  // The rows that were found, of one table; the ones that the file's trees lead to come first.
  const std::vector<RowPlace>& rows(SalvagedTable table) const {
    return rows_[static_cast<std::size_t>(table)];
  }
  // Whether every page of the table's tree could be read, so that other rows that were found do not count.
  bool complete(SalvagedTable table) const { return complete_[static_cast<std::size_t>(table)]; }
  // Reads a row with all its values. Empty when it does not have the shape of its table.
  std::optional<SalvagedRow> Read(const RowPlace& place) const;

  std::uint64_t bytes() const { return size_; }
  // From the file's header; 0 when the header is lost.
  std::uint32_t application_id() const { return application_id_; }
  std::uint32_t format() const { return format_; }

 private:
  using Page = std::vector<std::uint8_t>;
  struct Cell;
  struct Overflow;

  void ReadHeader();
  std::optional<Page> ReadPage(std::uint32_t number) const;
  void ReadUnusedPages();
  void FollowTrees();
  bool FollowTree(std::uint32_t root, std::set<std::uint32_t>* leaves) const;
  void SearchPage(std::uint32_t number, const Page& page, RowPlace::Page found);
  std::optional<Cell> CellAt(const Page& page, std::uint32_t offset) const;
  std::optional<SalvagedRow> ReadCell(const Cell& cell) const;
  bool ReadOverflow(std::uint32_t first, std::span<std::uint8_t> rest) const;
  std::uint32_t LargestPage() const;

  mutable std::ifstream file_;
  std::uint64_t size_ = 0, rows_found_ = 0;
  std::uint32_t page_size_ = 4096, usable_ = 4096;
  std::uint32_t application_id_ = 0, format_ = 0, first_unused_ = 0;
  std::set<std::uint32_t> unused_;
  std::array<std::vector<RowPlace>, kSalvagedTables> rows_;
  std::array<bool, kSalvagedTables> complete_{};
};

}  // namespace docent::maps
