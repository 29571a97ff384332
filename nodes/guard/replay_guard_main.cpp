// afterglow_replay_guard NODE-NAME: the watchdog beside a player, which starts it and is at the other
// end of its standard input (guard_socket.hpp).
#include <dirent.h>
#include <ros/ros.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "nodes/guard/guard_program.hpp"
#include "nodes/guard/guard_socket.hpp"
#include "nodes/guard/guarded_player.hpp"
#include "nodes/tools/stop_signal.hpp"

namespace afterglow {
namespace nodes {
namespace {

constexpr std::int64_t kRosLook = 200000000;  // ns; whether ROS still runs

/// The player's connections would stay open with this program after its death.
void closeInheritedFiles() {
  std::vector<int> files;
  DIR* folder = opendir("/proc/self/fd");
  while (const dirent* entry = folder ? readdir(folder) : nullptr) {
    const int fd = std::atoi(entry->d_name);
    if (fd > STDERR_FILENO && fd != dirfd(folder)) files.push_back(fd);
  }
  if (folder) closedir(folder);
  for (const int fd : files) close(fd);
}

/// The node's name in two parts, as ROS wants to be told them.
ros::M_string naming(const std::string& name) {
  const std::size_t slash = name.rfind('/');
  return {{"__name", name.substr(slash + 1)}, {"__ns", slash == 0 ? "/" : name.substr(0, slash)}};
}

void hear(GuardSocket& socket, ros::NodeHandle& node, GuardedPlayer& player) {
  for (GuardSocket::Packet packet; !(packet = socket.receive()).empty();) {
    GuardOutputs outputs;
    GuardBeat beat;
    if (GuardSocket::read(packet, outputs)) {
      player.know(outputs, GuardedPlayer::advertise(node, outputs, player.ways()),
                  replay::sinceBoot());
    } else if (GuardSocket::read(packet, beat)) {
      player.hear(beat, replay::sinceBoot());
    }
    socket.send(player.answer());
  }
}

/// Returns when the player has ended, or what it had in motion has been stopped.
void guard(GuardSocket& socket) {
  ros::NodeHandle node;
  GuardedPlayer player(true);
  while (!player.isOver() && ros::ok()) {
    hear(socket, node, player);
    const replay::SteadyTime now = replay::sinceBoot();
    if (socket.isClosed()) player.stop(now, "the player is gone");
    if (isStopRequested()) player.stop(now, "the watchdog was ended by " + stopRequest());
    if (player.step(now)) {
      socket.send(player.answer());  // a player that comes to life again must not drive on
      std::cerr << "afterglow_replay_guard: " << player.account() << "\n";
    }
    const std::int64_t wait_ns = std::min(player.deadline(), now.after(kRosLook)).ns - now.ns;
    if (player.isOver()) break;
    // A request that has been seen is no news.
    socket.wait(static_cast<int>(std::max<std::int64_t>(0, (wait_ns + 999999) / 1000000)),
                isStopRequested() ? -1 : stopRequestFd());
  }
}

}  // namespace
}  // namespace nodes
}  // namespace afterglow

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  if (argc != 2 || argv[1][0] == '-') {
    const bool is_asked = argc == 2 && std::string(argv[1]) == "--help";
    (is_asked ? std::cout : std::cerr) << "usage: afterglow_replay_guard NODE-NAME\n"
                                       << "started by players; their standard input is its link\n";
    return is_asked ? 0 : 2;
  }
  closeInheritedFiles();
  beginGuard();
  try {
    ros::init(naming(argv[1]), "replay_guard",
              ros::init_options::NoSigintHandler | ros::init_options::NoRosout);
    GuardSocket socket(STDIN_FILENO);
    guard(socket);
    ros::shutdown();
  } catch (const std::exception& error) {
    std::cerr << "afterglow_replay_guard: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
