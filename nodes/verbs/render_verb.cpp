#include "nodes/verbs/command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "calib/file_replacement.hpp"
#include "nodes/behavior_view/behavior_page.hpp"
#include "nodes/behavior_view/moment_painter.hpp"
#include "nodes/observer/caption.hpp"
#include "nodes/tools/stop_signal.hpp"
#include "nodes/tools/video_writer.hpp"
#include "nodes/verbs/behavior_film.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "render/image_file.hpp"

namespace afterglow::nodes {
namespace {

/// A sheet of pictures; each becomes as wide as a cell, `kCell` px, and has its caption below.
class ContactSheet {
 public:
  static constexpr int kCell = 640, kColumns = 3, kGap = 8;  ///< pixels

  /// Pictures of one moment, one above the other; all moments have as many of the same sizes.
  void add(const std::vector<render::Image>& pictures, const Caption& caption);
  /// All of them, on gray.
  render::Image image() const;

 private:
  CaptionPainter painter_;
  std::vector<render::Image> cells_;
};

cv::Mat pixelsOf(const render::Image& image) {
  return {image.height, image.width, CV_8UC3, const_cast<std::uint8_t*>(image.rgb.data())};
}

render::Image imageOf(const cv::Mat& pixels) {
  return {pixels.cols, pixels.rows, {pixels.datastart, pixels.dataend}};
}

void ContactSheet::add(const std::vector<render::Image>& pictures, const Caption& caption) {
  cv::Mat cell;
  for (const render::Image& picture : pictures) {
    const std::int64_t height = std::int64_t{picture.height} * kCell / picture.width;
    cv::Mat part;
    cv::resize(pixelsOf(picture), part, {kCell, std::max(1, static_cast<int>(height))}, 0, 0,
               cv::INTER_AREA);
    cell.push_back(part);
  }
  cells_.push_back(painter_.withStrip(imageOf(cell.clone()), caption));
}

render::Image ContactSheet::image() const {
  const int count = static_cast<int>(cells_.size());
  if (count == 0) return {};
  const int height = cells_.front().height + kGap;
  const int rows = (count + kColumns - 1) / kColumns, columns = std::min(kColumns, count);
  cv::Mat sheet(rows * height + kGap, columns * (kCell + kGap) + kGap, CV_8UC3,
                cv::Scalar::all(96));
  for (int i = 0; i < count; ++i) {
    const cv::Mat cell = pixelsOf(cells_[static_cast<std::size_t>(i)]);
    cell.copyTo(sheet(cv::Rect({kGap + i % kColumns * (kCell + kGap), kGap + i / kColumns * height},
                               cell.size())));
  }
  return imageOf(sheet);
}

using replay::Stamp;

/// Its `out`: as many as moments, or films; one without.
struct RenderOptions : FilmOptions {
  std::vector<double> at_s;
  bool is_observed = false, is_film = false, is_sheet = false;
};

namespace fs = std::filesystem;

/// How finely the last lit moment is looked for.
constexpr std::int64_t kSearchStepNs = 100'000'000;
/// Pictures of a contact sheet.
constexpr int kSheetMoments = 12;

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
    Progress progress("searching " + source_.name, "");
    std::optional<Stamp> last;
    eachMoment(kSearchStepNs, [&](Stamp moment) {
      tellMoment(progress, moment);
      if (painter_.hasContent()) last = moment;
    });
    if (last) {
      painter_.moveTo(*last);
      if (painter_.isLit()) return told();
    }
    // Content outside the picture at the end: every moment has to be looked at.
    if (const std::vector<Stamp> lit = litMoments(); !lit.empty()) {
      painter_.moveTo(lit.back());
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

  /// Moments evenly among the lit ones, or, where nothing is lit, among all, the first and the last
  /// of them included, with what was projected and, where the room is drawn, the room.
  render::Image contactSheet(bool has_room) {
    ContactSheet sheet;
    const std::vector<Stamp> lit = litMoments();
    Progress progress("rendering " + source_.name, "moments");
    for (int i = 0; i < kSheetMoments; ++i) {
      const std::int64_t span_ns = painter_.last().ns - begin_.ns;
      const Stamp moment =
          lit.empty() ? Stamp{begin_.ns + span_ns * i / (kSheetMoments - 1)}
                      : lit[(lit.size() - 1) * static_cast<std::size_t>(i) / (kSheetMoments - 1)];
      painter_.moveTo(moment);
      std::vector<render::Image> pictures = {painter_.projected()};
      if (has_room) pictures.push_back(painter_.picture());
      const double seconds = static_cast<double>(moment.ns - begin_.ns) * 1e-9;
      sheet.add(pictures, {fmt::format("{:.1f} s", seconds), source_.behavior.name, ""});
      progress.update(static_cast<std::uint64_t>(i + 1), kSheetMoments);
    }
    return sheet.image();
  }

 private:
  std::vector<Stamp> litMoments() {
    Progress progress("searching " + source_.name, "");
    std::vector<Stamp> lit;
    eachMoment(kSearchStepNs, [&](Stamp moment) {
      tellMoment(progress, moment);
      if (painter_.hasContent() && painter_.isLit()) lit.push_back(moment);
    });
    return lit;
  }

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

  void tellMoment(Progress& progress, Stamp moment) const {
    progress.update(static_cast<std::uint64_t>(moment.ns - begin_.ns),
                    static_cast<std::uint64_t>(painter_.last().ns - begin_.ns));
  }

  /// Takes every image of a video; says so if none was lit.
  template <typename Take>
  void eachImage(int fps, const Take& take) {
    Progress progress("rendering " + source_.name, "");
    bool is_dark = true;
    eachMoment(1'000'000'000 / fps, [&](Stamp moment) {
      is_dark = is_dark && !painter_.isLit();
      take(moment);
      tellMoment(progress, moment);
    });
    tellDark(painter_.whyDark(!is_dark), "video", !is_dark);
  }

  BehaviorSource source_;
  PictureSettings settings_;
  Stamp begin_;
  render::GlContext context_;
  MomentPainter painter_;
};

/// Says where something is that was written, and how large.
void tellWritten(const std::string& path) {
  std::cout << path << ": " << sizeText(fs::file_size(path)) << "\n";
}

bool isVideo(const std::string& path) { return fs::path(path).extension() == ".mp4"; }
bool isPage(const std::string& path) { return fs::path(path).extension() == ".html"; }

std::string checkEnding(const std::string& path) {
  const bool is_known = fs::path(path).extension() == ".png" || isVideo(path) || isPage(path);
  return is_known ? "" : "should end with .png, .mp4 or .html";
}

/// With the room, if it can be drawn here.
void runSheet(const RenderOptions& given) {
  RenderOptions options = given;
  try {
    options.is_observed = true;
    BehaviorPictures pictures(openBehavior(options.what, options.store), options);
    return render::writePng(options.out.at(0), pictures.contactSheet(options.is_observed));
  } catch (const std::runtime_error& error) {
    if (given.is_observed || isStopRequested()) throw;
    tell(std::string("without the room: ") + error.what());
  }
  options.is_observed = false;
  BehaviorPictures pictures(openBehavior(options.what, options.store), options);
  render::writePng(options.out.at(0), pictures.contactSheet(options.is_observed));
}

/// The bytes of the film of a behavior.
std::string filmOf(const RenderOptions& options) {
  const WorkFolder work(options.out.at(0));
  FilmOptions film = options;
  film.out = {work.path("film.mp4")};
  makeFilms(film);
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
  const Waiting waiting("drawing the page of " + source.name);
  calib::replaceFile(options.out.at(0),
                     behaviorPage(detail, settings ? DrawMoment(draw) : nullptr, film));
  if (settings) tell(settings->remark);
}

void draw(const RenderOptions& options) {
  if (isPage(options.out.at(0))) return runPage(options);
  if (options.is_film) return makeFilms(options);
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

void runRender(const RenderOptions& options) {
  draw(options);
  for (const std::string& path : options.out) tellWritten(path);
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
  verb->add_option("--title", options->titles,
                   "Words over a film's first picture, which stands for so long that they can be "
                   "read; once for each --out, \"\": none")
      ->expected(1)
      ->take_all()
      ->needs(film);
  verb->add_option("--closing", options->closings,
                   "Words below its brightest picture at the end, likewise")
      ->expected(1)
      ->take_all()
      ->needs(film);
  CLI::Option* sheet = verb->add_flag(
      "--contact-sheet", options->is_sheet,
      "A picture of twelve lit moments, with their times: what was projected, and the room");
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
    for (const auto& words : {options->titles, options->closings}) {
      if (words.empty() || words.size() == options->out.size()) continue;
      throw CLI::ValidationError("--out", "should be given once for each --title or --closing");
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

// `afterglow render`.
int main(int argc, char** argv) {
  return afterglow::nodes::runCommand(argc, argv, {afterglow::nodes::addRenderVerb});
}
