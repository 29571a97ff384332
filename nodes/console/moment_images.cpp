#include "nodes/console/moment_images.hpp"

namespace afterglow::nodes {

std::vector<MomentImage> keyImages(const BehaviorDetail& detail, PictureSource& pictures) {
  std::vector<MomentImage> images;
  constexpr std::pair<PictureView, const char*> kViews[] = {
      {PictureView::Projector, "the projector's picture"}, {PictureView::Bystander, "the room"}};
  for (const auto& [view, words] : kViews) {
    for (const double t : detail.story.key_moments) {
      PictureWish wish;
      wish.behavior = detail.behavior.id;
      wish.t = t;
      wish.view = view;
      wish.viewer = "page";
      const std::string jpeg = pictures.drawNow(wish);
      if (jpeg.empty()) break;  // the others cannot be drawn, either
      images.push_back({t, words, jpeg});
    }
  }
  return images;
}

}  // namespace afterglow::nodes
