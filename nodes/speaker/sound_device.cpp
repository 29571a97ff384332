#include "nodes/speaker/sound_device.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <system_error>

#include "nodes/tools/program.hpp"

namespace afterglow::nodes {

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
