/// \file
/// What a page asks to be replayed.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace afterglow::nodes {

struct PlayWish {
  std::int64_t behavior = 0;
  std::string only;  ///< "ar,speech"; empty: all
  double rate = 1;
  double start = 0;  ///< seconds into the behavior
  bool is_looping = false;

  /// Whether by its words alone nothing but light and speech is asked for.
  bool isWithoutBody() const;
  /// As the options of a goal (play_options.hpp).
  std::vector<std::string> options() const;
  /// The same text for the same wish.
  std::string key() const;
};

/// Of {"behavior": ID, "only":, "rate":, "start":, "loop":}. Throws HttpError 400 for what is none.
PlayWish readWish(const nlohmann::json& asked);

}  // namespace afterglow::nodes
