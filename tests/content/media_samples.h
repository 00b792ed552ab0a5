// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sndfile.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

// Small image and sound files for tests.
namespace docent::content {

inline void WriteBytes(const std::filesystem::path& path, const std::vector<std::uint8_t>& bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

inline std::uint32_t Crc32(const std::uint8_t* bytes, std::size_t count) {
  std::uint32_t crc = ~0u;
  for (std::size_t i = 0; i < count; ++i) {
    crc ^= bytes[i];
    for (int k = 0; k < 8; ++k) crc = (crc >> 1) ^ (0xEDB88320u & (0u - (crc & 1u)));
  }
  return ~crc;
}

inline void PutBigEndian(std::uint32_t value, std::vector<std::uint8_t>* bytes) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes->push_back(static_cast<std::uint8_t>(value >> shift));
}

// Stored (not compressed) data of zlib (RFC 1950 and 1951).
inline std::vector<std::uint8_t> StoredData(const std::vector<std::uint8_t>& bytes) {
  constexpr std::size_t kMostInBlock = 65'535;
  std::vector<std::uint8_t> data = {0x78, 0x01};
  for (std::size_t begin = 0; begin < bytes.size(); begin += kMostInBlock) {
    const std::size_t end = std::min(begin + kMostInBlock, bytes.size());
    const auto length = static_cast<std::uint16_t>(end - begin);
    data.push_back(end == bytes.size() ? 1 : 0);  // The last block.
    for (const int value : {length & 0xFF, length >> 8, ~length & 0xFF, (~length >> 8) & 0xFF})
      data.push_back(static_cast<std::uint8_t>(value));
    for (std::size_t i = begin; i < end; ++i) data.push_back(bytes[i]);
  }
  std::uint32_t a = 1, b = 0;  // Adler-32.
  for (const std::uint8_t byte : bytes) {
    a = (a + byte) % 65'521;
    b = (b + a) % 65'521;
  }
  PutBigEndian(b << 16 | a, &data);
  return data;
}

// A PNG (ISO/IEC 15948) of grey pixels, or interlaced ones, with this data of zlib.
inline std::vector<std::uint8_t> PngWith(std::uint32_t width_px, std::uint32_t height_px,
                                         const std::vector<std::uint8_t>& data, bool interlaced = false) {
  std::vector<std::uint8_t> png = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  const auto chunk = [&](const char* type, const std::vector<std::uint8_t>& content) {
    PutBigEndian(static_cast<std::uint32_t>(content.size()), &png);
    std::vector<std::uint8_t> body(type, type + 4);
    for (const std::uint8_t byte : content) body.push_back(byte);
    for (const std::uint8_t byte : body) png.push_back(byte);
    PutBigEndian(Crc32(body.data(), body.size()), &png);
  };
  std::vector<std::uint8_t> header;
  PutBigEndian(width_px, &header);
  PutBigEndian(height_px, &header);
  for (const int byte : {8, 0, 0, 0, interlaced ? 1 : 0}) header.push_back(static_cast<std::uint8_t>(byte));
  chunk("IHDR", header);
  chunk("IDAT", data);
  chunk("IEND", {});
  return png;
}

// Rows of a PNG with pixels of one byte.
inline std::vector<std::uint8_t> PngRows(std::uint32_t width_px, std::uint32_t height_px,
                                         std::uint8_t grey = 200) {
  std::vector<std::uint8_t> rows;
  for (std::uint32_t y = 0; y < height_px; ++y) {
    rows.push_back(0);  // No filter.
    for (std::uint32_t x = 0; x < width_px; ++x) rows.push_back(grey);
  }
  return rows;
}

inline std::vector<std::uint8_t> PngBytes(std::uint32_t width_px, std::uint32_t height_px,
                                          std::uint8_t grey = 200) {
  return PngWith(width_px, height_px, StoredData(PngRows(width_px, height_px, grey)));
}

// A tone of 440 Hz.
inline std::int16_t SampleOfTone(std::size_t index, int rate) {
  return static_cast<std::int16_t>(
      std::lround(9000 * std::sin(2 * std::numbers::pi * 440 * static_cast<double>(index) / rate)));
}

// A sound file in a format of libsndfile, with what `write` writes.
inline std::vector<std::uint8_t> SoundBytesBy(int format, int channels, int rate,
                                              const std::function<void(SNDFILE*)>& write) {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("docent-sound-" + std::to_string(::getpid()) + ".tmp");
  SF_INFO info{};
  info.channels = channels;
  info.samplerate = rate;
  info.format = format;
  SNDFILE* const file = sf_open(path.c_str(), SFM_WRITE, &info);
  if (file == nullptr) throw std::runtime_error(sf_strerror(nullptr));
  write(file);
  sf_close(file);
  std::ifstream read(path, std::ios::binary);
  std::vector<std::uint8_t> bytes((std::istreambuf_iterator<char>(read)), std::istreambuf_iterator<char>());
  std::filesystem::remove(path);
  return bytes;
}

// A tone; the second channel is the negative of the first.
inline std::vector<std::uint8_t> SoundBytesOf(int format, int channels, int rate, std::size_t frames) {
  std::vector<std::int16_t> samples;
  for (std::size_t i = 0; i < frames; ++i) {
    for (int channel = 0; channel < channels; ++channel)
      samples.push_back(
          static_cast<std::int16_t>(channel % 2 == 0 ? SampleOfTone(i, rate) : -SampleOfTone(i, rate)));
  }
  return SoundBytesBy(format, channels, rate, [&](SNDFILE* file) {
    sf_writef_short(file, samples.data(), static_cast<sf_count_t>(frames));
  });
}

}  // namespace docent::content
