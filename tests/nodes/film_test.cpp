#include "nodes/observer/film.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "nodes/speaker/sound.hpp"
#include "nodes/tools/program.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::film_test {
namespace {

render::Image gray(int width, int height, std::uint8_t level) {
  const auto count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3;
  return {width, height, std::vector<std::uint8_t>(count, level)};
}

Sound tone(double seconds, double amplitude) {
  Sound sound{22050, 1, {}};
  for (int i = 0; i < seconds * sound.sample_rate; ++i) {
    const double phase = 2 * M_PI * 440 * i / sound.sample_rate;
    sound.samples.push_back(static_cast<std::int16_t>(32767 * amplitude * std::sin(phase)));
  }
  return sound;
}

std::int64_t at(double seconds) { return static_cast<std::int64_t>(std::llround(seconds * 1e9)); }

std::string probe(const std::string& path, const std::string& entries) {
  return runProgram({"ffprobe", "-v", "error", "-count_frames", "-show_entries", entries, "-of",
                     "csv=p=0", path})
      .output;
}

/// The number after the n-th appearance of a word in what ffmpeg's filter reports.
double measured(const std::string& path, const std::string& filter, const std::string& word,
                int nth = 0) {
  const std::string report = runProgram({"ffmpeg", "-hide_banner", "-nostats", "-i", path, "-af",
                                         filter, "-vn", "-f", "null", "-"})
                                 .output;
  std::size_t found = report.find(word);
  for (; nth > 0 && found != std::string::npos; --nth) found = report.find(word, found + 1);
  if (found == std::string::npos) return NAN;
  return std::atof(report.c_str() + found + word.size());
}

struct FilmTest : ::testing::Test {
  test::TempFolder folder;
  const std::string log = folder.path("speech/speech.json"), output = folder.path("film.mp4");

  void SetUp() override {
    if (!hasProgram("ffmpeg")) GTEST_SKIP() << "ffmpeg is not installed";
  }
  /// Four seconds of 12 images each, with what was said.
  void film() {
    Film film(output, 64, 48, 12);
    for (int i = 0; i < 48; ++i) film.add(gray(64, 48, 90));
    film.close(readSpeechLog(log));
  }
  void say(double onset_s, double duration_s, double amplitude, double volume = 1,
           bool loop = false) {
    SpeechLog(folder.path("speech"))
        .add({"words", "", at(onset_s), duration_s, volume, loop, ""}, tone(1, amplitude));
  }
};

TEST_F(FilmTest, letsSpeechBeginWhenItBegan) {
  say(1.25, 1, 0.3);
  film();
  EXPECT_EQ(probe(output, "stream=codec_name"), "h264\naac\n");
  EXPECT_EQ(probe(output, "stream=nb_read_frames").substr(0, 3), "48\n");
  const std::string silence = "silencedetect=noise=-45dB:duration=0.2";
  EXPECT_NEAR(measured(output, silence, "silence_end: "), 1.25, 0.05);
  EXPECT_NEAR(measured(output, silence, "silence_start: ", 1), 2.25, 0.05);
  EXPECT_NEAR(std::stod(probe(output, "format=duration")), 4, 0.1);
}

TEST_F(FilmTest, isAsLoudAsSpokenVideoIsWhereItIsSpokenByESpeak) {
  say(0.5, 1, 0.16);  // about as loud as eSpeak NG
  say(2.0, 1, 0.16);
  film();
  EXPECT_NEAR(measured(output, "ebur128=framelog=verbose", "I: "), -16, 1.5);
}

TEST_F(FilmTest, doesNotClip) {
  say(0.5, 1, 0.95);
  film();
  EXPECT_LT(measured(output, "volumedetect", "max_volume: "), -0.5);
}

TEST_F(FilmTest, keepsTheVolumesApart) {
  say(0.2, 1, 0.3);
  say(2.2, 1, 0.3, 0.1);
  film();
  const double loud = measured(output, "atrim=0.4:1.0,volumedetect", "mean_volume: ");
  const double soft = measured(output, "atrim=2.4:3.0,volumedetect", "mean_volume: ");
  EXPECT_NEAR(loud - soft, 20, 1.5);
}

TEST_F(FilmTest, repeatsLoopsAndCutsWhatWasStopped) {
  say(0.5, 2.4, 0.3, 1, true);
  film();
  const std::string silence = "silencedetect=noise=-45dB:duration=0.2";
  EXPECT_NEAR(measured(output, silence, "silence_end: "), 0.5, 0.05);
  EXPECT_NEAR(measured(output, silence, "silence_start: ", 1), 2.9, 0.05);
}

TEST_F(FilmTest, cutsSpeechAtBothEndsOfTheVideo) {
  say(-0.4, 1, 0.3);
  say(3.5, 1, 0.3);
  say(20, 1, 0.3);
  say(-20, 1, 0.3);
  film();
  const std::string silence = "silencedetect=noise=-45dB:duration=0.2";
  EXPECT_NEAR(measured(output, silence, "silence_start: "), 0.6, 0.05);
  EXPECT_NEAR(measured(output, silence, "silence_end: "), 3.5, 0.05);
  EXPECT_NEAR(std::stod(probe(output, "format=duration")), 4, 0.1);
}

TEST_F(FilmTest, staysSilentWithoutSpeech) {
  SpeechLog empty(folder.path("speech"));
  film();
  EXPECT_EQ(probe(output, "stream=codec_name"), "h264\n");
}

TEST_F(FilmTest, keepsTheImagesWhereItsSoundCannotBeMade) {
  say(1, 1, 0.3);
  std::filesystem::remove(readSpeechLog(log)[0].file);
  try {
    film();
    FAIL() << "not refused";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("utterance_0001.wav"), std::string::npos)
        << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
  EXPECT_FALSE(std::filesystem::exists(output));
  EXPECT_FALSE(std::filesystem::exists(folder.path("film.part.mp4")));
  EXPECT_EQ(probe(folder.path("film.silent.mp4"), "stream=codec_name,nb_read_frames"),
            "h264,48\n");
}

}  // namespace
}  // namespace afterglow::nodes::film_test
