#include "nodes/verbs/command.hpp"

#include <afterglow/ReplayStatus.h>
#include <fmt/format.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "calib/file_replacement.hpp"
#include "nodes/behavior_view/behavior_page.hpp"
#include "nodes/behavior_view/moment_painter.hpp"
#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/observer/caption.hpp"
#include "nodes/observer/film.hpp"
#include "nodes/observer/film_pace.hpp"
#include "nodes/projector/recorded_scene.hpp"
#include "nodes/tools/video_writer.hpp"
#include "nodes/tools/work_folder.hpp"
#include "nodes/verbs/behavior_source.hpp"
#include "nodes/verbs/contact_sheet.hpp"
#include "nodes/verbs/recorded_messages.hpp"
#include "nodes/verbs/recorded_speech.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "render/image_file.hpp"
#include "replay/query/time_text.hpp"

namespace afterglow::nodes {
namespace {

using replay::Stamp;

struct RenderOptions {
  std::string what;  // a behavior's id, or a bag
  std::string store;
  PictureOptions pictures;
  std::vector<double> at_s;
  std::vector<std::string> out;  // as many as moments, or films; one without
  int fps = 30;
  bool is_observed = false, is_film = false, is_sheet = false;
  std::string beside;   // a second behavior
  std::string caption;  // of a film; empty: what is recorded there
  std::vector<double> at_most_s;
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
  const auto [day, clock, zone] = replay::timeParts(behavior.begin);
  const std::string outcome = behavior.outcome.empty() ? "" : ", " + behavior.outcome;
  return fmt::format("{}, {} {} {}{}", behavior.name, day, clock, zone == "Z" ? "UTC" : zone,
                     outcome);
}

double secondsBetween(Stamp from, Stamp to) { return static_cast<double>(to.ns - from.ns) * 1e-9; }

double secondsOf(const BehaviorSource& source) {
  return secondsBetween(source.behavior.begin, endOf(*source.store, source.behavior));
}

/// Draws one behavior at its moments.
class BehaviorPictures {
 public:
  BehaviorPictures(BehaviorSource source, const RenderOptions& options)
      : source_(std::move(source)),
        settings_(readPictureSettings(options.pictures)),
        begin_(source_.behavior.begin),
        painter_(context_, *source_.store, source_.behavior, settings_,
                 options.is_observed ? PictureView::Bystander : PictureView::Projector) {}

  /// The picture `seconds` after the beginning.
  render::Image at(double seconds) {
    const double duration_s = secondsOf(source_);
    if (!(seconds >= 0 && seconds <= duration_s)) {
      throw std::runtime_error(fmt::format("--at {:.3f} is not within the {:.3f} s of {}", seconds,
                                           duration_s, source_.name));
    }
    painter_.moveTo(Stamp{begin_.ns + std::llround(seconds * 1e9)});
    return told();
  }

  /// The picture of the last moment at which anything was lit.
  render::Image lastLit() {
    std::optional<Stamp> last;
    eachMoment(kSearchStepNs, [&](Stamp moment) {
      if (painter_.hasContent()) last = moment;
    });
    if (last) {
      painter_.moveTo(*last);
      if (painter_.isLit()) return told();
    }
    // Content outside the picture at the end: every moment has to be looked at.
    last.reset();
    eachMoment(kSearchStepNs, [&](Stamp moment) {
      if (painter_.hasContent() && painter_.isLit()) last = moment;
    });
    if (last) {
      painter_.moveTo(*last);
      return told();
    }
    throw std::runtime_error(fmt::format("nothing of {} is lit: {}", source_.name,
                                         fmt::join(painter_.whyDark(false), "; ")));
  }

  /// What is odd about the lens's file, or empty.
  const std::string& remark() const { return settings_.remark; }

  void writeVideo(const std::string& path, int fps) {
    VideoWriter video(path, painter_.width(), painter_.height(), fps);
    eachImage(fps, [&](Stamp) { video.write(painter_.picture()); });
    video.close();
  }

  /// Moments at even distances, the last one included, with what was projected and, where the room
  /// is drawn, the room.
  render::Image contactSheet(bool has_room) {
    ContactSheet sheet;
    for (int i = 0; i < kSheetMoments; ++i) {
      const Stamp moment{begin_.ns + (painter_.last().ns - begin_.ns) * i / (kSheetMoments - 1)};
      painter_.moveTo(moment);
      std::vector<render::Image> pictures = {painter_.projected()};
      if (has_room) pictures.push_back(painter_.picture());
      const double seconds = static_cast<double>(moment.ns - begin_.ns) * 1e-9;
      sheet.add(pictures, {fmt::format("{:.1f} s", seconds), source_.behavior.name, ""});
    }
    return sheet.image();
  }

  /// A film's picture of the room `seconds` after the beginning, or at the nearest moment that
  /// there is. `inset`, where there is one, shows the projector's image in a corner.
  render::Image filmed(double seconds, int width, int height, CaptionPainter* inset) {
    painter_.moveTo(seconds);
    is_film_lit_ = painter_.isLit() || is_film_lit_;
    render::Image image = painter_.room(width, height);
    if (inset != nullptr) inset->paintInset(image, painter_.lensImage(), "projector image");
    return image;
  }
  /// Tells what filmed() did not show.
  void tellOfFilm() {
    tellDark(painter_.whyDark(is_film_lit_), "video", is_film_lit_);
    tell(remark());
  }
  bool hasGhosts() const { return painter_.hasGhosts(); }

  /// Of a film's room, pixels.
  int width() const { return painter_.width(); }
  int height() const { return painter_.height(); }

 private:
  /// The moment's picture; says what it does not show.
  render::Image told() {
    const bool is_lit = painter_.isLit();
    tellDark(painter_.whyDark(is_lit), "picture", is_lit);
    return painter_.picture();
  }

  /// From the beginning in steps, and the end itself.
  template <typename Visit>
  void eachMoment(std::int64_t step_ns, const Visit& visit) {
    const auto go = [&](Stamp moment) {
      painter_.moveTo(moment);
      visit(moment);
    };
    for (std::int64_t ns = begin_.ns; ns < painter_.last().ns; ns += step_ns) go(Stamp{ns});
    go(painter_.last());
  }

  /// Takes every image of a video; says so if none was lit.
  template <typename Take>
  void eachImage(int fps, const Take& take) {
    Progress progress("rendering " + source_.name, "");
    const auto total = static_cast<std::uint64_t>(painter_.last().ns - begin_.ns);
    bool is_dark = true;
    eachMoment(1'000'000'000 / fps, [&](Stamp moment) {
      is_dark = is_dark && !painter_.isLit();
      take(moment);
      progress.update(static_cast<std::uint64_t>(moment.ns - begin_.ns), total);
    });
    tellDark(painter_.whyDark(!is_dark), "video", !is_dark);
  }

  BehaviorSource source_;
  PictureSettings settings_;
  Stamp begin_;
  render::GlContext context_;
  MomentPainter painter_;
  bool is_film_lit_ = false;
};

bool isVideo(const std::string& path) { return fs::path(path).extension() == ".mp4"; }
bool isPage(const std::string& path) { return fs::path(path).extension() == ".html"; }

std::string checkEnding(const std::string& path) {
  const bool is_known = fs::path(path).extension() == ".png" || isVideo(path) || isPage(path);
  return is_known ? "" : "should end with .png, .mp4 or .html";
}

std::string labelOf(const BehaviorSource& source) {
  return fmt::format("{} {}", source.behavior.name, source.behavior.id);
}

/// Returns the clocks of a recording and of the other one that stands beside it: where it is a
/// recorded replay of that one, as its player told; else both begin together.
ClockPair clocksOf(const BehaviorSource& source, const BehaviorSource& beside) {
  ClockPair clocks;
  eachRecorded<ReplayStatus>(
      *source.store, source.behavior, [&](Stamp at, const ReplayStatus& status) {
        if (status.state == ReplayStatus::PLAYING && status.behavior_id == beside.behavior.id &&
            status.behavior_name == beside.behavior.name) {
          clocks.add(secondsBetween(source.behavior.begin, at), status.position);
        }
      });
  return clocks;
}

/// Joins pictures of the same height, with a few dark columns between them.
render::Image besideEachOther(const render::Image& left, const render::Image& right, int width) {
  const auto bytes = [](int pixels) { return static_cast<std::size_t>(pixels) * 3; };
  render::Image both{width, left.height, {}};
  both.rgb.resize(bytes(width * left.height));
  for (int v = 0; v < left.height; ++v) {
    const auto row = both.rgb.begin() + static_cast<std::ptrdiff_t>(bytes(v * width));
    std::copy_n(left.rgb.begin() + static_cast<std::ptrdiff_t>(bytes(v * left.width)),
                bytes(left.width), row);
    std::copy_n(right.rgb.begin() + static_cast<std::ptrdiff_t>(bytes(v * right.width)),
                bytes(right.width), row + static_cast<std::ptrdiff_t>(bytes(width - right.width)));
  }
  return both;
}

/// The pictures of a film: a behavior's, and to their left those of another one.
class FilmPictures {
 public:
  FilmPictures(BehaviorSource source, const RenderOptions& options) {
    if (!options.beside.empty()) {
      BehaviorSource beside = openBehavior(options.beside, options.store);
      clocks_ = clocksOf(source, beside);
      seconds_ = clocks_.isKnown() ? 0 : secondsOf(beside);
      labels_ = {labelOf(beside), labelOf(source)};
      if (clocks_.isKnown()) labels_ = {"THEN", "NOW"};
      beside_.emplace(std::move(beside), options);
    }
    seconds_ = std::max(seconds_, secondsOf(source));
    own_.emplace(std::move(source), options);
  }

  int width() const { return own_->width(); }
  int height() const { return own_->height(); }
  double seconds() const { return seconds_; }
  bool hasGhosts() const { return own_->hasGhosts(); }
  void tellRemarks() { own_->tellOfFilm(); }

  /// The picture `seconds` after the beginning, which must not decrease.
  render::Image at(double seconds, CaptionPainter& painter) {
    if (!beside_) return own_->filmed(seconds, width(), height(), &painter);
    const int half = width() / 2 - 2;
    render::Image left = beside_->filmed(clocks_.secondAt(seconds), half, height(), nullptr);
    render::Image right = own_->filmed(seconds, half, height(), nullptr);
    painter.paintLabel(left, labels_.first);
    painter.paintLabel(right, labels_.second);
    return besideEachOther(left, right, width());
  }

 private:
  ClockPair clocks_;
  double seconds_ = 0;
  std::pair<std::string, std::string> labels_;
  std::optional<BehaviorPictures> beside_, own_;  ///< made in place: they hold OpenGL contexts
};

/// Returns when something sounds.
std::vector<FilmSpan> saidSpans(const std::vector<Utterance>& heard, Stamp begin) {
  std::vector<FilmSpan> spans;
  for (const Utterance& utterance : heard) {
    const double onset_s = secondsBetween(begin, {utterance.onset_ns});
    spans.push_back({onset_s, onset_s + utterance.duration_s});
  }
  std::sort(spans.begin(), spans.end(),
            [](const FilmSpan& a, const FilmSpan& b) { return a.begin_s < b.begin_s; });
  return spans;
}

/// Returns when a frame of /tf moves so that it can be seen.
std::vector<FilmSpan> movingSpans(const BehaviorSource& source) {
  constexpr double kVisible_m = 0.004, kVisible_rad = 0.008, kPause_s = 0.4;
  std::map<std::string, Eigen::Isometry3d> last;
  std::vector<FilmSpan> spans;
  const auto isMoved = [&](const geometry_msgs::TransformStamped& told) {
    const Eigen::Isometry3d now = toIsometry(told.transform);
    const auto [known, is_new] = last.emplace(told.child_frame_id, now);
    const Eigen::Isometry3d moved = known->second.inverse() * now;
    if (is_new || (moved.translation().norm() < kVisible_m &&
                   Eigen::AngleAxisd(moved.linear()).angle() < kVisible_rad)) {
      return false;
    }
    known->second = now;
    return true;
  };
  eachRecorded<tf2_msgs::TFMessage>(
      *source.store, source.behavior, [&](Stamp at, const tf2_msgs::TFMessage& told) {
        if (std::count_if(told.transforms.begin(), told.transforms.end(), isMoved) == 0) return;
        const double now_s = secondsBetween(source.behavior.begin, at);
        if (spans.empty() || now_s > spans.back().end_s + kPause_s) spans.push_back({now_s, now_s});
        spans.back().end_s = now_s;
      });
  return spans;
}

/// One of the films that are made of the same pictures, each at its own pace.
class FilmCut {
 public:
  FilmCut(const std::string& path, int width, int height, int fps, const FilmEvents& events,
          double most_s)
      : film_(path, width, height + stripHeight(width), fps),
        fps_(fps),
        pace_(filmPace(events, most_s)),
        images_(std::max(1LL, std::llround(std::ceil(pace_.firstAt(events.seconds) * fps)))) {}

  /// Whether it shows the picture of the recording's second i / fps.
  bool wants(std::int64_t i) const {
    return next_ < images_ && std::llround(nextSecond() * fps_) <= i;
  }
  /// Adds the picture, as often as it is shown.
  void add(std::int64_t i, const render::Image& image, Caption caption, CaptionPainter& painter) {
    for (; wants(i); ++next_) {
      const double shown_s = static_cast<double>(next_) / fps_;
      const double speed = (pace_.secondAt(shown_s + 0.02) - nextSecond()) / 0.02;
      if (speed > 1.05 && speed < 4.05) caption.tag = fmt::format("{:.1f} times as fast", speed);
      film_.add(painter.withStrip(image, caption));
    }
  }
  void close(std::vector<Utterance> heard, Stamp begin) {
    for (Utterance& utterance : heard) {
      const double film_s = pace_.firstAt(secondsBetween(begin, {utterance.onset_ns}));
      utterance.onset_ns = std::llround(film_s * 1e9);
    }
    film_.close(heard);
  }

 private:
  double nextSecond() const { return pace_.secondAt(static_cast<double>(next_) / fps_); }

  Film film_;
  const int fps_;
  const ClockPair pace_;
  const std::int64_t images_;
  std::int64_t next_ = 0;
};

/// Makes films of the room, with captions and sound.
void runFilm(const RenderOptions& options) {
  const WorkFolder work(options.out.at(0));
  BehaviorSource source = openBehavior(options.what, options.store);
  const Stamp begin = source.behavior.begin;
  Progress progress("rendering " + source.name, "");
  const RecordedSpeech speech(*source.store, source.behavior, work.folder("speech"));
  const std::vector<Utterance> heard = speech.heard();
  Caption caption;
  caption.tag = options.beside.empty() ? "recorded" : "";
  caption.text = options.caption.empty() ? captionOf(source.behavior) : options.caption;
  FilmEvents events{0, saidSpans(heard, begin), movingSpans(source)};
  FilmPictures pictures(std::move(source), options);
  events.seconds = pictures.seconds();
  if (events.moving.empty()) events.moving = {{0, events.seconds}};  // nothing tells
  CaptionPainter painter;
  std::deque<FilmCut> cuts;
  for (std::size_t i = 0; i < options.out.size(); ++i) {
    const double most_s = options.at_most_s.empty() ? INFINITY : options.at_most_s.at(i);
    cuts.emplace_back(options.out[i], pictures.width(), pictures.height(), options.fps, events,
                      most_s);
  }
  const auto images = std::llround(std::ceil(events.seconds * options.fps));
  for (std::int64_t i = 0; i <= images; ++i) {
    progress.update(static_cast<std::uint64_t>(i), static_cast<std::uint64_t>(images));
    if (std::none_of(cuts.begin(), cuts.end(), [i](const auto& cut) { return cut.wants(i); })) {
      continue;
    }
    const double now_s = static_cast<double>(i) / options.fps;
    const render::Image image = pictures.at(now_s, painter);
    const Stamp moment{begin.ns + std::llround(now_s * 1e9)};
    caption.speech = speech.saidAt(moment);
    caption.asked = speech.askedAt(moment);
    caption.has_ghosts = pictures.hasGhosts();
    for (FilmCut& cut : cuts) cut.add(i, image, caption, painter);
  }
  for (FilmCut& cut : cuts) cut.close(heard, begin);
  tell(speech.problem());
  pictures.tellRemarks();
}

/// With the room, if it can be drawn here.
void runSheet(const RenderOptions& given) {
  RenderOptions options = given;
  try {
    options.is_observed = true;
    BehaviorPictures pictures(openBehavior(options.what, options.store), options);
    return render::writePng(options.out.at(0), pictures.contactSheet(options.is_observed));
  } catch (const std::runtime_error& error) {
    if (given.is_observed) throw;
    tell(std::string("without the room: ") + error.what());
  }
  options.is_observed = false;
  BehaviorPictures pictures(openBehavior(options.what, options.store), options);
  render::writePng(options.out.at(0), pictures.contactSheet(options.is_observed));
}

/// The bytes of the film of a behavior.
std::string filmOf(const RenderOptions& options) {
  const WorkFolder work(options.out.at(0));
  RenderOptions film = options;
  film.out = {work.path("film.mp4")};
  runFilm(film);
  std::ifstream file(film.out.at(0), std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// Its story as a page, with pictures and film where there is a configuration.
void runPage(const RenderOptions& options) {
  const BehaviorSource source = openBehavior(options.what, options.store);
  const BehaviorDetail detail = readDetail(*source.store, source.behavior);
  std::optional<PictureSettings> settings;
  if (!options.pictures.config.empty()) settings = readPictureSettings(options.pictures);
  std::optional<render::GlContext> context;
  std::map<PictureView, MomentPainter> painters;  // gone before the context
  const auto draw = [&](PictureView view, double t) {
    if (!context) context.emplace();
    MomentPainter& painter = painters
                                 .try_emplace(view, *context, *source.store, source.behavior,
                                              *settings, view, kPagePictureWidth)
                                 .first->second;
    painter.moveTo(t);
    return painter.jpeg();
  };
  const std::string film = options.is_film ? filmOf(options) : "";
  calib::replaceFile(options.out.at(0),
                     behaviorPage(detail, settings ? DrawMoment(draw) : nullptr, film));
  if (settings) tell(settings->remark);
}

void runRender(const RenderOptions& options) {
  if (isPage(options.out.at(0))) return runPage(options);
  if (options.is_film) return runFilm(options);
  if (options.is_sheet) return runSheet(options);
  BehaviorPictures pictures(openBehavior(options.what, options.store), options);
  if (isVideo(options.out.at(0))) {
    pictures.writeVideo(options.out.at(0), options.fps);
  } else if (options.at_s.empty()) {
    render::writePng(options.out.at(0), pictures.lastLit());
  }
  for (std::size_t i = 0; i < options.at_s.size(); ++i) {
    render::writePng(options.out.at(i), pictures.at(options.at_s[i]));
  }
  tell(pictures.remark());  // last, so that a refusal is one line
}

}  // namespace

void addRenderVerb(CLI::App& app) {
  auto options = std::make_shared<RenderOptions>();
  CLI::App* verb = addVerb(app, "render");
  verb->add_option("what", options->what, std::string(kBehaviorHelp) + "; or FILE.bag")->required();
  addPictureOptions(*verb, options->pictures);
  CLI::Option* view = verb->add_option(
      "--view", "projector (default): the projector's picture; observer: the room it lights");
  view->check(CLI::IsMember({"projector", "observer"}));
  CLI::Option* film = verb->add_flag(
      "--film", options->is_film,
      "The room that it lights, with captions, the projector's image in a corner and, as sound, "
      "what was said: a video to be shown to people");
  verb->add_option("--beside", options->beside,
                   "Another behavior, shown to the left of it: in step where it is a recorded "
                   "replay of that one, else from both beginnings on; captions and sound are not "
                   "its own")
      ->needs(film);
  verb->add_option("--caption", options->caption,
                   "Words below a film, in place of the behavior's name, time and outcome")
      ->needs(film);
  verb->add_option("--at-most", options->at_most_s,
                   "Seconds that a film may take: what stands still is left out, what is not said "
                   "goes up to four times as fast; once for each --out")
      ->check(CLI::PositiveNumber)
      ->expected(1)
      ->take_all()
      ->needs(film);
  CLI::Option* sheet = verb->add_flag(
      "--contact-sheet", options->is_sheet,
      "A picture of twelve moments, with their times: what was projected, and the room");
  sheet->excludes(film);
  verb->add_option(
          "--out", options->out,
          "The picture (.png) or video (.mp4) to write; or one page for people (.html): its "
          "story, when what came, with --config what was to be seen, with --film the film; once "
          "for each --at or --at-most")
      ->required()
      ->expected(1)
      ->take_all()
      ->check(CLI::Validator(checkEnding, "FILE.png|FILE.mp4|FILE.html"));
  CLI::Option* at =
      verb->add_option("--at", options->at_s,
                       "Seconds from the behavior's beginning, once or several times; "
                       "without it, the last moment at which anything was lit");
  at->expected(1)->take_all();
  verb->add_option("--fps", options->fps, "Frames a second of a video")
      ->check(CLI::Range(1, 240))
      ->capture_default_str();
  addStoreOption(*verb, options->store);
  verb->add_option("--size", options->pictures.observer.size,
                   "Width and height of the room's picture, pixels: 640,480; else as the room has "
                   "them")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::Range(16, 4096));
  verb->callback([options, at, view] {
    const bool is_page = isPage(options->out.at(0)), is_video = isVideo(options->out.at(0));
    const std::size_t wanted = std::max(options->at_s.size(), options->at_most_s.size());
    if (options->out.size() != std::max<std::size_t>(1, wanted)) {
      throw CLI::ValidationError("--out", "should be given once for each --at or --at-most");
    }
    if (options->pictures.config.empty() && (!is_page || options->is_film)) {
      throw CLI::RequiredError("--config");
    }
    if (is_page && (!at->empty() || !view->empty() || options->is_sheet)) {
      throw CLI::ValidationError("--out", "a page has its own choice of moments and views");
    }
    if (is_page && !options->beside.empty()) {
      throw CLI::ValidationError("--beside", "makes a video (.mp4)");
    }
    const bool is_sent = !view->empty() && view->as<std::string>() == "projector";
    options->is_observed = options->is_film || (!view->empty() && !is_sent);
    if (options->is_film && is_sent) {
      throw CLI::ValidationError("--view", "a film shows the room, not the projector's view");
    }
    if (options->is_film && !is_video && !is_page) {
      throw CLI::ValidationError("--out", "should end with .mp4 or .html, as --film makes a video");
    }
    const bool has_room = options->is_observed || options->is_sheet || is_page;
    if (!has_room && options->pictures.observer.isGiven()) {
      throw CLI::ValidationError("--view", "these options need --view observer or --film");
    }
    if (options->is_sheet && (is_video || !at->empty())) {
      throw CLI::ValidationError("--contact-sheet", "is a .png of the whole behavior");
    }
    if (std::any_of(options->out.begin(), options->out.end(), isVideo) && !at->empty()) {
      throw CLI::ValidationError("--at", "a video shows the whole behavior");
    }
    runRender(*options);
  });
}

}  // namespace afterglow::nodes
