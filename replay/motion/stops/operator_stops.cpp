#include "replay/motion/stops/operator_stops.hpp"

#include <fmt/format.h>

#include "replay/messages/ranges.hpp"

namespace afterglow::replay {
namespace {

constexpr std::int64_t kFreshNs = 300'000'000;
constexpr std::int64_t kSteadyNs = 450'000'000;

}  // namespace

bool HoldToRun::isFresh(SteadyTime now) const { return now.ns - last_.ns <= kFreshNs; }

void HoldToRun::heard(SteadyTime now, bool is_pressed) {
  if (!is_pressed) {
    state_ = State::Released;
  } else if (state_ == State::Unknown) {
    state_ = State::Stuck;
  } else if (state_ == State::Released) {
    state_ = State::Held;
    since_ = now;
  } else if (state_ == State::Held && !isFresh(now)) {
    state_ = State::Silent;
  }
  last_ = now;
}

bool HoldToRun::isHeld(SteadyTime now) const { return state_ == State::Held && isFresh(now); }

bool HoldToRun::isHeldSteadily(SteadyTime now) const {
  return isHeld(now) && now.ns - since_.ns >= kSteadyNs;
}

bool HoldToRun::hasFallenSilent(SteadyTime now) const {
  return state_ == State::Silent || (state_ == State::Held && !isFresh(now));
}

std::vector<std::string> booleanFields(const Schema& schema) {
  std::vector<std::string> paths;
  visitFields(schema, [&](const MessageType&, const Field& field, const std::string& path) {
    if (field.type == FieldType::Bool) paths.push_back(path);
  });
  return paths;
}

void StopField::prepare(const std::string& type, const std::string& definition) {
  finder_.reset();
  const Schema schema = Schema::parse(type, definition);
  const std::vector<std::string> known = booleanFields(schema);
  const std::string names = fmt::format("{}", fmt::join(known, ", "));
  if (known.empty()) throw MessageError(type + " has no boolean field");
  if (path_.empty() && known.size() > 1) {
    throw MessageError(type + " has several boolean fields, one of which is to be named: " + names);
  }
  const std::string path = path_.empty() ? known.front() : path_;
  if (!contains(known, path)) {
    throw MessageError(type + " has no boolean field " + path + "; it has " + names);
  }
  finder_.emplace(schema, FieldPath::parse(path));
  type_ = type;
  definition_ = definition;
}

bool StopField::stops(const std::string& type, const std::string& definition,
                      const Bytes& bytes) {
  if (!finder_ || type != type_ || definition != definition_) prepare(type, definition);
  const std::vector<FieldSpan> spans = finder_->find(bytes).front();
  if (spans.empty()) throw MessageError(type + ": " + path_ + " is empty");
  return anyOf(spans, [&](const auto& span) { return (bytes[span.offset] != 0) == stops_when_; });
}

}  // namespace afterglow::replay
