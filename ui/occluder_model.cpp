// SPDX-License-Identifier: Apache-2.0
#include "ui/occluder_model.h"

#include "content/occluder.h"

namespace docent::ui {

std::shared_ptr<const content::Model> MakeOccluderModel(const content::Occluder& occluder) {
  auto model = std::make_shared<content::Model>();
  model->name = "occluder";
  content::Material material;
  material.base_color = {0.10f, 0.55f, 0.75f, 0.35f};  // Linear RGB.
  material.alpha = content::Material::Alpha::kBlend;
  material.unlit = true;
  material.double_sided = true;
  model->materials.push_back(material);
  const content::OccluderMesh mesh = content::MeshOf(occluder);
  content::Primitive primitive;
  primitive.material = 0;
  for (const Eigen::Vector3d& position : mesh.vertices) {
    content::Vertex vertex;
    vertex.position = {position.x(), position.y(), position.z()};
    if (primitive.vertices.empty()) model->bounds_min = model->bounds_max = vertex.position;
    model->bounds_min = glm::min(model->bounds_min, vertex.position);
    model->bounds_max = glm::max(model->bounds_max, vertex.position);
    primitive.vertices.push_back(vertex);
  }
  for (const auto& triangle : mesh.triangles)
    primitive.indices.insert(primitive.indices.end(), triangle.begin(), triangle.end());
  model->meshes.push_back({"occluder", {std::move(primitive)}});
  content::Node node;
  node.mesh = 0;
  model->nodes.push_back(node);
  model->roots.push_back(0);
  return model;
}

}  // namespace docent::ui
