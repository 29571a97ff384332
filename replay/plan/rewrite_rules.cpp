#include "replay/plan/rewrite_rules.hpp"

#include <algorithm>
#include <stdexcept>

namespace afterglow::replay {
namespace {

bool isTrajectory(const std::string& type) {
  return type == "trajectory_msgs/JointTrajectory" ||
         type == "trajectory_msgs/MultiDOFJointTrajectory";
}

bool isHeader(const std::string& type) {
  return type == "std_msgs/Header" || type == "roslib/Header";
}

const Field* fieldNamed(const MessageType& type, std::string_view field_name) {
  const auto found = std::find_if(type.fields.begin(), type.fields.end(),
                                  [&](const Field& field) { return field.name == field_name; });
  return found == type.fields.end() ? nullptr : &*found;
}

bool holds(const MessageType& type, std::string_view field_name, FieldType expected) {
  const Field* field = fieldNamed(type, field_name);
  return field && field->type == expected && field->arity == Field::Arity::Single;
}

bool isGoalId(const MessageType& type) {
  return type.name == kGoalIdType && holds(type, "id", FieldType::String) &&
         holds(type, "stamp", FieldType::Time);
}

bool isActionGoal(const Schema& schema) {
  const MessageType& root = schema.root();
  return endsWith(root.name, "ActionGoal") && holds(root, "header", FieldType::Message) &&
         holds(root, "goal", FieldType::Message) && holds(root, "goal_id", FieldType::Message) &&
         isGoalId(schema.types()[fieldNamed(root, "goal_id")->message]);
}

/// All fields that a rule can be for, with their rules without settings.
struct Candidate {
  std::string path;
  FieldType type;
  std::optional<RewriteRule> rule;
};

/// The user's rules by full path.
using Asked = std::map<std::string, RewriteRule>;

/// Walks over a schema.
class RuleCollector {
 public:
  RuleCollector(const Schema& schema, const RewriteSettings& settings)
      : schema_(schema), settings_(settings) {}

  void collect(std::size_t type_index, const std::string& prefix, bool in_trajectory_header) {
    const MessageType& type = schema_.types()[type_index];
    const auto asked = settings_.rules.find(type.name);
    if (asked != settings_.rules.end()) {
      for (const auto& [path, rule] : asked->second) {
        asked_.emplace(prefix + path, rule);  // the rule of the outer type counts
      }
    }
    for (const Field& field : type.fields) {
      const std::string path =
          prefix + field.name + (field.arity == Field::Arity::Single ? "" : "[]");
      if (field.type == FieldType::Message) {
        // By the type, not by the topic: a trajectory is to be executed in any goal or command.
        collect(field.message, path + ".", isTrajectory(type.name) && field.name == "header");
      } else {
        found_.push_back({path, field.type, ruleOf(type, field, in_trajectory_header)});
      }
    }
  }

  std::vector<RewrittenField> rules() {
    std::vector<RewrittenField> rules;
    for (Candidate& candidate : found_) {
      const auto asked = asked_.find(candidate.path);
      if (asked != asked_.end()) {
        checkKind(candidate, asked->second);
        candidate.rule = asked->second;
        asked_.erase(asked);
      }
      if (candidate.rule) rules.push_back({candidate.path, *candidate.rule});
    }
    if (!asked_.empty()) {
      throw std::invalid_argument("a rewriting rule names " + asked_.begin()->first + ", which " +
                                  schema_.root().name + " has not");
    }
    return rules;
  }

 private:
  std::optional<RewriteRule> ruleOf(const MessageType& type, const Field& field,
                                    bool in_trajectory_header) const {
    if (field.type == FieldType::Time) {
      return in_trajectory_header ? RewriteRule::StartNow : RewriteRule::ShiftStamp;
    }
    const bool is_frame =
        field.type == FieldType::String &&
        (field.name == "child_frame_id" || (field.name == "frame_id" && isHeader(type.name)));
    return is_frame && settings_.renamesFrames() ? std::optional(RewriteRule::RemapFrame)
                                                 : std::nullopt;
  }

  void checkKind(const Candidate& field, RewriteRule rule) const {
    const bool is_text = field.type == FieldType::String, is_time = field.type == FieldType::Time;
    const bool wants_text = rule == RewriteRule::FreshId || rule == RewriteRule::RemapFrame;
    const bool wants_time = rule == RewriteRule::ShiftStamp || rule == RewriteRule::PublishStamp;
    if ((wants_text && !is_text) || (wants_time && !is_time) ||
        (rule == RewriteRule::Zero && is_text)) {
      throw std::invalid_argument("a rewriting rule for " + field.path + " of " +
                                  schema_.root().name + " is not for a " +
                                  std::string(name(field.type)));
    }
  }

  const Schema& schema_;
  const RewriteSettings& settings_;
  std::vector<Candidate> found_;
  Asked asked_;
};

void setRule(std::vector<RewrittenField>& rules, const std::string& path, RewriteRule rule) {
  for (RewrittenField& field : rules) {
    if (field.path == path) {
      field.rule = rule;
      return;
    }
  }
  rules.push_back({path, rule});
}

}  // namespace

std::string_view describe(RewriteRule rule) {
  constexpr std::string_view kTexts[] = {"shifted to now",
                                         "set to the time of publishing",
                                         "zeroed: starts on arrival",
                                         "replaced by a fresh id",
                                         "replaced by the id its goal was sent with",
                                         "zeroed: it cancels the goal it names, nobody else's",
                                         "zeroed",
                                         "kept as recorded",
                                         "replaced by a fresh id",
                                         "renamed"};
  return kTexts[static_cast<std::size_t>(rule)];
}

std::string RewriteSettings::frame(const std::string& recorded) const {
  if (recorded.empty()) return recorded;
  const std::string bare = bareName(recorded);
  const auto renamed = frames.find(bare);
  if (renamed != frames.end()) return renamed->second;
  return tf_prefix.empty() ? robot.frame(recorded) : tf_prefix + "/" + bare;
}

std::optional<RewriteRule> parseRule(std::string_view word) {
  constexpr std::pair<std::string_view, RewriteRule> kWords[] = {
      {"shift", RewriteRule::ShiftStamp}, {"now", RewriteRule::PublishStamp},
      {"zero", RewriteRule::Zero},        {"keep", RewriteRule::Keep},
      {"fresh_id", RewriteRule::FreshId}, {"remap_frame", RewriteRule::RemapFrame}};
  for (const auto& [known, rule] : kWords) {
    if (known == word) return rule;
  }
  return std::nullopt;
}

std::vector<RewrittenField> rewriteRules(const Schema& schema, const RewriteSettings& settings) {
  RuleCollector collector(schema, settings);
  collector.collect(0, "", false);
  std::vector<RewrittenField> rules = collector.rules();
  if (isActionGoal(schema)) {
    setRule(rules, "header.stamp", RewriteRule::PublishStamp);
    setRule(rules, "goal_id.stamp", RewriteRule::PublishStamp);
    setRule(rules, "goal_id.id", RewriteRule::FreshGoalId);
  } else if (isGoalId(schema.root())) {
    setRule(rules, "stamp", RewriteRule::CancelStamp);
    setRule(rules, "id", RewriteRule::SentGoalId);
  }
  return rules;
}

}  // namespace afterglow::replay
