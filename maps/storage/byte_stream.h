// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

// Little-endian serialization of numbers for the binary columns of a library.
namespace docent::maps {

static_assert(std::endian::native == std::endian::little, "the file format is little-endian");

using Bytes = std::vector<std::uint8_t>;

// Appends numbers and bytes to an array that grows.
class ByteWriter {
 public:
  template <typename Number>
  void Put(Number number) {
    static_assert(std::is_arithmetic_v<Number>);
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&number);
    bytes_.insert(bytes_.end(), bytes, bytes + sizeof(number));
  }
  // Writes all coefficients of an Eigen vector, first to last.
  template <typename Vector>
  void PutAll(const Vector& vector) {
    for (Eigen::Index i = 0; i < vector.size(); ++i) Put(vector[i]);
  }
  void PutBytes(std::span<const std::uint8_t> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  // Writes the length in bytes as 32 bits, then the text.
  void PutText(std::string_view text) {
    Put(static_cast<std::uint32_t>(text.size()));
    bytes_.insert(bytes_.end(), text.begin(), text.end());
  }

  const Bytes& bytes() const { return bytes_; }
  Bytes Take() { return std::move(bytes_); }

 private:
  Bytes bytes_;
};

// Reads from a span that must outlive the reader. Reading past the end returns zeros and sets failed(), so
// that a decoder can read a whole record and check once.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <typename Number>
  Number Get() {
    static_assert(std::is_arithmetic_v<Number>);
    Number number{};
    const std::span<const std::uint8_t> source = GetBytes(sizeof(number));
    if (!source.empty()) std::memcpy(&number, source.data(), sizeof(number));
    return number;
  }
  template <typename Vector>
  Vector GetAll() {
    Vector vector;
    for (Eigen::Index i = 0; i < vector.size(); ++i) vector[i] = Get<typename Vector::Scalar>();
    return vector;
  }
  std::span<const std::uint8_t> GetBytes(std::size_t count) {
    if (count > bytes_.size()) {
      failed_ = true;
      bytes_ = {};
      return {};
    }
    const auto result = bytes_.first(count);
    bytes_ = bytes_.subspan(count);
    return result;
  }
  std::string GetText() {
    const std::span<const std::uint8_t> text = GetBytes(Get<std::uint32_t>());
    return {text.begin(), text.end()};
  }

  std::size_t remaining() const { return bytes_.size(); }
  bool failed() const { return failed_; }

 private:
  std::span<const std::uint8_t> bytes_;
  bool failed_ = false;
};

}  // namespace docent::maps
