/// \file
/// What a dry run gives to who may let the robot move: one-use, of one wish, for a minute.
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <mutex>
#include <optional>
#include <string>

namespace afterglow::nodes {

/// Any thread. Pure but for the randomness of tokens: times are given.
class MotionTokens {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::seconds kLifetime{60};
  static constexpr std::size_t kMost = 64;  ///< the oldest go

  /// What a dry run of the wish of this key found.
  struct Found {
    std::string key;
    bool moves = false;
  };

  std::string make(Found found, Time now);
  /// Takes it: a second time there is none. Empty: it is unknown, or too old.
  std::optional<Found> take(const std::string& token, Time now);

 private:
  struct Made {
    Found found;
    Time at;
  };
  void forgetOld(Time now);

  std::mutex mutex_;
  std::map<std::string, Made> made_;
};

}  // namespace afterglow::nodes
