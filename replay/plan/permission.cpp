#include "replay/plan/permission.hpp"

#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <string_view>

namespace afterglow::replay {
namespace {

/// The verdicts with the owner's permission, and without it.
struct PermissionCell {
  Verdict allowed, otherwise;
  std::string_view words;
};

constexpr PermissionCell kYes{Verdict::Publish, Verdict::Publish, "yes"};
constexpr PermissionCell kNo{Verdict::LeaveOut, Verdict::LeaveOut, "no"};
constexpr PermissionCell kMay{Verdict::Publish, Verdict::LeaveOut, "if motion is allowed"};
constexpr PermissionCell kMust{Verdict::Publish, Verdict::AskOwner, "motion has to be allowed"};
constexpr PermissionCell kMayTold{Verdict::Warn, Verdict::LeaveOut,
                                  "if motion is allowed, with a warning"};
constexpr PermissionCell kMustTold{Verdict::Warn, Verdict::AskOwner,
                                   "motion has to be allowed, with a warning"};
constexpr PermissionCell kNever{Verdict::Refuse, Verdict::Refuse, "refused"};

using PermissionCells = std::array<PermissionCell, 4>;  // by NamedBy

struct PermissionRow {
  std::string_view words;
  PermissionCells robot, elsewhere;  // by ReplayPlace
};

/// The table's rows by TopicKind.
constexpr std::array<PermissionRow, 7> kPermissions{{
    {"body", {kMust, kMust, kMust, kMust}, {kNo, kNo, kMay, kMust}},
    {"motion that is played by name alone", {kNo, kNo, kMay, kMust}, {kNo, kNo, kMay, kMust}},
    {"shown", {kNo, kYes, kYes, kYes}, {kYes, kYes, kYes, kYes}},
    {"other", {kNo, kNo, kMay, kMust}, {kYes, kYes, kYes, kYes}},
    {"control input", {kNo, kNo, kMayTold, kMustTold}, {kNo, kNo, kMayTold, kMustTold}},
    {"endless motion", {kNo, kNever, kNever, kNever}, {kNo, kNo, kNever, kNever}},
    {"no topic, or what the replay obeys", {kNo, kNo, kNever, kNever}, {kNo, kNo, kNever, kNever}},
}};

const PermissionCells& cellsOf(const PermissionRow& row, ReplayPlace place) {
  return place == ReplayPlace::Robot ? row.robot : row.elsewhere;
}

std::string line(std::string_view words, const PermissionCells& cells) {
  std::string text = "| " + std::string(words) + " |";
  for (const PermissionCell& cell : cells) text += " " + std::string(cell.words) + " |";
  return text + "\n";
}

}  // namespace

Verdict verdictOf(const PermissionCase& topic) {
  const PermissionRow& row = kPermissions[static_cast<std::size_t>(topic.kind)];
  const PermissionCell& cell =
      cellsOf(row, topic.place)[static_cast<std::size_t>(topic.named_by)];
  return topic.is_motion_allowed ? cell.allowed : cell.otherwise;
}

std::string permissionTable() {
  std::string text =
      "| class | named by nobody | by the recording, or a projector | by the robot's owner | by who "
      "replays |\n|---|---|---|---|---|\n";
  for (const PermissionRow& row : kPermissions) text += line(row.words, row.robot);
  text += "| *where no robot is live:* | | | | |\n";
  for (const PermissionRow& row : kPermissions) text += line(row.words, row.elsewhere);
  return text;
}

std::string someOf(const std::vector<std::string>& names, std::size_t most) {
  if (names.size() <= most) return fmt::format("{}", fmt::join(names, ", "));
  const auto end = names.begin() + static_cast<std::ptrdiff_t>(most);
  return fmt::format("{} and {} more", fmt::join(names.begin(), end, ", "), names.size() - most);
}

}  // namespace afterglow::replay
