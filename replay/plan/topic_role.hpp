/// \file
/// The role of a recorded topic in a replay: who would act on it if it was published again, and to
/// which of the three modalities it belongs. The names are in assets/topics.yaml; a topic that is
/// not known to be harmless is not published unless it is named (permission.hpp).
///
/// The wishes for a replay modality by modality: how much earlier its messages go out, and what
/// becomes of the replay when it fails.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "replay/plan/motion_stop.hpp"

namespace afterglow::replay {

/// The body moves, light is drawn on the world, speech is heard.
enum class Modality { Body, Ar, Speech };

constexpr Modality kModalities[] = {Modality::Body, Modality::Ar, Modality::Speech};

/// "body", "ar", "speech".
std::string_view name(Modality modality);
/// Empty for other words.
std::optional<Modality> modalityCalled(std::string_view word);

/// `topic` absolute, `type` "package/Type". Topics that neither move a robot nor speak are Ar.
Modality modalityOf(std::string_view topic, std::string_view type);

/// The effect of a topic, by who would act on it.
enum class TopicClass {  // the strictest first
  Endless,  ///< a robot moves or may move, and nothing stops it that is known: never published
  Control,  ///< a robot obeys: the input of an operator, a runstop or a safety device
  Other,    ///< unknown
  Body,     ///< a robot moves, and the player knows how to stop it
  Shown     ///< people see or hear it, if a recording or a projector's layer asks for it
};

/// "body", "shown", "control input", "endless motion", "other".
std::string_view name(TopicClass topic_class);
/// Returns the words of profiles and the table's file: "body", "shown", "control", "endless",
/// "other".
const std::vector<std::pair<std::string, TopicClass>>& topicClassWords();

struct TopicRole {
  TopicClass topic_class = TopicClass::Other;
  std::string why;                 ///< a clause for people
  StopKind stop = StopKind::None;  ///< stop of what moves a robot
};

/// Topics by their last names and their types, as patterns: `*` stands for any characters.
struct TopicPattern {
  std::vector<std::string> names;        ///< names for isCalled(); empty: any
  std::vector<std::string> types;        ///< "package/Type"; empty: any
  std::vector<std::string> other_types;  ///< types that are not meant

  bool holds(std::string_view topic, std::string_view type) const;
};

struct TopicRow : TopicPattern {
  TopicRole role;
  bool is_by_name = false;  ///< true: of the body, but played only if whoever replays names it
  bool is_behind = false;   ///< the base itself, behind its multiplexer
  bool is_motion = false;   ///< tells how motion is stopped
};

/// Last names of a goal, and behind the same namespace of what it is known to cause.
struct KnownNesting {
  std::string higher, lower;
  bool is_velocity = false;
};

/// A file such as assets/topics.yaml, which explains its keys.
struct TopicTable {
  std::vector<TopicRow> rows;  ///< the first that fits counts
  std::vector<std::pair<TopicPattern, Modality>> modalities;
  std::vector<KnownNesting> nesting;

  /// Throws std::runtime_error "FILE:LINE: text" for keys, classes, stops and values that are none.
  static TopicTable read(const std::string& file, const std::string& text);
  /// Returns the table of all robots: plan, player, `afterglow play --classes` and the README have
  /// their classes from here.
  static const TopicTable& ofAllRobots();
  /// Null: no row fits.
  const TopicRow* rowOf(std::string_view topic, std::string_view type) const;
};

/// Returns true if a topic ends with these names, in which * stands for any characters, slashes
/// too: "base/cmd_vel" fits /base/cmd_vel and /robot/base/cmd_vel, "/base/cmd_vel" the first alone.
bool isCalled(std::string_view topic, std::string_view pattern);

/// Returns the role by that table. Topics that are drawn or heard are Shown, asked for or not; the
/// plan decides about that. Of a certain robot: RobotTopics.
TopicRole roleOf(std::string_view topic, std::string_view type);

/// Returns the stop of motion on a topic, whatever its class is.
StopKind knownStop(std::string_view topic, std::string_view type);

/// The file that is built in.
struct EmbeddedTopics {
  const char* name;
  const char* text;
};
extern const EmbeddedTopics kEmbeddedTopics[];

/// "body,ar,speech", any of them; empty: all. Throws std::invalid_argument naming an unknown word.
std::set<Modality> parseModalities(const std::string& text);

/// Stop: the whole replay ends, the robot stands, the light is cleared. GoOn: without it; told in
/// the report.
enum class OnFailure { Stop, GoOn };

/// Real seconds, at any rate. No modality: 0.
using ModalityLatency = std::map<Modality, double>;
/// No modality: the body stops, light and speech go on.
using FailurePolicy = std::map<Modality, OnFailure>;

/// "ar=0.05,speech=0.2": how long after its message something is seen, heard or moves, 0 to 5 s.
/// Several texts together. Throws std::invalid_argument, one line.
ModalityLatency parseLatency(const std::vector<std::string>& texts);

double latencyOf(const ModalityLatency& latency, Modality modality);

/// "speech=stop,body=go_on". Throws std::invalid_argument, one line.
FailurePolicy parseOnFailure(const std::vector<std::string>& texts);

OnFailure policyOf(const FailurePolicy& policy, Modality modality);

}  // namespace afterglow::replay
