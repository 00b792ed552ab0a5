// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/lens_rows.h"

#include <algorithm>
#include <array>
#include <span>

#include "engine/base/error.h"
#include "maps/storage/byte_stream.h"
#include "maps/storage/checksum.h"
#include "maps/storage/library_identity.h"
#include "maps/storage/schema.h"

namespace docent::maps {

namespace {

Bytes Encode(const StoredLens& lens) {
  const auto& in = lens.model.intrinsics();
  ByteWriter writer;
  writer.Put(static_cast<std::uint32_t>(in.width_px));
  writer.Put(static_cast<std::uint32_t>(in.height_px));
  for (const double number :
       {in.fx, in.cx, in.cy, lens.model.distortion()[0], lens.model.distortion()[1], lens.focal_sigma})
    writer.Put(number);
  writer.Put(static_cast<std::uint8_t>(lens.fixed));
  return writer.Take();
}

std::int64_t ChecksumOf(const std::string& camera, std::span<const std::uint8_t> data) {
  ByteWriter writer;
  writer.PutText(camera);
  return static_cast<std::int64_t>(Checksum(data, Checksum(writer.bytes())));
}

StoredLens Decode(const std::string& camera, std::span<const std::uint8_t> data) {
  constexpr std::size_t kBytes = 2 * sizeof(std::uint32_t) + 6 * sizeof(double) + 1;
  if (data.size() != kBytes) throw Error("its length is wrong");
  ByteReader reader(data);
  engine::CameraModel::Intrinsics in;
  const auto width = reader.Get<std::uint32_t>(), height = reader.Get<std::uint32_t>();
  constexpr std::uint32_t kMaxSide = 65535;
  if (width > kMaxSide || height > kMaxSide) throw Error("its images are too large");
  in.width_px = static_cast<int>(width);
  in.height_px = static_cast<int>(height);
  in.fx = in.fy = reader.Get<double>();
  in.cx = reader.Get<double>();
  in.cy = reader.Get<double>();
  std::array<double, 5> distortion{};
  distortion[0] = reader.Get<double>();
  distortion[1] = reader.Get<double>();
  StoredLens lens;
  lens.camera = camera;
  lens.focal_sigma = reader.Get<double>();
  const auto fixed = reader.Get<std::uint8_t>();
  if (fixed > 1) throw Error("its flag is neither 0 nor 1");
  lens.fixed = fixed == 1;
  constexpr auto kLens = engine::LensModel::kRadialTangential;
  // The constructor of CameraModel requires valid values.
  if (const auto fault = engine::CameraModel::Validate(kLens, in, distortion)) throw Error(*fault);
  lens.model = engine::CameraModel(kLens, in, distortion);
  if (const std::string fault = ProblemOf(lens); !fault.empty()) throw Error(fault);
  return lens;
}

}  // namespace

std::string ProblemOf(const StoredLens& lens) {
  if (lens.camera.empty() || lens.camera.size() > kMaxCameraNameBytes)
    return "the name of its camera does not have 1 to " + std::to_string(kMaxCameraNameBytes) + " bytes";
  if (!(lens.focal_sigma > 0 && lens.focal_sigma <= 1))
    return "its standard deviation is not above 0 and at most 1";
  const auto& in = lens.model.intrinsics();
  const auto& k = lens.model.distortion();
  const bool radial = k[2] == 0 && k[3] == 0 && k[4] == 0;
  if (lens.model.lens() != engine::LensModel::kRadialTangential || in.fx != in.fy || !radial)
    return "its model is not one that is estimated";
  return engine::CameraModel::Validate(lens.model.lens(), in, k).value_or("");
}

StoredLens CheckedLens(const std::string& camera, std::span<const std::uint8_t> data, std::int64_t checksum) {
  if (checksum != ChecksumOf(camera, data)) throw Error("its checksum does not match");
  return Decode(camera, data);
}

std::vector<StoredLens> ReadLenses(const Database& database) {
  std::vector<StoredLens> lenses;
  if (SchemaVersion(database) < kLensesSince) return lenses;
  Statement query = database.Prepare("SELECT camera, data, checksum FROM lenses ORDER BY camera");
  while (query.Step()) {
    const std::string camera = query.Text(0);
    try {
      const StoredLens lens = CheckedLens(camera, query.Blob(1), query.Integer(2));
      if (!IsLibraryIdentity(lens)) lenses.push_back(lens);
    } catch (const Error& error) {
      const std::string what = error.what();
      if (what.starts_with(database.file())) throw;
      throw Error(database.file() + " is damaged: the lens of camera '" + camera + "': " + what);
    }
  }
  return lenses;
}

bool WriteLens(const Database& database, const StoredLens& lens) {
  if (const std::string fault = ProblemOf(lens); !fault.empty())
    throw Error("the lens of camera '" + lens.camera + "' cannot be saved: " + fault);
  const Bytes data = Encode(lens);
  const std::int64_t checksum = ChecksumOf(lens.camera, data);
  Statement query = database.Prepare("SELECT data, checksum FROM lenses WHERE camera = ?");
  query.Bind(1, lens.camera);
  if (query.Step() && std::ranges::equal(query.Blob(0), data) && query.Integer(1) == checksum) return false;
  database.Prepare("INSERT OR REPLACE INTO lenses (camera, data, checksum) VALUES (?, ?, ?)")
      .Bind(1, lens.camera)
      .Bind(2, std::span<const std::uint8_t>(data))
      .Bind(3, checksum)
      .Run();
  return true;
}

}  // namespace docent::maps
