// SPDX-License-Identifier: Apache-2.0
#include "app/files/image_files.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <opencv2/core.hpp>
#include <string>
#include <utility>

namespace docent::app {

namespace {

constexpr std::size_t kAlignment = 64;  // of each image, in bytes

// An open file without a name; -1 with errno when there can be none.
class NamelessFile {
 public:
  explicit NamelessFile(const std::filesystem::path& folder)
      : descriptor_(::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600)) {
    // Not every file system has files that never had a name.
    if (descriptor_ >= 0 || (errno != EOPNOTSUPP && errno != EISDIR)) return;
    std::string name = (folder / "docent-XXXXXX").string();
    descriptor_ = ::mkostemp(name.data(), O_CLOEXEC);
    if (descriptor_ >= 0) ::unlink(name.c_str());
  }
  ~NamelessFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  NamelessFile(const NamelessFile&) = delete;
  NamelessFile& operator=(const NamelessFile&) = delete;

  int descriptor() const { return descriptor_; }
  // False with errno when the disk has no room for it. What was written fits for sure then, now and when the
  // system brings it to the disk, and to look at it later cannot fail for want of room.
  bool Reserve(std::size_t bytes) const {
    if (::fallocate(descriptor_, 0, 0, static_cast<off_t>(bytes)) == 0) return true;
    // Where the file system cannot tell, writing does.
    return errno == EOPNOTSUPP || errno == ENOSYS;
  }
  // False with errno when the disk does not take it all.
  bool Write(const std::uint8_t* bytes, std::size_t count, std::size_t offset) const {
    while (count > 0) {
      const ssize_t written = ::pwrite(descriptor_, bytes, count, static_cast<off_t>(offset));
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) return false;
      bytes += written;
      offset += static_cast<std::size_t>(written);
      count -= static_cast<std::size_t>(written);
    }
    return true;
  }

 private:
  int descriptor_ = -1;
};

// A file's bytes in memory, and the owner of every image that lies in them: OpenCV's count of who holds an
// image ends here. Each image holds the mapping; the last one takes it along.
class ImageMapping final : public cv::MatAllocator,
                           public engine::KeptImages,
                           public WorkingSet::Member,
                           public std::enable_shared_from_this<ImageMapping> {
 public:
  // Null with errno when it cannot be mapped.
  static std::shared_ptr<const ImageMapping> Make(const NamelessFile& file, std::size_t bytes,
                                                  std::shared_ptr<WorkingSet> awake) {
    void* const data = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, file.descriptor(), 0);
    if (data == MAP_FAILED) return nullptr;
    return std::make_shared<ImageMapping>(data, bytes, std::move(awake));
  }

  ImageMapping(void* data, std::size_t bytes, std::shared_ptr<WorkingSet> awake)
      : Member(bytes), data_(data), bytes_(bytes), awake_(std::move(awake)) {}
  ~ImageMapping() override {
    awake_->Remove(*this);
    ::munmap(data_, bytes_);
  }
  ImageMapping(const ImageMapping&) = delete;
  ImageMapping& operator=(const ImageMapping&) = delete;

  cv::Mat Image(std::size_t offset, cv::Size size) const {
    cv::Mat image(size, CV_8UC1, static_cast<std::uint8_t*>(data_) + offset);
    auto holder = std::make_unique<std::shared_ptr<const ImageMapping>>(shared_from_this());
    image.u = new cv::UMatData(this);  // deleted by deallocate
    image.u->data = image.u->origdata = image.data;
    image.u->size = image.total();
    image.u->refcount = 1;
    image.u->userdata = holder.release();
    return image;
  }

  void Look() const override { awake_->Look(*this); }
  // The pages are shared with the file: to let them go loses nothing, even while somebody reads them.
  void Rest() const override { ::madvise(data_, bytes_, MADV_DONTNEED); }

  void deallocate(cv::UMatData* data) const override {
    if (data == nullptr) return;
    const std::unique_ptr<std::shared_ptr<const ImageMapping>> holder(
        static_cast<std::shared_ptr<const ImageMapping>*>(data->userdata));
    delete data;
  }
  // Nothing else is ever made in here: cv::Mat asks its `allocator`, which Image leaves empty.
  cv::UMatData* allocate(int /*dims*/, const int* /*sizes*/, int /*type*/, void* /*data*/,
                         std::size_t* /*step*/, cv::AccessFlag /*flags*/,
                         cv::UMatUsageFlags /*usage*/) const override {
    return nullptr;
  }
  bool allocate(cv::UMatData* /*data*/, cv::AccessFlag /*flags*/,
                cv::UMatUsageFlags /*usage*/) const override {
    return false;
  }

 private:
  void* const data_;
  const std::size_t bytes_;
  const std::shared_ptr<WorkingSet> awake_;
};

// The features with their pyramid in a file of the folder; null with errno.
std::shared_ptr<const engine::ImageFeatures> MoveToFile(const engine::ImageFeatures& features,
                                                        const std::filesystem::path& folder,
                                                        const std::shared_ptr<WorkingSet>& awake) {
  const NamelessFile file(folder);
  if (file.descriptor() < 0) return nullptr;
  std::array<std::size_t, engine::kPyramidLevels> offsets{};
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < features.levels.size(); ++i) {
    offsets[i] = bytes;
    bytes = (bytes + features.levels[i].total() + kAlignment - 1) / kAlignment * kAlignment;
  }
  if (!file.Reserve(bytes)) return nullptr;
  for (std::size_t i = 0; i < features.levels.size(); ++i) {
    const cv::Mat& level = features.levels[i];
    const cv::Mat whole = level.isContinuous() ? level : level.clone();
    if (!file.Write(whole.ptr(), whole.total(), offsets[i])) return nullptr;
  }
  const auto mapping = ImageMapping::Make(file, bytes, awake);
  if (!mapping) return nullptr;
  auto kept = std::make_shared<engine::ImageFeatures>();
  for (std::size_t i = 0; i < features.levels.size(); ++i)
    kept->levels[i] = mapping->Image(offsets[i], features.levels[i].size());
  kept->corners = features.corners;
  kept->row_begin = features.row_begin;
  kept->fast_threshold = features.fast_threshold;
  kept->small_blurry = {features.small_blurry.pixels.clone(), features.small_blurry.scale};
  kept->kept = mapping;
  return kept;
}

}  // namespace

ImageFiles::ImageFiles(std::filesystem::path folder, std::size_t awake_bytes)
    : folder_(std::move(folder)), awake_(std::make_shared<WorkingSet>(awake_bytes)) {}

std::filesystem::path ImageFiles::DefaultFolder() {
  const char* const folder = std::getenv("TMPDIR");
  return folder != nullptr && *folder != '\0' ? folder : "/var/tmp";
}

std::shared_ptr<const engine::ImageFeatures> ImageFiles::Keep(
    std::shared_ptr<const engine::ImageFeatures> features) {
  if (features->kept) return features;
  if (auto kept = MoveToFile(*features, folder_, awake_)) return kept;
  const int error = errno;
  if (!told_.exchange(true)) {
    spdlog::warn("The images of maps stay in memory: '{}' takes no file ({}).", folder_.string(),
                 std::strerror(error));
  }
  return features;
}

void ImageFiles::EvictAll() {
  awake_->EvictAll();
}

}  // namespace docent::app
