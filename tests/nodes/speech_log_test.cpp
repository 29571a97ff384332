#include "nodes/speaker/sound.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <stdexcept>

#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::speech_log_test {
namespace {

const Sound kRamp{8000, 2, {0, 1000, -2000, 3000, -32768, 32767}};

template <typename Action>
std::string refusal(const Action& action) {
  try {
    action();
    return "not refused";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

TEST(Sound, comesBackFromItsFile) {
  const test::TempFolder folder;
  writeWav(folder.path("ramp.wav"), kRamp);
  const Sound back = readWav(folder.path("ramp.wav"));
  EXPECT_EQ(back.sample_rate, 8000);
  EXPECT_EQ(back.channels, 2);
  EXPECT_EQ(back.samples, kRamp.samples);
  EXPECT_DOUBLE_EQ(back.seconds(), 3.0 / 8000);
}

TEST(Sound, isSofterAtLowerVolume) {
  const test::TempFolder folder;
  writeWav(folder.path("ramp.wav"), kRamp, 0.5);
  EXPECT_EQ(readWav(folder.path("ramp.wav")).samples,
            (std::vector<std::int16_t>{0, 500, -1000, 1500, -16384, 16384}));
}

TEST(Sound, refusesWhatIsNoWavFile) {
  const test::TempFolder folder;
  test::writeFile(folder.path("text.wav"), "no sound at all");
  writeWav(folder.path("empty.wav"), Sound{8000, 1, {}});
  EXPECT_EQ(refusal([&] { readWav(folder.path("none.wav")); }),
            folder.path("none.wav") + ": no such file");
  EXPECT_EQ(refusal([&] { readWav(folder.path("")); }), folder.path("") + ": no such file");
  EXPECT_NE(refusal([&] { readWav(folder.path("text.wav")); }), "not refused");
  EXPECT_EQ(refusal([&] { readWav(folder.path("empty.wav")); }),
            folder.path("empty.wav") + ": no sound in it");
}

TEST(SpeechLog, isAnEmptyArrayAtFirst) {
  const test::TempFolder folder;
  const SpeechLog log(folder.path("new/speech"));
  EXPECT_TRUE(readSpeechLog(folder.path("new/speech/speech.json")).empty());
}

TEST(SpeechLog, keepsEverySoundAndItsMoment) {
  const test::TempFolder folder;
  SpeechLog log(folder.path(""));
  log.add({"He said \"hi\".", "en-us", 1'700'000'000'123'456'789, 1.5, 0.25, false, ""}, kRamp);
  const std::size_t loop = log.add({"", "", 42, 1, 1, true, ""}, kRamp);
  log.setDuration(loop, 3.5);
  const auto back = readSpeechLog(folder.path("speech.json"));
  ASSERT_EQ(back.size(), 2u);
  EXPECT_EQ(back[0].text, "He said \"hi\".");
  EXPECT_EQ(back[0].voice, "en-us");
  EXPECT_EQ(back[0].onset_ns, 1'700'000'000'123'456'789);
  EXPECT_EQ(back[0].duration_s, 1.5);
  EXPECT_EQ(back[0].volume, 0.25);
  EXPECT_FALSE(back[0].loop);
  EXPECT_EQ(readWav(back[0].file).samples, kRamp.samples) << "unscaled";
  EXPECT_TRUE(back[1].loop);
  EXPECT_EQ(back[1].duration_s, 3.5);
  EXPECT_NE(back[0].file, back[1].file);
}

TEST(SpeechLog, goesOnWithWhatIsThere) {
  const test::TempFolder folder;
  SpeechLog(folder.path("")).add({"one", "", 1, 1, 1, false, ""}, kRamp);
  SpeechLog(folder.path("")).add({"two", "", 2, 1, 1, false, ""}, kRamp);
  const auto back = readSpeechLog(folder.path("speech.json"));
  ASSERT_EQ(back.size(), 2u);
  EXPECT_EQ(back[1].text, "two");
  EXPECT_NE(back[0].file, back[1].file);
}

TEST(SpeechLog, survivesTextThatIsNoUtf8) {
  const test::TempFolder folder;
  SpeechLog(folder.path("")).add({"caf\xe9", "", 1, 1, 1, false, ""}, kRamp);
  EXPECT_EQ(readSpeechLog(folder.path("speech.json")).size(), 1u);
}

TEST(SpeechLog, refusesAFileThatIsNoLog) {
  const test::TempFolder folder;
  for (const char* text : {"", "{\"text\"", "[{\"text\": \"without the rest\"}]", "[1]"}) {
    test::writeFile(folder.path("speech.json"), text);
    const std::string why = refusal([&] { SpeechLog{folder.path("")}; });
    EXPECT_EQ(why.rfind(folder.path("speech.json") + ": not a speech log: ", 0), 0u) << why;
  }
}

}  // namespace
}  // namespace afterglow::nodes::speech_log_test
