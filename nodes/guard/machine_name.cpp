#include "nodes/guard/machine_name.hpp"

#include <unistd.h>

#include <fstream>

namespace afterglow {
namespace nodes {

std::string machineName() {
  std::string boot;
  std::ifstream file("/proc/sys/kernel/random/boot_id");
  std::getline(file, boot);
  // "net:[4026531840]": containers of one machine may have a network between them.
  char network[64];
  const ssize_t size = ::readlink("/proc/self/ns/net", network, sizeof network);
  if (boot.empty() || size <= 0) return "";
  return boot + " " + std::string(network, static_cast<std::size_t>(size));
}

}  // namespace nodes
}  // namespace afterglow
