/// Says two sentences: speak.py in C++.
#include <ros/ros.h>
#include <sound_play/SoundRequest.h>
#include <afterglow/behavior_recording.hpp>

int main(int argc, char** argv) {
  ros::init(argc, argv, "example_speak");
  ros::NodeHandle node;
  ros::Publisher speech = node.advertise<sound_play::SoundRequest>("robotsound", 5);

  afterglow::nodes::RecordingOptions options{"speak", {speech.getTopic()}};
  options.tags = {"example"};
  afterglow::nodes::BehaviorRecording recording(options);
  for (const char* sentence :
       {"I am a robot that remembers.", "Ask me why I did something, and I show you."}) {
    sound_play::SoundRequest request;
    request.sound = sound_play::SoundRequest::SAY;
    request.command = sound_play::SoundRequest::PLAY_ONCE;
    request.volume = 1;
    request.arg = sentence;
    speech.publish(request);
    ros::Duration(3).sleep();
  }
  recording.succeed();
}
