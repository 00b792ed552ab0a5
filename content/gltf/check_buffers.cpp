// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <iterator>
#include <utility>

#include "content/gltf/check.h"

namespace docent::content {
namespace {

constexpr std::string_view kAccessorTypes[] = {"SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"};

bool IsGltf1(const Json& root) {
  // In glTF 1.0 the collections are named objects, not arrays.
  for (const char* name : {"meshes", "nodes", "accessors", "bufferViews", "buffers", "scenes"}) {
    const auto found = root.find(name);
    if (found != root.end() && found->is_object()) return true;
  }
  return false;
}

int MajorVersion(const std::string& version) {
  const std::size_t dot = version.find('.');
  const bool has_form =
      dot != std::string::npos && dot > 0 && dot + 1 < version.size() && version.size() < 12;
  if (!has_form || version.find_first_not_of("0123456789.") != std::string::npos) return -1;
  if (version.find('.', dot + 1) != std::string::npos) return -1;
  return std::stoi(version.substr(0, dot));
}

// The location of an accessor's elements in a view; all values in bytes except the count. Fits checks them.
struct Layout {
  // last_bytes is the size of the last element, which needs no padding.
  std::uint64_t offset, stride, last_bytes, count;
  bool Fits(std::uint64_t view_bytes) const {
    // No sum or product can overflow here, because each operand was bounded first.
    if (offset > view_bytes || last_bytes > view_bytes - offset) return false;
    return (count - 1) <= (view_bytes - offset - last_bytes) / stride;
  }
};

class AccessorChecker {
 public:
  AccessorChecker(std::string_view file, const Json& root, std::uint64_t file_bytes)
      : file_(file), views_(ArrayOf(root, "bufferViews")), file_bytes_(file_bytes) {}

  void Check(const Json& accessor, const std::string& place) const {
    const std::string& type = accessor["type"].get_ref<const std::string&>();
    const int component_type = accessor["componentType"].get<int>();
    const std::uint64_t count = accessor["count"].get<std::uint64_t>();
    if (accessor.value("normalized", false) && (component_type == 5126 || component_type == 5125)) {
      Refuse(file_, place, "is normalized, which only 8 and 16 bit integers can be.");
    }
    for (const char* bound : {"min", "max"}) {
      if (accessor.contains(bound) && static_cast<int>(accessor[bound].size()) != ComponentCount(type)) {
        Refuse(file_, place + "." + bound, "does not have one number for each component.");
      }
    }
    if (accessor.contains("bufferView")) {
      CheckDense(accessor, place);
    } else {
      if (accessor.contains("byteOffset")) Refuse(file_, place, "has a byteOffset but no bufferView.");
      if (count > file_bytes_) {
        Refuse(file_, place,
               "claims " + std::to_string(count) + " elements, more than the whole file has bytes.");
      }
    }
    if (accessor.contains("sparse")) CheckSparse(accessor, place + ".sparse");
  }

 private:
  void CheckDense(const Json& accessor, const std::string& place) const {
    const std::string& type = accessor["type"].get_ref<const std::string&>();
    const int component_type = accessor["componentType"].get<int>();
    const Json& view = views_[accessor["bufferView"].get<std::size_t>()];
    const std::uint64_t element_bytes = ElementBytes(type, component_type);
    const std::uint64_t stride = UnsignedOr(view, "byteStride", element_bytes);
    if (stride < element_bytes) Refuse(file_, place, "has elements larger than its view's byteStride.");
    CheckPart(view,
              {UnsignedOr(accessor, "byteOffset", 0), stride, UnpaddedBytes(type, component_type),
               accessor["count"].get<std::uint64_t>()},
              component_type, place);
  }

  void CheckSparse(const Json& accessor, const std::string& place) const {
    const Json& sparse = accessor["sparse"];
    const std::uint64_t count = sparse["count"].get<std::uint64_t>();
    if (count > accessor["count"].get<std::uint64_t>()) {
      Refuse(file_, place, "replaces more elements than the accessor has.");
    }
    const int index_type = sparse["indices"]["componentType"].get<int>();
    const int value_type = accessor["componentType"].get<int>();
    const std::string& type = accessor["type"].get_ref<const std::string&>();
    for (const char* part : {"indices", "values"}) {
      const bool indices = part == std::string_view("indices");
      const Json& view = views_[sparse[part]["bufferView"].get<std::size_t>()];
      if (view.contains("byteStride")) Refuse(file_, place + "." + part, "lies in a view with a byteStride.");
      const int component_type = indices ? index_type : value_type;
      const std::uint64_t stride = indices ? ComponentBytes(index_type) : ElementBytes(type, value_type);
      const std::uint64_t last = indices ? stride : UnpaddedBytes(type, value_type);
      CheckPart(view, {UnsignedOr(sparse[part], "byteOffset", 0), stride, last, count}, component_type,
                place + "." + part);
    }
  }

  void CheckPart(const Json& view, const Layout& layout, int component_type, const std::string& place) const {
    const std::uint64_t view_bytes = view["byteLength"].get<std::uint64_t>();
    if (!layout.Fits(view_bytes)) {
      Refuse(file_, place,
             "claims " + std::to_string(layout.count) + " elements of " + std::to_string(layout.stride) +
                 " bytes, more than its buffer view of " + std::to_string(view_bytes) + " bytes holds.");
    }
    const std::uint64_t alignment = ComponentBytes(component_type);
    const std::uint64_t begin = UnsignedOr(view, "byteOffset", 0) + layout.offset;
    if (layout.offset % alignment != 0 || begin % alignment != 0 || layout.stride % alignment != 0) {
      Refuse(file_, place, "is not aligned to its component's " + std::to_string(alignment) + " bytes.");
    }
  }

  std::string_view file_;
  const Json& views_;
  std::uint64_t file_bytes_;
};

}  // namespace

void CheckVersion(std::string_view file, const Json& root, std::vector<std::string>* warnings) {
  const Json& asset = ObjectOf(root, "asset");
  const auto major = [&](const char* member) {
    const auto version = asset.find(member);
    return version == asset.end() || !version->is_string() ? -1 : MajorVersion(version->get<std::string>());
  };
  if (major("version") == 1 || IsGltf1(root))
    Refuse(file, "", "this is a glTF 1.0 file; convert it to glTF 2.0 first.");
  if (major("version") != 2) Refuse(file, "asset.version", "is not 2.0.");
  if (!asset.contains("minVersion")) return;
  if (major("minVersion") != 2) Refuse(file, "asset.minVersion", "asks for a newer reader than glTF 2.");
  if (asset["minVersion"] != "2.0") {
    // The parts of a later 2.x that glTF 2.0 does not have are ignored as other unknown members are.
    warnings->push_back("The file asks for a reader of glTF " + asset["minVersion"].get<std::string>() +
                        "; what glTF 2.0 does not have is left out.");
  }
}

std::uint64_t ComponentBytes(int component_type) {
  if (component_type == 5120 || component_type == 5121) return 1;
  return component_type == 5122 || component_type == 5123 ? 2 : 4;
}

int ComponentCount(std::string_view type) {
  if (type == "SCALAR") return 1;
  const int side = type.back() - '0';
  return type.starts_with("VEC") ? side : side * side;
}

std::uint64_t ElementBytes(std::string_view type, int component_type) {
  const std::uint64_t component = ComponentBytes(component_type);
  if (!type.starts_with("MAT")) return component * static_cast<std::uint64_t>(ComponentCount(type));
  const std::uint64_t side = static_cast<std::uint64_t>(type.back() - '0');
  return side * ((side * component + 3) / 4 * 4);
}

std::uint64_t UnpaddedBytes(std::string_view type, int component_type) {
  const std::uint64_t element = ElementBytes(type, component_type);
  if (!type.starts_with("MAT")) return element;
  const std::uint64_t side = static_cast<std::uint64_t>(type.back() - '0');
  return element - (element / side - side * ComponentBytes(component_type));
}

void ReplaceUnknownAccessors(Json* root, std::vector<std::string>* warnings) {
  const auto accessors = root->find("accessors");
  if (accessors == root->end() || !accessors->is_array()) return;
  for (std::size_t i = 0; i < accessors->size(); ++i) {
    Json& accessor = (*accessors)[i];
    const auto type = accessor.is_object() ? accessor.find("type") : accessor.end();
    if (type == accessor.end() || !type->is_string()) continue;
    if (std::find(std::begin(kAccessorTypes), std::end(kAccessorTypes), type->get<std::string>()) !=
        std::end(kAccessorTypes)) {
      continue;
    }
    Json replacement = {{"componentType", 5121}, {"count", 1}, {"type", "MAT2"}};
    if (accessor.contains("count")) replacement["count"] = accessor["count"];
    accessor = std::move(replacement);
    const std::string warning = "Accessors of types that glTF 2.0 does not have are left out.";
    if (std::find(warnings->begin(), warnings->end(), warning) == warnings->end())
      warnings->push_back(warning);
  }
}

void CheckBufferViews(std::string_view file, const Json& root, std::span<const std::uint64_t> buffer_bytes) {
  const Json& buffers = ArrayOf(root, "buffers");
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    const std::uint64_t claimed = buffers[i]["byteLength"].get<std::uint64_t>();
    const bool is_placeholder = buffer_bytes[i] == 0 && !buffers[i].contains("uri");
    if (claimed > buffer_bytes[i] && !is_placeholder) {
      Refuse(file, Place("buffers", i),
             "claims " + std::to_string(claimed) + " bytes and has " + std::to_string(buffer_bytes[i]) + ".");
    }
  }
  const Json& views = ArrayOf(root, "bufferViews");
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::size_t buffer = views[i]["buffer"].get<std::size_t>();
    if (buffer_bytes[buffer] == 0) Refuse(file, Place("buffers", buffer), "is used but has no data.");
    const std::uint64_t whole = buffers[buffer]["byteLength"].get<std::uint64_t>();
    const std::uint64_t offset = UnsignedOr(views[i], "byteOffset", 0);
    const std::uint64_t length = views[i]["byteLength"].get<std::uint64_t>();
    const std::string place = Place("bufferViews", i);
    if (offset > whole || length > whole - offset)
      Refuse(file, place, "reaches beyond the end of its buffer.");
    const std::uint64_t stride = UnsignedOr(views[i], "byteStride", 4);
    if (stride % 4 != 0) Refuse(file, place + ".byteStride", "is not a multiple of 4.");
    if (views[i].contains("byteStride") && stride > length) {
      Refuse(file, place + ".byteStride", "is larger than the view.");
    }
  }
}

void CheckAccessors(std::string_view file, const Json& root, std::uint64_t file_bytes,
                    const LoadLimits& limits) {
  const Json& accessors = ArrayOf(root, "accessors");
  const AccessorChecker checker(file, root, file_bytes);
  std::uint64_t unpacked_bytes = 0;
  for (std::size_t i = 0; i < accessors.size(); ++i) {
    const Json& accessor = accessors[i];
    checker.Check(accessor, Place("accessors", i));
    if (accessor.contains("bufferView") && !accessor.contains("sparse")) continue;
    // Such an accessor is unpacked into separate memory; its count was bounded above.
    const std::uint64_t element_bytes =
        ElementBytes(accessor["type"].get_ref<const std::string&>(), accessor["componentType"].get<int>());
    unpacked_bytes += accessor["count"].get<std::uint64_t>() * element_bytes;
    if (unpacked_bytes > limits.max_file_bytes) {
      Refuse(file, Place("accessors", i),
             "takes the unpacked sparse accessors over the limit of " +
                 std::to_string(limits.max_file_bytes) + " bytes.");
    }
  }
}

}  // namespace docent::content
