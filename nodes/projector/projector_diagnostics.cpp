#include "nodes/projector/projector_diagnostics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "nodes/projector/dark_reasons.hpp"
#include "nodes/projector/light_offset.hpp"
#include "nodes/tools/diagnostics.hpp"

namespace afterglow::nodes {
namespace {

using diagnostic_msgs::DiagnosticStatus;

const std::string kOwnProblem = "projector: ";  // of a projector, not of the whole scene

/// A layer's light by the projector that shows most of it; empty: unknown.
std::optional<render::LayerCensus> lightOf(const ProjectorState& state, const std::string& topic) {
  std::optional<render::LayerCensus> best;
  for (const OutputState& output : state.outputs) {
    for (const render::LayerCensus& census : output.census) {
      if (census.name == topic && (!best || census.lit > best->lit)) best = census;
    }
  }
  return best;
}

/// Empty: it is the configured one, or unknown.
std::string otherType(const LayerStatus& layer) {
  if (!layer.source || layer.source->type.empty() || layer.source->type == layer.type) return "";
  return fmt::format("{} publishes {}, the configuration says {}",
                     fmt::join(layer.source->publishers, ", "), layer.source->type, layer.type);
}

/// Returns why a layer has nothing to show.
std::string emptyReason(const ProjectorState& state, const LayerStatus& layer) {
  if (layer.source && layer.source->publishers.empty()) return "nobody publishes it";
  const auto silent = state.silent_s.find(layer.topic);
  if (silent == state.silent_s.end()) return "no message yet";
  const std::string since = fmt::format("silent for {:.0f} s", silent->second);
  return layer.expired > 0 ? since + ", lifetimes are over" : since;
}

/// All layers together, as one projector's light reaches them.
render::LayerCensus sumOf(const std::vector<render::LayerCensus>& layers) {
  render::LayerCensus sum;
  for (const render::LayerCensus& layer : layers) {
    for (auto count : {&render::LayerCensus::drawables, &render::LayerCensus::lit,
                       &render::LayerCensus::outside, &render::LayerCensus::behind,
                       &render::LayerCensus::clipped, &render::LayerCensus::black,
                       &render::LayerCensus::transparent, &render::LayerCensus::flat,
                       &render::LayerCensus::blank, &render::LayerCensus::empty}) {
      sum.*count += layer.*count;
    }
  }
  return sum;
}

/// Level and words of a projector without problems.
void judgeLight(const ProjectorState& state, const OutputState& output, DiagnosticStatus& status) {
  std::size_t invisible = 0;
  for (const LayerStatus& layer : state.layers) invisible += layer.invisible;
  const render::LayerCensus sum = sumOf(output.census);
  status.level = DiagnosticStatus::OK;
  status.message = "projecting";
  if (output.census.empty() || sum.lit > 0) return;
  if (sum.drawables + invisible == 0) {
    status.message = "projecting nothing: no layer has anything to show";
    return;
  }
  status.level = DiagnosticStatus::WARN;
  status.message = "dark: " + lightWords(sum, invisible);
}

/// Light keeps off much of the image.
void judgeAvoidance(const OutputState& output, DiagnosticStatus& status) {
  constexpr double kAll = 0.999, kLittle = 0.005;
  const double share = output.avoided_share.value_or(0);
  if (share < kLittle) return;
  status.message += fmt::format("; {:.0f} % of the picture is kept dark ('avoid')", 100 * share);
  if (share > kAll) status.level = DiagnosticStatus::WARN;
}

/// The motion is not as predicted, or no latency is configured.
void judgeOffset(const OutputState& output, DiagnosticStatus& status) {
  constexpr double kMostOff_mm = 20;
  if (output.light_off_mm.value_or(0) <= kMostOff_mm) return;
  status.level = DiagnosticStatus::WARN;
  status.message += fmt::format("; it moves: light may be off by {:.0f} mm", *output.light_off_mm);
}

/// More to draw than time.
void judgeRate(const ProjectorState& state, DiagnosticStatus& status) {
  if (state.drawing_ms * state.wanted_hz <= 1000) return;
  status.level = DiagnosticStatus::WARN;
  status.message += fmt::format("; drawing takes {:.0f} ms: {:.0f} of {:.0f} images a second",
                                state.drawing_ms, state.drawn_hz, state.wanted_hz);
}

DiagnosticStatus projectorStatus(const ProjectorState& state, const OutputState& output) {
  DiagnosticStatus status;
  status.name = state.name + ": projector" + (output.name.empty() ? "" : " " + output.name);
  status.hardware_id = "projector";
  if (output.problems.empty()) {
    judgeLight(state, output, status);
    judgeRate(state, status);
    judgeOffset(output, status);
    judgeAvoidance(output, status);
  } else {
    // Problems of the projector itself come first and keep it dark.
    const bool is_dark = output.problems.front().rfind(kOwnProblem, 0) == 0;
    status.level = is_dark ? DiagnosticStatus::ERROR : DiagnosticStatus::WARN;
    status.message = output.problems.front();
  }
  addValue(status, "drawn_hz", fmt::format("{:.1f}", state.drawn_hz));
  addValue(status, "wanted_hz", fmt::format("{:.1f}", state.wanted_hz));
  addValue(status, "late", std::to_string(state.late));
  for (const auto& [stage, times] : state.stages) addValue(status, "time: " + stage, times);
  if (output.light_off_mm) {
    addValue(status, "light may be off",
             fmt::format("{:.1f} mm at {:.0f} m", *output.light_off_mm, LightOffset::kReach_m));
  }
  if (output.avoided_share) {
    addValue(status, "kept dark", fmt::format("{:.1f} %", 100 * *output.avoided_share));
  }
  if (!output.blending.empty()) addValue(status, "blending", output.blending);
  addValue(status, "renderer", output.renderer);
  if (!output.census.empty()) addValue(status, "light", lightWords(sumOf(output.census), 0));
  for (const render::TextureReport& texture : output.textures) {
    if (texture.lit > 0) addValue(status, "texture: " + texture.surface, textureWords(texture));
  }
  for (const std::string& problem : output.problems) addValue(status, "problem", problem);
  return status;
}

/// "reason, reason", of very many the first.
std::string reasonWords(const std::vector<std::string>& reasons) {
  constexpr std::size_t kMostSaid = 4;
  std::string words;
  for (std::size_t i = 0; i < std::min(reasons.size(), kMostSaid); ++i) words += ", " + reasons[i];
  if (reasons.size() > kMostSaid) {
    words += fmt::format(", and {} other reasons", reasons.size() - kMostSaid);
  }
  return words;
}

/// Judges what of a layer's darkness is known, and whether it is worth a warning.
void judgeLayer(const ProjectorState& state, const LayerStatus& layer, DiagnosticStatus& status) {
  const auto light = lightOf(state, layer.topic);
  const std::string type = otherType(layer);
  const std::size_t all = light ? light->drawables + layer.invisible : 0;
  const bool is_dark = light && all > 0 && light->lit == 0;
  const bool is_well = layer.dropped.empty() && layer.missing.empty() && type.empty();
  status.level = is_well && !is_dark ? DiagnosticStatus::OK : DiagnosticStatus::WARN;
  status.message = std::to_string(layer.shown) + " shown";
  if (!type.empty()) status.message += ", " + type;
  status.message += reasonWords(darkReasons(layer, light));
  const bool is_explained =
      !type.empty() || !layer.missing.empty() || !layer.nothing.empty() || !layer.source;
  if (layer.shown == 0 && !is_explained) status.message += ", " + emptyReason(state, layer);
  if (light) addValue(status, "light", lightWords(*light, layer.invisible));
}

DiagnosticStatus layerStatus(const ProjectorState& state, const LayerStatus& layer) {
  DiagnosticStatus status;
  status.name = state.name + ": " + layer.topic;
  status.hardware_id = "projector";
  judgeLayer(state, layer, status);
  addValue(status, "received", std::to_string(layer.received));
  addValue(status, "shown", std::to_string(layer.shown));
  addValue(status, "waiting", std::to_string(layer.waiting));
  const auto silent = state.silent_s.find(layer.topic);
  if (silent != state.silent_s.end()) {
    addValue(status, "silent_s", fmt::format("{:.0f}", silent->second));
  }
  if (layer.source) {
    addValue(status, "published_by", fmt::format("{}", fmt::join(layer.source->publishers, ", ")));
  }
  for (const auto& [reason, count] : layer.dropped) {
    addValue(status, "dropped: " + reason, std::to_string(count));
  }
  for (const auto& [reason, count] : layer.remarks) {
    addValue(status, "remark: " + reason, std::to_string(count));
  }
  return status;
}

/// The same while it stands, though its words count seconds.
std::string standingPart(const std::string& problem) {
  for (const std::string begins : {" is stale", ": stamped "}) {
    const std::size_t at = problem.find(begins);
    if (at != std::string::npos) return problem.substr(0, at + begins.size());
  }
  return problem;
}

}  // namespace

diagnostic_msgs::DiagnosticArray toDiagnostics(const ProjectorState& state) {
  diagnostic_msgs::DiagnosticArray array;
  for (const OutputState& output : state.outputs) {
    array.status.push_back(projectorStatus(state, output));
  }
  for (const LayerStatus& layer : state.layers) {
    array.status.push_back(layerStatus(state, layer));
  }
  return array;
}

// ------------------------------------------------------------------------------------------ log
void FaultLog::add(std::vector<std::string>& lines, const std::string& prefix,
                   const std::map<std::string, std::uint64_t>& reasons, std::int64_t now_ns) {
  for (const auto& [reason, count] : reasons) {
    const std::string line = prefix + reason;
    const auto [said, is_new] = counted_.try_emplace(line, Said{0, now_ns});
    if (count <= said->second.count) continue;
    if (!is_new && now_ns - said->second.at_ns < kAgainNs) continue;
    const std::uint64_t since = count - said->second.count;
    lines.push_back(since == 1 ? line : line + " (" + std::to_string(since) + " times)");
    said->second = {count, now_ns};
  }
}

std::vector<std::string> FaultLog::news(const std::vector<std::string>& problems,
                                        const std::vector<LayerStatus>& layers,
                                        std::int64_t now_ns) {
  std::vector<std::string> lines;
  for (auto it = standing_.begin(); it != standing_.end();) {
    it = now_ns - it->second >= kAgainNs ? standing_.erase(it) : std::next(it);
  }
  for (const std::string& problem : problems) {
    if (standing_.try_emplace(standingPart(problem), now_ns).second) lines.push_back(problem);
  }
  for (const LayerStatus& layer : layers) {
    add(lines, layer.topic + ": dropped: ", layer.dropped, now_ns);
    add(lines, layer.topic + ": shown, but odd: ", layer.remarks, now_ns);
  }
  return lines;
}

// ------------------------------------------------------------------------------------------ node
ProjectorDiagnostics::ProjectorDiagnostics(double wanted_hz)
    : wanted_hz_(wanted_hz), counted_at_(std::chrono::steady_clock::now()) {
  publisher_ = nh_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 2);
}

void ProjectorDiagnostics::countImage(std::chrono::steady_clock::duration drawing) {
  ++drawn_;
  drawing_ns_ += std::chrono::nanoseconds(drawing).count();
  if (std::chrono::duration<double>(drawing).count() * wanted_hz_ > 1) ++late_;
}

void ProjectorDiagnostics::publish(ProjectorState state,
                                   const std::optional<DiagnosticStatus>& watch) {
  const auto now = std::chrono::steady_clock::now();
  const std::uint64_t drawn = drawn_;
  state.name = ros::this_node::getName().substr(1);
  state.wanted_hz = wanted_hz_;
  state.drawn_hz = static_cast<double>(drawn - drawn_before_) /
                   std::chrono::duration<double>(now - counted_at_).count();
  const std::int64_t drawing_ns = drawing_ns_;
  if (drawn > drawn_before_) {
    state.drawing_ms = 1e-6 * static_cast<double>(drawing_ns - drawing_ns_before_) /
                       static_cast<double>(drawn - drawn_before_);
  }
  drawing_ns_before_ = drawing_ns;
  state.late = late_;
  drawn_before_ = drawn;
  counted_at_ = now;
  addSilences(state);
  log(state);
  diagnostic_msgs::DiagnosticArray array = toDiagnostics(state);
  if (watch) array.status.push_back(*watch);
  array.header.stamp = ros::Time::now();
  publisher_.publish(array);
}

void ProjectorDiagnostics::addSilences(ProjectorState& state) {
  for (const LayerStatus& layer : state.layers) {
    if (layer.received == 0) continue;
    const auto heard =
        heard_.try_emplace(layer.topic, Heard{layer.received, counted_at_}).first;
    if (heard->second.received != layer.received) heard->second = {layer.received, counted_at_};
    state.silent_s[layer.topic] =
        std::chrono::duration<double>(counted_at_ - heard->second.at).count();
  }
}

void ProjectorDiagnostics::log(const ProjectorState& state) {
  std::vector<std::string> problems;
  for (const auto& [name, renderer, of_image, census, off_mm, avoided, blending, textures] :
       state.outputs) {
    for (const std::string& problem : of_image) {
      const bool is_own = !name.empty() && problem.rfind(kOwnProblem, 0) == 0;
      problems.push_back(is_own ? "projector " + name + ": " + problem.substr(kOwnProblem.size())
                                : problem);
    }
  }
  for (const LayerStatus& layer : state.layers) {
    const std::string type = otherType(layer);
    if (!type.empty()) problems.push_back(layer.topic + ": " + type);
  }
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  const std::int64_t now_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
  for (const std::string& line : faults_.news(problems, state.layers, now_ns)) {
    ROS_WARN("%s", line.c_str());
  }
}

}  // namespace afterglow::nodes
