#include "nodes/tools/side_by_side.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "nodes/tools/program.hpp"
#include "nodes/tools/video_writer.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;

constexpr double kWidest_s = 2.5, kNarrowest_s = 0.3, kStep_s = 0.1;  // around a moment
constexpr double kBeforeSpeech_s = 0.3, kAfterSpeech_s = 0.7;
constexpr double kBridged_s = 0.6;   // a shorter cut only disturbs
constexpr double kPictureScale = 0.75;  // so that half the width shows two thirds of the picture
constexpr const char* kLabelFont = "/usr/share/fonts/truetype/dejavu/DejaVuSans-Bold.ttf";

double lengthOf(const std::vector<FilmSpan>& spans) {
  double sum = 0;
  for (const FilmSpan& span : spans) sum += span.end_s - span.begin_s;
  return sum;
}

std::vector<FilmSpan> merged(std::vector<FilmSpan> spans, const FilmSpan& whole) {
  std::sort(spans.begin(), spans.end(),
            [](const FilmSpan& a, const FilmSpan& b) { return a.begin_s < b.begin_s; });
  std::vector<FilmSpan> kept;
  for (FilmSpan span : spans) {
    span = {std::max(span.begin_s, whole.begin_s), std::min(span.end_s, whole.end_s)};
    if (span.end_s <= span.begin_s) continue;
    if (!kept.empty() && span.begin_s < kept.back().end_s + kBridged_s) {
      kept.back().end_s = std::max(kept.back().end_s, span.end_s);
    } else {
      kept.push_back(span);
    }
  }
  return kept;
}

/// A cut as ffmpeg reads it.
struct Cut {
  double then_s, now_s, length_s;
  double still_s = 0;  ///< time that it then stands still at its first image
};

std::vector<Cut> cutsOf(const SideBySide& films) {
  std::vector<Cut> cuts;
  for (const FilmSpan& span : films.spans) {
    const double then_s = thenAt(films.moments, span.begin_s);
    const double begin_s = std::max(films.then_begin_s, then_s);
    cuts.push_back({begin_s, span.begin_s, span.end_s - span.begin_s, begin_s - then_s});
  }
  const double lead_s = films.lead.end_s - films.lead.begin_s;
  if (lead_s > 0) {
    cuts.insert(cuts.begin(), {cuts.at(0).then_s, films.lead.begin_s, lead_s, lead_s});
  }
  return cuts;
}

/// A filter's text between quotes. Of what both levels of ffmpeg's escaping would change, colons
/// alone are worth it.
std::string quoted(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '\'') {
      safe += "’";
    } else if (c == ':') {
      safe += "\\:";
    } else {
      safe += c == '\\' || static_cast<unsigned char>(c) < 32 ? ' ' : c;
    }
  }
  return "'" + safe + "'";
}

/// Returns the filter of one of the two pictures: what of an input's picture, under which label.
std::string panel(const SideBySide& films, const std::string& from, const std::string& label,
                  const std::string& color) {
  const int height = static_cast<int>((films.height - films.strip) * kPictureScale) / 2 * 2;
  const int width = films.width / 4 * 2 - 2;
  return fmt::format(
      "{}crop={}:{}:0:0,scale=-2:{},crop={}:{},drawtext=fontfile={}:text={}:fontsize=26:"
      "expansion=none:fontcolor=white:box=1:boxcolor={}:boxborderw=8:x=18:y=18",
      from, films.width, films.height - films.strip, height, width, height, kLabelFont,
      quoted(label), color);
}

bool hasSound(const std::string& path) {
  return !runProgram({"ffprobe", "-v", "error", "-select_streams", "a", "-show_entries",
                      "stream=index", "-of", "csv=p=0", "file:" + path})
              .output.empty();
}

std::vector<std::string> commandOf(const SideBySide& films, const std::string& part) {
  std::vector<std::string> command = {"ffmpeg", "-hide_banner", "-nostats", "-nostdin",
                                      "-loglevel", "error", "-y"};
  for (const Cut& cut : cutsOf(films)) {
    for (const bool is_then : {true, false}) {
      const double length_s = is_then ? std::max(0.1, cut.length_s - cut.still_s) : cut.length_s;
      command.insert(command.end(),
                     {"-ss", fmt::format("{:.3f}", is_then ? cut.then_s : cut.now_s), "-t",
                      fmt::format("{:.3f}", length_s), "-i",
                      "file:" + (is_then ? films.then : films.now)});
    }
  }
  const bool has_sound = hasSound(films.now);
  command.insert(command.end(), {"-filter_complex", sideBySideGraph(films, has_sound), "-map",
                                 "[picture]", "-c:v", "libx264", "-preset", "veryfast", "-crf",
                                 "19", "-pix_fmt", "yuv420p"});
  if (has_sound) {
    command.insert(command.end(), {"-map", "[sound]", "-c:a", "aac", "-b:a", "128k"});
  }
  command.insert(command.end(), {"-movflags", "+faststart", "-f", "mp4", "file:" + part});
  return command;
}

}  // namespace

std::vector<FilmSpan> keptSpans(const std::vector<FilmMoment>& moments,
                                const std::vector<FilmSpan>& speech, const FilmSpan& whole,
                                double most_s) {
  std::vector<FilmSpan> kept;
  for (double around_s = kWidest_s; around_s >= kNarrowest_s; around_s -= kStep_s) {
    kept.clear();
    for (const FilmSpan& said : speech) {
      kept.push_back({said.begin_s - kBeforeSpeech_s, said.end_s + kAfterSpeech_s});
    }
    for (const FilmMoment& moment : moments) {
      kept.push_back({moment.now_s - around_s, moment.now_s + around_s});
    }
    kept = merged(std::move(kept), whole);
    if (lengthOf(kept) <= most_s) break;
  }
  return kept;
}

double thenAt(const std::vector<FilmMoment>& moments, double now_s) {
  if (moments.empty()) return now_s;
  const FilmMoment& nearest =
      *std::min_element(moments.begin(), moments.end(), [&](const auto& a, const auto& b) {
        return std::abs(a.now_s - now_s) < std::abs(b.now_s - now_s);
      });
  return now_s + nearest.then_s - nearest.now_s;
}

std::string sideBySideGraph(const SideBySide& films, bool has_sound) {
  const std::vector<Cut> cuts = cutsOf(films);
  std::string graph, parts;
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    const Cut& cut = cuts[i];
    const std::string then = fmt::format("[{}:v]", 2 * i), now = fmt::format("[now{}]", i);
    const std::string frozen =
        fmt::format("tpad=start_mode=clone:start_duration={:.3f}:stop_mode=clone:stop_duration={:.3f},",
                    cut.still_s, cut.length_s);
    graph += fmt::format("[{}:v]split[now{}][below{}];", 2 * i + 1, i, i);
    graph += panel(films, then + frozen, films.then_label, "0x1E78BE");
    graph += fmt::format("[left{}];", i) + panel(films, now, films.now_label, "0xEC6E14");
    graph += fmt::format("[right{}];", i);
    graph += fmt::format(
        "[left{0}][right{0}]hstack=shortest=1,pad={1}:ih:(ow-iw)/2:0:0x0C0E12[above{0}];"
        "[below{0}]crop={1}:{2}:0:{3}[strip{0}];[above{0}][strip{0}]vstack=shortest=1,setsar=1"
        "[part{0}];",
        i, films.width, films.strip, films.height - films.strip);
    parts += fmt::format("[part{}]", i);
    if (has_sound) parts += fmt::format("[{}:a]", 2 * i + 1);
  }
  return fmt::format("{}{}concat=n={}:v=1:a={}[picture]{}", graph, parts, cuts.size(),
                     has_sound ? 1 : 0, has_sound ? "[sound]" : "");
}

void makeSideBySide(const SideBySide& films, const std::string& path) {
  if (films.spans.empty()) throw std::invalid_argument(path + ": nothing to show side by side");
  const std::string part = partPath(path);
  const ProgramResult result = runProgram(commandOf(films, part));
  std::error_code ignored;
  if (result.status != 0) {
    fs::remove(part, ignored);
    std::string output = result.output.substr(0, 400);
    std::replace(output.begin(), output.end(), '\n', ' ');
    throw std::runtime_error(path + ": ffmpeg failed: " + output);
  }
  fs::rename(part, path);
}

}  // namespace afterglow::nodes
