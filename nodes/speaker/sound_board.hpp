/// \file
/// The sounds that are playing: the rules of sound_play's topic (soundplay_node.py), without ROS
/// and without a clock of their own, and the machine's loudspeaker.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "nodes/speaker/sound.hpp"

namespace afterglow::nodes {

/// An instant on both clocks: events are logged in ROS time, durations are in steady time.
struct SoundTime {
  std::int64_t ros_ns = 0;
  std::int64_t steady_ns = 0;
};

/// The sound that a request names. Each sound plays once at a time; other sounds may overlap it.
struct SoundKey {
  int sound = 0;          ///< SoundRequest's constant: SAY, PLAY_FILE
  std::string arg, arg2;  ///< text and voice, or path and package
  friend bool operator==(const SoundKey& a, const SoundKey& b) {
    return a.sound == b.sound && a.arg == b.arg && a.arg2 == b.arg2;
  }
};

struct PlayingSound {
  int id = 0;  ///< counts from 1; a restarted sound has a new one
  SoundKey key;
  std::shared_ptr<const Sound> sound;
  double volume = 1;  ///< 0..1
  bool loop = false;
  SoundTime onset;
  std::int64_t pass_end_ns = 0;  ///< steady
};

/// Plays sounds.
class SoundOutput {
 public:
  virtual ~SoundOutput() = default;
  /// Plays a sound once from its beginning; for a loop it is called for every pass.
  virtual void start(const PlayingSound& playing) = 0;
  /// Stops the sound; also called for sounds that have just ended by themselves.
  virtual void stop(const PlayingSound& playing) = 0;
};

/// Rules of playing sounds, for one thread. `output` must outlive it.
class SoundBoard {
 public:
  using Started = std::function<void(const PlayingSound&)>;
  using Ended = std::function<void(const PlayingSound&, double heard_s)>;

  SoundBoard(SoundOutput& output, Started started, Ended ended);

  /// Restarts the sound if it is playing. A volume outside 0..1 is clamped.
  void play(const SoundKey& key, std::shared_ptr<const Sound> sound, bool loop, double volume,
            SoundTime now);
  void stop(const SoundKey& key, SoundTime now);
  void stopAll(SoundTime now);
  /// Ends sounds that are over and starts the next pass of loops; call it often while sounds play.
  void advance(SoundTime now);

  const std::vector<PlayingSound>& playing() const { return playing_; }  ///< oldest first

 private:
  void end(const PlayingSound& playing, SoundTime now);

  SoundOutput& output_;
  Started started_;
  Ended ended_;
  std::vector<PlayingSound> playing_;
  int next_id_ = 1;
};

/// Plays sounds; without a program or a device it stays silent and says so; everything else goes
/// on, and the device is tried again with the next sound.
class SoundDevice : public SoundOutput {
 public:
  /// `program`: "aplay", "paplay" or another that plays the WAV file named last on its command
  /// line; "" takes the first of the two that is installed.
  explicit SoundDevice(const std::string& program = "");
  ~SoundDevice() override;
  SoundDevice(const SoundDevice&) = delete;
  SoundDevice& operator=(const SoundDevice&) = delete;

  void start(const PlayingSound& playing) override;
  void stop(const PlayingSound& playing) override;
  /// Returns why nothing can be heard, as far as is known; empty: all is well. Call it often: it
  /// also notices players that failed.
  std::string problem();

 private:
  void note(int status);
  std::string fileFor(const PlayingSound& playing) const;

  std::string program_;  ///< empty: silent for good
  std::string folder_;   ///< folder of WAV files in use
  int messages_fd_ = -1;
  std::map<int, pid_t> players_;  ///< players by the sound's id
  std::string problem_;
};

}  // namespace afterglow::nodes
