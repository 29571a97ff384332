#include "nodes/kitting/media.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <locale>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "nodes/observer/timed_video.hpp"
#include "nodes/speaker/speech_log.hpp"
#include "nodes/tools/program.hpp"
#include "nodes/tools/video_writer.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;
using Arguments = std::vector<std::string>;

constexpr int kSampleRate = 48000;
constexpr double kLoudness_lufs = -16;  // what web video and podcasts are leveled to
constexpr double kMostGain_db = 30;     // silence is not to become noise
constexpr double kFaintest_lufs = -69;  // EBU R 128's absolute gate: below it nothing was measured
constexpr const char* kPeakLimit = "0.84";  // -1.5 dB: AAC overshoots a little

/// An utterance as the video sees it, seconds.
struct Clip {
  Utterance utterance;
  double skipped_s;  ///< of the utterance, before the video began
  double begin_s;    ///< in the video
};

std::vector<Clip> clipsOf(const std::vector<Utterance>& utterances, const VideoInfo& info) {
  std::vector<Clip> clips;
  for (const Utterance& utterance : utterances) {
    const double onset_s = static_cast<double>(utterance.onset_ns - info.first_frame_ns) * 1e-9;
    if (onset_s >= info.seconds() || onset_s + utterance.duration_s <= 0) continue;
    if (utterance.duration_s <= 0 || utterance.volume <= 0) continue;
    clips.push_back({utterance, std::max(0.0, -onset_s), std::max(0.0, onset_s)});
  }
  return clips;
}

/// ffmpeg's filter graph: every clip at its place, mixed, without normalizing by their number.
std::string mixOf(const std::vector<Clip>& clips, std::size_t first_input) {
  std::string graph, names;
  for (std::size_t i = 0; i < clips.size(); ++i) {
    const Clip& clip = clips[i];
    graph += fmt::format(
        "[{}:a]aformat=sample_fmts=fltp:sample_rates={}:channel_layouts=mono,atrim=start={:.9g}"
        ":end={:.9g},asetpts=PTS-STARTPTS,volume={:.9g},adelay={}S:all=1[clip{}];",
        first_input + i, kSampleRate, clip.skipped_s, clip.utterance.duration_s,
        clip.utterance.volume, std::llround(clip.begin_s * kSampleRate), i);
    names += fmt::format("[clip{}]", i);
  }
  return fmt::format("{}{}amix=inputs={}:normalize=0:duration=longest", graph, names, clips.size());
}

void appendInputs(Arguments& arguments, const std::vector<Clip>& clips) {
  for (const Clip& clip : clips) {
    if (clip.utterance.loop) arguments.insert(arguments.end(), {"-stream_loop", "-1"});
    arguments.insert(arguments.end(), {"-i", "file:" + clip.utterance.file});
  }
}

Arguments ffmpeg(const std::string& log_level) {
  return {"ffmpeg", "-hide_banner", "-nostats", "-nostdin", "-loglevel", log_level, "-y"};
}

std::string oneLine(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  const auto end = text.find_last_not_of(' ');
  return text.substr(0, end == std::string::npos ? 0 : end + 1);
}

std::string run(const Arguments& arguments, const std::string& output) {
  const ProgramResult result = runProgram(arguments);
  if (result.status == 0) return result.output;
  throw std::runtime_error(output + ": ffmpeg failed: " + oneLine(result.output));
}

/// Integrated loudness of the mix, pauses not counted (EBU R 128).
double loudnessOf(const std::vector<Clip>& clips, const std::string& output) {
  Arguments arguments = ffmpeg("info");
  appendInputs(arguments, clips);
  const std::string graph = mixOf(clips, 0) + ",ebur128=framelog=verbose[mix]";
  arguments.insert(arguments.end(), {"-filter_complex", graph, "-map", "[mix]", "-f", "null", "-"});
  const std::string report = run(arguments, output);
  const std::size_t found = report.rfind("I:");
  if (found == std::string::npos)
    throw std::runtime_error(output + ": ffmpeg measures no loudness");
  std::istringstream value(report.substr(found + 2));
  value.imbue(std::locale::classic());
  double loudness = kFaintest_lufs;
  value >> loudness;
  return loudness;
}

std::string soundTrack(const std::vector<Clip>& clips, double seconds, const std::string& output) {
  const double loudness = loudnessOf(clips, output);
  const double gain_db =
      loudness > kFaintest_lufs ? std::min(kLoudness_lufs - loudness, kMostGain_db) : 0;
  return fmt::format(
      "{},volume={:.9g}dB,alimiter=limit={}:level=0,apad=whole_dur={:.9g},atrim=end={:.9g}[sound]",
      mixOf(clips, 1), gain_db, kPeakLimit, seconds, seconds);
}

}  // namespace

void addSpeech(const std::string& video, const std::string& speech_log, const std::string& output) {
  std::error_code error;
  if (fs::equivalent(video, output, error)) {
    throw std::runtime_error(output + ": the video with sound needs a name of its own");
  }
  const VideoInfo info = readVideoInfo(video + ".json");
  const std::vector<Clip> clips = clipsOf(readSpeechLog(speech_log), info);
  const std::string part = partPath(output);
  Arguments arguments = ffmpeg("error");
  arguments.insert(arguments.end(), {"-i", "file:" + video});
  appendInputs(arguments, clips);
  arguments.insert(arguments.end(), {"-map", "0:v", "-c:v", "copy"});
  if (!clips.empty()) {
    arguments.insert(arguments.end(), {"-filter_complex", soundTrack(clips, info.seconds(), output),
                                       "-map", "[sound]", "-c:a", "aac", "-b:a", "128k"});
  }
  arguments.insert(arguments.end(), {"-movflags", "+faststart", "-f", "mp4", "file:" + part});
  try {
    run(arguments, output);
    fs::rename(part, output);
  } catch (...) {
    std::remove(part.c_str());
    throw;
  }
}

}  // namespace afterglow::nodes
