#include "nodes/observer/film.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <utility>
#include <vector>

#include "nodes/tools/program.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;

constexpr int kSampleRate = 48000;
/// eSpeak NG speaks at -20.7 LUFS; web video and podcasts are leveled to -16.
constexpr double kGain_db = 4.7;
constexpr const char* kPeakLimit = "0.84";  // -1.5 dB

/// An utterance as the film hears it, seconds.
struct Clip {
  Utterance utterance;
  double skipped_s;  ///< part of the utterance before the film began
  double begin_s;    ///< time in the film
};

/// Returns what sounds within the film.
std::vector<Clip> clipsOf(const std::vector<Utterance>& said, double seconds) {
  std::vector<Clip> clips;
  for (const Utterance& utterance : said) {
    const double onset_s = static_cast<double>(utterance.onset_ns) * 1e-9;
    if (onset_s >= seconds || onset_s + utterance.duration_s <= 0) continue;
    if (utterance.duration_s <= 0 || utterance.volume <= 0) continue;
    clips.push_back({utterance, std::max(0.0, -onset_s), std::max(0.0, onset_s)});
  }
  return clips;
}

/// ffmpeg's filter graph: every clip, an input from the second on, at its place; mixed
/// as loud as they are. Before ffmpeg 4.4 amix divides by their number, again whenever one has
/// ended, unless it is to take its time for that: then all of it is undone.
std::string soundTrack(const std::vector<Clip>& clips, double seconds) {
  std::string graph, names;
  for (std::size_t i = 0; i < clips.size(); ++i) {
    const Clip& clip = clips[i];
    graph += fmt::format(
        "[{}:a]aformat=sample_fmts=fltp:sample_rates={}:channel_layouts=mono,atrim=start={:.9g}"
        ":end={:.9g},asetpts=PTS-STARTPTS,volume={:.9g},adelay={}S:all=1[clip{}];",
        i + 1, kSampleRate, clip.skipped_s, clip.utterance.duration_s, clip.utterance.volume,
        std::llround(clip.begin_s * kSampleRate), i);
    names += fmt::format("[clip{}]", i);
  }
  return fmt::format(
      "{}{}amix=inputs={}:dropout_transition=1e9:duration=longest,volume={},volume={}dB,"
      "alimiter=limit={}:level=0,apad=whole_dur={:.9g},atrim=end={:.9g}[sound]",
      graph, names, clips.size(), clips.size(), kGain_db, kPeakLimit, seconds, seconds);
}

std::string oneLine(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  const auto end = text.find_last_not_of(' ');
  return text.substr(0, end == std::string::npos ? 0 : end + 1);
}

/// The images as they are, AAC sound, playable while it loads.
void addSound(const std::string& silent, const std::vector<Clip>& clips, double seconds,
              const std::string& path) {
  const std::string part = partPath(path);
  std::vector<std::string> arguments = {"ffmpeg", "-hide_banner", "-nostats", "-nostdin",
                                        "-loglevel", "error", "-y", "-i", "file:" + silent};
  for (const Clip& clip : clips) {
    if (clip.utterance.loop) arguments.insert(arguments.end(), {"-stream_loop", "-1"});
    arguments.insert(arguments.end(), {"-i", "file:" + clip.utterance.file});
  }
  arguments.insert(arguments.end(),
                   {"-filter_complex", soundTrack(clips, seconds), "-map", "0:v", "-c:v", "copy",
                    "-map", "[sound]", "-c:a", "aac", "-b:a", "128k",
                    // The other coder of AAC overshoots the limit by 2 dB, which clips.
                    "-aac_coder", "fast", "-movflags", "+faststart", "-f", "mp4", "file:" + part});
  const ProgramResult result = runProgram(arguments);
  std::error_code ignored;
  if (result.status != 0) {
    fs::remove(part, ignored);
    throw std::runtime_error(path + ": ffmpeg failed: " + oneLine(result.output));
  }
  fs::rename(part, path);
}

}  // namespace

Film::Film(const std::string& path, int width, int height, int fps)
    : path_(path),
      silent_path_(fs::path(path).replace_extension(".silent.mp4").string()),
      fps_(fps),
      writer_(silent_path_, width, height, fps) {}

void Film::add(const render::Image& image) {
  writer_.write(image);
  ++count_;
}

void Film::close(const std::vector<Utterance>& said) {
  writer_.close();
  const double seconds = static_cast<double>(count_) / fps_;
  const std::vector<Clip> clips = clipsOf(said, seconds);
  if (clips.empty()) return fs::rename(silent_path_, path_);
  try {
    addSound(silent_path_, clips, seconds, path_);
  } catch (const std::exception& error) {
    throw std::runtime_error(error.what() + ("; without sound the film is " + silent_path_));
  }
  fs::remove(silent_path_);
}

namespace {

constexpr double kFastest = 4;
constexpr double kBeforeSpeech_s = 0.2, kAfterSpeech_s = 0.6;
constexpr double kStill_s = 0.7;  // shown of what stands still

/// A part of a recording, from where the part before it ends.
struct Part {
  enum class Kind { Said, Moving, Still } kind;
  double until_s;
};

/// Adds what is not said, until a second.
void addUnsaid(const std::vector<FilmSpan>& moving, double until_s, std::vector<Part>& parts) {
  const double begin_s = parts.empty() ? 0 : parts.back().until_s;
  double from_s = begin_s;
  for (const FilmSpan& span : moving) {
    if (span.end_s <= from_s || span.begin_s >= until_s) continue;
    if (span.begin_s > from_s + kStill_s) parts.push_back({Part::Kind::Still, span.begin_s});
    from_s = std::min(span.end_s, until_s);
    parts.push_back({Part::Kind::Moving, from_s});
  }
  if (until_s > from_s + kStill_s) parts.push_back({Part::Kind::Still, until_s});
  if (until_s > from_s) parts.push_back({Part::Kind::Moving, until_s});
}

std::vector<Part> partsOf(const FilmEvents& events) {
  std::vector<Part> parts;
  for (const FilmSpan& span : events.said) {
    const double from_s = parts.empty() ? 0 : parts.back().until_s;
    const double begin_s = std::clamp(span.begin_s - kBeforeSpeech_s, from_s, events.seconds);
    addUnsaid(events.moving, begin_s, parts);
    const double end_s = std::clamp(span.end_s + kAfterSpeech_s, begin_s, events.seconds);
    parts.push_back({Part::Kind::Said, end_s});
  }
  addUnsaid(events.moving, events.seconds, parts);
  return parts;
}

}  // namespace

double ClockPair::secondAt(double first_s) const {
  if (moments_.empty()) return first_s;
  const auto after = std::find_if(moments_.begin(), moments_.end(),
                                  [&](const auto& moment) { return moment.first >= first_s; });
  if (after == moments_.begin() || after == moments_.end()) {
    const auto& nearest = after == moments_.end() ? moments_.back() : *after;
    return nearest.second + first_s - nearest.first;
  }
  const auto& [a, a_second] = *(after - 1);
  const auto& [b, b_second] = *after;
  return a_second + (b_second - a_second) * (first_s - a) / (b - a);
}

double ClockPair::firstAt(double second_s) const {
  ClockPair turned;
  for (const auto& [first_s, at_s] : moments_) {
    const bool is_standing = turned.isKnown() && at_s <= turned.moments_.back().first;
    if (!is_standing) turned.add(at_s, first_s);
  }
  return turned.secondAt(second_s);
}

ClockPair filmPace(const FilmEvents& events, double most_s) {
  ClockPair clocks;
  clocks.add(0, 0);
  if (std::isinf(most_s)) return clocks;
  const std::vector<Part> parts = partsOf(events);
  double own_s = 0, moving_s = 0, begin_s = 0;  // at its own pace, and what may be faster
  for (const Part& part : parts) {
    const double length_s = part.until_s - begin_s;
    if (part.kind == Part::Kind::Moving) moving_s += length_s;
    if (part.kind == Part::Kind::Said) own_s += length_s;
    if (part.kind == Part::Kind::Still) own_s += kStill_s;
    begin_s = part.until_s;
  }
  const double pace = std::clamp(moving_s / std::max(1e-3, most_s - own_s), 1.0, kFastest);
  double film_s = begin_s = 0;
  for (const Part& part : parts) {
    const double length_s = part.until_s - begin_s;
    if (length_s <= 0) continue;
    film_s += part.kind == Part::Kind::Still    ? kStill_s
              : part.kind == Part::Kind::Moving ? length_s / pace
                                                : length_s;
    clocks.add(film_s, begin_s = part.until_s);
  }
  return clocks;
}

}  // namespace afterglow::nodes
