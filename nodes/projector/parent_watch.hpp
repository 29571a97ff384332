/// \file
/// Frames that several publishers hang below different parents: tf takes whichever spoke last, and
/// everything below such a frame jumps between two places.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace afterglow::nodes {

/// Bounded in frames. One thread at a time.
class ParentWatch {
 public:
  static constexpr std::int64_t kMemoryNs = 5'000'000'000;  ///< a parent not heard of is left

  /// A transform has come, at `now_ns` of any clock that does not run backwards. A static one
  /// replaces the static ones of its publisher.
  void note(const std::string& child, const std::string& parent, const std::string& publisher,
            bool is_static, std::int64_t now_ns);

  /// "frame 'arm' has two parents: 'map' (published by /a) and 'odom' (published by /b)", one line
  /// for each frame with several parents that are static or of the last seconds.
  std::vector<std::string> conflicts(std::int64_t now_ns) const;

 private:
  struct Link {
    std::string publisher;  ///< the last
    std::int64_t at_ns;     ///< the greatest value: static
  };
  std::map<std::string, std::map<std::string, Link>> links_;  ///< links by child and parent
};

}  // namespace afterglow::nodes
