// Sounds and meshes of a recording on a machine that has neither the files nor the old definitions.
#include "nodes/player/media_sink.hpp"

#include <gtest/gtest.h>
#include <visualization_msgs/MarkerArray.h>

#include <filesystem>
#include <fstream>

#include "nodes/conversion/sound_request.hpp"
#include "nodes/conversion/typed_message.hpp"
#include "replay/record/snapshot.hpp"
#include "replay/store/checksum.hpp"
#include "tests/support/player_world.hpp"
#include "tests/support/ros_bytes.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::media_sink_test {
namespace {

using test::rosBytes;
using test::rosChannel;
using replay::Bytes;
using replay::Channel;
using sound_play::SoundRequest;

const std::string kConstants = "int8 PLAY_FILE = -2\nint8 SAY = -3\n";
const Channel kFirst{"/robotsound", "sound_play/SoundRequest",
                     "1",           kConstants + "int8 sound\nint8 command\nstring arg\n",
                     false,         "/robot"};
const Channel kSecond{
    "/robotsound", "sound_play/SoundRequest",
    "2",           kConstants + "int8 sound\nint8 command\nstring arg\nstring arg2\n",
    false,         "/robot"};

/// sound, command, arg and, of the second age, arg2.
Bytes oldRequest(std::int8_t sound, const std::string& arg, bool has_arg2) {
  Bytes bytes{static_cast<std::uint8_t>(sound), 1};
  for (const std::string& text : has_arg2 ? std::vector<std::string>{arg, ""} : std::vector{arg}) {
    const auto size = static_cast<std::uint8_t>(text.size());
    for (const std::uint8_t byte : {size, std::uint8_t{0}, std::uint8_t{0}, std::uint8_t{0}}) {
      bytes.push_back(byte);
    }
    bytes.insert(bytes.end(), text.begin(), text.end());
  }
  return bytes;
}

SoundRequest playFile(const std::string& arg, const std::string& package = "") {
  SoundRequest request;
  request.sound = SoundRequest::PLAY_FILE;
  request.command = SoundRequest::PLAY_ONCE;
  request.volume = 0.5f;
  request.arg = arg;
  request.arg2 = package;
  return request;
}

struct MediaSinkTest : test::PlayerWorld {
  /// Plays what was recorded, with these files kept.
  void playWith(const std::map<std::string, std::string>& kept) {
    replay::Behavior behavior;
    behavior.recording = recording;
    behavior.begin = {test::kBegin};
    behavior.end = replay::Stamp{test::kBegin + 1000 * test::kMs};
    behavior.topics = topics;
    replay::Snapshot snapshot;
    for (const auto& [uri, text] : kept) {
      const Bytes contents(text.begin(), text.end());
      snapshot.files[uri] = replay::sha256(contents);
      if (!text.empty()) store->addFile(snapshot.files[uri], contents);
    }
    snapshot.requested = topics;
    behavior.snapshot = snapshot.toJson();
    behavior.id = store->addBehavior(behavior);
    plan = makePlan(*store, behavior, plan_options);
    renewSpeechOutputs(plan);
    MediaSink media(*store, plan, sink, cache.path("files"));
    if (has_sound_play) media.speakThroughSoundPlay();
    options.clear_projection = false;
    player = std::make_unique<replay::Player>(
        *store, plan, options, media, clock,
        [this] { return replay::Stamp{clock.now().ns + 2 * test::kBegin}; },
        [] { return std::string("id"); });
    report = player->run();
    notes = media.notes();
  }
  SoundRequest said(std::size_t index) {
    return *toMessage<SoundRequest>(sink.on("/robotsound").at(index).bytes);
  }

  bool has_sound_play = false;
  test::TempFolder cache;
  test::PlayReport report;
  std::vector<std::string> notes;
};

TEST(SoundRequest, isUnderstoodInTheWordsOfAllItsAges) {
  const auto first = soundRequestOf(kFirst, oldRequest(-3, "Hello.", false));
  const auto second = soundRequestOf(kSecond, oldRequest(-3, "Hello.", true));
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->sound, SoundRequest::SAY);
  EXPECT_EQ(first->command, SoundRequest::PLAY_ONCE);
  EXPECT_EQ(second->arg, "Hello.");
  EXPECT_EQ(first->volume, 1) << "nothing was silent then";
  EXPECT_EQ(second->volume, 1);
  SoundRequest silent;
  EXPECT_EQ(soundRequestOf(rosChannel<SoundRequest>("/robotsound"), rosBytes(silent))->volume, 0)
      << "what is muted today is meant to be";
  EXPECT_FALSE(soundRequestOf(kSecond, oldRequest(-3, "Hello.", false)));
  EXPECT_FALSE(soundRequestOf(test::kMarkers, {}));
}

TEST_F(MediaSinkTest, namesVoicesThatSoundPlayHas) {
  has_sound_play = true;
  SoundRequest request = playFile("Hello.", "en-us");
  request.sound = SoundRequest::SAY;
  int at_ms = 100;
  for (const char* voice : {"en-us", "", "voice_don_diphone", "en-us"}) {
    request.arg2 = voice;
    record(rosChannel<SoundRequest>("/robotsound"), at_ms += 100, rosBytes(request));
  }
  playWith({});
  EXPECT_EQ(said(0).arg2, "voice_kal_diphone");
  EXPECT_EQ(said(0).arg, "Hello.");
  EXPECT_EQ(said(1).arg2, "");
  EXPECT_EQ(said(2).arg2, "voice_don_diphone");
  EXPECT_EQ(notes, std::vector<std::string>{"sound_play has no voice 'en-us': it is asked for "
                                            "voice_kal_diphone"});
}

TEST_F(MediaSinkTest, bringsOldRequestsToTodaysDefinition) {
  record(kSecond, 100, oldRequest(-3, "Hello.", true));
  playWith({});
  EXPECT_EQ(plan.topics.at(0).output.md5, rosChannel<SoundRequest>("/robotsound").md5);
  EXPECT_EQ(said(0).arg, "Hello.");
  EXPECT_EQ(said(0).volume, 1);
  ASSERT_EQ(sentencesOf(*store, plan).size(), 1u);
}

TEST_F(MediaSinkTest, takesFilesThatAreNotHereFromTheStore) {
  test::TempFolder here;
  std::ofstream(here.path("here.wav")) << "here";
  const Channel sounds = rosChannel<SoundRequest>("/robotsound");
  record(sounds, 100, rosBytes(playFile("/no/such/tone.wav")));
  record(sounds, 200, rosBytes(playFile("sounds/tone.wav", "no_such_package")));
  record(sounds, 300, rosBytes(playFile(here.path("here.wav"))));
  visualization_msgs::MarkerArray markers;
  markers.markers.resize(2);
  markers.markers[1].mesh_resource = "package://no_such_package/part.stl";
  markers.markers[1].text = "part";
  record(rosChannel<visualization_msgs::MarkerArray>("/meshes"), 400, rosBytes(markers));
  playWith({{"file:///no/such/tone.wav", "tone"},
            {"package://no_such_package/sounds/tone.wav", "another"},
            {"file://" + here.path("here.wav"), "as it was then"},
            {"package://no_such_package/part.stl", "solid"}});
  EXPECT_EQ(test::fileBytes(said(0).arg), "tone");
  EXPECT_EQ(said(0).volume, 0.5f);
  EXPECT_EQ(test::fileBytes(said(1).arg), "another");
  EXPECT_EQ(said(1).arg2, "");
  EXPECT_EQ(std::filesystem::path(said(1).arg).extension(), ".wav");
  EXPECT_EQ(said(2).arg, here.path("here.wav"));
  const auto meshes = *toMessage<visualization_msgs::MarkerArray>(sink.on("/meshes").at(0).bytes);
  ASSERT_EQ(meshes.markers[1].mesh_resource.rfind("file:///", 0), 0u);
  EXPECT_EQ(test::fileBytes(meshes.markers[1].mesh_resource.substr(7)), "solid");
  EXPECT_EQ(meshes.markers[0].mesh_resource, "");
  EXPECT_EQ(meshes.markers[1].text, "part");
  EXPECT_EQ(notes.size(), 3u) << "what came from the store is said";
}

TEST_F(MediaSinkTest, keepsAFilesExtensionOnlyIfItIsOne) {
  const Channel sounds = rosChannel<SoundRequest>("/robotsound");
  const std::vector<std::string> files = {"/no/such/a.abcdef", "/no/such/a.abcdefg",
                                          "/no/such/a.a b"};
  std::map<std::string, std::string> kept;
  for (const std::string& file : files) {
    record(sounds, 100, rosBytes(playFile(file)));
    kept["file://" + file] = file;
  }
  playWith(kept);
  const std::vector<std::string> extensions = {".abcdef", "", ""};
  for (std::size_t i = 0; i < files.size(); ++i) {
    EXPECT_EQ(test::fileBytes(said(i).arg), files[i]);
    EXPECT_EQ(std::filesystem::path(said(i).arg).extension(), extensions[i]);
  }
}

TEST_F(MediaSinkTest, writesAFileAnewThatAFullDiskHadCutOff) {
  record(rosChannel<SoundRequest>("/robotsound"), 100, rosBytes(playFile("/no/such/tone.wav")));
  playWith({{"file:///no/such/tone.wav", "tone"}});
  std::ofstream(said(0).arg) << "to";
  playWith({{"file:///no/such/tone.wav", "tone"}});
  EXPECT_EQ(test::fileBytes(said(0).arg), "tone");
  playWith({{"file:///no/such/tone.wav", "tone"}});
  EXPECT_EQ(test::fileBytes(said(0).arg), "tone");
}

TEST_F(MediaSinkTest, tellsAheadWhatIsSaidEachOnceAndSixtySentencesAtMost) {
  SoundRequest request = playFile("tone");
  record(rosChannel<SoundRequest>("/robotsound"), 100, rosBytes(request));
  request.sound = SoundRequest::SAY;
  for (int i = 0; i < 130; ++i) {
    request.arg = std::to_string(i / 2);
    record(rosChannel<SoundRequest>("/robotsound"), 100 + i, rosBytes(request));
  }
  playWith({});
  const auto sentences = sentencesOf(*store, plan);
  ASSERT_EQ(sentences.size(), 60u);
  EXPECT_EQ(sentences.front().arg, "0");
  EXPECT_EQ(sentences.back().arg, "59");
}

TEST_F(MediaSinkTest, goesOnWithoutWhatIsLostAndSaysSo) {
  const Channel sounds = rosChannel<SoundRequest>("/robotsound");
  record(sounds, 100, rosBytes(playFile("/no/such/tone.wav")));
  record(sounds, 200, rosBytes(playFile("/no/such/other.wav")));
  record(sounds, 300, rosBytes(playFile("/no/such/other.wav")));
  playWith({{"file:///no/such/tone.wav", ""}});  // the store has lost its contents
  EXPECT_TRUE(report.is_complete);
  EXPECT_EQ(said(0).arg, "/no/such/tone.wav");
  EXPECT_EQ(sink.on("/robotsound").size(), 3u);
  ASSERT_EQ(notes.size(), 2u);
  EXPECT_EQ(notes[0],
            "'file:///no/such/tone.wav' is lost: not on this machine, and the store has lost it");
  EXPECT_EQ(notes[1],
            "'file:///no/such/other.wav' is lost: neither on this machine nor in the store");
}

}  // namespace
}  // namespace afterglow::nodes::media_sink_test
