// SPDX-License-Identifier: Apache-2.0
#include "app/files/image_files.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "app/files/guarded_pages.h"

namespace docent::app {

namespace {

constexpr std::size_t kAlignment = 64;  // of each image, in bytes

// An open file without a name. The descriptor is -1, with errno set, when none could be created.
class AnonymousFile {
 public:
  explicit AnonymousFile(const std::filesystem::path& folder)
      : descriptor_(::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600)) {
    // Some file systems do not support O_TMPFILE: create a named file and unlink it.
    if (descriptor_ >= 0 || (errno != EOPNOTSUPP && errno != EISDIR)) return;
    std::string name = (folder / "docent-XXXXXX").string();
    descriptor_ = ::mkostemp(name.data(), O_CLOEXEC);
    if (descriptor_ >= 0) ::unlink(name.c_str());
  }
  ~AnonymousFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  AnonymousFile(const AnonymousFile&) = delete;
  AnonymousFile& operator=(const AnonymousFile&) = delete;

  int descriptor() const { return descriptor_; }
  // Returns false with errno set when the disk has no space for the bytes. Reserving them first guarantees
  // that neither writing back nor reading the mapping later can fail for lack of space.
  bool Reserve(std::size_t bytes) const {
    if (::fallocate(descriptor_, 0, 0, static_cast<off_t>(bytes)) == 0) return true;
    // Where the file system does not support fallocate, Write detects a full disk.
    return errno == EOPNOTSUPP || errno == ENOSYS;
  }
  // Returns false with errno set when the disk does not accept all bytes.
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

// Says once that the disk could not return parts of images.
void WarnOfLostPages() {
  static std::atomic<bool> warned{false};
  if (GuardedPages::Lost() == 0 || warned.exchange(true)) return;
  spdlog::warn(
      "Parts of some keyframe images cannot be read from the disk and are black from now on. Check the "
      "disk.");
}

// A mapped file and the allocator of every image in it: OpenCV's reference count of an image ends in
// deallocate. Each image holds a reference to the mapping; the last one unmaps it.
class ImageMapping final : public cv::MatAllocator,
                           public engine::StoredImages,
                           public WorkingSet::Member,
                           public std::enable_shared_from_this<ImageMapping> {
 public:
  // Null with errno set when the file cannot be mapped.
  static std::shared_ptr<const ImageMapping> Make(const AnonymousFile& file, std::size_t bytes,
                                                  std::shared_ptr<WorkingSet> working_set) {
    void* const data = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, file.descriptor(), 0);
    if (data == MAP_FAILED) return nullptr;
    return std::make_shared<ImageMapping>(data, bytes, std::move(working_set));
  }

  ImageMapping(void* data, std::size_t bytes, std::shared_ptr<WorkingSet> working_set)
      : Member(bytes), data_(data), bytes_(bytes), working_set_(std::move(working_set)) {
    guard_.emplace(data, bytes);
  }
  ~ImageMapping() override {
    working_set_->Remove(*this);
    guard_.reset();
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

  void MarkInUse() const override {
    working_set_->Touch(*this);
    WarnOfLostPages();
  }
  // The pages are shared with the file, so dropping them loses nothing, even while another thread reads them.
  void ReleaseMemory() const override { ::madvise(data_, bytes_, MADV_DONTNEED); }

  void deallocate(cv::UMatData* data) const override {
    if (data == nullptr) return;
    const std::unique_ptr<std::shared_ptr<const ImageMapping>> holder(
        static_cast<std::shared_ptr<const ImageMapping>*>(data->userdata));
    delete data;
  }
  // Never used to allocate: cv::Mat calls its `allocator`, which Image leaves null.
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
  const std::shared_ptr<WorkingSet> working_set_;
  std::optional<GuardedPages> guard_;
};

// Returns the features with their pyramid in a file of the folder; null with errno set on failure.
std::shared_ptr<const engine::ImageFeatures> MoveToFile(const engine::ImageFeatures& features,
                                                        const std::filesystem::path& folder,
                                                        const std::shared_ptr<WorkingSet>& working_set) {
  const AnonymousFile file(folder);
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
  const auto mapping = ImageMapping::Make(file, bytes, working_set);
  if (!mapping) return nullptr;
  auto kept = std::make_shared<engine::ImageFeatures>();
  for (std::size_t i = 0; i < features.levels.size(); ++i)
    kept->levels[i] = mapping->Image(offsets[i], features.levels[i].size());
  kept->corners = features.corners;
  kept->row_begin = features.row_begin;
  kept->fast_threshold = features.fast_threshold;
  kept->small_blurry = {features.small_blurry.pixels.clone(), features.small_blurry.scale};
  kept->stored = mapping;
  return kept;
}

}  // namespace

ImageFiles::ImageFiles(std::filesystem::path folder, std::size_t resident_bytes)
    : folder_(std::move(folder)), working_set_(std::make_shared<WorkingSet>(resident_bytes)) {}

std::filesystem::path ImageFiles::DefaultFolder() {
  const char* const folder = std::getenv("TMPDIR");
  return folder != nullptr && *folder != '\0' ? folder : "/var/tmp";
}

std::shared_ptr<const engine::ImageFeatures> ImageFiles::Store(
    std::shared_ptr<const engine::ImageFeatures> features) {
  if (features->stored) return features;
  if (auto kept = MoveToFile(*features, folder_, working_set_)) return kept;
  const int error = errno;
  if (!warned_.exchange(true)) {
    spdlog::warn("Keyframe images stay in memory, because no file can be written in '{}' ({}).",
                 folder_.string(), std::generic_category().message(error));
  }
  return features;
}

void ImageFiles::EvictAll() {
  working_set_->EvictAll();
}

}  // namespace docent::app
