#include "nodes/speaker/speech.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <stdexcept>

#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::speech_test {
namespace {

std::string refusal(Speech& speech, const std::string& text, const std::string& voice) {
  try {
    speech.say(text, voice);
    return "not refused";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

TEST(Speech, saysMoreInMoreTime) {
  Speech speech;
  const double word = speech.say("Gearbox.")->seconds();
  const double sentence = speech.say("I picked up a gearbox bottom from here.")->seconds();
  EXPECT_GT(word, 0.2);
  EXPECT_GT(sentence, 2 * word);
  EXPECT_LT(sentence, 10);
}

TEST(Speech, obeysTheRate) {
  const std::string text = "I picked up a gearbox bottom from here.";
  const double slow = Speech({"en-us", 90}).say(text)->seconds();
  const double fast = Speech({"en-us", 300}).say(text)->seconds();
  EXPECT_GT(slow, 1.5 * fast);
}

TEST(Speech, soundsFromItsFirstMomentToItsLast) {
  Speech speech;
  const auto sound = speech.say("Please move.");  // 50 ms of closed lips first
  const auto loudest = [&](std::size_t begin, std::size_t end) {
    int level = 0;
    for (std::size_t i = begin; i < end; ++i) level = std::max(level, std::abs(sound->samples[i]));
    return level;
  };
  const auto edge = static_cast<std::size_t>(sound->sample_rate / 100);
  EXPECT_GT(loudest(0, edge), 160);
  EXPECT_GT(loudest(sound->samples.size() - edge, sound->samples.size()), 160);
}

TEST(Speech, remembersWhatItHasSaid) {
  Speech speech;
  const auto first = speech.say("Hello.", "en-us");
  EXPECT_EQ(speech.say("Hello.", "en-us"), first);
  EXPECT_EQ(speech.say("Hello.", ""), first) << "the default voice is en-us";
  EXPECT_EQ(speech.say("Hello.", "voice_kal_diphone"), first) << "Festival's voices are not there";
  EXPECT_NE(speech.say("Hello.", "de"), first);
  EXPECT_NE(speech.say("Hello!?", "en-us"), first);
}

TEST(Speech, saysTheSameAgainAfterForgetting) {
  Speech speech;
  const double seconds = speech.say("Again.")->seconds();
  for (int i = 0; i < 70; ++i) speech.say(std::to_string(i));
  // eSpeak NG's voice wavers a little.
  EXPECT_NEAR(speech.say("Again.")->seconds(), seconds, 0.05 * seconds);
}

TEST(Speech, refusesVoicesItDoesNotKnow) {
  Speech speech;
  EXPECT_EQ(refusal(speech, "Hello.", "nobody"),
            "no voice \"nobody\" (espeak-ng --voices lists those there are)");
  EXPECT_NE(refusal(speech, "Hello.", "../../etc/passwd"), "not refused");
  EXPECT_GT(speech.say("Hello.")->seconds(), 0) << "it goes on speaking";
}

TEST(Speech, fallsBackToAnotherVoiceOfTheLanguage) {
  Speech speech;
  EXPECT_GT(speech.say("Why?", "en-gb+f3")->seconds(), 0.1) << "Debian 12 names it en+f3";
  EXPECT_GT(speech.say("Why?", "en-nowhere+f3")->seconds(), 0.1);
  EXPECT_GT(speech.say("Why?", "en-us+nobody")->seconds(), 0.1);
  EXPECT_GT(speech.say("Why?", "en-nowhere")->seconds(), 0.1);
  EXPECT_EQ(refusal(speech, "Why?", "xx-nowhere+f3"),
            "no voice \"xx-nowhere+f3\" (espeak-ng --voices lists those there are)");
}

TEST(Speech, refusesADefaultVoiceItDoesNotKnow) {
  EXPECT_THROW(Speech({"nobody", 160}), std::runtime_error);
  EXPECT_GT(Speech().say("Hello.")->seconds(), 0) << "nothing is left in the way of another";
}

TEST(Speech, refusesTextsWithNothingToSayOrTooMuch) {
  Speech speech;
  EXPECT_EQ(refusal(speech, "", ""), "nothing to say in \"\"");
  EXPECT_EQ(refusal(speech, " \n ", ""), "nothing to say in \" \n \"");
  EXPECT_EQ(refusal(speech, std::string(5000, 'a'), ""),
            "a text of 5000 bytes; at most 4000 are said at once");
}

TEST(Speech, usesAPleasantVoiceThatIsInstalled) {
  test::TempFolder folder;
  writeWav(folder.path("said.wav"), {16000, 1, std::vector<std::int16_t>(1600, 5000)});
  test::writeFile(folder.path("pico2wave"), "#!/bin/sh\ncp '" + folder.path("said.wav") +
                                                "' \"$4\"\n[ \"$6\" != fail ]\n");
  std::filesystem::permissions(folder.path("pico2wave"), std::filesystem::perms::owner_all);
  const std::string path = std::getenv("PATH");
  setenv("PATH", (folder.path("") + ":" + path).c_str(), 1);
  Speech speech({"en-us", 160, "auto"});
  EXPECT_EQ(speech.defaultVoice(), "pico2wave");
  EXPECT_EQ(speech.say("Hello.")->sample_rate, 16000);
  EXPECT_NEAR(speech.say("Hello.")->seconds(), 0.1, 1e-9);
  EXPECT_GT(speech.say("Hallo, wie geht es dir?", "de")->seconds(), 0.2) << "by eSpeak NG";
  EXPECT_EQ(refusal(speech, "fail", ""), "pico2wave ended with status 1 on \"fail\"");
  EXPECT_EQ(Speech({"de", 160, "auto"}).defaultVoice(), "eSpeak NG, voice de");
  EXPECT_EQ(Speech({"en-us", 160, "espeak"}).defaultVoice(), "eSpeak NG, voice en-us");
  setenv("PATH", folder.path("nothing").c_str(), 1);
  EXPECT_THROW(Speech({"en-us", 160, "auto"}), std::runtime_error) << "espeak-ng is missing";
  setenv("PATH", path.c_str(), 1);
  EXPECT_EQ(Speech({"en-us", 160, "auto"}).defaultVoice(), "eSpeak NG, voice en-us");
  EXPECT_THROW(Speech({"en-us", 160, "pico"}), std::runtime_error);
  EXPECT_THROW(Speech({"en-us", 160, "festival"}), std::runtime_error);
}

}  // namespace
}  // namespace afterglow::nodes::speech_test
