#include "replay/ros2/twist_stamp.hpp"

#include <cstdint>

#include "replay/messages/wire.hpp"

namespace afterglow::replay {
namespace {

constexpr const char* kTwist = "geometry_msgs/Twist";
constexpr const char* kTwistStamped = "geometry_msgs/TwistStamped";
constexpr std::size_t kTwistSize = 6 * sizeof(double);
constexpr std::size_t kHeaderSize = 4 * sizeof(std::uint32_t);  ///< of an empty frame's
constexpr std::int64_t kSecond_ns = 1'000'000'000;

}  // namespace

std::string otherTwist(const std::string& ros1_type) {
  if (ros1_type == kTwist) return kTwistStamped;
  return ros1_type == kTwistStamped ? kTwist : "";
}

Bytes toOtherTwist(const std::string& ros1_type, const Bytes& bytes, Stamp now) {
  const bool is_bare = ros1_type == kTwist;
  std::size_t header = 0;
  if (!is_bare) {
    header = kHeaderSize;
    if (bytes.size() >= header) header += loadNumber<std::uint32_t>(&bytes[header - 4]);
  }
  if (bytes.size() != header + kTwistSize) {
    throw MessageError(std::to_string(bytes.size()) + " bytes are no " + ros1_type);
  }
  const auto twist = bytes.begin() + static_cast<std::ptrdiff_t>(header);
  if (!is_bare) return {twist, bytes.end()};
  Bytes stamped(kHeaderSize);
  storeNumber(&stamped[4], static_cast<std::uint32_t>(now.ns / kSecond_ns));
  storeNumber(&stamped[8], static_cast<std::uint32_t>(now.ns % kSecond_ns));
  stamped.insert(stamped.end(), twist, bytes.end());
  return stamped;
}

}  // namespace afterglow::replay
