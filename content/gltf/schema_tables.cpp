// SPDX-License-Identifier: Apache-2.0
#include "content/gltf/schema_tables.h"

namespace docent::content {
namespace {

constexpr double kMost = std::numeric_limits<double>::infinity();

Field Boolean(const char* name) {
  Field field;
  field.name = name;
  field.kind = Field::Kind::kBoolean;
  return field;
}

Field Text(const char* name, std::vector<std::string_view> words = {}) {
  Field field;
  field.name = name;
  field.kind = Field::Kind::kString;
  field.words = std::move(words);
  return field;
}

Field Integer(const char* name, double min, double max = kMost) {
  Field field;
  field.name = name;
  field.kind = Field::Kind::kInteger;
  field.min = min;
  field.max = max;
  return field;
}

Field Code(const char* name, std::vector<int> codes) {
  Field field = Integer(name, 0);
  field.codes = std::move(codes);
  return field;
}

Field Number(const char* name, double min = -kMost, double max = kMost) {
  Field field;
  field.name = name;
  field.kind = Field::Kind::kNumber;
  field.min = min;
  field.max = max;
  return field;
}

Field Index(const char* name, const char* target) {
  Field field;
  field.name = name;
  field.kind = Field::Kind::kIndex;
  field.target = target;
  return field;
}

Field IndexMap(const char* name, const char* target) {
  Field field = Index(name, target);
  field.kind = Field::Kind::kIndexMap;
  field.min_count = 1;
  return field;
}

Field Object(const char* name, const Schema& schema) {
  Field field;
  field.name = name;
  field.schema = &schema;
  return field;
}

const Schema kAnything{};
const Field kExtensions = Object("extensions", kAnything);

const Schema kAsset{{Text("version").Required(), Text("minVersion")}};

// §5.1 accessors, §5.10 buffers and their views
const std::vector<int> kComponentTypes = {5120, 5121, 5122, 5123, 5125, 5126};
const Schema kSparseIndices{{Index("bufferView", "bufferViews").Required(), Integer("byteOffset", 0),
                             Code("componentType", {5121, 5123, 5125}).Required(), kExtensions}};
const Schema kSparseValues{
    {Index("bufferView", "bufferViews").Required(), Integer("byteOffset", 0), kExtensions}};
const Schema kSparse{{Integer("count", 1).Required(), Object("indices", kSparseIndices).Required(),
                      Object("values", kSparseValues).Required(), kExtensions}};
const Schema kAccessor{{Index("bufferView", "bufferViews"), Integer("byteOffset", 0),
                        Code("componentType", kComponentTypes).Required(), Boolean("normalized"),
                        Integer("count", 1).Required(),
                        Text("type", {"SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"}).Required(),
                        Number("max").List(1, 16), Number("min").List(1, 16), Object("sparse", kSparse),
                        Text("name"), kExtensions}};
const Schema kBuffer{{Text("uri"), Integer("byteLength", 1).Required(), Text("name"), kExtensions}};
const Schema kBufferView{{Index("buffer", "buffers").Required(), Integer("byteOffset", 0),
                          Integer("byteLength", 1).Required(), Integer("byteStride", 4, 252),
                          Code("target", {34962, 34963}), Text("name"), kExtensions}};

// §5.24 meshes
const Schema kPrimitive{{IndexMap("attributes", "accessors").Required(), Index("indices", "accessors"),
                         Index("material", "materials"), Integer("mode", 0, 6),
                         IndexMap("targets", "accessors").List(1), kExtensions}};
const Schema kMesh{{Object("primitives", kPrimitive).List(1).Required(), Number("weights").List(1),
                    Text("name"), kExtensions}};

// §5.29 textures, §5.18 images, §5.27 samplers
const Schema kTextureTransform{{Number("offset").List(2, 2), Number("rotation"), Number("scale").List(2, 2),
                                Integer("texCoord", 0, 1000)}};
const Schema kTextureInfoExtensions{{Object("KHR_texture_transform", kTextureTransform)}};
const Field kTextureIndex = Index("index", "textures").Required();
const Field kTextureCoordinates = Integer("texCoord", 0, 1000);
const Field kTextureExtensions = Object("extensions", kTextureInfoExtensions);
const Schema kTextureInfo{{kTextureIndex, kTextureCoordinates, kTextureExtensions}};
const Schema kNormalTexture{{kTextureIndex, kTextureCoordinates, Number("scale"), kTextureExtensions}};
const Schema kOcclusionTexture{
    {kTextureIndex, kTextureCoordinates, Number("strength", 0, 1), kTextureExtensions}};
const Schema kWebpTexture{{Index("source", "images")}};
const Schema kTextureExtension{
    {Object("EXT_texture_webp", kWebpTexture), Object("KHR_texture_basisu", kWebpTexture)}};
const Schema kTexture{{Index("sampler", "samplers"), Index("source", "images"), Text("name"),
                       Object("extensions", kTextureExtension)}};
const Schema kImage{
    {Text("uri"), Text("mimeType"), Index("bufferView", "bufferViews"), Text("name"), kExtensions}};
const Schema kSampler{
    {Code("magFilter", {9728, 9729}), Code("minFilter", {9728, 9729, 9984, 9985, 9986, 9987}),
     Code("wrapS", {33071, 33648, 10497}), Code("wrapT", {33071, 33648, 10497}), Text("name"), kExtensions}};

// §5.19 materials and the extensions that are read
const Schema kMetallicRoughness{{Number("baseColorFactor", 0, 1).List(4, 4),
                                 Object("baseColorTexture", kTextureInfo), Number("metallicFactor", 0, 1),
                                 Number("roughnessFactor", 0, 1),
                                 Object("metallicRoughnessTexture", kTextureInfo), kExtensions}};
const Schema kSpecularGlossiness{{Number("diffuseFactor", 0, 1).List(4, 4),
                                  Object("diffuseTexture", kTextureInfo),
                                  Number("specularFactor", 0, 1).List(3, 3), Number("glossinessFactor", 0, 1),
                                  Object("specularGlossinessTexture", kTextureInfo)}};
const Schema kEmissiveStrength{{Number("emissiveStrength", 0)}};
const Schema kAnisotropy{{Object("anisotropyTexture", kTextureInfo)}};
const Schema kClearcoat{{Object("clearcoatTexture", kTextureInfo),
                         Object("clearcoatRoughnessTexture", kTextureInfo),
                         Object("clearcoatNormalTexture", kNormalTexture)}};
const Schema kIridescence{
    {Object("iridescenceTexture", kTextureInfo), Object("iridescenceThicknessTexture", kTextureInfo)}};
const Schema kSheen{
    {Object("sheenColorTexture", kTextureInfo), Object("sheenRoughnessTexture", kTextureInfo)}};
const Schema kSpecular{
    {Object("specularTexture", kTextureInfo), Object("specularColorTexture", kTextureInfo)}};
const Schema kTransmission{{Number("transmissionFactor", 0, 1), Object("transmissionTexture", kTextureInfo)}};
const Schema kVolume{{Object("thicknessTexture", kTextureInfo)}};
const Schema kMaterialExtensions{
    {Object("KHR_materials_pbrSpecularGlossiness", kSpecularGlossiness),
     Object("KHR_materials_unlit", kAnything), Object("KHR_materials_emissive_strength", kEmissiveStrength),
     Object("KHR_materials_anisotropy", kAnisotropy), Object("KHR_materials_clearcoat", kClearcoat),
     Object("KHR_materials_iridescence", kIridescence), Object("KHR_materials_sheen", kSheen),
     Object("KHR_materials_specular", kSpecular), Object("KHR_materials_transmission", kTransmission),
     Object("KHR_materials_volume", kVolume)}};
const Schema kMaterial{{Object("pbrMetallicRoughness", kMetallicRoughness),
                        Object("normalTexture", kNormalTexture),
                        Object("occlusionTexture", kOcclusionTexture),
                        Object("emissiveTexture", kTextureInfo), Number("emissiveFactor", 0, 1).List(3, 3),
                        Text("alphaMode", {"OPAQUE", "MASK", "BLEND"}), Number("alphaCutoff", 0),
                        Boolean("doubleSided"), Text("name"), Object("extensions", kMaterialExtensions)}};

// §5.25 nodes, §5.26 scenes, §5.28 skins, §5.12 cameras (checked because nodes refer to them; not shown)
const Schema kNode{{Index("camera", "cameras"), Index("children", "nodes").List(1).Distinct(),
                    Index("skin", "skins"), Number("matrix").List(16, 16), Index("mesh", "meshes"),
                    Number("rotation", -1.0001, 1.0001).List(4, 4), Number("scale").List(3, 3),
                    Number("translation").List(3, 3), Number("weights").List(1), Text("name"), kExtensions}};
const Schema kScene{{Index("nodes", "nodes").List(0).Distinct(), Text("name"), kExtensions}};
const Schema kSkin{{Index("inverseBindMatrices", "accessors"), Index("skeleton", "nodes"),
                    Index("joints", "nodes").List(1).Distinct().Required(), Text("name"), kExtensions}};
const Schema kOrthographic{{Number("xmag").Required(), Number("ymag").Required(),
                            Number("zfar", 0).Required(), Number("znear", 0).Required()}};
const Schema kPerspective{{Number("aspectRatio", 0), Number("yfov", 0).Required(), Number("zfar", 0),
                           Number("znear", 0).Required()}};
const Schema kCamera{{Text("type", {"perspective", "orthographic"}).Required(),
                      Object("orthographic", kOrthographic), Object("perspective", kPerspective),
                      Text("name"), kExtensions}};

// §5.3 animations
const Schema kAnimationTarget{
    {Index("node", "nodes"),
     Text("path", {"translation", "rotation", "scale", "weights", "pointer"}).Required(), kExtensions}};
const Schema kAnimationChannel{
    {Integer("sampler", 0).Required(), Object("target", kAnimationTarget).Required(), kExtensions}};
const Schema kAnimationSampler{{Index("input", "accessors").Required(),
                                Index("output", "accessors").Required(),
                                Text("interpolation", {"LINEAR", "STEP", "CUBICSPLINE"}), kExtensions}};
const Schema kAnimation{{Object("channels", kAnimationChannel).List(1).Required(),
                         Object("samplers", kAnimationSampler).List(1).Required(), Text("name"),
                         kExtensions}};

const Schema kRoot{{Object("asset", kAsset).Required(), Text("extensionsUsed").List(0).Distinct(),
                    Text("extensionsRequired").List(0).Distinct(), Object("buffers", kBuffer).List(0),
                    Object("bufferViews", kBufferView).List(0), Object("accessors", kAccessor).List(0),
                    Object("images", kImage).List(0), Object("samplers", kSampler).List(0),
                    Object("textures", kTexture).List(0), Object("materials", kMaterial).List(0),
                    Object("meshes", kMesh).List(0), Object("cameras", kCamera).List(0),
                    Object("nodes", kNode).List(0), Object("skins", kSkin).List(0),
                    Object("animations", kAnimation).List(0), Object("scenes", kScene).List(0),
                    Index("scene", "scenes"), kExtensions}};

}  // namespace

const Schema& RootSchema() {
  return kRoot;
}

}  // namespace docent::content
