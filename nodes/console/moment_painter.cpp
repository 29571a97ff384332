#include "nodes/console/moment_painter.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

namespace afterglow::nodes {
namespace {

constexpr int kJpegQuality = 82;
/// Light falls on the room in no more pixels than these.
constexpr int kWidestLight = 800;

}  // namespace

calib::Lens lensOfWidth(const calib::Lens& lens, int width) {
  const double scale = static_cast<double>(width) / lens.width;
  Eigen::Matrix3d K = lens.K;
  K.topRows<2>() *= scale;
  // (0, 0) is the center of the first pixel.
  K(0, 2) = (lens.K(0, 2) + 0.5) * scale - 0.5;
  K(1, 2) = (lens.K(1, 2) + 0.5) * scale - 0.5;
  const int height = std::max(1, static_cast<int>(std::lround(lens.height * scale)));
  return calib::makeLens(width, height, K, calib::distortionCoefficients(lens), lens.model);
}

std::string jpegOf(const render::Image& image) {
  const cv::Mat rgb(image.height, image.width, CV_8UC3,
                    const_cast<std::uint8_t*>(image.rgb.data()));
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", bgr, bytes, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  return {bytes.begin(), bytes.end()};
}

MomentPainter::MomentPainter(render::GlContext& context, const replay::Store& store,
                             const replay::Behavior& behavior, const PictureSettings& settings,
                             PictureView view, int width)
    : store_(store),
      behavior_(behavior),
      settings_(settings),
      width_(width),
      lens_(lensOfWidth(settings.lens,
                        view == PictureView::Projector
                            ? width
                            : std::min(settings.lens.width, kWidestLight))),
      end_(endOf(store, behavior)),
      light_(settings_.config.projectors.at(0).light),
      renderer_(context, lens_, render::Drawing::Cpu),
      census_(settings.lens) {
  if (view == PictureView::Bystander) {
    observed_.emplace(context, store_, behavior_, settings_.config, lens_, settings_.observer);
  }
  restart();
}

void MomentPainter::restart() {
  scene_.emplace(store_, behavior_, settings_.config);
  last_ = behavior_.begin;
}

MomentPicture MomentPainter::at(double t) {
  const std::int64_t last_ns = std::max(behavior_.begin.ns, end_.ns - 1);
  const double longest = static_cast<double>(last_ns - behavior_.begin.ns) * 1e-9;
  const double within = std::clamp(t, 0.0, longest);
  const std::int64_t since_ns = std::llround(within * 1e9);
  const replay::Stamp moment{std::min(last_ns, behavior_.begin.ns + since_ns)};
  if (moment < last_) {
    restart();
    if (observed_) observed_->restart();
  }
  last_ = moment;
  const SceneSnapshot snapshot = scene_->at(moment);
  render::Image image = snapshot.T_projector_world
                            ? renderer_.render(snapshot.scene, *snapshot.T_projector_world)
                            : renderer_.render({}, {});
  MomentPicture picture;
  picture.dark = scene_->whyDark(snapshot, census_, isLit(image));
  if (observed_) {
    picture.image = observed_->seeAt(width_, moment, snapshot, std::move(image));
  } else {
    light_.apply(image);
    picture.image = std::move(image);
  }
  return picture;
}

}  // namespace afterglow::nodes
