#include "replay/plan/rewrite.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <random>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "replay/messages/field_edit.hpp"

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

namespace {

std::vector<FieldPath> paths(const std::vector<RewrittenField>& rules) {
  std::vector<FieldPath> parsed;
  parsed.reserve(rules.size());
  for (const RewrittenField& field : rules) parsed.push_back(FieldPath::parse(field.path));
  return parsed;
}

// Far outside of ROS time in both directions, so that writeTime refuses sums that overflow.
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
  Stamp recorded;
};

/// The rules of a type, resolved to fields.
struct Plan {
  Plan(const Schema& schema, const RewriteSettings& settings)
      : fields(rewriteRules(schema, settings)), finder(schema, paths(fields)) {
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
      known = plans.emplace(Key(key), Plan(Schema::of(channel), settings)).first;
    }
    return known->second;
  }

  /// Returns whether the field has changed. Texts are left to newText().
  bool rewriteInPlace(RewriteRule rule, const FieldSpan& span, const PublishMoment& moment,
                      Bytes& bytes) const {
    if (rule == RewriteRule::Zero || rule == RewriteRule::CancelStamp) {
      std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(span.offset), span.size, 0);
      return true;
    }
    const std::optional<Stamp> recorded = readTime(bytes, span);
    if (!recorded || rule == RewriteRule::Keep) return false;
    const bool is_left = recorded->ns == 0 && rule != RewriteRule::PublishStamp;
    if (is_left || (rule == RewriteRule::ShiftStamp && moment.shift_ns == 0)) return false;
    const Stamp stamp = rule == RewriteRule::ShiftStamp ? shifted(*recorded, moment.shift_ns)
                        : rule == RewriteRule::StartNow ? Stamp{0}
                                                        : moment.now;
    writeTime(bytes, span, stamp);
    return true;
  }

  std::string newText(RewriteRule rule, const std::string& recorded) {
    if (rule == RewriteRule::RemapFrame) return settings.frame(recorded);
    if (rule != RewriteRule::FreshId || recorded.empty()) return recorded;
    std::string& id = ids[recorded];
    if (id.empty()) id = fresh_id();
    return id;
  }

  /// Rewrites all texts at once, as the last step, because the bytes behind them move.
  void rewriteTexts(const Plan& plan, const std::vector<std::vector<FieldSpan>>& spans,
                    const std::optional<std::string>& goal_id, std::vector<std::uint64_t>& edits,
                    Bytes& bytes) {
    std::vector<std::pair<FieldSpan, std::size_t>> texts;  // and the index of their field
    for (std::size_t i = 0; i < spans.size(); ++i) {
      for (const FieldSpan& span : spans[i]) {
        if (span.type == FieldType::String) texts.emplace_back(span, i);
      }
    }
    std::sort(texts.begin(), texts.end(),
              [](const auto& a, const auto& b) { return a.first.offset < b.first.offset; });
    std::vector<FieldSpan> places;
    for (const auto& [span, field] : texts) places.push_back(span);
    auto text = texts.begin();
    editStrings(bytes, places, [&](const std::string& recorded) {
      const std::size_t field = (text++)->second;
      const std::string edited =
          plan.id == field ? *goal_id : newText(plan.fields[field].rule, recorded);
      edits[field] += edited != recorded;
      return edited;
    });
  }

  /// The new id of a goal or a cancel; empty if the message must not be published. A cancel of
  /// everybody's goals, or of those up to a stamp, is that of this replay's last one.
  std::optional<std::string> newId(const Plan& plan, const GoalId& recorded,
                                   const std::string& topic) {
    if (plan.is_goal) return fresh_id();
    const auto named = goals.find(recorded.id);
    if (!recorded.id.empty() && named != goals.end()) return named->second.id;
    // Of an unknown goal only the stamp says anything.
    if (!recorded.id.empty() && recorded.stamp.ns == 0) return std::nullopt;
    const auto last = last_goals.find(actionOf(topic));
    const bool is_meant =
        last != last_goals.end() &&
        (recorded.stamp.ns == 0 || last->second.recorded <= recorded.stamp);
    return is_meant ? std::optional(last->second.id) : std::nullopt;
  }

  /// Returns how often each field was rewritten on a topic.
  std::vector<std::uint64_t>& doneOn(const std::string& topic, const Plan& plan) {
    std::vector<std::uint64_t>& counts = done[topic];
    counts.resize(std::max(counts.size(), plan.fields.size()));
    return counts;
  }

  FreshId fresh_id;
  RewriteSettings settings;
  std::map<Key, Plan, std::less<>> plans;
  std::map<std::string, std::vector<std::uint64_t>> done;
  std::map<std::string, Goal> goals;       // by recorded id
  std::map<std::string, Goal> last_goals;  // by action
  std::map<std::string, std::string> ids;  // fresh ones by recorded ones
};

Rewriter::Rewriter(FreshId fresh_id, RewriteSettings settings) : state_(std::make_unique<State>()) {
  state_->fresh_id = std::move(fresh_id);
  state_->settings = std::move(settings);
}

Rewriter::~Rewriter() = default;

std::vector<RewrittenField> Rewriter::rules(const Channel& channel) {
  const Plan& plan = state_->plan(channel);
  std::vector<RewrittenField> fields = plan.fields;
  const std::vector<std::uint64_t>& done = state_->doneOn(channel.topic, plan);
  for (std::size_t i = 0; i < fields.size(); ++i) fields[i].count = done[i];
  return fields;
}

Rewritten Rewriter::rewrite(const Channel& channel, const PublishMoment& moment, Bytes& bytes) {
  const Plan& plan = state_->plan(channel);
  const auto spans = plan.finder.find(bytes);
  GoalId recorded;
  std::optional<std::string> id;
  if (plan.id) {
    recorded = {readString(bytes, spans[*plan.id].front()),
                *readTime(bytes, spans[*plan.id_stamp].front())};
    id = state_->newId(plan, recorded, channel.topic);
    if (!id) return {false, {}, {}};
  }
  std::vector<std::uint64_t>& done = state_->doneOn(channel.topic, plan);
  for (std::size_t i = 0; i < spans.size(); ++i) {
    for (const FieldSpan& span : spans[i]) {
      done[i] += state_->rewriteInPlace(plan.fields[i].rule, span, moment, bytes);
    }
  }
  state_->rewriteTexts(plan, spans, id, done, bytes);
  if (!plan.is_goal) return {true, {}, id.value_or("")};
  // A goal without a stamp is given the time of its arrival by the server.
  if (recorded.stamp.ns == 0) recorded.stamp = shifted(moment.now, -bounded(moment.shift_ns));
  const Goal goal{*id, recorded.stamp};
  state_->goals[recorded.id] = goal;
  state_->last_goals[actionOf(channel.topic)] = goal;
  return {true, *id, {}};
}

Rewriter::FreshId uniqueGoalIds(const std::string& node) {
  std::random_device random;
  const std::string prefix = node + "-" + std::to_string(random()) + std::to_string(random()) + "-";
  return [prefix, next = std::uint64_t{1}]() mutable { return prefix + std::to_string(next++); };
}

}  // namespace afterglow::replay
