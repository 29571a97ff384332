/// \file
/// How far a spool's sender is behind. Whoever holds a Store asks it with
/// dynamic_cast<const SpoolStatusSource*>(store): null if the store writes without a spool.
#pragma once

#include <cstdint>
#include <string>

namespace afterglow::replay {

struct SpoolStatus {
  std::uint64_t unsent_messages = 0;
  std::uint64_t unsent_bytes = 0;  ///< on this machine's disk, with everything else that waits
  std::string last_error;          ///< why the last attempt failed; empty: all is well
};

class SpoolStatusSource {
 public:
  virtual ~SpoolStatusSource() = default;
  virtual SpoolStatus spoolStatus() const = 0;
};

}  // namespace afterglow::replay
