#include "nodes/console/moment_images.hpp"

#include <nlohmann/json.hpp>

namespace afterglow::nodes {
namespace {

/// What a picture does not show, and why, as its response tells it.
std::vector<std::string> darkIn(const HttpResponse& response) {
  for (const auto& [name, value] : response.headers) {
    if (name == kDarkHeader) return nlohmann::json::parse(value).get<std::vector<std::string>>();
  }
  return {};
}

}  // namespace

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
      HttpResponse drawn = pictures.drawNow(wish);
      if (drawn.status != 200) break;  // the others cannot be drawn, either
      // Of a moment's two pictures the first tells the reasons.
      const bool is_telling = view == PictureView::Projector;
      images.push_back({t, words, std::move(drawn.body),
                        is_telling ? darkIn(drawn) : std::vector<std::string>()});
    }
  }
  return images;
}

}  // namespace afterglow::nodes
