#include "replay/play/rewrite.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <random>
#include <tuple>

#include "replay/messages/field_edit.hpp"

namespace afterglow::replay {
namespace {

bool isTrajectory(const std::string& type) {
  return type == "trajectory_msgs/JointTrajectory" ||
         type == "trajectory_msgs/MultiDOFJointTrajectory";
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
  return type.name == "actionlib_msgs/GoalID" && holds(type, "id", FieldType::String) &&
         holds(type, "stamp", FieldType::Time);
}

bool isActionGoal(const Schema& schema) {
  const MessageType& root = schema.root();
  constexpr std::string_view kEnd = "ActionGoal";
  return root.name.size() > kEnd.size() &&
         root.name.compare(root.name.size() - kEnd.size(), kEnd.size(), kEnd) == 0 &&
         holds(root, "header", FieldType::Message) && holds(root, "goal", FieldType::Message) &&
         holds(root, "goal_id", FieldType::Message) &&
         isGoalId(schema.types()[fieldNamed(root, "goal_id")->message]);
}

/// Where a walk over the schema stands.
struct Place {
  std::size_t type;
  std::string prefix;  // of paths
  bool in_trajectory_header = false;
};

void collect(const Schema& schema, const Place& place, std::vector<RewrittenField>& rules) {
  const MessageType& type = schema.types()[place.type];
  for (const Field& field : type.fields) {
    const bool array = field.arity != Field::Arity::Single;
    const std::string path = place.prefix + field.name + (array ? "[]" : "");
    if (field.type == FieldType::Time) {
      rules.push_back(
          {path, place.in_trajectory_header ? RewriteRule::StartNow : RewriteRule::ShiftStamp});
    } else if (field.type == FieldType::Message) {
      // By the type and not by the topic: a trajectory is there to be executed, in whatever goal or
      // command it travels.
      collect(schema,
              {field.message, path + ".", isTrajectory(type.name) && field.name == "header"},
              rules);
    }
  }
}

void setRule(std::vector<RewrittenField>& rules, const std::string& path, RewriteRule rule) {
  for (RewrittenField& field : rules) {
    if (field.path == path) field.rule = rule;
  }
}

std::vector<FieldPath> paths(const std::vector<RewrittenField>& rules) {
  std::vector<FieldPath> parsed;
  parsed.reserve(rules.size());
  for (const RewrittenField& field : rules) parsed.push_back(FieldPath::parse(field.path));
  return parsed;
}

// Far outside of ROS time either way, so that writeTime refuses what an addition cannot hold.
std::int64_t bounded(std::int64_t shift_ns) {
  constexpr std::int64_t kFar = std::numeric_limits<std::int64_t>::max() / 2;
  return std::clamp(shift_ns, -kFar, kFar);
}

Stamp shifted(Stamp stamp, std::int64_t shift_ns) { return {stamp.ns + bounded(shift_ns)}; }

struct GoalId {
  std::string id;
  Stamp stamp;
};

/// A goal of this replay, under its new id.
struct Goal {
  std::string id;
  Stamp recorded, sent;
};

/// The rules for a type, worked out.
struct Plan {
  explicit Plan(const Schema& schema)
      : fields(rewriteRules(schema)), finder(schema, paths(fields)) {
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const RewriteRule rule = fields[i].rule;
      if (rule == RewriteRule::FreshGoalId || rule == RewriteRule::SentGoalId) id = i;
      if (fields[i].path == "goal_id.stamp" || rule == RewriteRule::CancelStamp) id_stamp = i;
    }
    if (id) is_goal = fields[*id].rule == RewriteRule::FreshGoalId;
  }

  std::vector<RewrittenField> fields;
  FieldFinder finder;
  std::optional<std::size_t> id, id_stamp;  // indices of the goal id's parts
  bool is_goal = false;
};

}  // namespace

struct Rewriter::State {
  using Key = std::tuple<std::string, std::string, std::string>;  // type, md5, definition

  const Plan& plan(const Channel& channel) {
    const auto key = std::tie(channel.type, channel.md5, channel.definition);
    auto known = plans.find(key);
    if (known == plans.end()) {
      known = plans.emplace(Key(key), Plan(Schema::parse(channel.type, channel.definition))).first;
    }
    return known->second;
  }

  /// Moved as everything else, but a goal that was covered then, and reached its server a little
  /// later than planned, is covered now as well.
  Stamp cancelStamp(Stamp recorded, const PublishMoment& moment) const {
    Stamp stamp = shifted(recorded, moment.shift_ns);
    for (const auto& [id, goal] : goals) {
      if (goal.recorded <= recorded) stamp = std::max(stamp, goal.sent);
    }
    return stamp;
  }

  void rewriteStamp(RewriteRule rule, const FieldSpan& span, const PublishMoment& moment,
                    Bytes& bytes) const {
    const Stamp recorded = *readTime(bytes, span);
    switch (rule) {
      case RewriteRule::ShiftStamp:
        if (recorded.ns != 0 && moment.shift_ns != 0) {
          writeTime(bytes, span, shifted(recorded, moment.shift_ns));
        }
        break;
      case RewriteRule::CancelStamp:
        if (recorded.ns != 0) writeTime(bytes, span, cancelStamp(recorded, moment));
        break;
      case RewriteRule::PublishStamp:
        writeTime(bytes, span, moment.now);
        break;
      case RewriteRule::StartNow:
        writeTime(bytes, span, {0});
        break;
      case RewriteRule::FreshGoalId:
      case RewriteRule::SentGoalId:
        break;  // no stamps
    }
  }

  /// What a goal's or a cancel's id becomes; empty if the message must not be published.
  std::optional<std::string> newId(const Plan& plan, const GoalId& recorded) {
    if (plan.is_goal) return fresh_id();
    if (recorded.id.empty()) return recorded.id;
    const auto goal = goals.find(recorded.id);
    if (goal != goals.end()) return goal->second.id;
    // An unknown id does nothing, but its stamp does. Without both it would cancel everything.
    if (recorded.stamp.ns == 0) return std::nullopt;
    return "";
  }

  FreshId fresh_id;
  std::map<Key, Plan, std::less<>> plans;
  std::map<std::string, Goal> goals;  // by recorded id
};

std::string_view describe(RewriteRule rule) {
  switch (rule) {
    case RewriteRule::ShiftStamp:
      return "shifted to now";
    case RewriteRule::PublishStamp:
      return "set to the time of publishing";
    case RewriteRule::StartNow:
      return "zeroed: starts on arrival";
    case RewriteRule::FreshGoalId:
      return "replaced by a fresh id";
    case RewriteRule::SentGoalId:
      return "replaced by the id its goal was sent with";
    case RewriteRule::CancelStamp:
      return "shifted to now, with the goals it covered";
  }
  return "";
}

std::vector<RewrittenField> rewriteRules(const Schema& schema) {
  std::vector<RewrittenField> rules;
  collect(schema, {0, "", false}, rules);
  if (isActionGoal(schema)) {
    setRule(rules, "header.stamp", RewriteRule::PublishStamp);
    setRule(rules, "goal_id.stamp", RewriteRule::PublishStamp);
    rules.push_back({"goal_id.id", RewriteRule::FreshGoalId});
  } else if (isGoalId(schema.root())) {
    setRule(rules, "stamp", RewriteRule::CancelStamp);
    rules.push_back({"id", RewriteRule::SentGoalId});
  }
  return rules;
}

Rewriter::Rewriter(FreshId fresh_id) : state_(std::make_unique<State>()) {
  state_->fresh_id = std::move(fresh_id);
}

Rewriter::~Rewriter() = default;

const std::vector<RewrittenField>& Rewriter::rules(const Channel& channel) {
  return state_->plan(channel).fields;
}

Rewritten Rewriter::rewrite(const Channel& channel, const PublishMoment& moment, Bytes& bytes) {
  const Plan& plan = state_->plan(channel);
  const auto spans = plan.finder.find(bytes);
  GoalId recorded;
  std::optional<std::string> id;
  if (plan.id) {
    recorded = {readString(bytes, spans[*plan.id].front()),
                *readTime(bytes, spans[*plan.id_stamp].front())};
    id = state_->newId(plan, recorded);
    if (!id) return {false, {}};
  }
  for (std::size_t i = 0; i < spans.size(); ++i) {
    if (plan.id == i) continue;
    for (const FieldSpan& span : spans[i]) {
      state_->rewriteStamp(plan.fields[i].rule, span, moment, bytes);
    }
  }
  // Last, since what lies behind the id moves.
  if (id) editStrings(bytes, spans[*plan.id], [&](const std::string&) { return *id; });
  if (!plan.is_goal) return {};
  // A goal without a stamp is given the time of its arrival by the server.
  if (recorded.stamp.ns == 0) recorded.stamp = shifted(moment.now, -bounded(moment.shift_ns));
  state_->goals[recorded.id] = {*id, recorded.stamp, moment.now};
  return {true, SentGoal{recorded.id, *id}};
}

Rewriter::FreshId uniqueGoalIds(const std::string& node) {
  std::random_device random;
  const std::string prefix = node + "-" + std::to_string(random()) + std::to_string(random()) + "-";
  return [prefix, next = std::uint64_t{1}]() mutable { return prefix + std::to_string(next++); };
}

}  // namespace afterglow::replay
