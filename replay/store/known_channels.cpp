#include "replay/store/known_channels.hpp"

#include "replay/store/store.hpp"

namespace afterglow::replay {

KnownChannels::Known& KnownChannels::of(std::int64_t id) {
  const auto found = known_.find(id);
  if (found != known_.end()) return found->second;
  return known_.emplace(id, Known{store_.channel(id), std::nullopt, ""}).first->second;
}

const Schema& KnownChannels::schema(std::int64_t id) {
  Known& known = of(id);
  if (!known.why_none.empty()) throw MessageError(known.why_none);
  try {
    if (!known.schema) known.schema = Schema::of(known.channel);
  } catch (const MessageError& error) {
    known.why_none = error.what();
    throw;
  }
  return *known.schema;
}

}  // namespace afterglow::replay
