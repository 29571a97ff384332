/// \file
/// The objects that all parts of a player share.
#pragma once

#include "replay/clock/clock.hpp"
#include "replay/play/ledger.hpp"
#include "replay/play/play_options.hpp"
#include "replay/play/transport.hpp"

namespace afterglow::replay {

/// The things that all parts of the player share; they outlive every part.
struct PlayContext {
  const PlayPlan& plan;
  const PlayOptions& options;
  Clock& clock;
  Transport& transport;
  Ledger& ledger;

  const Timeline& timeline() const { return transport.timeline(); }
};

}  // namespace afterglow::replay
