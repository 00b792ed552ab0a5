// SPDX-License-Identifier: Apache-2.0
#include "content/gltf/accessor.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "content/gltf/check.h"

namespace docent::content {
namespace {

const char* TypeName(int type) {
  switch (type) {
    case TINYGLTF_TYPE_SCALAR:
      return "SCALAR";
    case TINYGLTF_TYPE_VEC2:
      return "VEC2";
    case TINYGLTF_TYPE_VEC3:
      return "VEC3";
    case TINYGLTF_TYPE_VEC4:
      return "VEC4";
    case TINYGLTF_TYPE_MAT2:
      return "MAT2";
    case TINYGLTF_TYPE_MAT3:
      return "MAT3";
    default:
      return "MAT4";
  }
}

// Uses memcpy, because the buffer need not be aligned for the type.
template <typename T>
T Load(const std::uint8_t* from) {
  T value;
  std::memcpy(&value, from, sizeof(T));
  return value;
}

const std::uint8_t* ViewData(const tinygltf::Model& model, int view) {
  const tinygltf::BufferView& buffer_view = model.bufferViews[static_cast<std::size_t>(view)];
  return model.buffers[static_cast<std::size_t>(buffer_view.buffer)].data.data() + buffer_view.byteOffset;
}

std::uint32_t LoadUnsigned(const std::uint8_t* from, int component_type) {
  if (component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) return *from;
  if (component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) return Load<std::uint16_t>(from);
  return Load<std::uint32_t>(from);
}

}  // namespace

AccessorReader::AccessorReader(const std::string& file, const tinygltf::Model& model, int accessor)
    : file_(file), index_(accessor) {
  const tinygltf::Accessor& source = model.accessors[static_cast<std::size_t>(accessor)];
  const std::string type = TypeName(source.type);
  count_ = source.count;
  components_ = ComponentCount(type);
  component_type_ = source.componentType;
  component_bytes_ = ComponentBytes(source.componentType);
  normalized_ = source.normalized;
  const std::size_t element_bytes = ElementBytes(type, source.componentType);
  if (source.bufferView >= 0) {
    const std::size_t stride = model.bufferViews[static_cast<std::size_t>(source.bufferView)].byteStride;
    stride_ = stride == 0 ? element_bytes : stride;
    data_ = ViewData(model, source.bufferView) + source.byteOffset;
  }
  if (source.sparse.isSparse || source.bufferView < 0) ApplySparse(model, source, element_bytes);
}

void AccessorReader::ApplySparse(const tinygltf::Model& model, const tinygltf::Accessor& accessor,
                                 std::size_t element_bytes) {
  own_.assign(count_ * element_bytes, 0);
  const std::size_t copied_bytes = UnpaddedBytes(TypeName(accessor.type), accessor.componentType);
  if (data_ != nullptr) {
    for (std::size_t i = 0; i < count_; ++i)
      std::memcpy(&own_[i * element_bytes], data_ + i * stride_, copied_bytes);
  }
  data_ = own_.data();
  stride_ = element_bytes;
  if (!accessor.sparse.isSparse) return;
  const int index_type = accessor.sparse.indices.componentType;
  const std::uint8_t* indices =
      ViewData(model, accessor.sparse.indices.bufferView) + accessor.sparse.indices.byteOffset;
  const std::uint8_t* values =
      ViewData(model, accessor.sparse.values.bufferView) + accessor.sparse.values.byteOffset;
  for (std::size_t i = 0; i < static_cast<std::size_t>(accessor.sparse.count); ++i) {
    const std::uint32_t element = LoadUnsigned(indices + i * ComponentBytes(index_type), index_type);
    if (element >= count_) {
      Refuse(file_, Place("accessors", static_cast<std::size_t>(index_)) + ".sparse",
             "replaces element " + std::to_string(element) + " of " + std::to_string(count_) + ".");
    }
    std::memcpy(&own_[element * element_bytes], values + i * element_bytes, copied_bytes);
  }
}

float AccessorReader::Float(std::size_t element, int component) const {
  const std::uint8_t* from = At(element, component);
  switch (component_type_) {
    case TINYGLTF_COMPONENT_TYPE_BYTE: {
      const float value = Load<std::int8_t>(from);
      return normalized_ ? std::max(value / 127.0f, -1.0f) : value;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return normalized_ ? static_cast<float>(*from) / 255.0f : static_cast<float>(*from);
    case TINYGLTF_COMPONENT_TYPE_SHORT: {
      const float value = Load<std::int16_t>(from);
      return normalized_ ? std::max(value / 32767.0f, -1.0f) : value;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: {
      const float value = Load<std::uint16_t>(from);
      return normalized_ ? value / 65535.0f : value;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return static_cast<float>(Load<std::uint32_t>(from));
    default:
      break;
  }
  const float value = Load<float>(from);
  if (!std::isfinite(value)) {
    Refuse(file_, Place("accessors", static_cast<std::size_t>(index_)),
           "holds a number that is not finite, at element " + std::to_string(element) + ".");
  }
  return value;
}

std::uint32_t AccessorReader::Unsigned(std::size_t element, int component) const {
  return LoadUnsigned(At(element, component), component_type_);
}

const AccessorReader& AccessorCache::Get(int accessor) {
  std::unique_ptr<AccessorReader>& reader = readers_[accessor];
  if (!reader) reader = std::make_unique<AccessorReader>(file_, model_, accessor);
  return *reader;
}

void AccessorCache::CheckFinite(std::uint64_t max_bytes) {
  std::uint64_t bytes_left = max_bytes;
  for (std::size_t i = 0; i < model_.accessors.size(); ++i) {
    const tinygltf::Accessor& accessor = model_.accessors[i];
    if (accessor.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT) continue;
    if (accessor.bufferView < 0 && !accessor.sparse.isSparse) continue;  // All zeros.
    const AccessorReader& reader = Get(static_cast<int>(i));
    const std::uint64_t bytes =
        reader.count() * static_cast<std::uint64_t>(reader.components()) * sizeof(float);
    if (bytes > bytes_left) {
      Refuse(file_, Place("accessors", i),
             "takes the accessors over the limit of " + std::to_string(max_bytes) + " bytes.");
    }
    bytes_left -= bytes;
    for (std::size_t element = 0; element < reader.count(); ++element) {
      for (int component = 0; component < reader.components(); ++component) reader.Float(element, component);
    }
  }
}

}  // namespace docent::content
