/// \file
/// The machine's loudspeaker, through the player program it has (aplay or paplay).
#pragma once

#include <sys/types.h>

#include <map>
#include <string>

#include "nodes/speaker/sound_board.hpp"

namespace afterglow::nodes {

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
