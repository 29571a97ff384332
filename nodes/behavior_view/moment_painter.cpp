#include "nodes/behavior_view/moment_painter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <utility>

#include "nodes/projector/output_config.hpp"

namespace afterglow::nodes {
namespace {

constexpr int kJpegQuality = 82;
constexpr int kLightLooks = 50;
constexpr std::chrono::seconds kLightPatience{2};
/// Light falls on a room of a given width in no more pixels than these.
constexpr int kWidestLight = 800;

/// Returns the configuration with one projector alone: the one of that name, or the only one.
ProjectorConfig ofProjector(ProjectorConfig config, const std::string& name) {
  std::vector<std::string> names;
  for (const OutputConfig& projector : config.projectors) {
    if (projector.name == name || (name.empty() && config.projectors.size() == 1)) {
      config.projectors = {OutputConfig(projector)};
      return config;
    }
    if (!projector.name.empty()) names.push_back(projector.name);
  }
  const std::string known = fmt::format("{}", fmt::join(names, ", "));
  if (name.empty()) throw std::runtime_error("--projector is needed, one of: " + known);
  throw std::runtime_error("no projector '" + name + "' in the configuration" +
                           (known.empty() ? ", its only one has no name" : "; known: " + known));
}

calib::Lens drawnLens(const calib::Lens& lens, PictureView view, int width) {
  if (width == 0) return lens;
  const bool is_projector = view == PictureView::Projector;
  return lensOfWidth(lens, is_projector ? width : std::min(lens.width, kWidestLight));
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

}  // namespace

void addPictureOptions(CLI::App& verb, PictureOptions& options) {
  verb.add_option("--config", options.config,
                  "What is projected where (assets/projector.yaml), for pictures of moments");
  verb.add_option("--calibration", options.calibration,
                  "Folder of the lens's file; without it, the configuration's folder");
  verb.add_option("--projector", options.projector,
                  "Which of several projectors of the configuration");
  addObserverOptions(verb, options.observer);
}

PictureSettings readPictureSettings(const PictureOptions& options) {
  PictureSettings settings;
  settings.config =
      ofProjector(loadProjectorConfig(options.config, options.calibration), options.projector);
  const OutputConfig& projector = settings.config.projectors[0];
  calib::CameraInfoFile file = loadLens(projector);
  if (!file.warning.empty()) settings.remark = projector.camera_info + ": " + file.warning;
  settings.lens = std::move(file.lens);
  settings.observer = options.observer;
  return settings;
}

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

MomentPainter::MomentPainter(render::GlContext& context, const replay::Store& store,
                             const replay::Behavior& behavior, const PictureSettings& settings,
                             PictureView view, int width)
    : store_(store),
      behavior_(behavior),
      settings_(settings),
      width_(width),
      lens_(drawnLens(settings.lens, view, width)),
      last_{std::max(behavior.begin.ns, endOf(store, behavior).ns - 1)},
      light_(settings_.config.projectors.at(0).light),
      renderer_(context, lens_, settings_.config.projectors[0].drawing),
      census_(settings.lens),
      now_(behavior.begin) {
  scene_.emplace(store_, behavior_, settings_.config);
  if (view == PictureView::Bystander) {
    observed_.emplace(context, store_, behavior_, settings_.config, lens_, settings_.observer);
  }
}

void MomentPainter::restart() {
  scene_.emplace(store_, behavior_, settings_.config);
  if (observed_) observed_->restart();
}

int MomentPainter::width() const {
  return width_ > 0 ? width_ : observed_ ? observed_->width() : lens_.width;
}

int MomentPainter::height() const {
  return observed_ ? observed_->heightOf(width()) : lens_.height;
}

void MomentPainter::moveTo(replay::Stamp moment) {
  if (moment < now_) restart();
  now_ = moment;
  snapshot_ = scene_->at(moment);
  image_.reset();
}

void MomentPainter::moveTo(double t) {
  const double longest = static_cast<double>(last_.ns - behavior_.begin.ns) * 1e-9;
  const std::int64_t since_ns = std::llround(std::clamp(t, 0.0, longest) * 1e9);
  moveTo(replay::Stamp{std::min(last_.ns, behavior_.begin.ns + since_ns)});
}

std::optional<double> MomentPainter::moveToLight() {
  const auto end = std::chrono::steady_clock::now() + kLightPatience;
  const double length = static_cast<double>(last_.ns - behavior_.begin.ns) * 1e-9;
  for (int i = 0; i <= kLightLooks && std::chrono::steady_clock::now() < end; ++i) {
    const double t = length * i / kLightLooks;
    moveTo(t);
    if (hasContent() && isLit()) return t;
  }
  return std::nullopt;
}

bool MomentPainter::hasContent() const {
  const auto& layers = snapshot_.scene.layers;
  return snapshot_.T_projector_world &&
         std::any_of(layers.begin(), layers.end(),
                     [](const render::Layer& layer) { return !layer.drawables.empty(); });
}

const render::Image& MomentPainter::lensImage() {
  if (!image_) {
    // For an unknown projector the scene is empty: black.
    image_ = snapshot_.T_projector_world
                 ? renderer_.render(snapshot_.scene, *snapshot_.T_projector_world)
                 : renderer_.render({}, {});
  }
  return *image_;
}

std::vector<std::string> MomentPainter::whyDark(bool is_lit) {
  return scene_->whyDark(snapshot_, census_, is_lit);
}

render::Image MomentPainter::projected() {
  render::Image image = lensImage();
  light_.apply(image);
  return image;
}

render::Image MomentPainter::picture() { return observed_ ? room(width(), height()) : projected(); }

render::Image MomentPainter::room(int width, int height) {
  return observed_.value().seeAt(width, height, now_, snapshot_, lensImage());
}

MomentJpeg MomentPainter::jpeg() { return {jpegOf(picture()), whyDark(isLit())}; }

}  // namespace afterglow::nodes
