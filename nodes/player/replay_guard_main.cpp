// afterglow_replay_guard NODE-NAME: started by a player (guard_process.hpp), which is at the other
// end of its standard input.
#include <dirent.h>
#include <ros/ros.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "nodes/player/realtime.hpp"
#include "nodes/player/replay_guard.hpp"
#include "nodes/tools/stop_signal.hpp"

namespace {

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

}  // namespace

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  if (argc != 2 || argv[1][0] == '-') {
    const bool is_asked = argc == 2 && std::string(argv[1]) == "--help";
    (is_asked ? std::cout : std::cerr) << "usage: afterglow_replay_guard NODE-NAME\n"
                                       << "started by players; their standard input is its link\n";
    return is_asked ? 0 : 2;
  }
  closeInheritedFiles();
  std::signal(SIGPIPE, SIG_IGN);
  // First the robot, then this program, however often it is told to end.
  catchStopSignals(SecondSignal::IsIgnored);
  catchShutdownRequests();
  try {
    RealtimeScope realtime;  // a busy machine must not hold it up, nor make it see a stall
    ros::init(naming(argv[1]), "replay_guard",
              ros::init_options::NoSigintHandler | ros::init_options::NoRosout);
    ros::NodeHandle node;
    GuardLink link(STDIN_FILENO);
    ReplayGuard guard(link);
    realtime.extend();
    guard.run();
    ros::shutdown();
  } catch (const std::exception& error) {
    std::cerr << "afterglow_replay_guard: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
