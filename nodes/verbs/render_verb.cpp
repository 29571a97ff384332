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
#include <vector>

#include "nodes/observer/film.hpp"
#include "nodes/projector/projector_config.hpp"
#include "nodes/projector/recorded_scene.hpp"
#include "nodes/tools/side_by_side.hpp"
#include "nodes/tools/video_writer.hpp"
#include "nodes/tools/work_folder.hpp"
#include "nodes/verbs/behavior_source.hpp"
#include "nodes/verbs/contact_sheet.hpp"
#include "nodes/verbs/observed_pictures.hpp"
#include "nodes/verbs/projector_choice.hpp"
#include "nodes/verbs/recorded_speech.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "render/compose/light_census.hpp"
#include "render/image_file.hpp"
#include "render/projector_renderer.hpp"
#include "replay/query/time_text.hpp"

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
  bool is_observed = false, is_film = false, is_sheet = false;
  std::string beside;  // a second behavior
  ObserverOptions observer;
};

namespace fs = std::filesystem;

/// How finely the last lit moment is looked for.
constexpr std::int64_t kSearchStepNs = 100'000'000;
/// Pictures of a contact sheet.
constexpr int kSheetMoments = 12;

/// A line on stderr, unless it is empty.
void tell(const std::string& remark) {
  if (!remark.empty()) std::cerr << "afterglow render: " << remark << std::endl;
}

/// A dark picture's reasons in one line; of a lit one a line for each thing that it does not show.
void tellDark(const std::vector<std::string>& reasons, const char* what, bool is_lit) {
  if (!is_lit) return tell(fmt::format("the {} is dark: {}", what, fmt::join(reasons, "; ")));
  for (const std::string& reason : reasons) tell(reason);
}

/// "pick, 2026-11-23 08:13:45 +01:00, success".
std::string captionOf(const replay::Behavior& behavior) {
  const std::string time = replay::timeText(behavior.begin);
  const std::string outcome = behavior.outcome.empty() ? "" : ", " + behavior.outcome;
  const std::string zone = time.substr(time.find_first_of("Z+-", 20));
  return fmt::format("{}, {} {} {}{}", behavior.name, time.substr(0, 10), time.substr(11, 8),
                     zone == "Z" ? "UTC" : zone, outcome);
}

/// Draws one behavior at its moments.
class BehaviorPictures {
 public:
  BehaviorPictures(BehaviorSource source, const RenderOptions& options)
      : source_(std::move(source)),
        config_(ofProjector(loadProjectorConfig(options.config, options.calibration),
                            options.projector)),
        light_(config_.projectors[0].light),
        lens_(lensOf(config_.projectors[0])),
        begin_(source_.behavior.begin),
        end_(endOf(*source_.store, source_.behavior)),
        renderer_(context_, lens_, config_.projectors[0].drawing),
        census_(lens_) {
    if (options.is_observed) {
      observed_.emplace(context_, *source_.store, source_.behavior, config_, lens_,
                        options.observer);
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
    const bool is_lit = isLit(image);
    tellDark(scene.whyDark(snapshot, census_, is_lit), "picture", is_lit);
    return shown(moment, snapshot, std::move(image));
  }

  /// The picture of the last moment at which anything was lit.
  render::Image lastLit() {
    if (const auto moment = lastMomentWithContent()) {
      RecordedScene scene = start();
      const SceneSnapshot snapshot = scene.at(*moment);
      render::Image image = draw(snapshot);
      if (isLit(image)) {
        tellDark(scene.whyDark(snapshot, census_, true), "picture", true);
        return shown(*moment, snapshot, std::move(image));
      }
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
      RecordedScene again = start();
      snapshot = again.at(*last);
      tellDark(again.whyDark(snapshot, census_, true), "picture", true);
      return shown(*last, snapshot, draw(snapshot));
    }
    throw std::runtime_error(fmt::format("nothing of {} is lit: {}", source_.name,
                                         fmt::join(scene.whyDark(snapshot, census_, false), "; ")));
  }

  /// What is odd about the lens's file, or empty.
  const std::string& remark() const { return remark_; }

  void writeVideo(const std::string& path, int fps) {
    VideoWriter video(path, observed_ ? observed_->width() : lens_.width,
                      observed_ ? observed_->height() : lens_.height, fps);
    eachImage(fps, [&](Stamp moment, const SceneSnapshot& snapshot, render::Image image) {
      video.write(shown(moment, snapshot, std::move(image)));
    });
    video.close();
  }

  /// Moments at even distances, the last one included, with what was projected and, where the room
  /// is drawn, the room.
  render::Image contactSheet() {
    ContactSheet sheet;
    RecordedScene scene = start();
    const std::int64_t last_ns = std::max(begin_.ns, end_.ns - 1);
    for (int i = 0; i < kSheetMoments; ++i) {
      const Stamp moment{begin_.ns + (last_ns - begin_.ns) * i / (kSheetMoments - 1)};
      const SceneSnapshot snapshot = scene.at(moment);
      const render::Image image = draw(snapshot);
      std::vector<render::Image> pictures = {image};
      light_.apply(pictures.front());
      if (observed_) pictures.push_back(observed_->see(moment, snapshot, image));
      const double seconds = static_cast<double>(moment.ns - begin_.ns) * 1e-9;
      sheet.add(pictures, {fmt::format("{:.1f} s", seconds), source_.behavior.name, ""});
    }
    return sheet.image();
  }

  /// As a bystander saw and heard it. It takes `seconds`: the last image stands for what is left.
  /// Sounds are kept in the folder, which is there and empty.
  void writeFilm(const std::string& path, int fps, double seconds, const std::string& folder) {
    const RecordedSpeech speech(*source_.store, source_.behavior, folder);
    CaptionPainter painter;
    Film film(path, observed_->width(), observed_->height() + stripHeight(observed_->width()), fps,
              {speech.log()});
    Caption caption{"recorded", captionOf(source_.behavior), ""};
    eachImage(fps, [&](Stamp moment, const SceneSnapshot& snapshot, render::Image image) {
      caption.speech = speech.at(moment);
      film.add(moment.ns,
               observed_->seeFilmed(moment, snapshot, std::move(image), caption, painter));
    });
    film.close(begin_.ns + std::llround(seconds * 1e9));
    tell(speech.problem());
  }

  /// Of a film's room, pixels.
  int width() const { return observed_->width(); }
  int height() const { return observed_->height(); }

 private:
  calib::Lens lensOf(const OutputConfig& projector) {
    const calib::CameraInfoFile file = loadLens(projector);
    if (!file.warning.empty()) remark_ = projector.camera_info + ": " + file.warning;
    return file.lens;
  }

  /// Takes every image of a video; says so if none was lit.
  template <typename Take>
  void eachImage(int fps, const Take& take) {
    RecordedScene scene = start();
    Progress progress("rendering " + source_.name, "");
    const auto total = static_cast<std::uint64_t>(end_.ns - begin_.ns);
    bool is_dark = true;
    SceneSnapshot snapshot;
    eachMoment(1'000'000'000 / fps, [&](Stamp moment) {
      snapshot = scene.at(moment);
      render::Image image = draw(snapshot);
      is_dark = is_dark && !isLit(image);
      take(moment, snapshot, std::move(image));
      progress.update(static_cast<std::uint64_t>(moment.ns - begin_.ns), total);
    });
    tellDark(scene.whyDark(snapshot, census_, !is_dark), "video", !is_dark);
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
    if (observed_) return observed_->see(moment, snapshot, std::move(image));
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
  render::LightCensus census_;
  std::optional<ObservedPictures> observed_;
};

bool isVideo(const std::string& path) { return fs::path(path).extension() == ".mp4"; }

std::string checkEnding(const std::string& path) {
  const std::string ending = fs::path(path).extension().string();
  return ending == ".png" || ending == ".mp4" ? "" : "should end with .png or .mp4";
}

double secondsOf(const BehaviorSource& source) {
  return static_cast<double>(endOf(*source.store, source.behavior).ns - source.behavior.begin.ns) *
         1e-9;
}

std::string labelOf(const BehaviorSource& source) {
  return fmt::format("{} {}", source.behavior.name, source.behavior.id);
}

/// Each as a film of its own, both of the same length, then one out of both, with captions and
/// sound of `source`.
void filmBeside(const RenderOptions& options, BehaviorSource source, const WorkFolder& work) {
  BehaviorSource other = openBehavior(options.beside, options.store);
  SideBySide films;
  films.then = work.path("left.mp4");
  films.now = work.path("right.mp4");
  films.then_label = labelOf(other);
  films.now_label = labelOf(source);
  const double seconds = std::max(secondsOf(source), secondsOf(other));
  films.spans = {{0, seconds}};
  {
    BehaviorPictures left(std::move(other), options);
    left.writeFilm(films.then, options.fps, seconds, work.folder("left"));
    films.strip = stripHeight(left.width());
    films.height = left.height() + films.strip;
    films.width = left.width() / 2 * 2;
  }
  BehaviorPictures right(std::move(source), options);
  right.writeFilm(films.now, options.fps, seconds, work.folder("right"));
  makeSideBySide(films, options.out);
  tell(right.remark());
}

void runFilm(const RenderOptions& options) {
  BehaviorSource source = openBehavior(options.what, options.store);
  const WorkFolder work(options.out);
  if (!options.beside.empty()) return filmBeside(options, std::move(source), work);
  const double seconds = secondsOf(source);
  BehaviorPictures pictures(std::move(source), options);
  pictures.writeFilm(options.out, options.fps, seconds, work.folder("speech"));
  tell(pictures.remark());
}

/// With the room, if it can be drawn here.
void runSheet(const RenderOptions& given) {
  RenderOptions options = given;
  try {
    options.is_observed = true;
    BehaviorPictures pictures(openBehavior(options.what, options.store), options);
    return render::writePng(options.out, pictures.contactSheet());
  } catch (const std::runtime_error& error) {
    if (given.is_observed) throw;
    tell(std::string("without the room: ") + error.what());
  }
  options.is_observed = false;
  BehaviorPictures pictures(openBehavior(options.what, options.store), options);
  render::writePng(options.out, pictures.contactSheet());
}

void runRender(const RenderOptions& options) {
  if (options.is_film) return runFilm(options);
  if (options.is_sheet) return runSheet(options);
  BehaviorPictures pictures(openBehavior(options.what, options.store), options);
  if (isVideo(options.out)) {
    pictures.writeVideo(options.out, options.fps);
  } else {
    render::writePng(options.out, options.at_s ? pictures.at(*options.at_s) : pictures.lastLit());
  }
  tell(pictures.remark());  // last, so that a refusal is one line
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
  CLI::Option* film = verb->add_flag(
      "--film", options->is_film,
      "The room that it lights, with captions, the projector's image in a corner and, as sound, "
      "what was said: a video to be shown to people");
  verb->add_option("--beside", options->beside,
                   "Another behavior, shown to the left of it from both beginnings on; captions "
                   "and sound are not its own")
      ->needs(film);
  CLI::Option* sheet = verb->add_flag(
      "--contact-sheet", options->is_sheet,
      "A picture of twelve moments, with their times: what was projected, and the room");
  sheet->excludes(film);
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
    const bool is_sent = !view->empty() && view->as<std::string>() == "projector";
    options->is_observed = options->is_film || (!view->empty() && !is_sent);
    if (options->is_film && is_sent) {
      throw CLI::ValidationError("--view", "a film shows the room, not the projector's view");
    }
    if (options->is_film && !isVideo(options->out)) {
      throw CLI::ValidationError("--out", "should end with .mp4, as --film makes a video");
    }
    if (!options->is_observed && !options->is_sheet && options->observer.isGiven()) {
      throw CLI::ValidationError("--view", "these options need --view observer or --film");
    }
    if (options->is_sheet && (isVideo(options->out) || !at->empty())) {
      throw CLI::ValidationError("--contact-sheet", "is a .png of the whole behavior");
    }
    if (isVideo(options->out) && !at->empty()) {
      throw CLI::ValidationError("--at", "a video shows the whole behavior");
    }
    runRender(*options);
  });
}

}  // namespace afterglow::nodes
