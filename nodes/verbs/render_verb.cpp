#include "nodes/verbs/command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "calib/camera_info_file.hpp"
#include "nodes/projector/projector_config.hpp"
#include "nodes/projector/recorded_scene.hpp"
#include "nodes/tools/video_writer.hpp"
#include "nodes/verbs/behavior_source.hpp"
#include "nodes/verbs/observed_pictures.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "render/image_file.hpp"
#include "render/projector_renderer.hpp"

namespace afterglow::nodes {
namespace {

using replay::Stamp;

struct RenderOptions {
  std::string what;  // a behavior's id, or a bag
  std::string store;
  std::string config;
  std::string calibration;
  std::string projector;
  std::optional<double> at_s;
  std::string out;
  int fps = 30;
  bool is_observed = false;
  ObserverOptions observer;
};

/// How finely the last lit moment is looked for.
constexpr std::int64_t kSearchStepNs = 100'000'000;

bool isLit(const render::Image& image) {
  return std::any_of(image.rgb.begin(), image.rgb.end(),
                     [](std::uint8_t byte) { return byte != 0; });
}

/// Why the picture stays dark: the problems of the snapshot, and what the layers dropped.
std::string darkReason(const SceneSnapshot& snapshot, const std::vector<LayerStatus>& layers) {
  std::vector<std::string> reasons(snapshot.problems.begin(), snapshot.problems.end());
  bool has_received = false;
  for (const LayerStatus& layer : layers) {
    has_received = has_received || layer.received > 0;
    for (const auto& [reason, count] : layer.dropped) {
      reasons.push_back(fmt::format("{}: {} dropped ({})", layer.topic, count, reason));
    }
  }
  if (!has_received) reasons.push_back("no message on any configured topic");
  if (reasons.empty()) return "nothing within the projector's picture";
  return fmt::format("{}", fmt::join(reasons, "; "));
}

/// The configuration with one projector alone: the one of that name, or the only one.
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

/// Draws one behavior at its moments.
class BehaviorPictures {
 public:
  BehaviorPictures(BehaviorSource source, const RenderOptions& options)
      : source_(std::move(source)),
        config_(ofProjector(loadProjectorConfig(options.config, options.calibration),
                            options.projector)),
        light_(config_.projectors[0].light),
        lens_(loadLens(config_.projectors[0].camera_info)),
        begin_(source_.behavior.begin),
        end_(endOf(*source_.store, source_.behavior)),
        renderer_(context_, lens_, config_.projectors[0].drawing) {
    if (options.is_observed) {
      observed_.emplace(context_, *source_.store, source_.behavior, config_, options.observer);
    }
  }

  /// The picture `seconds` after the beginning.
  render::Image at(double seconds) {
    const double duration_s = static_cast<double>(end_.ns - begin_.ns) * 1e-9;
    if (!(seconds >= 0 && seconds <= duration_s)) {
      throw std::runtime_error(fmt::format("--at {:.3f} is not within the {:.3f} s of {}", seconds,
                                           duration_s, source_.name));
    }
    RecordedScene scene = start();
    const Stamp moment{begin_.ns + std::llround(seconds * 1e9)};
    const SceneSnapshot snapshot = scene.at(moment);
    render::Image image = draw(snapshot);
    if (!isLit(image)) {
      std::cerr << "afterglow render: the picture is dark: " << darkReason(snapshot, scene.status())
                << std::endl;
    }
    return shown(moment, snapshot, std::move(image));
  }

  /// The picture of the last moment at which anything was lit.
  render::Image lastLit() {
    if (const auto moment = lastMomentWithContent()) {
      RecordedScene scene = start();
      const SceneSnapshot snapshot = scene.at(*moment);
      render::Image image = draw(snapshot);
      if (isLit(image)) return shown(*moment, snapshot, std::move(image));
    }
    // Content outside the picture at the end: every moment has to be looked at.
    std::optional<Stamp> last;
    RecordedScene scene = start();
    SceneSnapshot snapshot;
    eachMoment(kSearchStepNs, [&](Stamp moment) {
      snapshot = scene.at(moment);
      if (hasContent(snapshot) && isLit(draw(snapshot))) last = moment;
    });
    if (last) {
      snapshot = start().at(*last);
      return shown(*last, snapshot, draw(snapshot));
    }
    throw std::runtime_error("nothing of " + source_.name +
                             " is lit: " + darkReason(snapshot, scene.status()));
  }

  /// What is odd about the lens's file, or empty.
  const std::string& remark() const { return remark_; }

  void writeVideo(const std::string& path, int fps) {
    VideoWriter video(path, observed_ ? observed_->width() : lens_.width,
                      observed_ ? observed_->height() : lens_.height, fps);
    RecordedScene scene = start();
    Progress progress("rendering");
    const auto total = static_cast<std::uint64_t>(end_.ns - begin_.ns);
    bool is_dark = true;
    SceneSnapshot snapshot;
    eachMoment(1'000'000'000 / fps, [&](Stamp moment) {
      snapshot = scene.at(moment);
      render::Image image = draw(snapshot);
      is_dark = is_dark && !isLit(image);
      video.write(shown(moment, snapshot, std::move(image)));
      progress.update(static_cast<std::uint64_t>(moment.ns - begin_.ns), total);
    });
    video.close();
    if (is_dark) {
      std::cerr << "afterglow render: the video is dark: " << darkReason(snapshot, scene.status())
                << std::endl;
    }
  }

 private:
  calib::Lens loadLens(const std::string& path) {
    const calib::CameraInfoFile file = calib::loadCameraInfo(path);
    if (!file.warning.empty()) remark_ = path + ": " + file.warning;
    return file.lens;
  }

  RecordedScene start() const { return {*source_.store, source_.behavior, config_}; }

  static bool hasContent(const SceneSnapshot& snapshot) {
    return snapshot.T_projector_world &&
           std::any_of(snapshot.scene.layers.begin(), snapshot.scene.layers.end(),
                       [](const render::Layer& layer) { return !layer.drawables.empty(); });
  }

  render::Image draw(const SceneSnapshot& snapshot) {
    // An unknown projector draws the empty scene: black.
    if (!snapshot.T_projector_world) return renderer_.render({}, {});
    return renderer_.render(snapshot.scene, *snapshot.T_projector_world);
  }

  /// What is to be seen of it: as it is sent to the projector, or as it falls on the room, where
  /// the projector's own ways have no part.
  render::Image shown(Stamp moment, const SceneSnapshot& snapshot, render::Image image) {
    if (observed_) return observed_->see(moment, snapshot, lens_, std::move(image));
    light_.apply(image);
    return image;
  }

  /// From the beginning in steps, and the end itself.
  template <typename Visit>
  void eachMoment(std::int64_t step_ns, const Visit& visit) const {
    const std::int64_t last_ns = std::max(begin_.ns, end_.ns - 1);
    for (std::int64_t ns = begin_.ns; ns < last_ns; ns += step_ns) visit(Stamp{ns});
    visit(Stamp{last_ns});
  }

  std::optional<Stamp> lastMomentWithContent() const {
    std::optional<Stamp> last;
    RecordedScene scene = start();
    eachMoment(kSearchStepNs, [&](Stamp moment) {
      if (hasContent(scene.at(moment))) last = moment;
    });
    return last;
  }

  BehaviorSource source_;
  ProjectorConfig config_;
  render::LightOutput light_;
  std::string remark_;
  calib::Lens lens_;
  Stamp begin_, end_;
  render::GlContext context_;
  render::ProjectorRenderer renderer_;
  std::optional<ObservedPictures> observed_;
};

bool isVideo(const std::string& path) { return std::filesystem::path(path).extension() == ".mp4"; }

std::string checkEnding(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  return ending == ".png" || ending == ".mp4" ? "" : "should end with .png or .mp4";
}

void runRender(const RenderOptions& options) {
  BehaviorPictures pictures(openBehavior(options.what, options.store), options);
  if (isVideo(options.out)) {
    pictures.writeVideo(options.out, options.fps);
  } else {
    render::writePng(options.out, options.at_s ? pictures.at(*options.at_s) : pictures.lastLit());
  }
  // Last, so that a refusal is one line.
  if (!pictures.remark().empty()) {
    std::cerr << "afterglow render: " << pictures.remark() << std::endl;
  }
}

}  // namespace

void addRenderVerb(CLI::App& app) {
  auto options = std::make_shared<RenderOptions>();
  CLI::App* verb = addVerb(app, "render");
  verb->add_option("what", options->what, std::string(kBehaviorHelp) + "; or FILE.bag")->required();
  verb->add_option("--config", options->config, "What is projected where (assets/projector.yaml)")
      ->required();
  verb->add_option("--calibration", options->calibration,
                   "Folder of the lens's file; without it, the configuration's folder");
  verb->add_option("--projector", options->projector,
                   "Which of several projectors of the configuration");
  CLI::Option* view = verb->add_option(
      "--view", "projector (default): the projector's picture; observer: the room it lights");
  view->check(CLI::IsMember({"projector", "observer"}));
  verb->add_option("--out", options->out, "The picture (.png) or video (.mp4) to write")
      ->required()
      ->check(CLI::Validator(checkEnding, "FILE.png|FILE.mp4"));
  CLI::Option* at = verb->add_option("--at", options->at_s,
                                     "Seconds from the behavior's beginning; without it, the last "
                                     "moment at which anything was lit");
  verb->add_option("--fps", options->fps, "Frames a second of a video")
      ->check(CLI::Range(1, 240))
      ->capture_default_str();
  addStoreOption(*verb, options->store);
  addObserverOptions(*verb, options->observer);
  verb->callback([options, at, view] {
    options->is_observed = !view->empty() && view->as<std::string>() == "observer";
    if (!options->is_observed && options->observer.isGiven()) {
      throw CLI::ValidationError("--view", "these options need --view observer");
    }
    if (isVideo(options->out) && !at->empty()) {
      throw CLI::ValidationError("--at", "a video shows the whole behavior");
    }
    runRender(*options);
  });
}

}  // namespace afterglow::nodes
