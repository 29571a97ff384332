/// \file
/// The difference between another machine's clock and this one's, asked of its time server (NTP:
/// chrony, ntpd, systemd-timesyncd does not answer) by one question. Source: RFC 4330 (SNTP),
/// sections 4 and 5.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace afterglow::nodes {

struct ClockOffset {
  std::int64_t ahead_ns = 0;    ///< the other clock is ahead of ours by so much
  std::int64_t at_most_ns = 0;  ///< and that is wrong by no more: half of the round trip
};

/// The best of up to 4 questions. Empty if no time server answers there within `seconds`, or it
/// says that its clock is not set.
std::optional<ClockOffset> askTimeServer(const std::string& host, double seconds,
                                         std::uint16_t port = 123);

/// Returns true if an address of that host is this machine's; false if the name is not known.
bool isThisMachine(const std::string& host);

}  // namespace afterglow::nodes
