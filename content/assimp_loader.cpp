// SPDX-License-Identifier: Apache-2.0
#include "content/assimp_loader.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/DefaultIOSystem.h>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <span>

#include "content/assimp_material.h"
#include "content/gltf/container.h"
#include "content/gltf/json.h"
#include "content/gltf/resources.h"

namespace docent::content {
namespace {

constexpr const char* kFormats[] = {".obj", ".ply", ".stl", ".fbx", ".dae", ".3ds", ".off"};

// Formats whose vertex colours are those of a screen (sRGB), as scanners write them; glTF's are linear.
constexpr const char* kFormatsWithSrgbColors[] = {".obj", ".ply", ".stl", ".off"};

// The ending of the file's name in lower case, such as ".obj".
std::string EndingOf(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return ending;
}

bool Contains(std::span<const char* const> endings, const std::string& ending) {
  return std::find(endings.begin(), endings.end(), ending) != endings.end();
}

// IEC 61966-2-1.
float LinearFromSrgb(float value) {
  return value <= 0.04045f ? value / 12.92f : std::pow((value + 0.055f) / 1.055f, 2.4f);
}

// Restricts assimp to regular files of limited size inside one folder; symbolic links are resolved.
class FolderOnly : public Assimp::DefaultIOSystem {
 public:
  FolderOnly(const std::filesystem::path& folder, std::uint64_t max_bytes)
      : folder_(std::filesystem::weakly_canonical(folder.empty() ? "." : folder)), max_bytes_(max_bytes) {}

  bool Exists(const char* file) const override { return IsAllowed(file) && DefaultIOSystem::Exists(file); }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    const bool reads =
        mode != nullptr && mode[0] == 'r' && std::string_view(mode).find('+') == std::string_view::npos;
    return reads && IsAllowed(file) ? DefaultIOSystem::Open(file, mode) : nullptr;
  }

 private:
  bool IsAllowed(const char* file) const {
    std::error_code code;
    const std::filesystem::path target = std::filesystem::canonical(file, code);
    if (code || !std::filesystem::is_regular_file(target, code)) return false;
    if (std::filesystem::file_size(target, code) > max_bytes_ || code) return false;
    return std::mismatch(folder_.begin(), folder_.end(), target.begin(), target.end()).first == folder_.end();
  }

  std::filesystem::path folder_;
  std::uint64_t max_bytes_;
};

// Builds the JSON and the binary chunk of a glTF from an assimp scene.
class Writer {
 public:
  Writer(const std::string& file, const std::filesystem::path& folder, const aiScene& scene,
         const LoadLimits& limits)
      : file_(file),
        has_srgb_colors_(Contains(kFormatsWithSrgbColors, EndingOf(file))),
        scene_(scene),
        limits_(limits),
        materials_(folder, scene, limits, &buffer_, &warnings_) {}

  ConvertedGltf Write() {
    buffer_.json = {{"asset", {{"version", "2.0"}, {"generator", "docent"}}}};
    if (scene_.mNumAnimations > 0) warnings_.push_back("Animations of this format are left out.");
    CountMeshes();
    for (unsigned int i = 0; i < scene_.mNumMaterials; ++i) materials_.Write(*scene_.mMaterials[i]);
    for (unsigned int i = 0; i < scene_.mNumMeshes; ++i)
      primitives_.push_back(WritePrimitive(*scene_.mMeshes[i]));
    WriteNodes();
    if (!buffer_.bin.empty()) buffer_.json["buffers"] = Json::array({{{"byteLength", buffer_.bin.size()}}});
    return {MakeGlb(buffer_.json.dump(-1, ' ', false, Json::error_handler_t::replace), buffer_.bin),
            std::move(warnings_)};
  }

 private:
  void CountMeshes() const {
    std::uint64_t vertices = 0, indices = 0;
    for (unsigned int i = 0; i < scene_.mNumMeshes; ++i) {
      vertices += scene_.mMeshes[i]->mNumVertices;
      indices += std::uint64_t{scene_.mMeshes[i]->mNumFaces} * 3;
    }
    if (vertices > limits_.max_vertices || indices > limits_.max_indices) {
      Refuse(file_, "", "the model has more than " + std::to_string(limits_.max_vertices) + " vertices.");
    }
  }

  template <typename T>
  int WriteAccessor(const std::vector<T>& values, int component_type, const char* type, std::size_t count) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(values.data());
    const int view = buffer_.AppendView({bytes, values.size() * sizeof(T)});
    return buffer_.Add(
        "accessors",
        {{"bufferView", view}, {"componentType", component_type}, {"count", count}, {"type", type}});
  }

  int WriteVectors(const aiVector3D* from, unsigned int count, int size) {
    std::vector<float> values;
    for (unsigned int i = 0; i < count; ++i) {
      for (unsigned int k = 0; k < static_cast<unsigned int>(size); ++k) values.push_back(from[i][k]);
    }
    return WriteAccessor(values, 5126, size == 2 ? "VEC2" : "VEC3", count);
  }

  Json WritePrimitive(const aiMesh& mesh) {
    if (mesh.HasBones()) Warn("Skins of this format are left out.");
    std::vector<std::uint32_t> indices;
    for (unsigned int i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices == 3) indices.insert(indices.end(), face.mIndices, face.mIndices + 3);
    }
    if (indices.empty() || mesh.mNumVertices == 0 || mesh.mVertices == nullptr) {
      Warn("Points and lines are left out.");
      return nullptr;
    }
    Json attributes{{"POSITION", WriteVectors(mesh.mVertices, mesh.mNumVertices, 3)}};
    if (mesh.HasNormals()) attributes["NORMAL"] = WriteVectors(mesh.mNormals, mesh.mNumVertices, 3);
    for (unsigned int set = 0; set < 2 && mesh.HasTextureCoords(set); ++set) {
      attributes["TEXCOORD_" + std::to_string(set)] =
          WriteVectors(mesh.mTextureCoords[set], mesh.mNumVertices, 2);
    }
    if (mesh.HasVertexColors(0)) {
      std::vector<float> colors;
      for (unsigned int i = 0; i < mesh.mNumVertices; ++i) {
        const aiColor4D& color = mesh.mColors[0][i];
        for (const float value : {color.r, color.g, color.b})
          colors.push_back(has_srgb_colors_ ? LinearFromSrgb(value) : value);
        colors.push_back(color.a);
      }
      attributes["COLOR_0"] = WriteAccessor(colors, 5126, "VEC4", mesh.mNumVertices);
    }
    Json primitive{{"attributes", attributes},
                   {"indices", WriteAccessor(indices, 5125, "SCALAR", indices.size())}};
    if (mesh.mMaterialIndex < scene_.mNumMaterials) primitive["material"] = mesh.mMaterialIndex;
    return primitive;
  }

  void WriteNodes() {
    struct Open {
      const aiNode* node;
      int parent;
    };
    std::vector<Open> open = {{scene_.mRootNode, -1}};
    while (!open.empty()) {
      const Open next = open.back();
      open.pop_back();
      const int index = buffer_.Add("nodes", WriteNode(*next.node));
      if (index > static_cast<int>(limits_.max_nodes)) Refuse(file_, "", "the model has too many nodes.");
      if (next.parent >= 0)
        buffer_.json["nodes"][static_cast<std::size_t>(next.parent)]["children"].push_back(index);
      for (unsigned int i = 0; i < next.node->mNumChildren; ++i)
        open.push_back({next.node->mChildren[i], index});
    }
    buffer_.json["scenes"] = Json::array({{{"nodes", {0}}}});
  }

  Json WriteNode(const aiNode& node) {
    Json json{{"name", node.mName.C_Str()}};
    if (!node.mTransformation.IsIdentity()) {
      // glTF is column-major, assimp row-major.
      Json matrix = Json::array();
      for (unsigned int column = 0; column < 4; ++column) {
        for (unsigned int row = 0; row < 4; ++row) matrix.push_back(node.mTransformation[row][column]);
      }
      json["matrix"] = matrix;
    }
    Json primitives = Json::array();
    for (unsigned int i = 0; i < node.mNumMeshes; ++i) {
      if (node.mMeshes[i] < primitives_.size() && !primitives_[node.mMeshes[i]].is_null()) {
        primitives.push_back(primitives_[node.mMeshes[i]]);
      }
    }
    if (!primitives.empty()) json["mesh"] = buffer_.Add("meshes", {{"primitives", primitives}});
    return json;
  }

  void Warn(const std::string& sentence) {
    if (std::find(warnings_.begin(), warnings_.end(), sentence) == warnings_.end())
      warnings_.push_back(sentence);
  }

  const std::string& file_;
  const bool has_srgb_colors_;
  const aiScene& scene_;
  const LoadLimits& limits_;
  GltfBuilder buffer_;
  std::vector<std::string> warnings_;
  AssimpMaterialWriter materials_;
  std::vector<Json> primitives_;  // One for each assimp mesh; null for a mesh without triangles.
};

}  // namespace

bool IsAssimpFormat(const std::filesystem::path& path) {
  return Contains(kFormats, EndingOf(path));
}

ConvertedGltf GltfFromAssimp(const std::filesystem::path& path, const LoadLimits& limits) {
  const std::string file = path.filename().string();
  ReadFileBytes(path, limits.max_file_bytes);  // Throws Error when the file is missing or too large.
  Assimp::Importer importer;
  // The importer owns the handler.
  importer.SetIOHandler(new FolderOnly(path.parent_path(), limits.max_file_bytes));
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  // aiProcess_GlobalScale converts an FBX from its unit, usually centimetres, to metres. It changes no other
  // format: the importer of Collada applies the unit of the file itself, and the others have none.
  const aiScene* scene = importer.ReadFile(
      path.string(), aiProcess_Triangulate | aiProcess_JoinIdenticalVertices | aiProcess_SortByPType |
                         aiProcess_FlipUVs | aiProcess_ValidateDataStructure | aiProcess_GlobalScale);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    std::string words = importer.GetErrorString();
    std::replace(words.begin(), words.end(), '\n', ' ');
    Refuse(file, "", "the model cannot be read (" + words.substr(0, 160) + ").");
  }
  return Writer(file, path.parent_path(), *scene, limits).Write();
}

}  // namespace docent::content
