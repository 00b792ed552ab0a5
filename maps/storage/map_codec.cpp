// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/map_codec.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_set>
#include <utility>

#include "engine/base/error.h"
#include "maps/storage/envelope.h"

namespace docent::maps {

namespace {

using engine::CameraModel;
using engine::LensModel;

constexpr double kUnitTolerance = 1e-6;  // Tolerance of a stored quaternion's length.
// In the byte of the lens: the motion of a rolling shutter follows.
constexpr std::uint8_t kReadoutFlag = 0x80;
constexpr double kMaxRotationRate = 100;  // radians per second; no camera that is tracked turns as fast
constexpr double kMaxReadout_s = 1;       // of a rolling shutter
constexpr double kSameRotation = 1e-12;   // Tolerance of a quaternion's coefficients.

bool HasReadout(const engine::ReadoutMotion& motion) {
  return !motion.rotation_rate.isZero(0) && !motion.readout_s.isZero(0);
}

bool IsPlausible(const engine::ReadoutMotion& motion) {
  return motion.rotation_rate.cwiseAbs().maxCoeff() <= kMaxRotationRate &&
         motion.readout_s.cwiseAbs().maxCoeff() <= kMaxReadout_s && motion.rotation_rate.allFinite() &&
         motion.readout_s.allFinite();
}

bool SameKeyFrame(const StoredKeyFrame& stored_a, const StoredKeyFrame& stored_b) {
  const engine::KeyFrame& a = stored_a.keyframe;
  const engine::KeyFrame& b = stored_b.keyframe;
  return stored_a.image_hash == stored_b.image_hash && a.id == b.id && a.kind == b.kind &&
         a.panorama == b.panorama && a.fixed == b.fixed && a.time == b.time &&
         a.camera_from_map.translation == b.camera_from_map.translation &&
         (a.camera_from_map.rotation.quaternion().coeffs() - b.camera_from_map.rotation.quaternion().coeffs())
                 .cwiseAbs()
                 .maxCoeff() <= kSameRotation &&
         a.mean_depth == b.mean_depth && a.depth_sigma == b.depth_sigma && *a.camera == *b.camera;
}

bool SamePoint(const engine::MapPoint& a, const engine::MapPoint& b) {
  return a.id == b.id && a.point_in_map == b.point_in_map && a.panorama == b.panorama &&
         a.was_infinite == b.was_infinite && a.source_keyframe == b.source_keyframe &&
         a.source_level == b.source_level && a.source_pixel == b.source_pixel && a.normal == b.normal;
}

bool SameObservation(const engine::Observation& a, const engine::Observation& b) {
  return a.keyframe == b.keyframe && a.point == b.point && a.pixel == b.pixel && a.level == b.level;
}

std::uint16_t CameraIndex(const CameraTable& cameras, const std::shared_ptr<const CameraModel>& camera) {
  const auto it = std::find_if(cameras.begin(), cameras.end(),
                               [&](const auto& known) { return known == camera || *known == *camera; });
  return static_cast<std::uint16_t>(it - cameras.begin());
}

void CheckImageSize(const std::string& camera, std::int64_t width, std::int64_t height) {
  if (std::min(width, height) < kMinImageSidePx || std::max(width, height) > kMaxImageSidePx ||
      width * height > kMaxImagePixels) {
    throw Error(camera + " has an impossible image size of " + std::to_string(width) + "x" +
                std::to_string(height));
  }
}

StoredKeyFrame DecodeKeyFrame(ByteReader& reader, const CameraTable& cameras) {
  StoredKeyFrame stored;
  engine::KeyFrame& keyframe = stored.keyframe;
  keyframe.id = reader.Get<std::uint32_t>();
  const std::string name = "keyframe " + std::to_string(keyframe.id);
  const auto kind = reader.Get<std::uint8_t>();
  if (kind > static_cast<std::uint8_t>(engine::KeyFrameKind::kPanorama))
    throw Error(name + " is of an unknown kind");
  keyframe.kind = static_cast<engine::KeyFrameKind>(kind);
  const auto fixed = reader.Get<std::uint8_t>();
  if (fixed > 1) throw Error(name + " has unknown flags");
  keyframe.fixed = fixed == 1;
  const auto camera = reader.Get<std::uint32_t>();
  if (camera >= cameras.size()) throw Error(name + " refers to a camera that does not exist");
  keyframe.camera = cameras[camera];
  keyframe.time = Timestamp(reader.Get<std::int64_t>());
  const Eigen::Quaterniond rotation(reader.GetAll<Eigen::Vector4d>());  // Order x y z w.
  if (!rotation.coeffs().allFinite() || std::abs(rotation.norm() - 1) > kUnitTolerance) {
    throw Error(name + " has no valid rotation");
  }
  keyframe.camera_from_map = {engine::Rotation3(rotation), reader.GetAll<Eigen::Vector3d>()};
  keyframe.mean_depth = reader.Get<double>();
  keyframe.depth_sigma = reader.Get<double>();
  stored.image_hash = reader.Get<std::uint64_t>();
  return stored;
}

}  // namespace

CameraTable MakeCameraTable(const std::vector<StoredKeyFrame>& keyframes) {
  CameraTable cameras;
  for (const StoredKeyFrame& stored : keyframes) {
    if (CameraIndex(cameras, stored.keyframe.camera) == cameras.size())
      cameras.push_back(stored.keyframe.camera);
  }
  return cameras;
}

std::vector<StoredKeyFrame> MakeStoredKeyFrames(const engine::MapSnapshot& snapshot) {
  std::vector<StoredKeyFrame> keyframes;
  keyframes.reserve(snapshot.keyframes.size());
  for (const engine::KeyFrame& keyframe : snapshot.keyframes) {
    keyframe.features->MarkInUse();
    StoredKeyFrame stored{keyframe, ImageHash(keyframe.features->levels[0])};
    stored.keyframe.features = nullptr;
    keyframes.push_back(std::move(stored));
  }
  return keyframes;
}

Bytes EncodeCameras(std::uint64_t map_key, const CameraTable& cameras) {
  ByteWriter writer = BeginEnvelope(kCameraTableKind, map_key, cameras.size());
  for (const auto& camera : cameras) {
    const CameraModel::Intrinsics& intrinsics = camera->intrinsics();
    // Data that could not be read back must not be written.
    CheckImageSize("its camera", intrinsics.width_px, intrinsics.height_px);
    if (const auto problem = CameraModel::Validate(camera->lens(), intrinsics, camera->distortion())) {
      throw Error("its camera is not valid: " + *problem);
    }
    const engine::ReadoutMotion& motion = camera->readout_motion();
    const bool rotates = HasReadout(motion);
    if (rotates && !IsPlausible(motion)) throw Error("the rolling shutter of its camera is not valid");
    writer.Put(
        static_cast<std::uint8_t>(static_cast<std::uint8_t>(camera->lens()) | (rotates ? kReadoutFlag : 0)));
    writer.Put(static_cast<std::uint32_t>(intrinsics.width_px));
    writer.Put(static_cast<std::uint32_t>(intrinsics.height_px));
    for (const double number : {intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy})
      writer.Put(number);
    for (const double number : camera->distortion()) writer.Put(number);
    if (!rotates) continue;
    for (const double number : motion.rotation_rate) writer.Put(number);
    for (const double number : motion.readout_s) writer.Put(number);
  }
  return FinishEnvelope(std::move(writer));
}

CameraTable DecodeCameras(std::uint64_t map_key, std::span<const std::uint8_t> bytes) {
  auto [reader, count] = OpenEnvelope(kCameraTableKind, map_key, bytes);
  // Cameras without the motion of a rolling shutter have this size, the others are longer.
  constexpr std::size_t kSmallestRecord = 81;
  const auto refuse_count = [&, count = count](std::size_t bytes_left) {
    throw Error(std::string(kCameraTableKind.name) + " is damaged: its header gives " +
                std::to_string(count) + " records for " + std::to_string(bytes_left) + " bytes");
  };
  if (count > reader.remaining() / kSmallestRecord) refuse_count(reader.remaining());
  CameraTable cameras;
  cameras.reserve(count);
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::string name = "camera " + std::to_string(i);
    const auto kind = reader.Get<std::uint8_t>();
    const bool rotates = (kind & kReadoutFlag) != 0;
    const auto lens = static_cast<std::uint8_t>(kind & ~kReadoutFlag);
    if (lens > static_cast<std::uint8_t>(LensModel::kKannalaBrandt))
      throw Error(name + " has an unknown lens model");
    const auto width = reader.Get<std::uint32_t>(), height = reader.Get<std::uint32_t>();
    CheckImageSize(name, width, height);
    CameraModel::Intrinsics intrinsics;
    intrinsics.width_px = static_cast<int>(width);
    intrinsics.height_px = static_cast<int>(height);
    for (double* number : {&intrinsics.fx, &intrinsics.fy, &intrinsics.cx, &intrinsics.cy}) {
      *number = reader.Get<double>();
    }
    std::array<double, 5> distortion{};
    for (double& number : distortion) number = reader.Get<double>();
    if (const auto problem = CameraModel::Validate(static_cast<LensModel>(lens), intrinsics, distortion)) {
      throw Error(name + " is not valid: " + *problem);
    }
    auto camera = std::make_shared<const CameraModel>(static_cast<LensModel>(lens), intrinsics, distortion);
    if (!rotates) {
      cameras.push_back(std::move(camera));
      continue;
    }
    engine::ReadoutMotion motion;
    for (double& number : motion.rotation_rate) number = reader.Get<double>();
    for (double& number : motion.readout_s) number = reader.Get<double>();
    if (!HasReadout(motion) || !IsPlausible(motion)) throw Error(name + " has no valid rolling shutter");
    // Models of images of one camera share its lens, as they do in a session.
    const auto known = std::find_if(cameras.begin(), cameras.end(),
                                    [&](const auto& other) { return other->HasSameLens(*camera); });
    cameras.push_back(std::make_shared<const CameraModel>(
        CameraModel::WithReadout(known != cameras.end() ? *known : camera, motion)));
  }
  if (reader.remaining() > 0) refuse_count(reader.remaining());
  return cameras;
}

Bytes EncodeKeyFrames(std::uint64_t map_key, const std::vector<StoredKeyFrame>& keyframes,
                      const CameraTable& cameras) {
  ByteWriter writer = BeginEnvelope(kKeyFrameTableKind, map_key, keyframes.size());
  for (const StoredKeyFrame& stored : keyframes) {
    const engine::KeyFrame& keyframe = stored.keyframe;
    writer.Put(std::uint32_t{keyframe.id});
    writer.Put(static_cast<std::uint8_t>(keyframe.kind));
    writer.Put(std::uint8_t{keyframe.fixed});
    writer.Put(std::uint32_t{CameraIndex(cameras, keyframe.camera)});
    writer.Put(std::int64_t{keyframe.time.count()});
    writer.PutAll(keyframe.camera_from_map.rotation.quaternion().coeffs());
    writer.PutAll(keyframe.camera_from_map.translation);
    writer.Put(keyframe.mean_depth);
    writer.Put(keyframe.depth_sigma);
    writer.Put(stored.image_hash);
  }
  return FinishEnvelope(std::move(writer));
}

std::vector<StoredKeyFrame> DecodeKeyFrames(std::uint64_t map_key, std::span<const std::uint8_t> bytes,
                                            const CameraTable& cameras) {
  auto [reader, count] = OpenEnvelope(kKeyFrameTableKind, map_key, bytes);
  std::vector<StoredKeyFrame> keyframes;
  keyframes.reserve(count);
  for (std::uint64_t i = 0; i < count; ++i) keyframes.push_back(DecodeKeyFrame(reader, cameras));
  return keyframes;
}

Bytes EncodePoints(std::uint64_t map_key, const std::vector<engine::MapPoint>& points) {
  ByteWriter writer = BeginEnvelope(kPointTableKind, map_key, points.size());
  for (const engine::MapPoint& point : points) {
    writer.Put(std::uint32_t{point.id});
    writer.PutAll(point.point_in_map);
    writer.Put(std::uint32_t{point.source_keyframe});
    writer.Put(std::uint8_t{point.source_level});
    writer.PutAll(point.source_pixel);
    writer.PutAll(point.normal);
  }
  return FinishEnvelope(std::move(writer));
}

std::vector<engine::MapPoint> DecodePoints(std::uint64_t map_key, std::span<const std::uint8_t> bytes) {
  auto [reader, count] = OpenEnvelope(kPointTableKind, map_key, bytes);
  std::vector<engine::MapPoint> points(count);
  for (engine::MapPoint& point : points) {
    point.id = reader.Get<std::uint32_t>();
    point.point_in_map = reader.GetAll<Eigen::Vector4d>();
    point.source_keyframe = reader.Get<std::uint32_t>();
    point.source_level = reader.Get<std::uint8_t>();
    point.source_pixel = reader.GetAll<Eigen::Vector2f>();
    point.normal = reader.GetAll<Eigen::Vector3f>();
  }
  return points;
}

Bytes EncodeObservations(std::uint64_t map_key, const std::vector<engine::Observation>& observations) {
  ByteWriter writer = BeginEnvelope(kObservationTableKind, map_key, observations.size());
  for (const engine::Observation& observation : observations) {
    writer.Put(std::uint32_t{observation.keyframe});
    writer.Put(std::uint32_t{observation.point});
    writer.PutAll(observation.pixel);
    writer.Put(std::uint8_t{observation.level});
  }
  return FinishEnvelope(std::move(writer));
}

std::vector<engine::Observation> DecodeObservations(std::uint64_t map_key,
                                                    std::span<const std::uint8_t> bytes) {
  auto [reader, count] = OpenEnvelope(kObservationTableKind, map_key, bytes);
  std::vector<engine::Observation> observations(count);
  for (engine::Observation& observation : observations) {
    observation.keyframe = reader.Get<std::uint32_t>();
    observation.point = reader.Get<std::uint32_t>();
    observation.pixel = reader.GetAll<Eigen::Vector2f>();
    observation.level = reader.Get<std::uint8_t>();
  }
  return observations;
}

Bytes EncodeScene(std::uint64_t map_key, const ScenePart& scene) {
  ByteWriter writer = BeginEnvelope(kSceneKind, map_key, scene.asset_ids.size());
  writer.PutText(scene.text);
  for (const std::string& id : scene.asset_ids) writer.PutText(id);
  return FinishEnvelope(std::move(writer));
}

ScenePart DecodeScene(std::uint64_t map_key, std::span<const std::uint8_t> bytes) {
  auto [reader, count] = OpenEnvelope(kSceneKind, map_key, bytes);
  ScenePart scene;
  scene.text = reader.GetText();
  std::unordered_set<std::string> seen;
  constexpr std::size_t kSmallestId = sizeof(std::uint32_t) + kMinAssetIdBytes;
  if (reader.failed() || count > reader.remaining() / kSmallestId)
    throw Error("the scene is damaged: its length does not match");
  scene.asset_ids.reserve(count);
  for (std::uint64_t i = 0; i < count; ++i) {
    std::string id = reader.GetText();
    if (id.size() < kMinAssetIdBytes || id.size() > kMaxAssetIdBytes || !seen.insert(id).second) {
      throw Error("the scene is damaged: it refers to an asset without a valid id");
    }
    scene.asset_ids.push_back(std::move(id));
  }
  if (reader.failed() || reader.remaining() != 0)
    throw Error("the scene is damaged: its length does not match");
  return scene;
}

bool SameStructure(const MapParts& a, const MapParts& b) {
  return std::equal(a.keyframes.begin(), a.keyframes.end(), b.keyframes.begin(), b.keyframes.end(),
                    SameKeyFrame) &&
         std::equal(a.points.begin(), a.points.end(), b.points.begin(), b.points.end(), SamePoint) &&
         a.next_panorama == b.next_panorama &&
         std::equal(
             a.panoramas.begin(), a.panoramas.end(), b.panoramas.begin(), b.panoramas.end(),
             [](const auto& p, const auto& q) { return p.id == q.id && p.reference == q.reference; }) &&
         std::equal(a.observations.begin(), a.observations.end(), b.observations.begin(),
                    b.observations.end(), SameObservation);
}

}  // namespace docent::maps
