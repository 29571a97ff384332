// Stands in for rosbag_file.cpp where rosbag_storage is not installed.
#include "replay/bags/bag_file.hpp"
#include "replay/bags/export_file.hpp"

namespace afterglow::replay {

std::unique_ptr<ExportFile> writeRosbag(const std::string& path, Packing) {
  throw BagError(path + ": this build writes no bags, as rosbag_storage was not found; an MCAP " +
                 "file it does");
}

}  // namespace afterglow::replay
