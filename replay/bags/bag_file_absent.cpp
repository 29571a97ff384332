// Stands in for bag_file.cpp where rosbag_storage is not installed.
#include "replay/bags/bag_file.hpp"

namespace afterglow::replay {
namespace {

[[noreturn]] void refuse(const std::string& path) {
  throw BagError(path + ": this build reads and writes no bags: rosbag_storage was not found");
}

}  // namespace

BagImportResult importBag(const std::string& path, Store&, const BagImport&) { refuse(path); }

std::uint64_t exportBag(const Store&, const Behavior&, const MessageRange&, const std::string& path,
                        const BagProgress&) {
  refuse(path);
}

}  // namespace afterglow::replay
