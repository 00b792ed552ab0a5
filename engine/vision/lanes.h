// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <opencv2/core/simd_intrinsics.hpp>

#include "engine/base/multiply_add.h"

// OpenCV's universal intrinsics at the widths used in the engine: bytes at the width of the target up to 32,
// floats eight at a time, which is a row of a patch, doubles four at a time. Results are identical at every
// width, except for the rounding of MultiplyAdd. opencv2/core/hal/intrin.hpp alone provides only four floats,
// whatever the compiler's target.
namespace docent::engine {

using docent::MultiplyAdd;  // of single numbers; the overload below takes lanes

#if CV_SIMD256

using ByteLanes = cv::v_uint8x32;
inline ByteLanes LoadBytes(const std::uint8_t* from) {
  return cv::v256_load(from);
}
inline ByteLanes AllBytes(std::uint8_t value) {
  return cv::v256_setall_u8(value);
}

using EightFloats = cv::v_float32x8;
inline EightFloats AllFloats(float value) {
  return cv::v256_setall_f32(value);
}
inline EightFloats LoadAsFloats(const std::uint8_t* from) {
  return cv::v_cvt_f32(cv::v_reinterpret_as_s32(cv::v256_load_expand_q(from)));
}
inline EightFloats LoadAsFloats(const std::int16_t* from) {
  return cv::v_cvt_f32(cv::v256_load_expand(from));
}
inline EightFloats LoadFloats(const float* from) {
  return cv::v256_load(from);
}
inline void Store(const EightFloats& lanes, float* to) {
  cv::v_store(to, lanes);
}
inline EightFloats Smaller(const EightFloats& a, const EightFloats& b) {
  return cv::v_min(a, b);
}
inline void StoreRounded(const EightFloats& lanes, int* to) {
  cv::v_store(to, cv::v_round(lanes));
}
inline void StoreTruncated(const EightFloats& lanes, int* to) {
  cv::v_store(to, cv::v_trunc(lanes));
}

using FourDoubles = cv::v_float64x4;
inline FourDoubles AllDoubles(double value) {
  return cv::v256_setall_f64(value);
}
inline void Store(const FourDoubles& lanes, double* to) {
  cv::v_store(to, lanes);
}
inline FourDoubles MultiplyAdd(const FourDoubles& a, const FourDoubles& b, const FourDoubles& c) {
  return cv::v_fma(a, b, c);
}

#else

using ByteLanes = cv::v_uint8x16;
inline ByteLanes LoadBytes(const std::uint8_t* from) {
  return cv::v_load(from);
}
inline ByteLanes AllBytes(std::uint8_t value) {
  return cv::v_setall_u8(value);
}

struct EightFloats {
  cv::v_float32x4 low, high;
  EightFloats& operator+=(const EightFloats& other) { return *this = *this + other; }
  friend EightFloats operator+(const EightFloats& a, const EightFloats& b) {
    return {a.low + b.low, a.high + b.high};
  }
  friend EightFloats operator-(const EightFloats& a, const EightFloats& b) {
    return {a.low - b.low, a.high - b.high};
  }
  friend EightFloats operator*(const EightFloats& a, const EightFloats& b) {
    return {a.low * b.low, a.high * b.high};
  }
};
inline EightFloats AllFloats(float value) {
  return {cv::v_setall_f32(value), cv::v_setall_f32(value)};
}
inline EightFloats LoadAsFloats(const std::uint8_t* from) {
  const auto four = [](const std::uint8_t* bytes) {
    return cv::v_cvt_f32(cv::v_reinterpret_as_s32(cv::v_load_expand_q(bytes)));
  };
  return {four(from), four(from + 4)};
}
inline EightFloats LoadAsFloats(const std::int16_t* from) {
  return {cv::v_cvt_f32(cv::v_load_expand(from)), cv::v_cvt_f32(cv::v_load_expand(from + 4))};
}
inline EightFloats LoadFloats(const float* from) {
  return {cv::v_load(from), cv::v_load(from + 4)};
}
inline void Store(const EightFloats& lanes, float* to) {
  cv::v_store(to, lanes.low);
  cv::v_store(to + 4, lanes.high);
}
inline EightFloats Smaller(const EightFloats& a, const EightFloats& b) {
  return {cv::v_min(a.low, b.low), cv::v_min(a.high, b.high)};
}
inline void StoreRounded(const EightFloats& lanes, int* to) {
  cv::v_store(to, cv::v_round(lanes.low));
  cv::v_store(to + 4, cv::v_round(lanes.high));
}
inline void StoreTruncated(const EightFloats& lanes, int* to) {
  cv::v_store(to, cv::v_trunc(lanes.low));
  cv::v_store(to + 4, cv::v_trunc(lanes.high));
}

struct FourDoubles {
  cv::v_float64x2 low, high;
  FourDoubles() = default;
  FourDoubles(cv::v_float64x2 first, cv::v_float64x2 last) : low(first), high(last) {}
  FourDoubles(double a, double b, double c, double d) : low(a, b), high(c, d) {}
  FourDoubles& operator+=(const FourDoubles& other) { return *this = {low + other.low, high + other.high}; }
  friend FourDoubles operator*(const FourDoubles& a, const FourDoubles& b) {
    return {a.low * b.low, a.high * b.high};
  }
};
inline FourDoubles AllDoubles(double value) {
  return {cv::v_setall_f64(value), cv::v_setall_f64(value)};
}
inline void Store(const FourDoubles& lanes, double* to) {
  cv::v_store(to, lanes.low);
  cv::v_store(to + 2, lanes.high);
}
inline FourDoubles MultiplyAdd(const FourDoubles& a, const FourDoubles& b, const FourDoubles& c) {
  return {cv::v_fma(a.low, b.low, c.low), cv::v_fma(a.high, b.high, c.high)};
}

#endif

inline constexpr int kByteLanes = ByteLanes::nlanes;

// Sums in the same order at every width.
inline float Sum(const EightFloats& lanes) {
  std::array<float, 8> all;
  Store(lanes, all.data());
  return cv::v_reduce_sum(cv::v_load(all.data()) + cv::v_load(all.data() + 4));
}

}  // namespace docent::engine
