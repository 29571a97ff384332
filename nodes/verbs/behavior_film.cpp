#include "nodes/verbs/behavior_film.hpp"

#include <afterglow/ReplayStatus.h>
#include <fmt/format.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <iostream>
#include <map>
#include <optional>
#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/observer/caption.hpp"
#include "nodes/observer/film.hpp"
#include "nodes/projector/recorded_scene.hpp"
#include "nodes/tools/video_writer.hpp"
#include "nodes/verbs/recorded_speech.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "replay/bags/bag_file.hpp"
#include "replay/query/time_text.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

using replay::Stamp;

/// "pick, 2026-11-23 08:13:45 +01:00, success".
std::string captionOf(const replay::Behavior& behavior) {
  const auto [day, clock, zone] = replay::timeParts(behavior.begin);
  const std::string outcome = behavior.outcome.empty() ? "" : ", " + behavior.outcome;
  return fmt::format("{}, {} {} {}{}", behavior.name, day, clock, zone == "Z" ? "UTC" : zone,
                     outcome);
}

double secondsBetween(Stamp from, Stamp to) { return static_cast<double>(to.ns - from.ns) * 1e-9; }

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

/// Draws the room that one behavior lights.
class FilmedBehavior {
 public:
  FilmedBehavior(BehaviorSource source, const FilmOptions& options)
      : source_(std::move(source)),
        settings_(readPictureSettings(options.pictures)),
        painter_(context_, *source_.store, source_.behavior, settings_, PictureView::Bystander) {}

  int width() const { return painter_.width(); }
  int height() const { return painter_.height(); }

  /// The room `seconds` after the beginning, or at the nearest moment that there is. `inset`, where
  /// there is one, shows the projector's image in a corner.
  render::Image at(double seconds, int width, int height, CaptionPainter* inset) {
    painter_.moveTo(seconds);
    is_lit_ = painter_.isLit() || is_lit_;
    render::Image image = painter_.room(width, height);
    if (inset != nullptr) inset->paintInset(image, painter_.lensImage(), "projector image");
    return image;
  }
  /// Returns true if the last picture shows something that is gone.
  bool hasGhosts() const { return painter_.hasGhosts(); }
  /// Tells what the pictures did not show.
  void tellRemarks() {
    tellDark(painter_.whyDark(is_lit_), "video", is_lit_);
    tell(settings_.remark);
  }

 private:
  BehaviorSource source_;
  PictureSettings settings_;
  render::GlContext context_;
  MomentPainter painter_;
  bool is_lit_ = false;  ///< any picture was
};

/// The pictures of a film: a behavior's, and to their left those of another one.
class FilmPictures {
 public:
  FilmPictures(BehaviorSource source, const FilmOptions& options) {
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
  void tellRemarks() { own_->tellRemarks(); }

  /// The picture `seconds` after the beginning, which must not decrease.
  render::Image at(double seconds, CaptionPainter& painter) {
    if (!beside_) return own_->at(seconds, width(), height(), &painter);
    const int half = width() / 2 - 2;
    render::Image left = beside_->at(clocks_.secondAt(seconds), half, height(), nullptr);
    render::Image right = own_->at(seconds, half, height(), nullptr);
    painter.paintLabel(left, labels_.first);
    painter.paintLabel(right, labels_.second);
    return besideEachOther(left, right, width());
  }

 private:
  ClockPair clocks_;
  double seconds_ = 0;
  std::pair<std::string, std::string> labels_;
  std::optional<FilmedBehavior> beside_, own_;  ///< made in place: they hold OpenGL contexts
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

/// Returns when a frame of /tf moves so that it can be seen: some way within a pause's time, since
/// wheels that creep while a base settles look as if they stood.
std::vector<FilmSpan> movingSpans(const BehaviorSource& source) {
  constexpr double kVisible_m = 0.02, kVisible_rad = 0.03, kPause_s = 0.4;
  struct Place {
    double at_s;
    Eigen::Isometry3d pose;
  };
  std::map<std::string, Place> last;
  std::vector<FilmSpan> spans;
  const auto isMoved = [&](double now_s, const geometry_msgs::TransformStamped& told) {
    const Place now{now_s, toIsometry(told.transform)};
    const auto [known, is_new] = last.emplace(told.child_frame_id, now);
    const Eigen::Isometry3d moved = known->second.pose.inverse() * now.pose;
    const bool is_seen = moved.translation().norm() >= kVisible_m ||
                         Eigen::AngleAxisd(moved.linear()).angle() >= kVisible_rad;
    if (is_seen || now_s > known->second.at_s + kPause_s) known->second = now;
    return is_seen;
  };
  eachRecorded<tf2_msgs::TFMessage>(
      *source.store, source.behavior, [&](Stamp at, const tf2_msgs::TFMessage& told) {
        const double now_s = secondsBetween(source.behavior.begin, at);
        const auto isMovedNow = [&](const auto& one) { return isMoved(now_s, one); };
        if (std::count_if(told.transforms.begin(), told.transforms.end(), isMovedNow) == 0) return;
        if (spans.empty() || now_s > spans.back().end_s + kPause_s) spans.push_back({now_s, now_s});
        spans.back().end_s = now_s;
      });
  return spans;
}

/// How much of a picture is lit: its bright pixels.
std::size_t brightPixels(const render::Image& image) {
  constexpr int kBright = 160;  // of 255: a darkened room's things are not
  std::size_t count = 0;
  for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
    count += std::max({image.rgb[i], image.rgb[i + 1], image.rgb[i + 2]}) > kBright ? 1 : 0;
  }
  return count;
}

/// One of the films that are made of the same pictures, each at its own pace.
class FilmCut {
 public:
  /// `title`, `closing`: empty: none.
  FilmCut(const std::string& path, int width, int height, int fps, const FilmEvents& events,
          double most_s, std::string title, std::string closing)
      : film_(path, width, height + stripHeight(width), fps),
        fps_(fps),
        title_(std::move(title)),
        closing_(std::move(closing)),
        title_s_(title_.empty() ? 0 : kTitle_s),
        pace_(filmPace(events,
                       std::max(1.0, most_s - title_s_ - (closing_.empty() ? 0 : kClosing_s)))),
        images_(std::max(1LL, std::llround(std::ceil(pace_.firstAt(events.seconds) * fps)))) {}

  /// Returns true if it shows the picture of the recording's second i / fps.
  bool wants(std::int64_t i) const {
    return next_ < images_ && std::llround(nextSecond() * fps_) <= i;
  }
  /// Adds the picture, as often as it is shown.
  void add(std::int64_t i, const render::Image& image, Caption caption, CaptionPainter& painter) {
    if (next_ == 0 && title_s_ > 0) {
      render::Image titled = image;
      painter.paintTitle(titled, title_);
      hold(painter.withStrip(titled, {caption.tag, caption.text, ""}), title_s_);
    }
    if (!closing_.empty() && brightPixels(image) >= bright_pixels_) {
      bright_pixels_ = brightPixels(image);
      brightest_ = painter.withStrip(image, {"", closing_, "", "", caption.has_ghosts});
    }
    for (; wants(i); ++next_) {
      const double shown_s = static_cast<double>(next_) / fps_;
      const double speed = (pace_.secondAt(shown_s + 0.02) - nextSecond()) / 0.02;
      if (speed > 1.05 && speed < 4.05) caption.tag = fmt::format("{:.1f} times as fast", speed);
      film_.add(painter.withStrip(image, caption));
    }
  }
  void close(std::vector<Utterance> heard, Stamp begin) {
    if (!closing_.empty()) hold(brightest_, kClosing_s);
    for (Utterance& utterance : heard) {
      const double film_s = title_s_ + pace_.firstAt(secondsBetween(begin, {utterance.onset_ns}));
      utterance.onset_ns = std::llround(film_s * 1e9);
    }
    film_.close(heard);
  }

 private:
  static constexpr double kTitle_s = 2.5, kClosing_s = 3.5;  // to be read

  double nextSecond() const { return pace_.secondAt(static_cast<double>(next_) / fps_); }
  void hold(const render::Image& image, double seconds) {
    for (auto i = std::llround(seconds * fps_); i > 0; --i) film_.add(image);
  }

  Film film_;
  const int fps_;
  const std::string title_, closing_;
  const double title_s_;
  const ClockPair pace_;
  const std::int64_t images_;
  std::int64_t next_ = 0;
  render::Image brightest_;  ///< where there is a closing
  std::size_t bright_pixels_ = 0;
};

}  // namespace

void tell(const std::string& remark) {
  if (!remark.empty()) std::cerr << "afterglow render: " << remark << std::endl;
}

void tellDark(const std::vector<std::string>& reasons, const char* what, bool is_lit) {
  if (!is_lit) return tell(fmt::format("the {} is dark: {}", what, fmt::join(reasons, "; ")));
  for (const std::string& reason : reasons) tell(reason);
}

void makeFilms(const FilmOptions& options) {
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
    const auto wordsOf = [i](const std::vector<std::string>& all) {
      return all.empty() ? std::string() : all.at(i);
    };
    cuts.emplace_back(options.out[i], pictures.width(), pictures.height(), options.fps, events,
                      most_s, wordsOf(options.titles), wordsOf(options.closings));
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

namespace {

BehaviorSource openBag(const std::string& path) {
  BehaviorSource source;
  source.store = replay::openMemoryStore();
  Progress progress("reading the bag");
  replay::BagImport options;
  options.progress = [&progress](std::uint64_t done, std::uint64_t total) {
    progress.update(done, total);
  };
  source.behavior = replay::importBag(path, *source.store, options).behavior;
  source.name = path;
  return source;
}

}  // namespace

BehaviorSource openBehavior(const std::string& what, const std::string& store) {
  if (looksLikeFile(what)) return openBag(what);
  BehaviorSource source;
  source.store = replay::openStore(store, replay::OpenMode::ReadOnly);
  source.behavior = findBehavior(*source.store, store, {what});
  source.name =
      "behavior " + std::to_string(source.behavior.id) + " '" + source.behavior.name + "'";
  return source;
}

double secondsOf(const BehaviorSource& source) {
  const replay::Stamp end = endOf(*source.store, source.behavior);
  return static_cast<double>(end.ns - source.behavior.begin.ns) * 1e-9;
}

}  // namespace afterglow::nodes
