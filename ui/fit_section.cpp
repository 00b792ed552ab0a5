// SPDX-License-Identifier: Apache-2.0
#include "ui/fit_section.h"

#include <imgui.h>

#include "content/alignment.h"
#include "content/warp.h"
#include "ui/strings.h"

namespace docent::ui {
namespace {

void FitRemark(const char* text) {
  ImGui::PushTextWrapPos(0.0f);
  ImGui::TextDisabled("%s", text);
  ImGui::PopTextWrapPos();
}

}  // namespace

void FitSection::Draw(const AuthoringFacts& facts) {
  if (!facts.fit) return DrawBegin(facts);
  const FitFacts& fit = *facts.fit;
  ImGui::PushTextWrapPos(0.0f);
  ImGui::Text(strings::kFitting, fit.name.c_str());
  ImGui::TextUnformatted(fit.waits_for_place ? strings::kFitClickPlace : strings::kFitClickObject);
  ImGui::PopTextWrapPos();
  DrawPairs(fit);
  DrawButtons(fit);
}

void FitSection::DrawBegin(const AuthoringFacts& facts) {
  if (facts.scene == nullptr || facts.selection->names().size() != 1) return;
  const content::Entity* const entity = facts.scene->Find(facts.selection->names().front());
  if (entity == nullptr || entity->kind != content::Entity::Kind::kModel) return;
  ImGui::BeginDisabled(entity->locked);
  if (ImGui::Button(strings::kFit)) actions_->Fit(FitStep::kBegin);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", strings::kFitHelp);
  if (entity->model.warp) {
    ImGui::SameLine();
    if (ImGui::Button(strings::kUnbend)) actions_->Unbend(entity->name);
  }
  ImGui::EndDisabled();
}

void FitSection::DrawPairs(const FitFacts& fit) {
  if (fit.pairs < content::kMinAlignmentPoints) {
    ImGui::TextDisabled(strings::kFitPairs, static_cast<int>(fit.pairs));
    return FitRemark(strings::kFitNeeds);
  }
  if (!fit.problem.empty()) return FitRemark(fit.problem.c_str());
  for (std::size_t i = 0; i < fit.residuals.size(); ++i)
    ImGui::TextDisabled(fit.used[i] ? strings::kFitPair : strings::kFitPairUnused, static_cast<int>(i + 1),
                        fit.residuals[i]);
}

void FitSection::DrawButtons(const FitFacts& fit) {
  ImGui::BeginDisabled(fit.residuals.empty());
  if (ImGui::Button(strings::kFitAlign)) actions_->Fit(FitStep::kAlign);
  ImGui::EndDisabled();
  ImGui::SameLine();
  ImGui::BeginDisabled(fit.pairs < content::kMinWarpPoints);
  if (ImGui::Button(strings::kFitBend)) actions_->Fit(FitStep::kBend);
  if (ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled))
    ImGui::SetTooltip("%s", strings::kFitBendHelp);
  ImGui::EndDisabled();
  ImGui::BeginDisabled(fit.pairs == 0 && !fit.waits_for_place);
  if (ImGui::Button(strings::kFitRemoveLast)) actions_->Fit(FitStep::kRemoveLast);
  ImGui::EndDisabled();
  ImGui::SameLine();
  if (ImGui::Button(strings::kFitEnd)) actions_->Fit(FitStep::kEnd);
}

}  // namespace docent::ui
