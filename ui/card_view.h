// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "ui/canvas.h"
#include "ui/content_layer.h"
#include "ui/visitor_layout.h"

namespace docent::ui {

// Draws the model or image of a card alone, into a texture. Single thread, single context.
class CardModel {
 public:
  // As of ContentLayer.
  CardModel(int samples, int max_texture_px) : samples_(samples), max_texture_px_(max_texture_px) {}

  // Returns the texture (premultiplied, row 0 at the top) with the card's model or image on the card's
  // colour; 0 for a card without one. It is valid until the next call. Another framebuffer is bound after it.
  GLuint Draw(const Card& card, int width_px, int height_px);

 private:
  const int samples_, max_texture_px_;
  // Made for the first card: few visits need them at once.
  std::unique_ptr<ContentLayer> content_;
  std::unique_ptr<RenderTarget> target_;
};

// Draws a card with this texture of its model (0 for none).
void DrawCard(const Overlay& overlay, const HeadsUpStyle& style, GLuint texture, Canvas* canvas);

// The pose in which a card shows a model, in the axes of the camera that sees it: its bounds fill the view of
// this angle, whatever its size.
engine::Sim3 CardPose(const Card& card, double field_of_view_rad);

}  // namespace docent::ui
