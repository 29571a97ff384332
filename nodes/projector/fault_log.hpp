/// \file
/// What a projector's log says of what /diagnostics counts: each fault when it is new, and now and
/// then while it goes on.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "nodes/projector/layer_state.hpp"

namespace afterglow::nodes {

/// Bounded as the reasons of layers are. One thread at a time.
class FaultLog {
 public:
  static constexpr std::int64_t kAgainNs = 30'000'000'000;  ///< between two lines on one fault

  /// Lines to be logged at this moment (of any clock that does not run backwards): problems that
  /// stand, and what layers dropped or found odd since they were last spoken of.
  std::vector<std::string> news(const std::vector<std::string>& problems,
                                const std::vector<LayerStatus>& layers, std::int64_t now_ns);

 private:
  struct Said {
    std::uint64_t count;
    std::int64_t at_ns;
  };
  void add(std::vector<std::string>& lines, const std::string& what,
           const std::map<std::string, std::uint64_t>& reasons, std::int64_t now_ns);

  std::map<std::string, Said> counted_;
  std::map<std::string, std::int64_t> standing_;  ///< problems, and when each was last said
};

}  // namespace afterglow::nodes
