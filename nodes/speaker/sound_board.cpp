#include "nodes/speaker/sound_board.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "nodes/tools/program.hpp"

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

SoundDevice::SoundDevice(const std::string& program) : program_(program) {
  for (const char* candidate : {"aplay", "paplay"}) {
    if (program_.empty() && hasProgram(candidate)) program_ = candidate;
  }
  if (program_.empty()) {
    problem_ = "neither aplay nor paplay is installed";
    return;
  }
  std::error_code no_folder;  // then the path is empty
  std::string pattern =
      (std::filesystem::temp_directory_path(no_folder) / "afterglow_sound.XXXXXX").string();
  messages_fd_ = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (messages_fd_ < 0 || no_folder || mkdtemp(pattern.data()) == nullptr) {
    program_.clear();
    problem_ = "no temporary folder";
    return;
  }
  folder_ = pattern;
}

SoundDevice::~SoundDevice() {
  for (const auto& [id, player] : players_) {
    ::kill(player, SIGTERM);
    waitForProgram(player);
  }
  if (messages_fd_ >= 0) ::close(messages_fd_);
  std::error_code ignored;
  if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
}

void SoundDevice::start(const PlayingSound& playing) {
  if (program_.empty()) return;
  try {
    writeWav(fileFor(playing), *playing.sound, playing.volume);
    players_[playing.id] = startProgram({program_, fileFor(playing)}, messages_fd_);
  } catch (const std::runtime_error& error) {
    problem_ = error.what();
  }
}

void SoundDevice::stop(const PlayingSound& playing) {
  const auto found = players_.find(playing.id);
  if (found == players_.end()) return;
  int status = 0;
  if (::waitpid(found->second, &status, WNOHANG) == 0) {
    ::kill(found->second, SIGTERM);
    waitForProgram(found->second);
    status = 0;  // it was playing
  }
  note(status);
  players_.erase(found);
  std::error_code ignored;
  std::filesystem::remove(fileFor(playing), ignored);
}

std::string SoundDevice::problem() {
  for (auto it = players_.begin(); it != players_.end();) {
    int status = 0;
    if (::waitpid(it->second, &status, WNOHANG) == 0) {
      ++it;
      continue;
    }
    note(status);
    it = players_.erase(it);
  }
  return problem_;
}

void SoundDevice::note(int status) {
  problem_ = status == 0 ? "" : program_ + " finds no sound device, or it is busy";
}

std::string SoundDevice::fileFor(const PlayingSound& playing) const {
  return folder_ + "/" + std::to_string(playing.id) + ".wav";
}

}  // namespace afterglow::nodes
