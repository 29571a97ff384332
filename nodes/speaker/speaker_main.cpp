#include <ros/ros.h>

#include <exception>
#include <iostream>
#include <string>

#include "nodes/speaker/sound.hpp"
#include "nodes/speaker/speaker_node.hpp"
#include "nodes/speaker/speech.hpp"
#include "nodes/tools/node_help.hpp"
#include "nodes/tools/registration.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace {

/// speaker_node --wav FILE VOICE TEXT: for films of what was said; needs no master.
bool writesSpeech(int argc, char** argv) {
  if (argc != 5 || std::string(argv[1]) != "--wav") return false;
  afterglow::nodes::SpeechOptions options;
  options.engine = "auto";
  afterglow::nodes::Speech speech(options);
  afterglow::nodes::writeWav(argv[2], *speech.say(argv[4], argv[3]));
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (writesSpeech(argc, argv)) return 0;
  } catch (const std::exception& error) {
    std::cerr << "speaker_node: " << error.what() << "\n";
    return 1;
  }
  const bool is_helped = afterglow::nodes::answersHelp(
      argc, argv, "speaker_node", "speaks and plays what /robotsound asks for.",
      "speaker.launch");
  if (is_helped) return 0;
  try {
    afterglow::nodes::requireMaster(argc, argv);
    ros::init(argc, argv, "speaker_node");
    afterglow::nodes::SpeakerNode node{ros::NodeHandle(), ros::NodeHandle("~")};
    const afterglow::nodes::Registration registration;
    ros::spin();
    node.stop();
  } catch (const std::exception& error) {
    std::cerr << "speaker_node: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
