// SPDX-License-Identifier: Apache-2.0
#include "app/demo/exhibit_model.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>

namespace docent::app {

namespace {

static_assert(std::endian::native == std::endian::little, "glTF is little-endian");

struct Mesh {
  std::vector<Eigen::Vector3f> positions, normals;
  std::vector<Eigen::Vector2f> texture;
  std::vector<std::uint16_t> indices;

  // Adds a quad with corners counter-clockwise seen from outside, and with the texture rows from top to
  // bottom.
  void AddQuad(const std::array<Eigen::Vector3f, 4>& corners, float top, float bottom) {
    const Eigen::Vector3f normal = (corners[2] - corners[0]).cross(corners[3] - corners[1]).normalized();
    const auto first = static_cast<std::uint16_t>(positions.size());
    const std::array<Eigen::Vector2f, 4> coordinates = {Eigen::Vector2f(0, bottom),
                                                        Eigen::Vector2f(1, bottom), Eigen::Vector2f(1, top),
                                                        Eigen::Vector2f(0, top)};
    for (std::size_t i = 0; i < 4; ++i) {
      positions.push_back(corners[i]);
      normals.push_back(normal);
      texture.push_back(coordinates[i]);
    }
    for (const int corner : {0, 1, 2, 0, 2, 3}) {
      indices.push_back(static_cast<std::uint16_t>(first + corner));
    }
  }

  // Adds a square frustum between two heights, with its top face.
  void AddFrustum(float low, float low_half, float high, float high_half, float top, float bottom) {
    const auto corner = [](float height, float half, int i) {
      constexpr std::array<std::array<float, 2>, 4> kSigns = {{{-1, 1}, {1, 1}, {1, -1}, {-1, -1}}};
      const auto& sign = kSigns[static_cast<std::size_t>(i % 4)];
      return Eigen::Vector3f(sign[0] * half, height, sign[1] * half);
    };
    for (int i = 0; i < 4; ++i) {
      AddQuad({corner(low, low_half, i), corner(low, low_half, i + 1), corner(high, high_half, i + 1),
               corner(high, high_half, i)},
              top, bottom);
    }
    if (high_half < 0.002f) return;  // A tip needs no top face.
    AddQuad({corner(high, high_half, 0), corner(high, high_half, 1), corner(high, high_half, 2),
             corner(high, high_half, 3)},
            top, top + 0.1f);
  }
};

Mesh MakeObelisk() {
  Mesh mesh;
  mesh.AddFrustum(0.00f, 0.20f, 0.06f, 0.20f, 0.80f, 1.00f);
  mesh.AddFrustum(0.06f, 0.16f, 0.14f, 0.16f, 0.80f, 1.00f);
  mesh.AddFrustum(0.14f, 0.11f, 0.86f, 0.06f, 0.20f, 0.80f);
  mesh.AddFrustum(0.86f, 0.06f, 1.00f, 0.001f, 0.00f, 0.18f);
  return mesh;
}

// From top to bottom: a gold tip, red and white bands, a dark pedestal.
std::vector<std::uint8_t> PaintTexture() {
  cv::Mat image(256, 64, CV_8UC3);
  for (int y = 0; y < image.rows; ++y) {
    cv::Scalar color(60, 190, 235);
    if (y >= 205) {
      color = cv::Scalar(95, 85, 80);
    } else if (y >= 48) {
      color = (y - 48) / 20 % 2 == 0 ? cv::Scalar(55, 60, 200) : cv::Scalar(235, 240, 240);
    }
    image.row(y).setTo(color);
  }
  for (int y = 16; y < 256; y += 32) {
    cv::line(image, {0, y}, {63, y}, cv::Scalar(70, 70, 70), 1);
  }
  std::vector<std::uint8_t> png;
  cv::imencode(".png", image, png);
  return png;
}

class GlbBuilder {
 public:
  template <typename Item>
  int AddView(const std::vector<Item>& items, int target) {
    while (binary_.size() % 4 != 0) binary_.push_back(0);
    nlohmann::json view = {
        {"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", items.size() * sizeof(Item)}};
    if (target != 0) view["target"] = target;
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(items.data());
    binary_.insert(binary_.end(), bytes, bytes + items.size() * sizeof(Item));
    views_.push_back(std::move(view));
    return static_cast<int>(views_.size()) - 1;
  }

  std::vector<std::uint8_t> Finish(nlohmann::json json) {
    while (binary_.size() % 4 != 0) binary_.push_back(0);
    json["bufferViews"] = views_;
    json["buffers"] = {{{"byteLength", binary_.size()}}};
    std::string text = json.dump();
    while (text.size() % 4 != 0) text += ' ';
    std::vector<std::uint8_t> glb;
    const auto put = [&glb](std::uint32_t value) {
      for (int shift = 0; shift < 32; shift += 8) glb.push_back(static_cast<std::uint8_t>(value >> shift));
    };
    put(0x46546C67);  // "glTF"
    put(2);
    put(static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + binary_.size()));
    put(static_cast<std::uint32_t>(text.size()));
    put(0x4E4F534A);  // "JSON"
    glb.insert(glb.end(), text.begin(), text.end());
    put(static_cast<std::uint32_t>(binary_.size()));
    put(0x004E4942);  // "BIN"
    glb.insert(glb.end(), binary_.begin(), binary_.end());
    return glb;
  }

 private:
  std::vector<std::uint8_t> binary_;
  nlohmann::json views_ = nlohmann::json::array();
};

}  // namespace

std::vector<std::uint8_t> MakeExhibitGlb() {
  constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963, kFloat = 5126, kUnsignedShort = 5123;
  const Mesh mesh = MakeObelisk();
  GlbBuilder builder;
  Eigen::Vector3f low = mesh.positions.front(), high = low;
  for (const Eigen::Vector3f& position : mesh.positions) {
    low = low.cwiseMin(position);
    high = high.cwiseMax(position);
  }
  const int positions = builder.AddView(mesh.positions, kArrayBuffer);
  const int normals = builder.AddView(mesh.normals, kArrayBuffer);
  const int texture = builder.AddView(mesh.texture, kArrayBuffer);
  const int indices = builder.AddView(mesh.indices, kElementArrayBuffer);
  const int image = builder.AddView(PaintTexture(), 0);
  const std::size_t count = mesh.positions.size();
  nlohmann::json json;
  json["asset"] = {{"version", "2.0"}, {"generator", "Docent"}};
  json["scene"] = 0;
  json["scenes"] = {{{"nodes", {0}}}};
  json["nodes"] = {{{"mesh", 0}, {"name", "obelisk"}}};
  json["meshes"] = {{{"primitives",
                      {{{"attributes", {{"POSITION", 0}, {"NORMAL", 1}, {"TEXCOORD_0", 2}}},
                        {"indices", 3},
                        {"material", 0}}}}}};
  json["materials"] = {
      {{"pbrMetallicRoughness",
        {{"baseColorTexture", {{"index", 0}}}, {"metallicFactor", 0.0}, {"roughnessFactor", 0.7}}}}};
  json["textures"] = {{{"source", 0}}};
  json["images"] = {{{"bufferView", image}, {"mimeType", "image/png"}}};
  json["accessors"] = nlohmann::json::array();
  json["accessors"].push_back({{"bufferView", positions},
                               {"componentType", kFloat},
                               {"count", count},
                               {"type", "VEC3"},
                               {"min", {low.x(), low.y(), low.z()}},
                               {"max", {high.x(), high.y(), high.z()}}});
  json["accessors"].push_back(
      {{"bufferView", normals}, {"componentType", kFloat}, {"count", count}, {"type", "VEC3"}});
  json["accessors"].push_back(
      {{"bufferView", texture}, {"componentType", kFloat}, {"count", count}, {"type", "VEC2"}});
  json["accessors"].push_back({{"bufferView", indices},
                               {"componentType", kUnsignedShort},
                               {"count", mesh.indices.size()},
                               {"type", "SCALAR"}});
  return builder.Finish(std::move(json));
}

}  // namespace docent::app
