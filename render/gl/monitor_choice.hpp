/// \file
/// The rule that finds the screen for a projector's window. Needs no display.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace afterglow::render {

/// Returns true if this process may open windows: an X or Wayland display is named in the
/// environment.
bool hasDisplay();

/// A screen as the desktop has it.
struct Monitor {
  std::string name;           ///< connector by RandR's name: "HDMI-1"
  std::string model;          ///< the monitor's own name; empty: unknown
  int x = 0, y = 0;           ///< px, its top left corner on the desktop
  int width = 0, height = 0;  ///< px, now
};

struct MonitorChoice {
  std::optional<std::size_t> monitor;  ///< index
  std::string problem;                 ///< the reason why there is no monitor, for people
};

/// The monitor, of those that are there with the primary one first, for images of a size.
/// `wanted` is a connector, a model or an index ("1"); empty: the last that is not the primary one,
/// else the only one. No monitor if the wanted one is absent, is one of several of that model, has
/// another resolution (light would land elsewhere), or is mirrored by another monitor.
MonitorChoice chooseMonitor(const std::vector<Monitor>& monitors, const std::string& wanted,
                            int width, int height);

/// The model in a monitor's EDID (VESA E-EDID 1.4, 3.10.3.4), or nothing.
std::string edidModel(const std::vector<std::uint8_t>& edid);

}  // namespace afterglow::render
