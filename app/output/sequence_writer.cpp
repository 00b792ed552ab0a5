// SPDX-License-Identifier: Apache-2.0
#include "app/output/sequence_writer.h"

#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "app/calibration/calibration_file.h"
#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

std::filesystem::path MadeSequenceFolder(const std::filesystem::path& folder) {
  MakeFolder(folder / "rgb");
  // Lists of an earlier run would not match the new images.
  for (const char* name : {"rgb.txt", "groundtruth.txt", "segments.txt"})
    std::filesystem::remove(folder / name);
  return folder;
}

}  // namespace

SequenceWriter::SequenceWriter(const std::filesystem::path& folder, const engine::CameraModel& camera,
                               ImageFormat format)
    : folder_(MadeSequenceFolder(folder)),
      format_(format),
      list_(folder / "rgb.txt"),
      truth_(folder / "groundtruth.txt"),
      segments_(folder / "segments.txt") {
  WriteCalibration(folder_ / "calibration.yaml", camera);
  list_.Write("# timestamp filename\n");
  truth_.Write("# timestamp tx ty tz qx qy qz qw (camera to world)\n");
  segments_.Write("# timestamp label\n");
}

void SequenceWriter::Add(const SequenceImage& image) {
  const std::string time = FormatSeconds(image.time);
  const bool png = format_ == ImageFormat::kPng;
  const std::string name = "rgb/" + time + (png ? ".png" : ".jpg");
  std::vector<std::uint8_t> bytes;
  // The lowest PNG compression level that still filters: noise does not compress, and higher levels take
  // seconds.
  const std::vector<int> parameters =
      png ? std::vector<int>{cv::IMWRITE_PNG_COMPRESSION, 1} : std::vector<int>{cv::IMWRITE_JPEG_QUALITY, 95};
  if (!cv::imencode(png ? ".png" : ".jpg", image.image, bytes, parameters)) {
    throw Error("Cannot encode the image '" + name + "'.");
  }
  CheckedFile file(folder_ / name);
  file.Write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  file.Close(CheckedFile::WaitForDisk::kNo);
  list_.Write(time + ' ' + name + '\n');

  const Eigen::Vector3d& t = image.truth_from_camera.translation;
  const Eigen::Vector4d& q = image.truth_from_camera.rotation.quaternion().coeffs();  // x y z w
  std::string line = time;
  for (const double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()})
    line += ' ' + FormatNumber(value, 12);
  truth_.Write(line + '\n');
  if (!image.label.empty()) segments_.Write(time + ' ' + image.label + '\n');
}

void SequenceWriter::Close() {
  truth_.Close();
  segments_.Close();
  list_.Close();  // last: rgb.txt is what marks the folder as a complete sequence
}

}  // namespace docent::app
