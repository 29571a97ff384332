// Files that people write and mail to each other. An input is the letter of a reader, and the file;
// every reader answers with "FILE:LINE: ..." or takes it.
#include <functional>
#include <map>
#include <stdexcept>
#include <string>

#include "calib/camera_info_file.hpp"
#include "calib/color/color.hpp"
#include "calib/color/texture.hpp"
#include "calib/mount/turret.hpp"
#include "calib/targets/target_files.hpp"
#include "nodes/observer/room_view.hpp"
#include "nodes/player/robot_file.hpp"
#include "nodes/projector/projector_config.hpp"
#include "nodes/tools/mount_poses.hpp"
#include "nodes/tools/tag_layout_file.hpp"
#include "tests/fuzz/memory_file.hpp"
#include "tests/fuzz/target.hpp"

namespace afterglow::fuzz::yaml_fuzz {
namespace {

const std::map<char, std::function<void(const std::string& path)>>& readers() {
  static const std::map<char, std::function<void(const std::string&)>> all = {
      {'b', calib::loadBoard},
      {'c', calib::loadCameraInfo},
      {'k',
       [](const std::string& path) { calib::colorToSend(calib::loadColor(path), {1, 99, 200}); }},
      {'l', nodes::readLimits},
      {'m', nodes::loadMountRecords},
      {'p', [](const std::string& path) { nodes::loadProjectorConfig(path, ""); }},
      {'r', nodes::readRobotProfile},
      {'s', calib::loadTexture},
      {'t', nodes::loadTagLayout},
      {'u', nodes::readRules},
      {'v', nodes::loadRoomView},
      {'w', calib::loadTurret},
      {'x', calib::loadPattern}};
  return all;
}

}  // namespace

AFTERGLOW_FUZZ_TARGET(yaml) {
  if (size == 0) return;
  const auto reader = readers().find(static_cast<char>(data[0]));
  if (reader == readers().end()) return;
  const MemoryFile file(data + 1, size - 1);
  try {
    reader->second(file.path());
  } catch (const std::runtime_error&) {
    // The right answer to most inputs.
  }
}

}  // namespace afterglow::fuzz::yaml_fuzz
