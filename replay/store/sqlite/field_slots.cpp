#include "replay/store/sqlite/field_slots.hpp"

#include <algorithm>

namespace afterglow::replay {
namespace {

/// "points.0.x" -> "points.x". No field of a message is called a number.
std::string withoutIndices(const std::string& path) {
  std::string kept;
  for (std::size_t at = 0; at <= path.size();) {
    const std::size_t dot = std::min(path.find('.', at), path.size());
    const std::string name = path.substr(at, dot - at);
    const bool is_index =
        !name.empty() &&
        std::all_of(name.begin(), name.end(), [](unsigned char c) { return c >= '0' && c <= '9'; });
    if (!is_index) kept += (kept.empty() ? "" : ".") + name;
    at = dot + 1;
  }
  return kept;
}

bool isTime(const Field& field) {
  return field.type == FieldType::Time || field.type == FieldType::Duration;
}

}  // namespace

FieldSlots::FieldSlots(Schema schema) : schema_(std::move(schema)), steps_(stepsOf(0, "")) {}

std::vector<FieldSlots::Step> FieldSlots::stepsOf(std::size_t type_index,
                                                  const std::string& prefix) {
  std::vector<Step> steps;
  for (const Field& field : schema_.types()[type_index].fields) {
    steps.push_back(stepOf(field, prefix + field.name));
  }
  return steps;
}

FieldSlots::Step FieldSlots::stepOf(const Field& field, const std::string& path) {
  Step step;
  step.field = &field;
  const bool is_array = field.arity != Field::Arity::Single;
  if (is_full_) return step;
  if (field.type == FieldType::Message) {
    groups_.insert(path);
    step.below = stepsOf(field.message, path + ".");
  } else if (isTime(field)) {
    groups_.insert(path);
    step.slot = slotOf(path + ".secs", false);
    slotOf(path + ".nsecs", false);
  } else {
    step.slot = slotOf(path, is_array);
  }
  if (is_array) {
    step.type_slot = slotOf(path + ".type", false);
    step.count_slot = slotOf(path + ".count", false);
  }
  return step;
}

std::size_t FieldSlots::slotOf(const std::string& path, bool is_array) {
  // A message in an array may have a field "type" or "count" of its own: they share the slot.
  const auto known = slots_.find(path);
  if (known != slots_.end()) return known->second.number;
  const std::size_t number = slots_.size();
  slots_[path] = {number, is_array};
  if (slots_.size() >= kMost) is_full_ = true;
  return number;
}

FieldSlots::Found FieldSlots::find(const std::string& path) const {
  const std::string name = withoutIndices(path);
  if (const auto slot = slots_.find(name); slot != slots_.end()) {
    return {Place::Slot, slot->second.number, slot->second.is_array, name != path};
  }
  const bool is_known_group = groups_.count(name) > 0 || name.empty();
  if (is_full_ || is_known_group || name.rfind("_meta", 0) == 0)
    return {Place::Unknown, kNone, false, false};
  return {Place::Nowhere, kNone, false, false};
}

}  // namespace afterglow::replay
