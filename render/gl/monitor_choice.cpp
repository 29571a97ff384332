#include "render/gl/monitor_choice.hpp"

#include <fmt/format.h>

#include <cstdlib>

namespace afterglow::render {
namespace {

std::string listText(const std::vector<Monitor>& monitors) {
  std::vector<std::string> texts;
  for (const Monitor& monitor : monitors) {
    const std::string model = monitor.model.empty() ? "" : "'" + monitor.model + "' ";
    texts.push_back(fmt::format("{} '{}' {}{}x{}", texts.size(), monitor.name, model, monitor.width,
                                monitor.height));
  }
  return texts.empty() ? "none" : fmt::format("{}", fmt::join(texts, ", "));
}

MonitorChoice findMonitor(const std::vector<Monitor>& monitors, const std::string& wanted) {
  if (wanted.empty() && !monitors.empty()) return {monitors.size() - 1, ""};
  std::vector<std::size_t> of_model;
  for (std::size_t i = 0; i < monitors.size(); ++i) {
    if (wanted == monitors[i].name || wanted == std::to_string(i)) return {i, ""};
    if (wanted == monitors[i].model) of_model.push_back(i);
  }
  if (of_model.size() == 1) return {of_model.front(), ""};
  const std::string fault =
      of_model.empty() ? "no monitor '" + wanted + "'" : "several monitors '" + wanted + "'";
  return {std::nullopt, fault + "; there are: " + listText(monitors)};
}

bool overlap(const Monitor& a, const Monitor& b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

}  // namespace

bool hasDisplay() {
  const auto isSet = [](const char* name) {
    const char* value = std::getenv(name);
    return value != nullptr && *value != '\0';
  };
  return isSet("DISPLAY") || isSet("WAYLAND_DISPLAY");
}

MonitorChoice chooseMonitor(const std::vector<Monitor>& monitors, const std::string& wanted,
                            int width, int height) {
  MonitorChoice choice = findMonitor(monitors, wanted);
  if (!choice.monitor) return choice;
  const Monitor& chosen = monitors[*choice.monitor];
  if (chosen.width != width || chosen.height != height) {
    return {std::nullopt,
            fmt::format("monitor '{}' is set to {}x{} but the projector's lens is for {}x{}: set "
                        "the output to that resolution",
                        chosen.name, chosen.width, chosen.height, width, height)};
  }
  for (const Monitor& other : monitors) {
    if (&other != &chosen && overlap(other, chosen)) {
      return {std::nullopt, "monitor '" + chosen.name + "' shows what '" + other.name +
                                "' shows: extend the desktop instead of mirroring it"};
    }
  }
  return choice;
}

std::string edidModel(const std::vector<std::uint8_t>& edid) {
  constexpr std::size_t kFirst = 54, kSize = 18, kEnd = 126, kText = 5;
  for (std::size_t at = kFirst; at + kSize <= kEnd && at + kSize <= edid.size(); at += kSize) {
    const bool is_name = edid[at] == 0 && edid[at + 1] == 0 && edid[at + 3] == 0xfc;
    if (!is_name) continue;
    std::string name;
    for (std::size_t i = at + kText; i < at + kSize && edid[i] >= ' ' && edid[i] < 0x7f; ++i) {
      name += static_cast<char>(edid[i]);
    }
    while (!name.empty() && name.back() == ' ') name.pop_back();
    return name;
  }
  return {};
}

}  // namespace afterglow::render
