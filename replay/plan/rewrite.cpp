#include "replay/plan/rewrite.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <random>
#include <tuple>
#include <utility>

#include "replay/messages/field_edit.hpp"

namespace afterglow::replay {
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
