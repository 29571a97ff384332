/// \file
/// --help of nodes: roscpp leaves it to them, and a node that begins its work instead surprises.
/// C++14, as afterglow_guard is built on robots with old systems, too.
#pragma once

#include <cstring>
#include <iostream>
#include <string>

namespace afterglow {
namespace nodes {

/// If it is asked for: prints what the node does and where its parameters are explained, and is
/// true. `launch`: its launch file; empty: none.
inline bool answersHelp(int argc, char** argv, const std::string& name, const std::string& does,
                        const std::string& launch) {
  bool is_asked = false;
  for (int i = 1; i < argc; ++i) {
    is_asked = is_asked || std::strcmp(argv[i], "--help") == 0 || std::strcmp(argv[i], "-h") == 0;
  }
  if (!is_asked) return false;
  std::cout << name << " " << does << "\n\nusage: " << name
            << " [_PARAMETER:=VALUE ...] [TOPIC:=OTHER_TOPIC ...] [__name:=NAME]\n";
  if (!launch.empty()) {
    std::cout << "   or: roslaunch afterglow " << launch << " [ARGUMENT:=VALUE ...]\n\n"
              << "roslaunch --ros-args afterglow " << launch << " explains its parameters;\n"
              << "nodes/README.md its topics, services and actions, too.\n";
  }
  return true;
}

}  // namespace nodes
}  // namespace afterglow
