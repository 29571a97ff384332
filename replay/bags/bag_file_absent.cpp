// Stands in for bag_import.cpp and bag_export.cpp where rosbag_storage is not installed.
#include "replay/bags/bag_file.hpp"

namespace afterglow::replay {
namespace {

[[noreturn]] void refuse(const std::string& path) {
  throw BagError(path + ": this build reads and writes no bags: rosbag_storage was not found");
}

}  // namespace

BagImportResult importBags(const std::vector<std::string>& paths, Store&, const BagImport&) {
  refuse(paths.front());
}

BagExportResult exportBags(const Store&, const std::vector<Behavior>&, const MessageRange&,
                           const std::string& path, const BagExport&) {
  refuse(path);
}

}  // namespace afterglow::replay
