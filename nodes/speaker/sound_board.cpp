#include "nodes/speaker/sound_board.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace afterglow::nodes {
namespace {

std::int64_t lengthOf(const Sound& sound) {
  return static_cast<std::int64_t>(std::llround(sound.seconds() * 1e9));
}

}  // namespace

SoundBoard::SoundBoard(SoundOutput& output, Started started, Ended ended)
    : output_(output), started_(std::move(started)), ended_(std::move(ended)) {}

void SoundBoard::play(const SoundKey& key, std::shared_ptr<const Sound> sound, bool loop,
                      double volume, SoundTime now) {
  stop(key, now);
  PlayingSound playing{next_id_++, key, std::move(sound), std::clamp(volume, 0.0, 1.0), loop,
                       now,        0};
  playing.pass_end_ns = now.steady_ns + lengthOf(*playing.sound);
  output_.start(playing);
  playing_.push_back(playing);
  started_(playing);
}

void SoundBoard::stop(const SoundKey& key, SoundTime now) {
  const auto same = [&](const PlayingSound& playing) { return playing.key == key; };
  const auto found = std::find_if(playing_.begin(), playing_.end(), same);
  if (found == playing_.end()) return;
  const PlayingSound ended = *found;
  playing_.erase(found);
  end(ended, now);
}

void SoundBoard::stopAll(SoundTime now) {
  for (const PlayingSound& playing : std::exchange(playing_, {})) end(playing, now);
}

void SoundBoard::advance(SoundTime now) {
  std::vector<PlayingSound> over;
  for (PlayingSound& playing : playing_) {
    if (now.steady_ns < playing.pass_end_ns) continue;
    if (playing.loop) {
      output_.stop(playing);
      output_.start(playing);
      const std::int64_t pass = std::max<std::int64_t>(lengthOf(*playing.sound), 1);
      // Whole passes from the onset: a late call must not make a loop drift.
      playing.pass_end_ns += ((now.steady_ns - playing.pass_end_ns) / pass + 1) * pass;
    } else {
      over.push_back(playing);
    }
  }
  const auto is_over = [&](const PlayingSound& playing) {
    return !playing.loop && now.steady_ns >= playing.pass_end_ns;
  };
  playing_.erase(std::remove_if(playing_.begin(), playing_.end(), is_over), playing_.end());
  for (const PlayingSound& playing : over) end(playing, now);
}

void SoundBoard::end(const PlayingSound& playing, SoundTime now) {
  output_.stop(playing);
  const double played_s = static_cast<double>(now.steady_ns - playing.onset.steady_ns) * 1e-9;
  ended_(playing, playing.loop ? played_s : std::min(played_s, playing.sound->seconds()));
}

}  // namespace afterglow::nodes
