#include <gtest/gtest.h>
#include <ros/ros.h>
#include <sound_play/SoundRequest.h>
#include <std_msgs/Float64.h>
#include <std_msgs/String.h>
#include <visualization_msgs/Marker.h>

#include <mutex>
#include <string>
#include <vector>

#include "nodes/speaker/sound.hpp"
#include "nodes/tools/program.hpp"
#include "tests/support/ros_master.hpp"

namespace afterglow::nodes::speaker_node_ros_test {
namespace {

using sound_play::SoundRequest;
using test::eventually;

const std::string kProgram = AFTERGLOW_TEST_SPEAKER_NODE;

/// Asks a running speaker_node to speak, and hears what it says of itself.
struct SpeakerNodeTest : ::testing::Test {
  test::TempFolder folder;
  ros::NodeHandle node;
  std::mutex mutex;
  std::vector<std::string> states;
  ros::Publisher requests = node.advertise<SoundRequest>("/robotsound", 10);
  ros::Subscriber subscriber =
      node.subscribe("/speaker_node/state", 10, &SpeakerNodeTest::onState, this);
  std::FILE* log = std::tmpfile();
  pid_t pid = startProgram(
      {kProgram, "__name:=speaker_node", "_player:=none", "_folder:=" + folder.path("speech")},
      fileno(log));

  void SetUp() override {
    ASSERT_TRUE(eventually([&] { return requests.getNumSubscribers() > 0 && heard("") == 1; }));
  }
  void TearDown() override {
    if (pid > 0) stop();
    std::fclose(log);
  }
  void onState(const std_msgs::String& state) {
    const std::lock_guard<std::mutex> lock(mutex);
    states.push_back(state.data);
  }
  std::size_t heard(const std::string& text) {
    const std::lock_guard<std::mutex> lock(mutex);
    return static_cast<std::size_t>(std::count(states.begin(), states.end(), text));
  }
  int stop() {
    int status = 0;
    kill(pid, SIGINT);
    waitpid(pid, &status, 0);
    pid = -1;
    return status;
  }
  void ask(int sound, int command, const std::string& arg, const std::string& arg2 = "",
           float volume = 1) {
    SoundRequest request;
    request.sound = static_cast<std::int8_t>(sound);
    request.command = static_cast<std::int8_t>(command);
    request.volume = volume;
    request.arg = arg;
    request.arg2 = arg2;
    requests.publish(request);
  }
  std::vector<Utterance> spoken() const { return readSpeechLog(folder.path("speech/speech.json")); }
};

TEST_F(SpeakerNodeTest, tellsWhenItSpeaksAndKeepsWhatItSaid) {
  const ros::Time before = ros::Time::now();
  ask(SoundRequest::SAY, SoundRequest::PLAY_ONCE, "Ok.", "voice_kal_diphone", 0.5f);
  ASSERT_TRUE(eventually([&] { return heard("Ok.") == 1; }));
  ASSERT_TRUE(eventually([&] { return heard("") == 2; })) << "it ends by itself";
  ASSERT_EQ(spoken().size(), 1u);
  const Utterance utterance = spoken()[0];
  EXPECT_EQ(utterance.text, "Ok.");
  EXPECT_EQ(utterance.voice, "voice_kal_diphone");
  EXPECT_EQ(utterance.volume, 0.5);
  EXPECT_GE(utterance.onset_ns, static_cast<std::int64_t>(before.toNSec()));
  EXPECT_LE(utterance.onset_ns, static_cast<std::int64_t>(ros::Time::now().toNSec()));
  EXPECT_DOUBLE_EQ(utterance.duration_s, readWav(utterance.file).seconds());
}

TEST_F(SpeakerNodeTest, goesOnAfterRequestsItCannotObey) {
  std::vector<std::string> problems;
  const ros::Subscriber hears = node.subscribe<std_msgs::String>(
      "/robotsound/problem", 10, [&](const std_msgs::StringConstPtr& problem) {
        const std::lock_guard<std::mutex> lock(mutex);
        problems.push_back(problem->data);
      });
  ASSERT_TRUE(eventually([&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return problems.size() == 1;
  }));
  ask(SoundRequest::SAY, SoundRequest::PLAY_ONCE, "Hello.", "nobody");
  ask(SoundRequest::SAY, SoundRequest::PLAY_ONCE, "");
  ask(SoundRequest::SAY, 17, "Hello.");
  ask(SoundRequest::SAY, SoundRequest::PLAY_ONCE, "Hello.", "", NAN);
  ask(SoundRequest::PLAY_FILE, SoundRequest::PLAY_ONCE, "/etc/passwd");
  ask(SoundRequest::PLAY_FILE, SoundRequest::PLAY_ONCE, "sound.wav", "no_such_package");
  ask(6, SoundRequest::PLAY_ONCE, "");  // built in are 1 to 5
  ask(SoundRequest::SAY, SoundRequest::PLAY_ONCE, "Still here.");
  EXPECT_TRUE(eventually([&] { return heard("Still here.") == 1; }));
  EXPECT_TRUE(eventually([&] { return spoken().size() == 1; }));
  EXPECT_TRUE(eventually([&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return problems.size() == 9;
  })) << "seven refusals, all is well before and after";
  EXPECT_EQ(problems.back(), "");
  EXPECT_EQ(
      std::count(problems.begin(), problems.end(), "no package no_such_package for sound.wav"), 1);
}

TEST_F(SpeakerNodeTest, playsFilesAndStopsThem) {
  writeWav(folder.path("tone.wav"), Sound{8000, 1, std::vector<std::int16_t>(80'000, 999)});
  const std::string file = "file://" + folder.path("tone.wav");
  ask(SoundRequest::PLAY_FILE, SoundRequest::PLAY_ONCE, file);
  ASSERT_TRUE(eventually([&] { return spoken().size() == 1; }));
  EXPECT_EQ(spoken()[0].duration_s, 10);
  EXPECT_EQ(spoken()[0].text, "");
  ask(SoundRequest::PLAY_FILE, SoundRequest::PLAY_STOP, file);
  EXPECT_TRUE(eventually([&] { return spoken()[0].duration_s < 10; }));
}

TEST_F(SpeakerNodeTest, loopsUntilAllIsStopped) {
  ask(SoundRequest::SAY, SoundRequest::PLAY_START, "Again.");
  ASSERT_TRUE(eventually([&] { return spoken().size() == 1; }));
  const double pass = spoken()[0].duration_s;
  const ros::Time begin = ros::Time::now();
  ASSERT_TRUE(eventually([&] { return (ros::Time::now() - begin).toSec() > 1.5 * pass; }));
  ask(SoundRequest::ALL, SoundRequest::PLAY_STOP, "");
  EXPECT_TRUE(eventually([&] { return spoken()[0].duration_s > 1.4 * pass; }));
  EXPECT_TRUE(spoken()[0].loop);
  EXPECT_TRUE(eventually([&] { return heard("") == 2; }));
}

TEST_F(SpeakerNodeTest, notesHowLongItSpokeWhenItIsStopped) {
  ask(SoundRequest::SAY, SoundRequest::PLAY_ONCE,
      "This is a sentence that is so long that nobody will ever hear the end of it.");
  ASSERT_TRUE(eventually([&] { return spoken().size() == 1; }));
  const double whole = spoken()[0].duration_s;
  EXPECT_EQ(stop(), 0);
  EXPECT_LT(spoken()[0].duration_s, whole);
}

TEST_F(SpeakerNodeTest, playsTheBuiltInSounds) {
  ask(SoundRequest::BACKINGUP, SoundRequest::PLAY_START, "");
  ask(SoundRequest::NEEDS_PLUGGING_BADLY, SoundRequest::PLAY_ONCE, "");
  ASSERT_TRUE(eventually([&] { return spoken().size() == 2; }));
  EXPECT_TRUE(spoken()[0].loop);
  EXPECT_GT(spoken()[1].duration_s, spoken()[0].duration_s);
}

TEST_F(SpeakerNodeTest, hasPreparedWhatItIsToldAheadAndTellsHowLongItTakes) {
  std::vector<double> durations;
  const ros::Subscriber hears = node.subscribe<std_msgs::Float64>(
      "/speaker_node/duration", 10, [&](const std_msgs::Float64ConstPtr& duration) {
        const std::lock_guard<std::mutex> lock(mutex);
        durations.push_back(duration->data);
      });
  ros::Publisher ahead = node.advertise<SoundRequest>("/robotsound/ahead", 10);
  ASSERT_TRUE(eventually([&] { return ahead.getNumSubscribers() > 0; }));
  SoundRequest request;
  request.sound = SoundRequest::SAY;
  request.arg = "Please hand me the gearbox bottom that lies on the table.";
  ahead.publish(request);
  EXPECT_TRUE(spoken().empty()) << "it is only prepared";
  ask(SoundRequest::SAY, SoundRequest::PLAY_ONCE, request.arg);
  ASSERT_TRUE(eventually([&] { return spoken().size() == 1; }));
  ASSERT_TRUE(eventually([&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return !durations.empty() && durations.back() > 0;
  }));
  EXPECT_DOUBLE_EQ(durations.back(), spoken()[0].duration_s);
}

TEST_F(SpeakerNodeTest, isSilentWhileSoundPlaySpeaks) {
  const auto isLogged = [&](const std::string& text) {
    return eventually([&] {
      std::string all(1 << 16, '\0');
      const ssize_t size = pread(fileno(log), all.data(), all.size(), 0);
      all.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
      return all.find(text) != std::string::npos;
    });
  };
  // It only has the name.
  const pid_t other = startProgram({kProgram, "__name:=soundplay_node", "_player:=none"}, -1);
  EXPECT_TRUE(isLogged("sound_play (/soundplay_node) speaks what /robotsound says"));
  ask(SoundRequest::SAY, SoundRequest::PLAY_ONCE, "Once.");
  ASSERT_TRUE(eventually([&] { return spoken().size() == 1; }));
  EXPECT_EQ(spoken()[0].volume, 0);
  kill(other, SIGKILL);
  waitpid(other, nullptr, 0);
  EXPECT_TRUE(isLogged("sound_play is gone: this node speaks"));
  ask(SoundRequest::SAY, SoundRequest::PLAY_ONCE, "Again.");
  ASSERT_TRUE(eventually([&] { return spoken().size() == 2; }));
  EXPECT_EQ(spoken()[1].volume, 1);
}

TEST(SpeakerNode, saysWhyNothingIsHeardAndItsCaptionsGoOn) {
  ros::NodeHandle node;
  std::mutex mutex;
  std::string problem;
  std::vector<std::string> captions;
  const ros::Subscriber problems = node.subscribe<std_msgs::String>(
      "/robotsound/problem", 10, [&](const std_msgs::StringConstPtr& text) {
        const std::lock_guard<std::mutex> lock(mutex);
        problem = text->data;
      });
  const ros::Subscriber markers = node.subscribe<visualization_msgs::Marker>(
      "/caption", 10, [&](const visualization_msgs::MarkerConstPtr& marker) {
        const std::lock_guard<std::mutex> lock(mutex);
        captions.push_back(marker->action == visualization_msgs::Marker::ADD ? marker->text : "-");
      });
  ros::Publisher requests = node.advertise<SoundRequest>("/robotsound", 10);
  std::FILE* log = std::tmpfile();
  const pid_t pid = startProgram({kProgram, "__name:=unheard", "_player:=/bin/false",
                                  "_caption_topic:=/caption", "_caption_line:=12"},
                                 fileno(log));
  ASSERT_TRUE(eventually(
      [&] { return requests.getNumSubscribers() == 1 && markers.getNumPublishers() == 1; }));
  SoundRequest request;
  request.sound = SoundRequest::SAY;
  request.command = SoundRequest::PLAY_ONCE;
  request.volume = 1;
  request.arg = "I am quite hoarse.";
  requests.publish(request);
  EXPECT_TRUE(eventually([&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return problem == "/bin/false finds no sound device, or it is busy" && captions.size() == 2;
  })) << problem;
  EXPECT_EQ(captions, (std::vector<std::string>{"I am quite\nhoarse.", "-"}));
  kill(pid, SIGINT);
  waitpid(pid, nullptr, 0);
  std::fclose(log);
}

}  // namespace
}  // namespace afterglow::nodes::speaker_node_ros_test

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  const afterglow::test::RosMaster master;
  ros::init(argc, argv, "speaker_test", ros::init_options::NoSigintHandler);
  ros::NodeHandle node;
  ros::AsyncSpinner spinner(1);
  spinner.start();
  return RUN_ALL_TESTS();
}
