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

}  // namespace afterglow::nodes
